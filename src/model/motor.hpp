// Brushed motor, gear and stroke spring of one wing. Gear N, efficiency eta; friction f, damping b, inertia J motor-side:
//   tau = N eta (K i - J N psi'' - b N psi' - f sgn psi')      i = (V - K N psi')/R, also when driven back
// so about the stroke axis: torque per volt N eta K/R, damping eta N^2 (K^2/R + b), friction eta N f, inertia eta N^2 J.
// The rotor's spin N psi', of sense s and parallel to the stroke's axis, is in the body's momentum, too: S beta' about z with
// S = s N J, as much as a disc of inertia S that turns with the leading edge has. So derive() hangs such a disc on the leading
// edge, takes it from the body and S from the stroke's inertia: nothing else changes, and the coupling S w_z' beta'' between
// yaw and stroke is exact. The gear's efficiency is left out of it, or momentum would be lost.
// Spring: -k (psi - psi_0), a k for each direction. Winding inductance is neglected.
#pragma once

#include "model/flapper.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

template <class T>
FLAPPY_INLINE T spring_torque(const SideParameters<T>& p, const T& stroke_rad) {
  const T x = stroke_rad - p.spring_rest_rad;
  return -T(where(x > T(0), p.spring_positive_Nm_rad, p.spring_negative_Nm_rad) * x);
}

/// Torque about psi, dry friction and rotor inertia excluded: they belong to the solve.
template <class T>
FLAPPY_INLINE T drive_torque(const SideParameters<T>& p, const SideState<T>& q, const T& voltage_V) {
  return p.stroke_torque_per_V_Nm * voltage_V +
         (spring_torque(p, q.stroke_rad) - p.stroke_damping_Nm_s * q.stroke_rate_rad_s);
}

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
