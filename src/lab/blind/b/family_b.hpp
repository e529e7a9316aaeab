// Family B: blade strips with lagging circulation, rigid bodies in reduced coordinates, Runge-Kutta at 50 us, its own
// models of windings, friction and stops, sensors that jitter and swap markers.
#pragma once

#include <memory>

#include "lab/blind/family.hpp"

namespace flappy::blind::b {

std::unique_ptr<Family> make_family_b();

}  // namespace flappy::blind::b
