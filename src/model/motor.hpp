// Brushed motor, gear and stroke spring of one wing. Gear N, efficiency eta; friction f, damping b, inertia J on the
// motor's side:
//   tau = N eta (K i - J N psi'' - b N psi' - f sgn psi')      i = (V - K N psi')/R, also when driven back
// so about the stroke axis: torque per volt N eta K/R, damping eta N^2 (K^2/R + b), friction eta N f, inertia eta N^2
// J. The rotor's spin N psi', of sense s and parallel to the stroke's axis, adds S beta' about z to the body's
// momentum, S = s N J: as much as a disc of inertia S on the leading edge. So derive() adds that disc, and subtracts it
// from the body and S from the stroke's inertia; the coupling S w_z' beta'' of yaw and stroke is then exact. Without
// the gear's efficiency, which would lose momentum. Spring: -k (psi - psi_0), with a k for each direction. Winding
// inductance is neglected.
#pragma once

#include "model/flapper.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

template <class T>
FLAPPY_INLINE T spring_torque(const SideParameters<T>& p, const T& stroke_rad) {
  const T x = stroke_rad - p.spring_rest_rad;
  return -T(where(x > T(0), p.spring_positive_Nm_rad, p.spring_negative_Nm_rad) * x);
}

/// Torque about psi, without dry friction and rotor inertia, which the solver of the step adds.
template <class T>
FLAPPY_INLINE T drive_torque(const SideParameters<T>& p, const SideState<T>& q, const T& voltage_V) {
  return p.stroke_torque_per_V_Nm * voltage_V +
         (spring_torque(p, q.stroke_rad) - p.stroke_damping_Nm_s * q.stroke_rate_rad_s);
}

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
