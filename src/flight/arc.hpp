// Adaptive robust controller (Yao and Tomizuka 1997; for this vehicle the code of Fei et al. 2019). It forms sliding
// errors down to the derivative on which the wing beat acts, lets them decay by feedback, and adapts parameters within
// known bounds. Derivatives of position, in the heading frame (f: forward, l: left); b = R z is the direction of
// thrust, w the body rate:
//   acceleration a = g b/b_z + d        jerk j = g R (w x z)       snap = g (w_y', -w_x')
//   s = (D + lambda)^3 e = j_e + 3 lambda a_e + 3 lambda^2 v_e + lambda^3 e
//   snap_sp = -3 lambda j_e - 3 lambda^2 a_e - lambda^3 v_e - k s
//   V_0 = (I_y snap_f/g - tau_y)/B_y    V_d = (-I_x snap_l/g - tau_x)/B_x       tau' = gamma s, clamped (projection)
//   d: indirect, from the error of a predicted velocity  v^' = g b/b_z + d + l (v - v^),  d' = gamma (v - v^), clamped
// Heading: s = r_e + lambda e, torque I_z (-lambda r_e - k s) - tau_z. Height: s = v_e + lambda e, thrust
//   T = m (g + a_ref - lambda v_e - k s)/b_z with m' = -gamma s (g + ..), clamped; V_amp = T/B_T + V_T.
// d is not adapted from s: then an error of d could cancel one of tau and leave a position error.
#pragma once

#include "flight/pid.hpp"

namespace flappy::flight {

/// Decay rates: k of the sliding error s, lambda of the tracking error on s = 0.
template <class T>
struct Sliding {
  T lambda_1_s, k_1_s;
};

template <class T>
struct Adapted {
  T gain, low, high;
};

template <class T>
struct ArcConstants : LoopConstants<T> {
  Sliding<T> horizontal, height, heading;
  T position_error_limit_m, velocity_error_limit_m_s, yaw_error_limit_rad;
  Adapted<T> mass_kg, roll_Nm, pitch_Nm, yaw_Nm, disturbance_m_s2;
  T predictor_1_s;
  // linear map from the wing-beat inputs to thrust and torque
  T thrust_N_V, thrust_offset_V, roll_Nm_V, pitch_Nm_V, yaw_Nm_split;
  T inertia_x_kg_m2, inertia_y_kg_m2, inertia_z_kg_m2;
  T initial_mass_kg, amplitude_low_V, amplitude_high_V;
  T difference_limit_V, bias_limit_V, split_cycle_limit;
};

inline namespace FLAPPY_ISA {

template <class T>
struct Arc {
  T mass_kg;  // 0 before the first update
  T roll_Nm, pitch_Nm, yaw_Nm;
  T disturbance_x_m_s2, disturbance_y_m_s2, predicted_x_m_s, predicted_y_m_s;
  Vec3<T> velocity_m_s, body_rate_rad_s;  // low-passed
};

/// One step of projected adaptation. `blocked_towards`: sign of the direction of the parameter that would push an input
/// further past its limit; the parameter does not move in that direction. 0: the input is not at its limit.
template <class T, class K>
FLAPPY_INLINE T adapted(const Adapted<K>& k, const T& value, const T& rate, const T& period, const T& blocked_towards) {
  const T moved = clamp(T(value + T(T(k.gain) * rate) * period), T(k.low), T(k.high));
  return where(rate * blocked_towards > T(0), value, moved);
}

struct ArcController {
  static constexpr const char* kName = "arc";
  template <class T>
  using Constants = ArcConstants<T>;
  template <class T>
  using Memory = Arc<T>;

  static void fields(ArcConstants<double>& k, const auto& add);

  template <class T>
  static void start(Arc<T>& m, const Estimate<T>& x) {
    m.predicted_x_m_s = x.velocity_m_s.x;
    m.predicted_y_m_s = x.velocity_m_s.y;
    m.velocity_m_s = x.velocity_m_s;
    m.body_rate_rad_s = x.body_rate_rad_s;
  }

  /// Wing-beat inputs that balance the adapted weight and torques.
  template <class T>
  static FLAPPY_INLINE WingBeat<T> trim(const ArcConstants<Element<T>>& k, const Arc<T>& m) {
    const T weight = T(k.gravity_m_s2) * where(m.mass_kg > T(0), m.mass_kg, T(k.initial_mass_kg));
    return {weight / T(k.thrust_N_V) + T(k.thrust_offset_V), -T(m.roll_Nm / T(k.roll_Nm_V)),
            -T(m.pitch_Nm / T(k.pitch_Nm_V)), -T(m.yaw_Nm / T(k.yaw_Nm_split))};
  }

  /// Restores the adapted parameters in the lanes `held`; low-passes and predicted velocity keep their new values.
  template <class T>
  static FLAPPY_INLINE void unlearn(auto held, const Arc<T>& before, Arc<T>& now) {
    constexpr T Arc<T>::*kLearnt[] = {
        &Arc<T>::mass_kg,           &Arc<T>::roll_Nm, &Arc<T>::pitch_Nm, &Arc<T>::yaw_Nm, &Arc<T>::disturbance_x_m_s2,
        &Arc<T>::disturbance_y_m_s2};
    for (const auto learnt : kLearnt) now.*learnt = where(held, before.*learnt, now.*learnt);
  }

  template <class T>
  static void rotate(const T& sin, const T& cos, Arc<T>& m) {
    const Vec3<T> push = rotate_z(sin, cos, Vec3<T>{m.disturbance_x_m_s2, m.disturbance_y_m_s2, T(0)});
    const Vec3<T> predicted = rotate_z(sin, cos, Vec3<T>{m.predicted_x_m_s, m.predicted_y_m_s, T(0)});
    m.disturbance_x_m_s2 = push.x, m.disturbance_y_m_s2 = push.y;
    m.predicted_x_m_s = predicted.x, m.predicted_y_m_s = predicted.y;
    m.velocity_m_s = rotate_z(sin, cos, m.velocity_m_s);
  }

  template <class T>
  static FLAPPY_INLINE WingBeat<T> update(const ArcConstants<Element<T>>& k, Arc<T>& m, const Estimate<T>& x,
                                          const Setpoint<T>& ref);
};

void ArcController::fields(ArcConstants<double>& k, const auto& add) {
  const auto sliding = [&](const std::string& path, Sliding<double>& s) {
    add(path + ".lambda_1_s", s.lambda_1_s, io::non_negative(1000));
    add(path + ".k_1_s", s.k_1_s, io::non_negative(1000));
  };
  const auto adapted = [&](const std::string& path, Adapted<double>& a) {
    add(path + ".gain", a.gain, io::non_negative(1e6));
    add(path + ".low", a.low, io::Range{-1e3, 1e3});
    add(path + ".high", a.high, io::Range{-1e3, 1e3});
  };
  sliding("horizontal", k.horizontal);
  sliding("height", k.height);
  sliding("heading", k.heading);
  add("limits.position_error_m", k.position_error_limit_m, io::positive(100));
  add("limits.velocity_error_m_s", k.velocity_error_limit_m_s, io::positive(100));
  add("limits.yaw_error_rad", k.yaw_error_limit_rad, io::positive(3.2));
  adapted("adapted.mass_kg", k.mass_kg);
  adapted("adapted.roll_Nm", k.roll_Nm);
  adapted("adapted.pitch_Nm", k.pitch_Nm);
  adapted("adapted.yaw_Nm", k.yaw_Nm);
  adapted("adapted.disturbance_m_s2", k.disturbance_m_s2);
  add("adapted.initial_mass_kg", k.initial_mass_kg, io::positive(1));
  add("adapted.predictor_1_s", k.predictor_1_s, io::non_negative(1000));
  add("force_map.thrust_N_V", k.thrust_N_V, io::positive(1));
  add("force_map.thrust_offset_V", k.thrust_offset_V, io::Range{-18, 18});
  add("force_map.roll_Nm_V", k.roll_Nm_V, io::positive(1));
  add("force_map.pitch_Nm_V", k.pitch_Nm_V, io::positive(1));
  add("force_map.yaw_Nm_split", k.yaw_Nm_split, io::positive(1));
  add("inertia.x_kg_m2", k.inertia_x_kg_m2, io::positive(1));
  add("inertia.y_kg_m2", k.inertia_y_kg_m2, io::positive(1));
  add("inertia.z_kg_m2", k.inertia_z_kg_m2, io::positive(1));
  add("limits.amplitude_low_V", k.amplitude_low_V, io::non_negative(18));
  add("limits.amplitude_high_V", k.amplitude_high_V, io::non_negative(18));
  add("limits.difference_V", k.difference_limit_V, io::positive(18));
  add("limits.bias_V", k.bias_limit_V, io::positive(18));
  add("limits.split_cycle", k.split_cycle_limit, io::positive(0.4));
}

template <class T>
FLAPPY_INLINE WingBeat<T> ArcController::update(const ArcConstants<Element<T>>& k, Arc<T>& m, const Estimate<T>& x,
                                                const Setpoint<T>& ref) {
  const T dt(k.period_s), g(k.gravity_m_s2);
  const Matrix3<T> R = rotation_matrix(x.attitude);
  const SinCos<T> yaw = heading_of(R);
  const auto forward = [&](const T& ex, const T& ey) { return T(yaw.cos * ex + yaw.sin * ey); };
  const auto left = [&](const T& ex, const T& ey) { return T(yaw.cos * ey - yaw.sin * ex); };
  const auto within = [](const T& value, auto limit) { return clamp(value, T(-T(limit)), T(limit)); };
  m.mass_kg = where(m.mass_kg > T(0), m.mass_kg, T(k.initial_mass_kg));
  m.velocity_m_s = add_scaled(m.velocity_m_s, T(k.velocity_share), x.velocity_m_s - m.velocity_m_s);
  m.body_rate_rad_s = add_scaled(m.body_rate_rad_s, T(k.rate_share), x.body_rate_rad_s - m.body_rate_rad_s);
  const Vec3<T>& w = m.body_rate_rad_s;

  // horizontal: acceleration from lean, and the disturbance, estimated from what lean does not explain
  const T upright = max(R.row_z.z, T(0.5));
  const T lean_x = T(g * R.row_x.z) / upright, lean_y = T(g * R.row_y.z) / upright;
  const auto predict = [&](T& disturbance, T& predicted, const T& lean, const T& velocity) {
    const T innovation = velocity - predicted;
    predicted += dt * T(lean + (disturbance + T(k.predictor_1_s) * innovation));
    disturbance = adapted(k.disturbance_m_s2, disturbance, innovation, dt, T(0));
  };
  predict(m.disturbance_x_m_s2, m.predicted_x_m_s, lean_x, x.velocity_m_s.x);
  predict(m.disturbance_y_m_s2, m.predicted_y_m_s, lean_y, x.velocity_m_s.y);
  struct Errors {
    T position, velocity, acceleration, jerk;
  };
  const auto errors = [&](const T& p, const T& p_ref, const T& v, const T& v_ref, const T& a, const T& a_ref,
                          const T& j) {
    return Errors{within(T(p - p_ref), k.position_error_limit_m), within(T(v - v_ref), k.velocity_error_limit_m_s),
                  a - a_ref, j};
  };
  const Errors ex =
      errors(x.position_m.x, ref.position_m.x, m.velocity_m_s.x, ref.velocity_m_s.x, T(lean_x + m.disturbance_x_m_s2),
             ref.acceleration_m_s2.x, T(g * T(R.row_x.x * w.y - R.row_x.y * w.x)));
  const Errors ey =
      errors(x.position_m.y, ref.position_m.y, m.velocity_m_s.y, ref.velocity_m_s.y, T(lean_y + m.disturbance_y_m_s2),
             ref.acceleration_m_s2.y, T(g * T(R.row_y.x * w.y - R.row_y.y * w.x)));
  const T lambda(k.horizontal.lambda_1_s), rate(k.horizontal.k_1_s);
  const T c2 = T(3) * lambda, c1 = c2 * lambda, c0 = T(T(lambda * lambda) * lambda);
  const auto sliding = [&](const Errors& e) {
    return T(e.jerk + (c2 * e.acceleration + (c1 * e.velocity + c0 * e.position)));
  };
  const T sx = sliding(ex), sy = sliding(ey);
  const auto snap = [&](const Errors& e, const T& s) {
    return T(-(c2 * e.jerk + (c1 * e.acceleration + (c0 * e.velocity + rate * s))));
  };
  const T snap_x = snap(ex, sx), snap_y = snap(ey, sy);

  WingBeat<T> u;
  const auto drive = [&](T& offset, const Adapted<Element<T>>& adaptation, const T& torque, auto per_input, auto limit,
                         const T& s) {
    const T wanted = T(torque - offset) / T(per_input);
    offset = adapted(adaptation, offset, s, dt, T(-saturation(wanted, T(-T(limit)), T(limit))));
    return within(wanted, limit);
  };
  const T per_g = T(1) / g;
  u.bias_V = drive(m.pitch_Nm, k.pitch_Nm, T(T(k.inertia_y_kg_m2) * T(forward(snap_x, snap_y) * per_g)), k.pitch_Nm_V,
                   k.bias_limit_V, forward(sx, sy));
  u.difference_V = drive(m.roll_Nm, k.roll_Nm, T(-T(T(k.inertia_x_kg_m2) * T(left(snap_x, snap_y) * per_g))),
                         k.roll_Nm_V, k.difference_limit_V, T(-left(sx, sy)));

  const T turn = within(T(-atan2(T(ref.heading.sin * yaw.cos - ref.heading.cos * yaw.sin),
                                 T(ref.heading.cos * yaw.cos + ref.heading.sin * yaw.sin))),
                        k.yaw_error_limit_rad);
  const T turn_rate = w.z - ref.heading_rate_rad_s;
  const T s_yaw = turn_rate + T(k.heading.lambda_1_s) * turn;
  const T spin = -T(T(k.heading.lambda_1_s) * turn_rate + T(k.heading.k_1_s) * s_yaw);
  u.split_cycle = drive(m.yaw_Nm, k.yaw_Nm, T(T(k.inertia_z_kg_m2) * spin), k.yaw_Nm_split, k.split_cycle_limit, s_yaw);

  const T climb = within(T(m.velocity_m_s.z - ref.velocity_m_s.z), k.velocity_error_limit_m_s);
  const T high = within(T(x.position_m.z - ref.position_m.z), k.position_error_limit_m);
  const T s_z = climb + T(k.height.lambda_1_s) * high;
  const T lift = (g + ref.acceleration_m_s2.z) - T(T(k.height.lambda_1_s) * climb + T(k.height.k_1_s) * s_z);
  const T wanted = T(m.mass_kg * lift) / T(upright * T(k.thrust_N_V)) + T(k.thrust_offset_V);
  m.mass_kg = adapted(k.mass_kg, m.mass_kg, T(-T(s_z * lift)), dt,
                      saturation(wanted, T(k.amplitude_low_V), T(k.amplitude_high_V)));
  u.amplitude_V = clamp(wanted, T(k.amplitude_low_V), T(k.amplitude_high_V));
  return u;
}

}  // namespace FLAPPY_ISA
}  // namespace flappy::flight
