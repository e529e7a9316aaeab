// A family of blind robots: blade strips with circulation that lags, rigid bodies in reduced coordinates, Runge and Kutta at 50 us,
// windings, friction and stops in forms of their own, sensors that jitter and swap markers. It shares nothing with other families.
#pragma once

#include <memory>

#include "blind/family.hpp"

namespace flappy::blind::b {

std::unique_ptr<Family> make_family_b();

}  // namespace flappy::blind::b
