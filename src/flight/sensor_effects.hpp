// Effects of sensors, done to samples that are taken: the forms of src/model/effects, which src/gap/sensor_effects.hpp undoes.
//
//   accelerometer_misalignment  force turned by e
//   gyro_bias                   rate + drift (1 - exp(-t / warm_up)), t since the flight's start
//   marker_offset               seen position p + R_WB d, R_WB the true attitude: the marker is where it is, however seen
//   mocap_tilt                  seen position R(e) p, attitude R(e) q, of what the marker's offset left
//
// They act on what is measured, noise and all, in the lanes in which they have a size. vibration_rectification, which needs the
// beat before, and mocap_delay, which needs the poses before, do not act.
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

/// Bit of an effect in a block's set.
template <class Effect>
inline constexpr std::uint64_t kBit = std::uint64_t{1} << index_of<Effect>();
inline constexpr std::uint64_t kImuEffects = kBit<AccelerometerMisalignment> | kBit<GyroBias>;
inline constexpr std::uint64_t kMocapEffects = kBit<MarkerOffset> | kBit<MocapTilt>;

/// Parameter `k` of an effect in a register of lanes.
template <class Effect, class T>
FLAPPY_INLINE Lanes<T, sim::kWidth<T>> effect_parameter(const sim::BlockEffects<T>& effects, int k, int first) {
  const int row = effect_rows_before<index_of<Effect>()>() + k;
  return Lanes<T, sim::kWidth<T>>::load(effects.rows + row * sim::kLanes<T> + first);
}

/// Lanes in which a vector is not 0.
template <class T>
FLAPPY_INLINE auto has_size(const Vec3<T>& v) {
  return dot(v, v) > T(0);
}

/// v turned by the rotation vector e, |e| < 0.53 rad as three axes of 0.3 have it: Rodrigues' formula, sin(x)/x and (1 - cos x)/x^2
/// by their series, whose next terms are below 1e-13.
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

/// The quaternion of the rotation vector e, as above: series in (|e|/2)^2 < 0.07.
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

/// What the IMU's effects make of a sample at `time_s` since each flight's start.
template <class T, class L>
FLAPPY_INLINE void disturb(const sim::BlockEffects<T>& effects, const L& time_s, ImuSample<L>& y, int first) {
  if (effects.set & kBit<AccelerometerMisalignment>) {
    const auto of = [&](int k) { return effect_parameter<AccelerometerMisalignment>(effects, k, first); };
    const Vec3<L> e{of(0), of(1), of(2)};
    y.accel_m_s2 = where(has_size(e), turned_by(e, y.accel_m_s2), y.accel_m_s2);
  }
  if (effects.set & kBit<GyroBias>) {
    const auto of = [&](int k) { return effect_parameter<GyroBias>(effects, k, first); };
    const Vec3<L> drift{of(0), of(1), of(2)};
    const L cold = exp(L(L(0) - time_s / of(3)));
    y.gyro_rad_s = where(has_size(drift), add_scaled(y.gyro_rad_s, L(L(1) - cold), drift), y.gyro_rad_s);
  }
}

/// What the effects of motion capture make of a pose that was truly at `attitude`.
template <class T, class L>
FLAPPY_INLINE void disturb(const sim::BlockEffects<T>& effects, const Quaternion<L>& attitude, MocapSample<L>& y,
                           int first) {
  if (effects.set & kBit<MarkerOffset>) {
    const auto of = [&](int k) { return effect_parameter<MarkerOffset>(effects, k, first); };
    const Vec3<L> d{of(0), of(1), of(2)};
    y.position_m = where(has_size(d), y.position_m + rotation_matrix(attitude) * d, y.position_m);
  }
  if (effects.set & kBit<MocapTilt>) {
    const auto of = [&](int k) { return effect_parameter<MocapTilt>(effects, k, first); };
    const L none(0);
    const Vec3<L> e{of(0), of(1), none}, back{L(none - e.x), L(none - e.y), none};
    const auto on = has_size(e);
    const Quaternion<L> q = from_to(quaternion_of(back), y.attitude);
    y.position_m = where(on, turned_by(e, y.position_m), y.position_m);
    y.attitude = {where(on, q.w, y.attitude.w), where(on, q.x, y.attitude.x), where(on, q.y, y.attitude.y),
                  where(on, q.z, y.attitude.z)};
  }
}

}  // namespace FLAPPY_ISA
}  // namespace flappy::flight
