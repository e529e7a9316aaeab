#pragma once

#include "lab/blind/b/b_flight.hpp"

namespace flappy::blind::b {

struct Times {
  double trim_s = kTrim_s, log_s = Family::kFlight_s;
};

/// Flies a programme. `path`, `sent`, unless null, get the torso's path by steps and the pilot's inputs by ticks.
FamilyFlight fly_programme(const Assignment& a, std::size_t number, const Times& times = {}, Path* path = nullptr,
                           std::vector<Beat>* sent = nullptr);

/// Implements Family::contrast. The torso is led along the flown path from the start of the trimming on, with and
/// without the effect; all else evolves freely. Returns the difference of the accelerations that a free torso would
/// have. InputError if the assignment has the effect.
Contrast contrast_of(const Assignment& a, std::size_t flight, const std::string& effect, double magnitude,
                     const Times& times = {});

}  // namespace flappy::blind::b
