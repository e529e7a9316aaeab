// The chord along the span, which a planform states by moments alone.
#pragma once

#include "flappy/vehicle.hpp"

namespace flappy::model {

/// Chord over mean chord, with the moments r00, r11, r22 of a planform: a0 + a1 P_1(y) + a2 P_2(y), with Legendre's
/// polynomials P_k of y = 2 r/R - 1, -1 at the root and 1 at the tip.
struct QuadraticChord {
  explicit QuadraticChord(const Planform& p)
      : a0(p.r00), a1(3 * (2 * p.r11 - p.r00)), a2(5 * (6 * p.r22 - 6 * p.r11 + p.r00)) {}
  double at(double y) const { return a0 + a1 * y + a2 * (1.5 * y * y - 0.5); }
  double a0, a1, a2;
};

}  // namespace flappy::model
