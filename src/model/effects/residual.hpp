// A smooth load on the torso. It describes how a robot still differs from its vehicle once parameters and effects are
// fitted, and names no cause. It accelerates the body by
//   a = f (a_0 + A v + B w)      in x, y, z, m/s^2, and about x, y, z (roll, pitch, yaw), rad/s^2
// v = (u, v, w): velocity of the torso origin in the air; w = (p, q, r): body rate; all in B. The force is the mass times
// the first three; the moment the diagonal of the inertia about the torso origin, wings at their shoulders, times the
// others. Flights do not say what happens beyond their regime: f is 1 while each of u, ..., r is within its limit, falls
// linearly, and is 0 from 1.5 times any limit on.
#pragma once

#include "model/effects/effect.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct Residual {
  static constexpr int kTerms = 7;  ///< number of terms of an acceleration: a constant, u, v, w, p, q, r
  static constexpr EffectInfo kInfo{"residual", Stage::world, 6 * kTerms, "", "Kennedy, O'Hagan 2001", false};
  // clang-format off
  static constexpr std::array<EffectParameter, 7 * kTerms - 1> kParameters{{
      {"x_m_s2", -50, 50, 0.1, -2, 2}, {"x_u_1_s", -50, 50, 0.1, -2, 2}, {"x_v_1_s", -50, 50, 0.1, -2, 2}, {"x_w_1_s", -50, 50, 0.1, -2, 2},
      {"x_p_m_rad_s", -5, 5, 0.01, -0.2, 0.2}, {"x_q_m_rad_s", -5, 5, 0.01, -0.2, 0.2}, {"x_r_m_rad_s", -5, 5, 0.01, -0.2, 0.2},
      {"y_m_s2", -50, 50, 0.1, -2, 2}, {"y_u_1_s", -50, 50, 0.1, -2, 2}, {"y_v_1_s", -50, 50, 0.1, -2, 2}, {"y_w_1_s", -50, 50, 0.1, -2, 2},
      {"y_p_m_rad_s", -5, 5, 0.01, -0.2, 0.2}, {"y_q_m_rad_s", -5, 5, 0.01, -0.2, 0.2}, {"y_r_m_rad_s", -5, 5, 0.01, -0.2, 0.2},
      {"z_m_s2", -50, 50, 0.1, -2, 2}, {"z_u_1_s", -50, 50, 0.1, -2, 2}, {"z_v_1_s", -50, 50, 0.1, -2, 2}, {"z_w_1_s", -50, 50, 0.1, -2, 2},
      {"z_p_m_rad_s", -5, 5, 0.01, -0.2, 0.2}, {"z_q_m_rad_s", -5, 5, 0.01, -0.2, 0.2}, {"z_r_m_rad_s", -5, 5, 0.01, -0.2, 0.2},
      {"roll_rad_s2", -2000, 2000, 1, -100, 100}, {"roll_u_rad_m_s", -2000, 2000, 1, -100, 100}, {"roll_v_rad_m_s", -2000, 2000, 1, -100, 100}, {"roll_w_rad_m_s", -2000, 2000, 1, -100, 100},
      {"roll_p_1_s", -200, 200, 0.1, -10, 10}, {"roll_q_1_s", -200, 200, 0.1, -10, 10}, {"roll_r_1_s", -200, 200, 0.1, -10, 10},
      {"pitch_rad_s2", -2000, 2000, 1, -100, 100}, {"pitch_u_rad_m_s", -2000, 2000, 1, -100, 100}, {"pitch_v_rad_m_s", -2000, 2000, 1, -100, 100}, {"pitch_w_rad_m_s", -2000, 2000, 1, -100, 100},
      {"pitch_p_1_s", -200, 200, 0.1, -10, 10}, {"pitch_q_1_s", -200, 200, 0.1, -10, 10}, {"pitch_r_1_s", -200, 200, 0.1, -10, 10},
      {"yaw_rad_s2", -2000, 2000, 1, -100, 100}, {"yaw_u_rad_m_s", -2000, 2000, 1, -100, 100}, {"yaw_v_rad_m_s", -2000, 2000, 1, -100, 100}, {"yaw_w_rad_m_s", -2000, 2000, 1, -100, 100},
      {"yaw_p_1_s", -200, 200, 0.1, -10, 10}, {"yaw_q_1_s", -200, 200, 0.1, -10, 10}, {"yaw_r_1_s", -200, 200, 0.1, -10, 10},
      {"u_limit_m_s", 0, 1000, 1000, 1000, 1000}, {"v_limit_m_s", 0, 1000, 1000, 1000, 1000}, {"w_limit_m_s", 0, 1000, 1000, 1000, 1000},
      {"p_limit_rad_s", 0, 1000, 1000, 1000, 1000}, {"q_limit_rad_s", 0, 1000, 1000, 1000, 1000}, {"r_limit_rad_s", 0, 1000, 1000, 1000, 1000}}};
  // clang-format on

  template <class T>
  static FLAPPY_INLINE void world(const T (&q)[7 * kTerms - 1], const Surroundings<T>& s, const StateRows<T>&,
                                  BodyLoad<T>& load) {
    const Vec3<T> v = s.velocity_B_m_s - s.wind_B_m_s, &w = s.x.body_rate_rad_s;
    const T of[kTerms] = {T(1), v.x, v.y, v.z, w.x, w.y, w.z};
    T within(1), sum[6];
    for (int i = 1; i < kTerms; ++i) {
      const T& limit = q[6 * kTerms + i - 1];
      within *= clamp(T(T(3) - T(T(2) * abs(of[i])) / max(limit, T(kMinLimit))), T(0), T(1));
    }
    for (int load_axis = 0; load_axis < 6; ++load_axis) {
      T a = q[load_axis * kTerms];
      for (int i = 1; i < kTerms; ++i) a += q[load_axis * kTerms + i] * of[i];
      sum[load_axis] = within * a;
    }
    const Sym3<T>& second = s.p.fixed_second_kg_m2;
    const T mass = T(1) / s.p.inverse_mass_1_kg;
    load.force_B = load.force_B + mass * Vec3<T>{sum[0], sum[1], sum[2]};
    load.moment_B = load.moment_B + Vec3<T>{(second.yy + second.zz) * sum[3], (second.xx + second.zz) * sum[4],
                                            (second.xx + second.yy) * sum[5]};
  }

 private:
  static constexpr double kMinLimit = 1e-6;  ///< least limit, m/s or rad/s
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
