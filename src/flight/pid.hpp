// Cascaded PID controller (Fei et al. 2019; same structure as ArduPilot): position P -> velocity PID -> lean angles ->
// attitude PID -> wing-beat inputs. Index f: forward, l: left, in the heading frame (W turned by the yaw angle).
//   v_sp = v_ref + k (p_ref - p)             e = v_sp - v        a_f,l = a_ref + PID(e)       V_z = PID(e_z)
//   pitch_sp = atan(a_f / g)                 roll_sp = -atan(a_l cos(pitch_sp) / g)
//   V_d = PID(roll_sp - roll)                V_0 = PID(pitch_sp - pitch)      d_sigma = PID(yaw_ref - yaw)
//                                            there P and D pass N
//   V_amp = V_hover + V_z / (cos roll cos pitch)
// N: a notch at notch_hz, if any (notched(), below), because the answer to the swing of the pitch within each beat adds to
// the beat that is commanded, or takes from it, by its delay. Roll and yaw hardly swing.
// The derivative of a roll or pitch error is the negative low-passed body rate (yaw: relative to the set point's rate);
// the derivative of a velocity error comes from the low-passed velocity. Integrators are clamped. They do not move
// further out while the output that they drive is at its limit (anti-windup).
#pragma once

#include <numbers>
#include <string>

#include "flight/controller_loop.hpp"
#include "flight/path.hpp"
#include "io/config.hpp"
#include "model/wing_beat.hpp"

namespace flappy::flight {

template <class T>
struct PidGains {
  T p, i, d;
  T integral_limit;  // limit of |i * integral|, in the unit of the output
};

template <class T>
struct PidConstants : LoopConstants<T> {
  T position_xy_1_s, position_z_1_s, speed_limit_m_s, climb_limit_m_s;
  PidGains<T> forward, left, up;  // m/s -> m/s^2, m/s^2, V
  T acceleration_limit_m_s2, roll_limit_rad, pitch_limit_rad, yaw_error_limit_rad;
  PidGains<T> roll, pitch, yaw;  // rad -> V, V, split cycle
  T hover_V, lower_V, upper_V;   // V_amp = hover_V + clip(.., lower_V, upper_V)
  T difference_limit_V, bias_limit_V, split_cycle_limit;
  T notch_hz, notch_quality;            // 0 Hz: no notch
  T notch_near, notch_far, notch_back;  // its coefficients (PidController::derive())
};

inline namespace FLAPPY_ISA {

template <class T>
struct Pid {
  T integral_x, integral_y;               // m/s^2, in W
  T integral_z;                           // V
  T integral_roll, integral_pitch;        // V
  T integral_yaw;                         // split cycle
  Vec3<T> velocity_m_s, body_rate_rad_s;  // low-passed
  T notch_next, notch_after;              // memory of the notch
};

template <class T>
FLAPPY_INLINE SinCos<T> heading_of(const Matrix3<T>& R) {
  const T c = R.row_x.x, s = R.row_y.x;
  const T scale = T(1) / sqrt(T(max(T(c * c + s * s), T(1e-12))));
  return {s * scale, c * scale};
}

/// Integrates an error, in the unit of the output, and clamps to +-limit. `blocked_towards`: sign of the direction in
/// which the output is saturated; the integral does not move in that direction. 0: not saturated.
template <class T>
FLAPPY_INLINE T integrated(const T& integral, const T& gain_and_time, const T& error, const T& limit,
                           const T& blocked_towards) {
  const T step = gain_and_time * error;
  const T moved = clamp(T(integral + step), T(-limit), limit);
  return where(step * blocked_towards > T(0), integral, moved);
}

/// +1 or -1 where `value` is at its limit, else 0.
template <class T>
FLAPPY_INLINE T saturation(const T& value, const T& low, const T& high) {
  return where(value > high, T(1), where(value < low, T(-1), T(0)));
}

/// One step of a second-order notch, in transposed direct form II:
///   y = n x + a,   a' = f (x - y) + b,   b' = n x - r y
/// with 1 at 0 Hz and at half of the control rate, 0 at the notch (Bristow-Johnson, Cookbook formulae for audio EQ biquad
/// filter coefficients, 2021, W3C).
template <class T>
FLAPPY_INLINE T notched(const T& near, const T& far, const T& back, const T& x, T& next, T& after) {
  const T y = near * x + next;
  next = far * T(x - y) + after;
  after = near * x - back * y;
  return y;
}

/// Table of the controller's functions (controllers.hpp).
struct PidController {
  static constexpr const char* kName = "pid";
  template <class T>
  using Constants = PidConstants<T>;
  template <class T>
  using Memory = Pid<T>;

  static void fields(PidConstants<double>& k, const auto& add);

  /// C code for the robot: src/deploy/c/controller_pid.h. exported() lists the members of its constants in order.
  static constexpr const char* kSource = "controller_pid";
  static void exported(const PidConstants<float>& k, const auto& add) {
    add("position_xy_1_s", k.position_xy_1_s);
    add("position_z_1_s", k.position_z_1_s);
    add("speed_limit_m_s", k.speed_limit_m_s);
    add("climb_limit_m_s", k.climb_limit_m_s);
    add("forward", k.forward);
    add("left", k.left);
    add("up", k.up);
    add("acceleration_limit_m_s2", k.acceleration_limit_m_s2);
    add("roll_limit_rad", k.roll_limit_rad);
    add("pitch_limit_rad", k.pitch_limit_rad);
    add("yaw_error_limit_rad", k.yaw_error_limit_rad);
    add("roll", k.roll);
    add("pitch", k.pitch);
    add("yaw", k.yaw);
    add("hover_V", k.hover_V);
    add("lower_V", k.lower_V);
    add("upper_V", k.upper_V);
    add("difference_limit_V", k.difference_limit_V);
    add("bias_limit_V", k.bias_limit_V);
    add("split_cycle_limit", k.split_cycle_limit);
    add("notch_hz", k.notch_hz);
    add("notch_near", k.notch_near);
    add("notch_far", k.notch_far);
    add("notch_back", k.notch_back);
  }

  /// Coefficients of the notch: with w = 2 pi notch_hz period_s and alpha = sin w / (2 quality),
  ///   n = 1 / (1 + alpha),   f = -2 n cos w,   r = n (1 - alpha)
  static void derive(PidConstants<double>& k) {
    const auto [sin, cos] = sin_cos(2 * std::numbers::pi * k.notch_hz * k.period_s);
    const double alpha = sin / (2 * k.notch_quality);
    k.notch_near = 1 / (1 + alpha);
    k.notch_far = -2 * k.notch_near * cos;
    k.notch_back = k.notch_near * (1 - alpha);
  }

  template <class T>
  static void start(Pid<T>& m, const Estimate<T>& x) {
    m.velocity_m_s = x.velocity_m_s;
    m.body_rate_rad_s = x.body_rate_rad_s;
  }

  template <class T>
  static FLAPPY_INLINE WingBeat<T> trim(const PidConstants<Element<T>>& k, const Pid<T>& m) {
    return {T(k.hover_V) + m.integral_z, m.integral_roll, m.integral_pitch, m.integral_yaw};
  }

  /// Restores the integrators in the lanes `held`; the low-passes keep their new values.
  template <class T>
  static FLAPPY_INLINE void unlearn(auto held, const Pid<T>& before, Pid<T>& now) {
    constexpr T Pid<T>::*kLearnt[] = {&Pid<T>::integral_x,    &Pid<T>::integral_y,     &Pid<T>::integral_z,
                                      &Pid<T>::integral_roll, &Pid<T>::integral_pitch, &Pid<T>::integral_yaw};
    for (const auto learnt : kLearnt) now.*learnt = where(held, before.*learnt, now.*learnt);
  }

  template <class T>
  static void rotate(const T& sin, const T& cos, Pid<T>& m) {
    const Vec3<T> integral = rotate_z(sin, cos, Vec3<T>{m.integral_x, m.integral_y, T(0)});
    m.integral_x = integral.x;
    m.integral_y = integral.y;
    m.velocity_m_s = rotate_z(sin, cos, m.velocity_m_s);
  }

  template <class T>
  static FLAPPY_INLINE WingBeat<T> update(const PidConstants<Element<T>>& k, Pid<T>& m, const Estimate<T>& x,
                                          const Setpoint<T>& ref);
};

void PidController::fields(PidConstants<double>& k, const auto& add) {
  const auto gains = [&](const std::string& path, PidGains<double>& g) {
    add(path + ".p", g.p, io::non_negative(1000));
    add(path + ".i", g.i, io::non_negative(1000));
    add(path + ".d", g.d, io::non_negative(1000));
    add(path + ".integral_limit", g.integral_limit, io::non_negative(1000));
  };
  add("position.xy_1_s", k.position_xy_1_s, io::non_negative(100));
  add("position.z_1_s", k.position_z_1_s, io::non_negative(100));
  add("position.speed_limit_m_s", k.speed_limit_m_s, io::positive(100));
  add("position.climb_limit_m_s", k.climb_limit_m_s, io::positive(100));
  gains("velocity.forward", k.forward);
  gains("velocity.left", k.left);
  gains("velocity.up", k.up);
  gains("attitude.roll", k.roll);
  gains("attitude.pitch", k.pitch);
  gains("attitude.yaw", k.yaw);
  add("limits.acceleration_m_s2", k.acceleration_limit_m_s2, io::positive(100));
  add("limits.roll_rad", k.roll_limit_rad, io::positive(1.5));
  add("limits.pitch_rad", k.pitch_limit_rad, io::positive(1.5));
  add("limits.yaw_error_rad", k.yaw_error_limit_rad, io::positive(3.2));
  add("hover_V", k.hover_V, io::non_negative(18));
  add("limits.amplitude_below_V", k.lower_V, io::Range{-18, 0});
  add("limits.amplitude_above_V", k.upper_V, io::Range{0, 18});
  add("limits.difference_V", k.difference_limit_V, io::positive(18));
  add("limits.bias_V", k.bias_limit_V, io::positive(18));
  add("limits.split_cycle", k.split_cycle_limit, io::positive(0.4));
  add("notch.frequency_hz", k.notch_hz, io::non_negative(200), 0.0);
  add("notch.quality", k.notch_quality, io::Range{0.1, 100}, 1.0);
}

template <class T>
FLAPPY_INLINE WingBeat<T> PidController::update(const PidConstants<Element<T>>& k, Pid<T>& m, const Estimate<T>& x,
                                                const Setpoint<T>& ref) {
  const T dt(k.period_s);
  const Matrix3<T> R = rotation_matrix(x.attitude);
  const SinCos<T> yaw = heading_of(R);

  const auto toward = [](const T& want, const T& have, auto gain, const T& feed_forward, auto limit) {
    return clamp(T(feed_forward + T(gain) * T(want - have)), T(-T(limit)), T(limit));
  };
  const Vec3<T> wanted{
      toward(ref.position_m.x, x.position_m.x, k.position_xy_1_s, ref.velocity_m_s.x, k.speed_limit_m_s),
      toward(ref.position_m.y, x.position_m.y, k.position_xy_1_s, ref.velocity_m_s.y, k.speed_limit_m_s),
      toward(ref.position_m.z, x.position_m.z, k.position_z_1_s, ref.velocity_m_s.z, k.climb_limit_m_s)};
  const Vec3<T> before = m.velocity_m_s;
  m.velocity_m_s = add_scaled(before, T(k.velocity_share), x.velocity_m_s - before);
  const Vec3<T> slope = T(k.per_period_Hz) * (before - m.velocity_m_s);  // derivative of the velocity error
  const Vec3<T> error = wanted - m.velocity_m_s;
  const auto forward = [&](const T& ex, const T& ey) { return T(yaw.cos * ex + yaw.sin * ey); };
  const auto left = [&](const T& ex, const T& ey) { return T(yaw.cos * ey - yaw.sin * ex); };
  const T sum_f = forward(m.integral_x, m.integral_y), sum_l = left(m.integral_x, m.integral_y);
  const T error_f = forward(error.x, error.y), error_l = left(error.x, error.y);
  const T a_f = T(k.forward.p) * error_f + (T(k.forward.d) * forward(slope.x, slope.y) +
                                            (sum_f + forward(ref.acceleration_m_s2.x, ref.acceleration_m_s2.y)));
  const T a_l = T(k.left.p) * error_l + (T(k.left.d) * left(slope.x, slope.y) +
                                         (sum_l + left(ref.acceleration_m_s2.x, ref.acceleration_m_s2.y)));

  const T g(k.gravity_m_s2), limit(k.acceleration_limit_m_s2), most_pitch(k.pitch_limit_rad),
      most_roll(k.roll_limit_rad);
  const T pitch_for_a = atan2(clamp(a_f, T(-limit), limit), g);
  const T pitch_wanted = clamp(pitch_for_a, T(-most_pitch), most_pitch);
  const T roll_for_a = -atan2(T(clamp(a_l, T(-limit), limit) * sin_cos(pitch_wanted).cos), g);
  const T roll_wanted = clamp(roll_for_a, T(-most_roll), most_roll);
  const T blocked_f = saturation(a_f, T(-limit), limit) + saturation(pitch_for_a, T(-most_pitch), most_pitch);
  const T blocked_l = saturation(a_l, T(-limit), limit) - saturation(roll_for_a, T(-most_roll), most_roll);
  const T step_f = integrated(sum_f, T(T(k.forward.i) * dt), error_f, T(k.forward.integral_limit), blocked_f) - sum_f;
  const T step_l = integrated(sum_l, T(T(k.left.i) * dt), error_l, T(k.left.integral_limit), blocked_l) - sum_l;
  m.integral_x += yaw.cos * step_f - yaw.sin * step_l;
  m.integral_y += yaw.sin * step_f + yaw.cos * step_l;
  const T roll = atan2(R.row_z.y, R.row_z.z), pitch = T(-asin(R.row_z.x));
  const T yaw_error = atan2(T(ref.heading.sin * yaw.cos - ref.heading.cos * yaw.sin),
                            T(ref.heading.cos * yaw.cos + ref.heading.sin * yaw.sin));

  m.body_rate_rad_s = add_scaled(m.body_rate_rad_s, T(k.rate_share), x.body_rate_rad_s - m.body_rate_rad_s);
  const auto attitude = [&](const PidGains<Element<T>>& gain, T& integral, const T& angle_error, const T& rate_error,
                            auto most, bool swings = false) {
    T out;
    if (swings && k.notch_hz > 0) {
      const T swinging = T(gain.p) * angle_error + T(gain.d) * rate_error;
      out = notched(T(k.notch_near), T(k.notch_far), T(k.notch_back), swinging, m.notch_next, m.notch_after) + integral;
    } else {
      out = T(gain.p) * angle_error + (T(gain.d) * rate_error + integral);
    }
    const T top(most);
    integral =
        integrated(integral, T(T(gain.i) * dt), angle_error, T(gain.integral_limit), saturation(out, T(-top), top));
    return clamp(out, T(-top), top);
  };
  const Vec3<T>& w = m.body_rate_rad_s;
  const T yaw_reach(k.yaw_error_limit_rad);
  WingBeat<T> u;
  u.difference_V = attitude(k.roll, m.integral_roll, T(roll_wanted - roll), T(-w.x), k.difference_limit_V);
  u.bias_V = attitude(k.pitch, m.integral_pitch, T(pitch_wanted - pitch), T(-w.y), k.bias_limit_V, true);
  u.split_cycle = attitude(k.yaw, m.integral_yaw, clamp(yaw_error, T(-yaw_reach), yaw_reach),
                           T(ref.heading_rate_rad_s - w.z), k.split_cycle_limit);

  const T climb = T(k.up.p) * error.z + (T(k.up.d) * slope.z + m.integral_z);
  const T lift = climb / max(R.row_z.z, T(0.5));  // cos roll cos pitch
  m.integral_z = integrated(m.integral_z, T(T(k.up.i) * dt), error.z, T(k.up.integral_limit),
                            saturation(lift, T(k.lower_V), T(k.upper_V)));
  u.amplitude_V = T(k.hover_V) + clamp(lift, T(k.lower_V), T(k.upper_V));
  return u;
}

}  // namespace FLAPPY_ISA
}  // namespace flappy::flight
