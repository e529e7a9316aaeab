// Stops of the wing's rotation as spring and damper instead of hard stops: a wing that is x beyond its stop feels
//   tau = -(k x + d theta')  while that pushes it back      k = 1 / compliance     d = 2 damping_ratio sqrt(k I)
// with I the wing's inertia about its leading edge. x and theta' are taken at the end of the step (implicit Euler): the
// torque with the old rate, and h (k h + d) as inertia on the hinge. This is stable for any k, damps slightly more, and
// tends to the landing on the hard stop for k -> infinity.
// [1] Hunt, Crossley, Coefficient of restitution interpreted as damping in vibroimpact, J. Appl. Mech. 42(2), 1975,
// sec. 1: the linear spring and damper from which they start. At 1.7 rad there is a hard stop again.
#pragma once

#include "model/effects/effect.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct StopCompliance {
  static constexpr EffectInfo kInfo{"stop_compliance", Stage::wing, 1, "wing_compliance", "Hunt, Crossley 1975"};
  static constexpr std::array<EffectParameter, 2> kParameters{
      {{"compliance_rad_Nm", 0, 1000, 50, 0, 150}, {"damping_ratio", 0, 2, 0.5, 0.2, 0.8}}};
  static constexpr double kReach_rad = 1.7;  // rotation angle at which the stop is hard again

  template <class T>
  static FLAPPY_INLINE void hinges(const T (&q)[2], const Surroundings<T>& s, const StateRows<T>&,
                                   Sides<Hinges<T>>& h) {
    soften(q, s, s.p.left, s.x.left, h.left);
    soften(q, s, s.p.right, s.x.right, h.right);
  }

 private:
  template <class T>
  static FLAPPY_INLINE void soften(const T (&q)[2], const Surroundings<T>& s, const SideParameters<T>& p,
                                   const SideState<T>& x, Hinges<T>& h) {
    const T inertia = p.wing_second_kg_m2.xx + p.wing_second_kg_m2.zz;
    const T k = T(1) / q[0], d = T(T(2) * q[1]) * sqrt(T(k * inertia));
    const T rate = x.rotation_rate_rad_s, next = x.rotation_rad + s.step_s * rate;
    const T over = max(T(next - h.rotation_upper_rad), T(0)), under = min(T(next - h.rotation_lower_rad), T(0));
    const T push = k * T(over + under) + d * rate;
    const auto touches = ((over > T(0)) & (push > T(0))) | ((under < T(0)) & (push < T(0)));
    h.rotation_torque_Nm -= where(touches, push, T(0));
    h.rotation_inertia_kg_m2 += where(touches, T(s.step_s * T(k * s.step_s + d)), T(0));
    h.rotation_upper_rad = T(kReach_rad);
    h.rotation_lower_rad = T(-kReach_rad);
  }
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
