// The motion as gyro, accelerometer and mocap measured it, the lag between their clocks, and mistaken frames.
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

/// Conventions in which the four numbers of a logged quaternion may be.
enum class Order { wxyz, xyzw, wxyz_inverse, xyzw_inverse };
inline constexpr std::array kOrders = {Order::wxyz, Order::xyzw, Order::wxyz_inverse, Order::xyzw_inverse};

/// The 48 matrices that permute and flip the axes; the first is the identity.
const std::vector<Matrix3d>& signed_permutations();

/// Samples of IMU and mocap. Times are less the declared latencies and count from the first mocap sample. Lost and
/// swapped poses are left out.
class SensorMotion {
 public:
  explicit SensorMotion(const FlightLog& log);

  const std::vector<double>& mocap_t_s() const { return mocap_t_s_; }
  const std::vector<double>& imu_t_s() const { return imu_t_s_; }
  const std::vector<Vector3d>& accel_m_s2() const { return accel_m_s2_; }
  Quaterniond attitude(std::size_t sample, Order order) const;
  /// Interpolated between samples; nothing in a gap or outside.
  std::optional<Quaterniond> attitude_at(double t_s, Order order) const;
  std::optional<Vector3d> position_at(double t_s) const;
  /// Rms per axis, rad, of an attitude less the interpolation of its neighbours: noise plus motion between the samples.
  double roughness_rad() const;
  /// Mean of the gyro over an interval; nothing across a gap or outside.
  std::optional<Vector3d> mean_rate(double begin_s, double end_s) const;
  /// Rotation vector integrated from the gyro, divided by the time; nothing across a gap or outside.
  std::optional<Vector3d> mean_turn(double begin_s, double end_s) const;

 private:
  Vector3d gyro_at(std::size_t k, double t_s) const;
  Vector3d gyro_integral(std::size_t k, double t_s) const;
  /// Index of the mocap sample before an instant; nothing in a gap or outside.
  std::optional<std::size_t> bracket(double t_s) const;

  double longest_mocap_s_, longest_imu_s_;
  std::vector<double> mocap_t_s_, imu_t_s_;
  std::vector<Vector3d> position_m_, gyro_rad_s_, accel_m_s2_, gyro_integral_rad_;
  std::vector<std::array<double, 4>> quaternion_;
  std::vector<std::size_t> gaps_before_;  ///< number of gaps of the IMU up to each sample
};

/// A window of whole beats, in whose mean oscillations at the beat frequency cancel; they would match at wrong lags.
struct BeatWindow {
  double begin_s, end_s;
  std::array<Vector3d, 4> rate_rad_s;  ///< mean from mocap, in B, for each Order
  double middle_s() const { return (begin_s + end_s) / 2; }
};

/// Successive windows of `length_s`, without those in which mocap has a gap.
std::vector<BeatWindow> make_windows(const SensorMotion& motion, double length_s);

/// The convention in which a log is: rate of mocap = scale x axes x rate of the gyro.
struct SensorFrame {
  Order order = Order::wxyz;
  Matrix3d axes = Matrix3d::Identity();
  bool operator==(const SensorFrame&) const = default;
};

/// Lag of the IMU's clock behind mocap's, beyond the declared latencies: gyro(t + at(t)) belongs to mocap(t).
struct Lag {
  double middle_s = 0, at_middle_s = 0, per_s = 0;
  double at(double t_s) const { return at_middle_s + per_s * (t_s - middle_s); }
};

/// Rates of mocap and gyro, rad/s, in the windows that both cover.
struct Pairs {
  std::vector<Vector3d> mocap, gyro, gyro_change;  ///< gyro_change: derivative of the gyro's rate by the lag
  std::vector<std::size_t> window;                 ///< index of the window
};
Pairs pair_up(const SensorMotion& motion, const std::vector<BeatWindow>& windows, Order order, const Lag& lag);

struct Sync {
  double lag_s = 0;
  double correlation = 0;  ///< between the rates at this lag in `frame`
  SensorFrame frame;       ///< the frame with the best score
};

/// `pairs` with the gyro's mean_turn() in place of its mean rates.
//
// Coning: a body that oscillates about two axes out of phase also turns about the third, at mean rate 0. A rotation
// vector p has p' = w + p x w / 2 + ... (Bortz, IEEE Trans. AES-7, 1971): rates a cos and b sin at the beat frequency f
// add a mean of a b / (2 x 2 pi f), 0.1 rad/s for 7 rad/s at 34 Hz.
Pairs with_turns(const SensorMotion& motion, const std::vector<BeatWindow>& windows, const Pairs& pairs,
                 const Lag& lag);

/// The lag, within one second, and the frame at which mocap and gyro agree best; nothing under ten common windows.
std::optional<Sync> find_lag(const SensorMotion& motion, const std::vector<BeatWindow>& windows);

struct LagEstimate {
  double value = 0, sd = 0;
};
/// Correction to the lag `start`, by least squares; nothing where the rates determine no lag. `noise`: sd of a window's
/// mean rate from mocap.
std::optional<LagEstimate> refine_lag(const SensorMotion& motion, const std::vector<BeatWindow>& windows,
                                      const SensorFrame& frame, Lag start, double noise);

/// Sum of squares of mocap's rates less `scale x axes x gyro` and less a constant.
double misfit(const Pairs& pairs, const Matrix3d& axes, double scale);

/// mocap = gain x gyro + offset, by least squares. An axis with too little rotation is untested, gain 1.
struct Gains {
  Matrix3d gain = Matrix3d::Zero();
  Vector3d gain_sd = Vector3d::Zero();  ///< for each column of `gain`
  std::array<bool, 3> tested = {false, false, false};
  Vector3d offset = Vector3d::Zero();
  Vector3d offset_sd = Vector3d::Zero();
  Vector3d residual = Vector3d::Zero();  ///< rms of mocap's rates less the fit, for each axis
  Vector3d spread = Vector3d::Zero();    ///< rms of the gyro's rates about their mean
};
Gains fit_gains(const Pairs& pairs, double mocap_noise, double gyro_noise);

}  // namespace flappy::flightlog
