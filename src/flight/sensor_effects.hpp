// Effects of sensors (src/model/effects) on simulated samples. src/gap/replay/sensor_correction.hpp inverts them.
//   accelerometer_misalignment  specific force turned by the rotation vector e
//   vibration_rectification     turned force + gain (variance of noiseless force over the beat before), every axis
//   gyro_bias                   rate + drift (1 - exp(-t / warm_up)), t since the flight's start
//   marker_offset               position p + R_WB d, R_WB the true attitude: attitude noise does not move the marker
//   mocap_tilt                  position R(e) p, attitude R(e) q, after marker_offset
//   mocap_delay                 pose and the two effects above at t - delay, from the true motion
// They act on noisy samples, in the lanes in which a magnitude is not 0.
#pragma once

#include "flight/sensors.hpp"
#include "model/effects/registry.hpp"
#include "sim/rows.hpp"
#include "sim/step.hpp"

namespace flappy::flight {
inline namespace FLAPPY_ISA {

template <class Effect, int I = 0>
constexpr int index_of() {
  if constexpr (std::is_same_v<Effect, EffectAt<I>>) return I;
  else return index_of<Effect, I + 1>();
}

/// Bit of an effect in sim::BlockEffects::set.
template <class Effect>
inline constexpr std::uint64_t kBit = std::uint64_t{1} << index_of<Effect>();
inline constexpr std::uint64_t kImuEffects =
    kBit<AccelerometerMisalignment> | kBit<VibrationRectification> | kBit<GyroBias>;
inline constexpr std::uint64_t kMocapEffects = kBit<MarkerOffset> | kBit<MocapTilt>;

/// Parameter `k` of an effect, for the register of lanes that begins at lane `first`.
template <class Effect, class T>
FLAPPY_INLINE Lanes<T, sim::kWidth<T>> effect_parameter(const sim::BlockEffects<T>& effects, int k, int first) {
  const int row = effect_rows_before<index_of<Effect>()>() + k;
  return Lanes<T, sim::kWidth<T>>::load(effects.rows + row * sim::kLanes<T> + first);
}

/// Memory of an effect for the register of lanes that begins at lane `first`. Only lanes of `on` are written.
template <class Effect, class T>
FLAPPY_INLINE StateRows<Lanes<T, sim::kWidth<T>>> memory_of(const sim::BlockEffects<T>& effects, int first,
                                                            typename Lanes<T, sim::kWidth<T>>::Mask on) {
  const int row = state_rows(effects.kept & (kBit<Effect> - 1));
  return {effects.states + row * sim::kLanes<T> + first, sim::kLanes<T>, on};
}

template <class T>
FLAPPY_INLINE auto is_nonzero(const Vec3<T>& v) {
  return dot(v, v) > T(0);
}

/// v turned by the rotation vector e: Rodrigues' formula, with power series of sin(x)/x and (1 - cos x)/x^2 whose next
/// terms are below 1e-13 for |e| < 0.53 rad. The effects allow 0.3 rad on each of three axes.
template <class T>
FLAPPY_INLINE Vec3<T> turned_by(const Vec3<T>& e, const Vec3<T>& v) {
  const T x = dot(e, e);
  T sine = T(-1.0 / 39916800), cosine = T(-1.0 / 479001600);
  sine = T(1.0 / 362880) + x * sine;
  cosine = T(1.0 / 3628800) + x * cosine;
  sine = T(-1.0 / 5040) + x * sine;
  cosine = T(-1.0 / 40320) + x * cosine;
  sine = T(1.0 / 120) + x * sine;
  cosine = T(1.0 / 720) + x * cosine;
  sine = T(-1.0 / 6) + x * sine;
  cosine = T(-1.0 / 24) + x * cosine;
  sine = T(1) + x * sine;
  cosine = T(0.5) + x * cosine;
  const Vec3<T> across = cross(e, v);
  return add_scaled(add_scaled(v, sine, across), cosine, cross(e, across));
}

/// The quaternion of the rotation vector e, |e| < 0.53 rad: power series in (|e|/2)^2 < 0.07.
template <class T>
FLAPPY_INLINE Quaternion<T> quaternion_of(const Vec3<T>& e) {
  const T y = T(0.25) * dot(e, e);
  T cosine = T(1.0 / 40320), sine = T(1.0 / 362880);
  cosine = T(-1.0 / 720) + y * cosine;
  sine = T(-1.0 / 5040) + y * sine;
  cosine = T(1.0 / 24) + y * cosine;
  sine = T(1.0 / 120) + y * sine;
  cosine = T(-0.5) + y * cosine;
  sine = T(-1.0 / 6) + y * sine;
  cosine = T(1) + y * cosine;
  sine = T(1) + y * sine;
  const T half = T(0.5) * sine;
  return {cosine, half * e.x, half * e.y, half * e.z};
}

/// Bias from the vibration in the last beat. Adds a force sample at `phase` of this beat to the memory. Rows of memory:
/// 0-2 bias, 3 number of samples in this beat, 4-6 sums, 7-9 sums of squares, 10 last phase.
template <class L>
FLAPPY_INLINE Vec3<L> rectified(const L& gain, const StateRows<L>& state, const L& phase, const Vec3<L>& force) {
  const auto over = phase < state.get(10);  // the phase has wrapped: the last beat is complete
  const L count = state.get(3), per_count = L(1) / max(count, L(1)), none(0);
  const auto axis = [&](int k, const L& f) {
    const L sum = state.get(4 + k), squares = state.get(7 + k), mean = per_count * sum;
    const L bias = where(over, L(gain * L(per_count * squares - mean * mean)), state.get(k));
    state.set(k, bias);
    state.set(4 + k, L(where(over, none, sum) + f));
    state.set(7 + k, L(where(over, none, squares) + f * f));
    return bias;
  };
  state.set(3, L(where(over, none, count) + L(1)));
  state.set(10, phase);
  return {axis(0, force.x), axis(1, force.y), axis(2, force.z)};
}

/// Applies the IMU's effects to sample `y`. `time_s`: since each flight's start. `phase`: fraction of the wing beat.
/// `force`: specific force without sensor noise, m/s^2, in B.
template <class T, class L>
FLAPPY_INLINE void disturb(const sim::BlockEffects<T>& effects, const L& time_s, const L& phase, Vec3<L> force,
                           ImuSample<L>& y, int first) {
  if (effects.set & kBit<AccelerometerMisalignment>) {
    const auto of = [&](int k) { return effect_parameter<AccelerometerMisalignment>(effects, k, first); };
    const Vec3<L> e{of(0), of(1), of(2)};
    y.accel_m_s2 = where(is_nonzero(e), turned_by(e, y.accel_m_s2), y.accel_m_s2);
    force = where(is_nonzero(e), turned_by(e, force), force);
  }
  if (effects.set & kBit<VibrationRectification>) {
    const L gain = effect_parameter<VibrationRectification>(effects, 0, first);
    const auto on = !(gain == L(0));
    const Vec3<L> bias = rectified(gain, memory_of<VibrationRectification>(effects, first, on), phase, force);
    y.accel_m_s2 = where(on, y.accel_m_s2 + bias, y.accel_m_s2);
  }
  if (effects.set & kBit<GyroBias>) {
    const auto of = [&](int k) { return effect_parameter<GyroBias>(effects, k, first); };
    const Vec3<L> drift{of(0), of(1), of(2)};
    const L cold = exp(L(L(0) - time_s / of(3)));
    y.gyro_rad_s = where(is_nonzero(drift), add_scaled(y.gyro_rad_s, L(L(1) - cold), drift), y.gyro_rad_s);
  }
}

/// Applies the effects of motion capture, except mocap_delay, to pose `y`. `attitude`: the true attitude.
template <class T, class L>
FLAPPY_INLINE void disturb(const sim::BlockEffects<T>& effects, const Quaternion<L>& attitude, MocapSample<L>& y,
                           int first) {
  if (effects.set & kBit<MarkerOffset>) {
    const auto of = [&](int k) { return effect_parameter<MarkerOffset>(effects, k, first); };
    const Vec3<L> d{of(0), of(1), of(2)};
    y.position_m = where(is_nonzero(d), y.position_m + rotation_matrix(attitude) * d, y.position_m);
  }
  if (effects.set & kBit<MocapTilt>) {
    const auto of = [&](int k) { return effect_parameter<MocapTilt>(effects, k, first); };
    const L none(0);
    const Vec3<L> e{of(0), of(1), none}, back{L(none - e.x), L(none - e.y), none};
    const auto on = is_nonzero(e);
    const Quaternion<L> q = from_to(quaternion_of(back), y.attitude);
    y.position_m = where(on, turned_by(e, y.position_m), y.position_m);
    y.attitude = {where(on, q.w, y.attitude.w), where(on, q.x, y.attitude.x), where(on, q.y, y.attitude.y),
                  where(on, q.z, y.attitude.z)};
  }
}

/// Stores the true motion at the start of a control period, for past_truth(). `tick`: periods since each lane's start;
/// `all`: of all lanes, else of those with a mocap_delay.
template <class T, class L>
FLAPPY_INLINE void keep_past(const sim::BlockEffects<T>& effects, const std::uint32_t* tick, const Truth<L>& truth,
                             bool all, int first) {
  static_assert(kRows<Truth> == MocapDelay::kRows);
  const L late = effect_parameter<MocapDelay>(effects, 0, first);
  const auto on = all ? late == late : !(late == L(0));
  const auto past = memory_of<MocapDelay>(effects, first, on);
  const L* rows = reinterpret_cast<const L*>(&truth);
  for (int i = 0; i < sim::kWidth<T>; ++i)
    for (int r = 0; on.raw[i] && r < MocapDelay::kRows; ++r)
      past.rows[(tick[i] % MocapDelay::kSlots * MocapDelay::kRows + r) * past.stride + i] = rows[r].raw[i];
}

/// True pose `age` control periods before the end of period `tick`, where the motion is `now`: cubic Hermite; velocity
/// and body rate of the newer support point. Ages below 0 give `now`, ages beyond the memory the oldest motion.
template <class T, class L>
FLAPPY_INLINE Truth<L> past_truth(const sim::BlockEffects<T>& effects, const std::uint32_t* tick, const Truth<L>& now,
                                  const L& age, const T& period_s, int first) {
  constexpr std::uint32_t kSlots = MocapDelay::kSlots;
  const auto past = memory_of<MocapDelay>(effects, first, age == age);
  Truth<L> older = now, newer = now;
  L part(0);  // fraction of a period from `newer` back to `older`
  for (int i = 0; i < sim::kWidth<T>; ++i) {
    const std::uint32_t kept = tick[i] + 1 < kSlots ? tick[i] + 1 : kSlots;
    const T periods = age.raw[i] > T(0) ? age.raw[i] < T(kept) ? age.raw[i] : T(kept) : T(0);
    const auto whole = static_cast<std::uint32_t>(periods), from = whole < kept ? whole : kept - 1;
    part.raw[i] = periods - static_cast<T>(from);
    const auto copy = [&](std::uint32_t back, Truth<L>& to) {
      const T* rows = past.rows + (tick[i] + 1 - back) % kSlots * MocapDelay::kRows * past.stride + i;
      T length2 = 0;  // squared norm of the quaternion
      for (int r = 3; r < 7; ++r) length2 += rows[r * past.stride] * rows[r * past.stride];
      if (back == 0 || !(length2 > 0)) return;  // the present, or never stored
      for (int r = 0; r < MocapDelay::kRows; ++r) reinterpret_cast<L*>(&to)[r].raw[i] = rows[r * past.stride];
    };
    copy(from, newer);
    copy(from + 1, older);
  }
  const L u = L(1) - part, h(period_s), share = u * u * L(L(3) - L(2) * u), at_older = h * u * part * part,
          at_newer = L(0) - h * u * u * part;
  const auto between = [&](const L& a, const L& a_rate, const L& b, const L& b_rate) {
    return a + (share * L(b - a) + (at_older * a_rate + at_newer * b_rate));
  };
  const auto rate = [](const Truth<L>& x) {
    const Quaternion<L>& q = x.attitude;
    const Vec3<L> w = L(0.5) * x.body_rate_rad_s;
    return Quaternion<L>{L(0) - (q.x * w.x + (q.y * w.y + q.z * w.z)), q.w * w.x + (q.y * w.z - q.z * w.y),
                         q.w * w.y + (q.z * w.x - q.x * w.z), q.w * w.z + (q.x * w.y - q.y * w.x)};
  };
  const auto &p = older.position_m, &p_new = newer.position_m, &v = older.velocity_m_s, &v_new = newer.velocity_m_s;
  const Quaternion<L>&a = older.attitude, &b = newer.attitude, a_rate = rate(older), b_rate = rate(newer);
  Quaternion<L> q{between(a.w, a_rate.w, b.w, b_rate.w), between(a.x, a_rate.x, b.x, b_rate.x),
                  between(a.y, a_rate.y, b.y, b_rate.y), between(a.z, a_rate.z, b.z, b_rate.z)};
  const L scale = L(1) / sqrt(L(q.w * q.w + (q.x * q.x + (q.y * q.y + q.z * q.z))));
  q = {q.w * scale, q.x * scale, q.y * scale, q.z * scale};
  return {
      {between(p.x, v.x, p_new.x, v_new.x), between(p.y, v.y, p_new.y, v_new.y), between(p.z, v.z, p_new.z, v_new.z)},
      q,
      newer.velocity_m_s,
      newer.body_rate_rad_s};
}

}  // namespace FLAPPY_ISA
}  // namespace flappy::flight
