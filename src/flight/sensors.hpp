// Sensor models. IMU: every sample is the mean over the interval since the last, as an integrating IMU or a decimating
// filter delivers it, which keeps the wing beat from aliasing, then passes a first-order low-pass:
//   gyro   rotation between the two attitudes / interval + constant bias + noise
//   accel  specific force R^T (dv/dt + g z) at the position of the IMU, R half-way between the two attitudes, + noise
// An IMU at rest reads +g upward. Motion capture: pose of the torso origin, with white noise, late, lost in bursts
// (Gilbert 1960: a loss begins with one probability and ends with another). Lateness may vary from sample to sample,
// uniformly or exponentially beyond the latency (as time steps in Andrychowicz et al., Int. J. Robotics Research
// 2020); nobody is told, so a pose that is taken for one of t - latency is older.
#pragma once

#include "model/vehicle_dynamics.hpp"
#include "sim/noise.hpp"

namespace flappy::flight {

template <class T>
struct ImuConstants {
  T position_m[3];  // in B
  T gyro_noise_rad_s, accel_noise_m_s2;
  T low_pass_share;  // share of a new value in the low-passed one
  T gravity_m_s2;
};

/// Where an exponential jitter is cut, in units of its mean, so that the motion before is kept for a time that is known.
/// Choice: cuts one sample in 3,000.
inline constexpr double kJitterCut = 8;

template <class T>
struct MocapConstants {
  T position_noise_m, attitude_noise_rad;
  T loss_begins, loss_ends;  // probabilities at each sample
  T jitter_s;                // as MocapSensor::jitter_s
  T exponential, drawn;      // 0 or 1: its law; whether each flight draws its own
};

inline namespace FLAPPY_ISA {

using namespace model;

/// True motion of the torso.
template <class T>
struct Truth {
  Vec3<T> position_m;  // torso origin, in W
  Quaternion<T> attitude;
  Vec3<T> velocity_m_s;     // torso origin, in W
  Vec3<T> body_rate_rad_s;  // in B
};

template <class T>
FLAPPY_INLINE Truth<T> truth_of(const Parameters<T>& p, const State<T>& x) {
  const auto whole = whole_vehicle<T>(
      p, {place_wing<+1>(p.left, x.left, x.body_rate_rad_s), place_wing<-1>(p.right, x.right, x.body_rate_rad_s)});
  const Vec3<T> of_com = cross(x.body_rate_rad_s, whole.com) + whole.com_rate;
  const Vec3<T> velocity = x.com_velocity_m_s - rotation_matrix(x.attitude) * of_com;
  const Vec3<T> none{T(0), T(0), T(0)};
  return {x.position_m, x.attitude, where(x.support > T(0), none, velocity), x.body_rate_rad_s};
}

template <class T>
struct ImuSample {
  Vec3<T> gyro_rad_s, accel_m_s2;
};

template <class T>
struct Imu {
  Quaternion<T> attitude;  // at the last sample
  Vec3<T> velocity_m_s;    // velocity of the IMU at the last sample, in W
  ImuSample<T> low_passed;
  Vec3<T> gyro_bias_rad_s;
};

/// conj(a) b: the rotation from a to b.
template <class T>
FLAPPY_INLINE Quaternion<T> from_to(const Quaternion<T>& a, const Quaternion<T>& b) {
  return {a.w * b.w + (a.x * b.x + (a.y * b.y + a.z * b.z)), a.w * b.x - (a.x * b.w + (a.y * b.z - a.z * b.y)),
          a.w * b.y - (a.y * b.w + (a.z * b.x - a.x * b.z)), a.w * b.z - (a.z * b.w + (a.x * b.y - a.y * b.x))};
}

/// Rotation vector of a small rotation: 2 asin(n)/n e for the vector part e of length n, exact to n^4; q and -q agree.
template <class T>
FLAPPY_INLINE Vec3<T> rotation_vector(const Quaternion<T>& q) {
  const Vec3<T> e{q.x, q.y, q.z};
  const T scale = T(2) + T(1.0 / 3) * dot(e, e);
  return where(q.w < T(0), T(-scale), scale) * e;
}

/// Velocity in W of a point fixed in B.
template <class T>
FLAPPY_INLINE Vec3<T> point_velocity(const Truth<T>& t, const Vec3<T>& point_m) {
  return t.velocity_m_s + rotation_matrix(t.attitude) * cross(t.body_rate_rad_s, point_m);
}

template <class T>
FLAPPY_INLINE ImuSample<T> sample_imu(const ImuConstants<Element<T>>& k, const T& per_interval, const Truth<T>& t,
                                      Imu<T>& imu, const sim::Normals4<T>& a, const sim::Normals4<T>& b) {
  const Vec3<T> turn = rotation_vector(from_to(imu.attitude, t.attitude));
  const Vec3<T> velocity = point_velocity(t, {T(k.position_m[0]), T(k.position_m[1]), T(k.position_m[2])});
  Vec3<T> force = per_interval * (velocity - imu.velocity_m_s);
  force.z += T(k.gravity_m_s2);
  const Matrix3<T> halfway = rotation_matrix(rotated(imu.attitude, T(0.25) * turn));
  const ImuSample<T> mean{per_interval * turn, transpose_times(halfway, force)};
  ImuSample<T>& y = imu.low_passed;
  y.gyro_rad_s = add_scaled(y.gyro_rad_s, T(k.low_pass_share), mean.gyro_rad_s - y.gyro_rad_s);
  y.accel_m_s2 = add_scaled(y.accel_m_s2, T(k.low_pass_share), mean.accel_m_s2 - y.accel_m_s2);
  imu.attitude = t.attitude;
  imu.velocity_m_s = velocity;
  return {add_scaled(y.gyro_rad_s + imu.gyro_bias_rad_s, T(k.gyro_noise_rad_s), Vec3<T>{a.n[0], a.n[1], a.n[2]}),
          add_scaled(y.accel_m_s2, T(k.accel_noise_m_s2), Vec3<T>{a.n[3], b.n[0], b.n[1]})};
}

/// A mocap pose in transit, stored as rows; `valid` is 0 for a lost one.
template <class T>
struct MocapSample {
  Vec3<T> position_m;
  Quaternion<T> attitude;
  T valid;
};

/// Markov chain of losses: 1 while the tracker sees the flapper, 0 in a burst of losses. `seen`: value at the last
/// sample; `chance`: uniform in [0, 1].
template <class T>
FLAPPY_INLINE T next_seen(const MocapConstants<Element<T>>& k, const T& seen, const T& chance) {
  return where(seen > T(0), where(chance < T(k.loss_begins), T(0), T(1)), where(chance < T(k.loss_ends), T(1), T(0)));
}

/// How late a sample is beyond the latency; `chance`: uniform in (0, 1).
template <class T>
FLAPPY_INLINE T jitter_of(const MocapConstants<Element<T>>& k, const T& chance) {
  if (!(k.exponential > 0)) return T(k.jitter_s) * chance;
  return T(k.jitter_s) * min(T(T(0) - log(chance)), T(kJitterCut));
}

template <class T>
FLAPPY_INLINE MocapSample<T> sample_mocap(const MocapConstants<Element<T>>& k, const Truth<T>& t, const T& seen,
                                          const sim::Normals4<T>& a, const sim::Normals4<T>& b) {
  return {add_scaled(t.position_m, T(k.position_noise_m), Vec3<T>{a.n[0], a.n[1], a.n[2]}),
          rotated(t.attitude, T(0.5 * k.attitude_noise_rad) * Vec3<T>{a.n[3], b.n[0], b.n[1]}), seen};
}

}  // namespace FLAPPY_ISA
}  // namespace flappy::flight
