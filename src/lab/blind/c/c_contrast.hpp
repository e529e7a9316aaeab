// Change that an effect makes along the flight of a robot without it.
// Both runs repeat the voltages and the torso's motion; all else moves freely. Effects on sensors alone give zeros.
#pragma once

#include "lab/blind/c/c_flight.hpp"

namespace flappy::blind::c {

/// Keeps the other effects of `a`. Throws io::InputError for an unknown effect or a magnitude outside 0 to 4.
Contrast contrast_of(const Assignment& a, std::size_t flight, const std::string& effect, double magnitude,
                     Length length = {});

}  // namespace flappy::blind::c
