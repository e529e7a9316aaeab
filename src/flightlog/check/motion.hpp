// What gyro, accelerometer and mocap say of one motion, on one clock: samples at the instants they were measured, means
// over windows of whole beats, and the frames that a log can be in by mistake.
#pragma once

#include <Eigen/Geometry>
#include <Eigen/StdVector>
#include <array>
#include <optional>
#include <vector>

#include "flightlog/flight_log.hpp"

namespace flappy::flightlog {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

/// How the four numbers of a quaternion may have been meant.
enum class Order { wxyz, xyzw, wxyz_inverse, xyzw_inverse };
inline constexpr std::array kOrders = {Order::wxyz, Order::xyzw, Order::wxyz_inverse, Order::xyzw_inverse};

/// The 48 matrices that permute and flip axes; the first is the identity.
const std::vector<Matrix3d>& signed_permutations();

/// Times of the IMU and of mocap less their declared latencies, from the first mocap sample on. A pose that repeats the
/// one before is none.
class SensorMotion {
 public:
  explicit SensorMotion(const FlightLog& log);

  const std::vector<double>& mocap_t_s() const { return mocap_t_s_; }
  const std::vector<double>& imu_t_s() const { return imu_t_s_; }
  const std::vector<Vector3d>& accel_m_s2() const { return accel_m_s2_; }
  Quaterniond attitude(std::size_t sample, Order order) const;
  /// Between samples; nothing in a gap or outside.
  std::optional<Quaterniond> attitude_at(double t_s, Order order) const;
  std::optional<Vector3d> position_at(double t_s) const;
  /// Rms per axis by which an attitude differs from the middle of its neighbours: noise, and what goes on in between.
  double roughness_rad() const;
  /// Mean of the gyro over an interval; nothing across a gap or outside.
  std::optional<Vector3d> mean_rate(double begin_s, double end_s) const;
  /// The turn that the gyro made of an interval, as a rotation vector over its time; nothing as above.
  std::optional<Vector3d> mean_turn(double begin_s, double end_s) const;

 private:
  Vector3d gyro_at(std::size_t k, double t_s) const;
  Vector3d gyro_integral(std::size_t k, double t_s) const;
  /// The mocap samples around an instant.
  std::optional<std::size_t> bracket(double t_s) const;

  double longest_mocap_s_, longest_imu_s_;
  std::vector<double> mocap_t_s_, imu_t_s_;
  std::vector<Vector3d> position_m_, gyro_rad_s_, accel_m_s2_, gyro_integral_rad_;
  std::vector<std::array<double, 4>> quaternion_;
  std::vector<std::size_t> gaps_before_;  ///< of the IMU, up to each sample
};

/// Whole beats, in which the shaking of the beat cancels: it repeats, and would match at the wrong lag.
struct BeatWindow {
  double begin_s, end_s;
  std::array<Vector3d, 4> rate_rad_s;  ///< mean from mocap, in the body, for each Order
  double middle_s() const { return (begin_s + end_s) / 2; }
};

/// One after another, each of `length_s`, without gaps.
std::vector<BeatWindow> make_windows(const SensorMotion& motion, double length_s);

/// The frame a log is in: mocap's rate = scale x axes x gyro's.
struct SensorFrame {
  Order order = Order::wxyz;
  Matrix3d axes = Matrix3d::Identity();
  bool operator==(const SensorFrame&) const = default;
};

/// The IMU's clock against mocap's, beyond the latencies declared: gyro(t + lag_s(t)) belongs to mocap(t).
struct Lag {
  double middle_s = 0, at_middle_s = 0, per_s = 0;
  double at(double t_s) const { return at_middle_s + per_s * (t_s - middle_s); }
};

/// Rates of both in the windows where both have them.
struct Pairs {
  std::vector<Vector3d> mocap, gyro, gyro_change;  ///< change of the gyro's rate per second of lag
  std::vector<std::size_t> window;                 ///< of which window
};
Pairs pair_up(const SensorMotion& motion, const std::vector<BeatWindow>& windows, Order order, const Lag& lag);

struct Sync {
  double lag_s = 0;
  double correlation = 0;  ///< of the rates at that lag, in the best frame
  SensorFrame frame;       ///< at which it is best
};

/// `pairs` with the gyro's turns in place of its mean rates, where it has them.
//
// A body that shakes about two axes out of phase turns about the third though its mean rate there is 0 (coning): the
// rotation vector p of a rate w has p' = w + p x w / 2 + ... (Bortz, IEEE Trans. AES-7, 1971), so that a beat of rates
// a cos and b sin about two axes adds a b / (2 x 2 pi f) to the third: 0.1 rad/s where these are 7 rad/s at 34 Hz.
Pairs with_turns(const SensorMotion& motion, const std::vector<BeatWindow>& windows, const Pairs& pairs,
                 const Lag& lag);

/// The lag, within a second, and frame at which mocap follows the gyro best; nothing without common windows.
std::optional<Sync> find_lag(const SensorMotion& motion, const std::vector<BeatWindow>& windows);

struct LagEstimate {
  double value = 0, sd = 0;
};
/// What is to be added to a first lag, to a fraction of a sample, by least squares; `noise` of a window's mean mocap rate.
std::optional<LagEstimate> refine_lag(const SensorMotion& motion, const std::vector<BeatWindow>& windows,
                                      const SensorFrame& frame, Lag start, double noise);

/// Sum of squares that mocap's rates keep once `scale x axes x gyro` and a constant are taken off.
double remainder(const Pairs& pairs, const Matrix3d& axes, double scale);

/// mocap = gain x gyro + offset, by least squares; a gyro axis with too little rotation is taken as it stands.
struct Gains {
  Matrix3d gain = Matrix3d::Zero();
  Vector3d gain_sd = Vector3d::Zero();  ///< of each column
  std::array<bool, 3> tested = {false, false, false};
  Vector3d offset = Vector3d::Zero();
  Vector3d offset_sd = Vector3d::Zero();
  Vector3d residual = Vector3d::Zero();  ///< rms of each row
  Vector3d spread = Vector3d::Zero();    ///< of the gyro, rms about its mean
};
Gains fit_gains(const Pairs& pairs, double mocap_noise, double gyro_noise);

}  // namespace flappy::flightlog
