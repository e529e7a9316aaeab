// A wing that twists under load, at most 0.5 rad, linearly along the span: theta(r) = theta - twist F_N r / R. The
// whole wing is evaluated with theta(r_cp), so the effect is a mean. F_N > 0 pushes the trailing edge towards +x, which
// reduces theta on both sides. F_N is that of the untwisted wing: one step of a fixed-point iteration, whose next is
// smaller by twist dF_N/dtheta, 0.05 at the typical magnitude. Static: the wing's own modes are far above the beat.
// [1] Nakata, Liu, Aerodynamic performance of a hovering hawkmoth with flexible wings: a computational approach, Proc.
// R. Soc. B 279, 2012: passive twist, and its influence on force and efficiency. The linear law is ours.
#pragma once

#include "model/effects/effect.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct WingFlexibility {
  static constexpr EffectInfo kInfo{"wing_flexibility", Stage::air, 1, "wing_compliance", "Nakata, Liu 2012"};
  static constexpr std::array<EffectParameter, 1> kParameters{{{"twist_rad_N", 0, 10, 0.5, 0, 1.5}}};

  template <int side, class T>
  static FLAPPY_INLINE void air(const T (&q)[1], const Surroundings<T>& s, const StateRows<T>&, WingWrench<T>& air) {
    const SideParameters<T>& p = of_side<side>(s.p);
    const T at = p.span_to_pressure_m / of_side<side>(s.constants).wing_length_m;
    const T twist = clamp(T(q[0] * T(air.normal_force_N * at)), T(-0.5), T(0.5));
    const T theta = clamp(T(of_side<side>(s.x).rotation_rad - twist), T(-kLargestAngle_rad), T(kLargestAngle_rad));
    const WingFlow<T> f = flow<side>(s);
    air = blade_element<side>(p, sin_cos(theta), of_side<side>(s.pose).theta_rate, f.v, f.w);
  }
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
