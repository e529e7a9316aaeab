// Drag of the torso: F = -1/2 rho C_d A |v| v, v: velocity in the air of the drag centre, which lies on the body's z
// axis. Valid for |v| up to a few m/s (Re 1e3 to 1e4 on a 20 mm torso). C_d A of a 12 g vehicle: 1e-3 to 2e-3 m^2.
// [1] Hoerner, Fluid-Dynamic Drag, 1965, ch. 3: bluff bodies, C_d constant above Re about 1e3.
#pragma once

#include "model/effects/beat_averaged_effect.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct BodyDrag {
  static constexpr EffectInfo kInfo{"body_drag", Stage::world, 1, "", "Hoerner 1965"};
  static constexpr std::array<EffectParameter, 2> kParameters{
      {{"drag_area_m2", 0, 0.01, 0.0015, 0, 0.0045}, {"centre_z_m", -0.1, 0.1, 0, -0.02, 0.02}}};

  template <class T>
  static FLAPPY_INLINE void world(const T (&q)[2], const Surroundings<T>& s, const StateRows<T>&, BodyLoad<T>& load) {
    const Vec3<T> arm{T(0), T(0), q[1]};
    const Vec3<T> v = (s.velocity_B_m_s + cross(s.x.body_rate_rad_s, arm)) - s.wind_B_m_s;
    const T drag = T(T(-0.5) * s.p.air_density_kg_m3) * T(q[0] * sqrt(dot(v, v)));
    const Vec3<T> force = drag * v;
    load.force_B = load.force_B + force;
    load.moment_B = load.moment_B + cross(arm - s.com_m, force);
  }

  // Drag areas of robots of up to about 100 g.
  static constexpr std::array<EffectParameter, 2> kBeatAveragedParameters{
      {{"drag_area_m2", 0, 0.5, 0.02, 0, 0.06}, {"centre_z_m", -0.3, 0.3, 0, -0.05, 0.05}}};
  template <class T>
  static FLAPPY_INLINE void beat_averaged_load(const T (&q)[2], const BeatAveragedState<T>& s,
                                               BeatAveragedLoads<T>& load) {
    const Vec3<T> arm{T(0), T(0), q[1]};
    const Vec3<T> v = (s.velocity_B_m_s + cross(s.rate_rad_s, arm)) - s.wind_B_m_s;
    const T drag = T(T(-0.5) * s.air_density_kg_m3) * T(q[0] * sqrt(dot(v, v)));
    load.add(drag * v, arm - s.com_m);
  }
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
