// Flights of the programme, and what an effect changes along one.
#pragma once

#include "blind/b/flight.hpp"

namespace flappy::blind::b {

/// How long a robot finds its trim, and how long the log is.
struct Times {
  double trim_s = kTrim_s, log_s = Family::kFlight_s;
};

/// Flies the programme of a flight; with `path` and `sent`, those of all steps and ticks.
FamilyFlight fly_programme(const Assignment& a, std::size_t number, const Times& times = {}, Path* path = nullptr,
                           std::vector<Beat>* sent = nullptr);

/// As Family::contrast has it. The torso is led along the path flown, with and without the effect; the hinges and all that is slow
/// go as they do, from the first moment of the trimming on. What the free torso would feel there is compared.
Contrast contrast_of(const Assignment& a, std::size_t flight, const std::string& effect, double size,
                     const Times& times = {});

}  // namespace flappy::blind::b
