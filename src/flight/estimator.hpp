// Error-state Kalman filter with delayed motion capture (Lefferts, Markley and Shuster 1982; Sola 2017). A pose
// describes the past: the filter keeps its state at the time of the last pose that arrived (the horizon) and the IMU
// increments since then. A new pose moves the horizon through those to its own time and corrects it there; the
// remaining increments are replayed to the present. Between poses only the present moves. Errors, true = estimate +
// error, angle in B:
//   angle'  = -bias_g - noise_g        (the rotation of B between poses is neglected)  bias_g' = drift
//   position' = velocity      velocity' = -R bias_a - R noise_a                        bias_a' = drift
// Pose and noise are isotropic, so all axes share one covariance: 3 numbers for angle and gyro bias, 6 for position,
// velocity and accelerometer bias. The acceleration error of gravity under a tilt error is treated as velocity drift.
#pragma once

#include "flight/sensors.hpp"

namespace flappy::flight {

/// Spectral densities of process noise, and variances of mocap noise on each axis.
template <class T>
struct EstimatorConstants {
  T angle_noise_rad2_s, gyro_bias_drift_rad2_s3;
  T velocity_noise_m2_s3, accel_bias_drift_m2_s5;
  T mocap_angle_rad2, mocap_position_m2;
  T gravity_m_s2;
  T imu_position_m[3];  // in B
};

inline namespace FLAPPY_ISA {

/// Attitude B to W, position and velocity in W.
template <class T>
struct Pose {
  Quaternion<T> attitude;
  Vec3<T> position_m, velocity_m_s;
};

/// Measured rotation and gain of velocity, in the frame B at the middle of the interval; biases included.
template <class T>
struct Increment {
  Vec3<T> rotation_rad, velocity_m_s;
};

template <class T>
struct Covariance {
  T angle, angle_bias, gyro_bias;  // rad^2, rad^2/s, rad^2/s^2
  T position, position_velocity, position_bias, velocity, velocity_bias, accel_bias;
};

/// State of the filter, as rows. Its poses are the IMU's, so that increments need no lever arm.
template <class T>
struct Estimator {
  Pose<T> horizon, now;
  Vec3<T> gyro_bias_rad_s, accel_bias_m_s2;
  Covariance<T> covariance;
  Increment<T> gathered;                    // IMU samples since the last control tick
  Vec3<T> body_rate_rad_s;                  // mean over the newest increment, less the bias
  T angle_innovation, position_innovation;  // r.r/S for the last pose, three degrees of freedom each
};

/// The estimated motion of the torso, for controllers and observations.
template <class T>
using Estimate = Truth<T>;

/// Appends an IMU sample over `interval_s` to an increment.
template <class T>
FLAPPY_INLINE void gather(Increment<T>& sum, const ImuSample<T>& sample, const T& interval_s) {
  const Vec3<T> turn = interval_s * sample.gyro_rad_s, gained = interval_s * sample.accel_m_s2;
  // both velocity gains, to first order in the frame at the middle of the joint interval
  sum.velocity_m_s =
      sum.velocity_m_s + (gained + T(0.5) * cross(sum.rotation_rad, gained)) - T(0.5) * cross(turn, sum.velocity_m_s);
  sum.rotation_rad = sum.rotation_rad + turn;
}

/// Moves a pose by `share` of an increment, whose whole duration is `duration_s`.
template <class T>
FLAPPY_INLINE void advance(Pose<T>& x, const Increment<T>& increment, const Vec3<T>& gyro_bias,
                           const Vec3<T>& accel_bias, const T& share, const T& duration_s, const T& gravity_m_s2) {
  const T time = share * duration_s;
  const Vec3<T> quarter = T(T(0.25) * share) * (increment.rotation_rad - duration_s * gyro_bias);
  const Quaternion<T> middle = rotated(x.attitude, quarter);
  Vec3<T> gained = rotation_matrix(middle) * (share * (increment.velocity_m_s - duration_s * accel_bias));
  gained.z -= time * gravity_m_s2;
  x.position_m = add_scaled(x.position_m, time, add_scaled(x.velocity_m_s, T(0.5), gained));
  x.velocity_m_s = x.velocity_m_s + gained;
  x.attitude = rotated(middle, quarter);
}

template <class T>
FLAPPY_INLINE void spread(Covariance<T>& c, const EstimatorConstants<Element<T>>& k, const T& time) {
  c.angle = c.angle + time * T(T(k.angle_noise_rad2_s) + (time * c.gyro_bias - T(2) * c.angle_bias));
  c.angle_bias = c.angle_bias - time * c.gyro_bias;
  c.gyro_bias += time * T(k.gyro_bias_drift_rad2_s3);
  c.position = c.position + time * T(T(2) * c.position_velocity + time * c.velocity);
  c.position_velocity = c.position_velocity + time * T(c.velocity - T(c.position_bias + time * c.velocity_bias));
  c.position_bias += time * c.velocity_bias;
  c.velocity = c.velocity + time * T(T(k.velocity_noise_m2_s3) + (time * c.accel_bias - T(2) * c.velocity_bias));
  c.velocity_bias = c.velocity_bias - time * c.accel_bias;
  c.accel_bias += time * T(k.accel_bias_drift_m2_s5);
}

template <class T>
FLAPPY_INLINE Vec3<T> imu_position(const EstimatorConstants<Element<T>>& k) {
  return {T(k.imu_position_m[0]), T(k.imu_position_m[1]), T(k.imu_position_m[2])};
}

template <class T>
FLAPPY_INLINE Estimate<T> torso(const EstimatorConstants<Element<T>>& k, const Pose<T>& imu, const Vec3<T>& body_rate) {
  const Matrix3<T> R = rotation_matrix(imu.attitude);
  const Vec3<T> arm = imu_position<T>(k);
  return {imu.position_m - R * arm, imu.attitude, imu.velocity_m_s - R * cross(body_rate, arm), body_rate};
}

template <class T>
FLAPPY_INLINE Pose<T> imu_pose(const EstimatorConstants<Element<T>>& k, const Estimate<T>& torso) {
  const Matrix3<T> R = rotation_matrix(torso.attitude);
  const Vec3<T> arm = imu_position<T>(k);
  return {torso.attitude, torso.position_m + R * arm, torso.velocity_m_s + R * cross(torso.body_rate_rad_s, arm)};
}

/// Corrects the horizon by a mocap pose of the same time; a lost pose changes nothing.
template <class T>
FLAPPY_INLINE void correct(Estimator<T>& f, const EstimatorConstants<Element<T>>& k, const MocapSample<T>& z) {
  const auto lost = z.valid <= T(0);
  const T none(0);
  Covariance<T>& c = f.covariance;

  const Vec3<T> angle = rotation_vector(from_to(f.horizon.attitude, z.attitude));
  const T per_angle = T(1) / T(c.angle + T(k.mocap_angle_rad2));
  f.angle_innovation = where(lost, f.angle_innovation, T(dot(angle, angle) * per_angle));
  const T to_angle = where(lost, none, T(c.angle * per_angle));
  const T to_gyro = where(lost, none, T(c.angle_bias * per_angle));
  f.horizon.attitude = rotated(f.horizon.attitude, T(T(0.5) * to_angle) * angle);
  f.gyro_bias_rad_s = add_scaled(f.gyro_bias_rad_s, to_gyro, angle);
  c.gyro_bias -= to_gyro * c.angle_bias;
  c.angle_bias -= to_angle * c.angle_bias;
  c.angle -= to_angle * c.angle;

  const Vec3<T> tracked = f.horizon.position_m - rotation_matrix(f.horizon.attitude) * imu_position<T>(k);
  const Vec3<T> offset = z.position_m - tracked;
  const T per_position = T(1) / T(c.position + T(k.mocap_position_m2));
  f.position_innovation = where(lost, f.position_innovation, T(dot(offset, offset) * per_position));
  const T to_position = where(lost, none, T(c.position * per_position));
  const T to_velocity = where(lost, none, T(c.position_velocity * per_position));
  const T to_accel = where(lost, none, T(c.position_bias * per_position));
  f.horizon.position_m = add_scaled(f.horizon.position_m, to_position, offset);
  f.horizon.velocity_m_s = add_scaled(f.horizon.velocity_m_s, to_velocity, offset);
  f.accel_bias_m_s2 =
      add_scaled(f.accel_bias_m_s2, to_accel, transpose_times(rotation_matrix(f.horizon.attitude), offset));
  c.accel_bias -= to_accel * c.position_bias;
  c.velocity_bias -= to_velocity * c.position_bias;
  c.velocity -= to_velocity * c.position_velocity;
  c.position_bias -= to_position * c.position_bias;
  c.position_velocity -= to_position * c.position_velocity;
  c.position -= to_position * c.position;
}

}  // namespace FLAPPY_ISA
}  // namespace flappy::flight
