// Flights of the programme, and what an effect changes along one.
#pragma once

#include "blind/b/flight.hpp"

namespace flappy::blind::b {

/// Flies kTrim_s and then `lasts_s`; with `path` and `voltages`, of all steps and ticks.
FamilyFlight fly_programme(const Assignment& a, std::size_t flight, double lasts_s, Path* path, std::vector<std::array<double, 2>>* voltages);

Contrast contrast_of(const Assignment& a, std::size_t flight, const std::string& effect, double size, double lasts_s = Family::kFlight_s);

}  // namespace flappy::blind::b
