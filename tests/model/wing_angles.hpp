// Wings whose four angles are driven, as an animal's are: stroke-plane offset Phi, stroke psi, deviation phi, rotation
// theta (Fei et al. 2019). The leading edge's frame E follows from B by
//   R_BE = R_y(-s Phi) R_z(s psi) R_x(s phi)      s = +1 left, -1 right; phi > 0 lifts the tip out of the stroke plane
// and the wing from E by R_y(theta). Stroke planes that tilt together have opposite Phi. The blade element sees E alone,
// so it is the same for a robot, whose E is turned by the stroke only (hinged_wing.hpp) and which pays nothing for the
// other two.
#pragma once

#include "model/math.hpp"
#include "model/wing_aerodynamics.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

template <class T>
struct WingAngles {
  T stroke_plane_rad, stroke_rad, deviation_rad, rotation_rad;
};

/// Force and moment at the shoulder, in B.
template <class T>
struct ShoulderWrench {
  Vec3<T> force_N, moment_Nm;
};

/// Air on a driven wing. `rates`: d angles / dt. `velocity_B`, `body_rate`: of the shoulder and of B relative
/// to the air.
template <int side, class T>
FLAPPY_INLINE ShoulderWrench<T> air_on_driven_wing(const SideParameters<T>& p, const WingAngles<T>& angles,
                                                   const WingAngles<T>& rates, const Vec3<T>& velocity_B,
                                                   const Vec3<T>& body_rate) {
  const SinCos<T> plane = sin_cos(T(T(-side) * angles.stroke_plane_rad)), theta = sin_cos(angles.rotation_rad);
  const SinCos<T> beta = sin_cos(T(T(side) * angles.stroke_rad)), lift = sin_cos(T(T(side) * angles.deviation_rad));
  const T zero(0), plane_rate = T(-side) * rates.stroke_plane_rad, beta_rate = T(side) * rates.stroke_rad,
                   lift_rate = T(side) * rates.deviation_rad;
  const auto to_E = [&](const Vec3<T>& v, const Vec3<T>& plane_part, const Vec3<T>& beta_part,
                        const Vec3<T>& lift_part) {
    const Vec3<T> in_plane = rotate_back_y(plane.sin, plane.cos, v + plane_part) + beta_part;
    return rotate_back_x(lift.sin, lift.cos, rotate_back_z(beta.sin, beta.cos, in_plane) + lift_part);
  };
  const Vec3<T> none{zero, zero, zero};
  const Vec3<T> v = to_E(velocity_B, none, none, none);
  const Vec3<T> w = to_E(body_rate, {zero, plane_rate, zero}, {zero, zero, beta_rate}, {lift_rate, zero, zero});
  const WingWrench<T> air = blade_element<side>(p, theta, rates.rotation_rad, v, w);
  const auto to_B = [&](const Vec3<T>& a) {
    return rotate_y(plane.sin, plane.cos, rotate_z(beta.sin, beta.cos, rotate_x(lift.sin, lift.cos, a)));
  };
  return {to_B({air.force_x_N, zero, air.force_z_N}), to_B(air.moment_Nm)};
}

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
