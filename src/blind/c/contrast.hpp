// Change that an effect makes along the flight of a robot without it.
#pragma once

#include "blind/c/flight.hpp"

namespace flappy::blind::c {

Contrast contrast_of(const Assignment& a, std::size_t flight, const std::string& effect, double magnitude,
                     Length length = {});

}  // namespace flappy::blind::c
