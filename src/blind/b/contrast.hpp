// Flies a programme, and measures the change that an effect makes along such a flight.
#pragma once

#include "blind/b/flight.hpp"

namespace flappy::blind::b {

/// Duration of the trimming and of the log.
struct Times {
  double trim_s = kTrim_s, log_s = Family::kFlight_s;
};

/// Flies the programme of a flight. If not null, `path` receives the torso's path by steps and `sent` the pilot's inputs by ticks.
FamilyFlight fly_programme(const Assignment& a, std::size_t number, const Times& times = {}, Path* path = nullptr,
                           std::vector<Beat>* sent = nullptr);

/// Implements Family::contrast. The torso is led along the flown path, once with and once without the effect, from the start of the
/// trimming on; hinges and slow states evolve freely. The result is the difference between the accelerations that a free torso would
/// have. Throws InputError if the assignment has the effect.
Contrast contrast_of(const Assignment& a, std::size_t flight, const std::string& effect, double magnitude,
                     const Times& times = {});

}  // namespace flappy::blind::b
