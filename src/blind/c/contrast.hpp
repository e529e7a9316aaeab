// What an effect changes along a flight of a robot that does not have it.
#pragma once

#include "blind/c/flight.hpp"

namespace flappy::blind::c {

Contrast contrast_of(const Assignment& a, std::size_t flight, const std::string& effect, double size,
                     Length length = {});

}  // namespace flappy::blind::c
