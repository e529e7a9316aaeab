// The motion of a recorded flight, estimated from motion capture and IMU by a fixed-interval smoother.
//
// Forward, an error-state Kalman filter predicts the IMU's pose from its samples and corrects it at each mocap pose.
// Backward, the modified Bryson-Frazier smoother (Bierman, Factorization Methods for Discrete Sequential Estimation,
// 1977) adds later samples; it inverts no matrix of the state's size. 15 errors, true = estimate + error, 3 each:
//   angle (in B: R_true = R exp(angle)), position, velocity (both of the IMU, in W), gyro bias, accelerometer bias
//
// Model of the IMU, from flight.toml: a sample is the mean over its interval, centred latency + 1/(2 pi bandwidth)
// before t_s, with a first-order low-pass, which the smoother undoes, where the bandwidth is below that of such a mean.
// Inside an interval the signal is the quadratic of SplineOfMeans: a sine of w rad/s is off by about (w
// interval)^4/180 of its amplitude; the gyro's noise stays (the body rate is not smoothed); a jump, as at a stop,
// spreads over two intervals. In simulated hovering (500 Hz, noise 0.052 rad/s, rates of 10 rad/s, jumps of 2) the body
// rate is off by 0.065 rad/s in the median, by 0.3 in one case of ten; its interval mean is as good as the gyro.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <filesystem>
#include <optional>
#include <vector>

#include "flightlog/flight_log.hpp"
#include "flightlog/spline_of_means.hpp"
#include "sim/replay.hpp"

namespace flappy::flightlog {

/// Motion of the torso origin: position and velocity in W, attitude body to world, rate in B.
struct TorsoMotion {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  Eigen::Quaterniond attitude = Eigen::Quaterniond::Identity();
  Eigen::Vector3d velocity_m_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d body_rate_rad_s = Eigen::Vector3d::Zero();
};

class Smoother {
 public:
  using Covariance = Eigen::Matrix<double, 15, 15>;

  /// io::InputError, naming `folder`, for declared inputs in place of voltages (then a gyro may be missing), and where
  /// fewer than two poses lie within the time of the IMU, latencies taken off. `with_covariance`: for covariance(); it
  /// takes as long as all else.
  Smoother(const FlightLog& log, const std::filesystem::path& folder, bool with_covariance = false);

  /// Time of the first and of the last pose that the IMU covers.
  double begin_s() const { return nodes_.front().t_s; }
  double end_s() const { return nodes_.back().t_s; }
  /// Measured instants of the poses that the smoother uses (pose_readings()).
  const std::vector<double>& pose_s() const { return pose_s_; }

  /// The bound between two IMU intervals nearest to a time. A mean says nothing about the motion within its interval.
  double imu_bound_s(double t_s) const;

  /// Bounds of the IMU's intervals, gaps included.
  const std::vector<double>& bounds_s() const { return bounds_s_; }
  /// The sample of imu.csv whose interval contains a time; none in a gap.
  std::optional<std::size_t> imu_sample(double t_s) const;
  /// Mean of the measured specific force over a time, bias included, in the turning frame B.
  Eigen::Vector3d mean_force_m_s2(double from_s, double to_s) const { return mean(accel_, from_s, to_s); }
  /// Mean of the measured rate over a time, bias included, in B.
  Eigen::Vector3d mean_rate_rad_s(double from_s, double to_s) const { return mean(gyro_, from_s, to_s); }

  /// At any time from begin_s() to end_s(); std::out_of_range elsewhere.
  TorsoMotion at(double t_s) const;
  Eigen::Vector3d gyro_bias_rad_s(double t_s) const { return nodes_[node_before(t_s)].state.gyro_bias; }
  Eigen::Vector3d accel_bias_m_s2(double t_s) const { return nodes_[node_before(t_s)].state.accel_bias; }
  /// Covariance of the smoothed errors at pose `i`; only of a smoother made with it.
  const Covariance& covariance(std::size_t i) const { return covariance_[i]; }

  /// Whether the IMU has no gap in this time and motion capture none longer than four of its intervals.
  bool covers(double from_s, double to_s) const;
  /// Mean of nu^T S^-1 nu / dim(nu) of the forward filter: 1 for correct noise, large where the streams disagree.
  double angle_normalised_innovation() const { return normalised_innovation_[0]; }
  double position_normalised_innovation() const { return normalised_innovation_[1]; }
  /// Mean square of the initial biases over their prior variance, gyro or accelerometer, whichever is larger.
  double bias_normalised_innovation() const { return normalised_innovation_[2]; }

 private:
  struct State {
    Eigen::Quaterniond attitude = Eigen::Quaterniond::Identity();
    Eigen::Vector3d position_m = Eigen::Vector3d::Zero(), velocity_m_s = Eigen::Vector3d::Zero();
    Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero(), accel_bias = Eigen::Vector3d::Zero();
  };
  struct Node {
    double t_s;
    std::size_t interval;  ///< interval of the IMU that begins at the node or contains it
    State state;
  };
  struct Noise;
  struct Reading;
  struct Pose;
  struct Transition;
  struct Correction;
  struct Filtered;

  void read_imu(const FlightLog& log);
  std::vector<Pose> read_poses(const FlightLog& log) const;
  void lay_nodes(const std::vector<Pose>& poses);
  Filtered filter(const std::vector<Pose>& poses, const Noise& noise);
  void smooth(const Filtered& filtered, const Noise& noise, bool with_covariance);

  Eigen::Vector3d mean(const SplineOfMeans& signal, double from_s, double to_s) const;
  std::size_t node_before(double t_s) const;
  Reading reading(std::size_t interval, double from_s, double to_s) const;
  static Eigen::Quaterniond to_middle(const State& x, const Reading& r);
  State moved(const State& x, const Reading& r) const;
  Transition transition(const State& x, const Reading& r) const;
  void add_noise(Covariance& p, const Reading& r, const Noise& noise) const;
  Correction correct(State& x, Covariance& p, const Pose& z, const Noise& noise);
  static void displace(State& x, const Eigen::Matrix<double, 15, 1>& error);

  double gravity_m_s2_, longest_unseen_s_;
  Eigen::Vector3d arm_m_;            // position of the IMU, in B
  std::vector<double> bounds_s_;     // bounds of the IMU's intervals
  std::vector<char> gap_;            // for each interval, whether it has no sample
  std::vector<std::size_t> sample_;  // for each interval, its sample of imu.csv; in a gap, the one after it
  SplineOfMeans gyro_, accel_;
  std::vector<Node> nodes_;  // at every bound and every pose
  std::vector<double> pose_s_;
  std::vector<std::size_t> pose_node_;
  std::vector<Covariance> covariance_;  // at poses
  double normalised_innovation_[3] = {0, 0, 0};
};

/// The voltages at the motors: the commands, times battery_V (interpolated) / battery_nominal_V with a power.csv.
sim::VoltageScript motor_voltages(const FlightLog& log);

/// Left and right stroke, then left and right rotation, rad, at a time, by a cubic through the four samples around it;
/// NaN where these have a gap.
std::array<double, 4> wing_angles_at(const WingsStream& wings, double rate_hz, double t_s);

}  // namespace flappy::flightlog
