// The motion of a recorded flight, estimated from motion capture and IMU by a fixed-interval smoother.
//
// Forward, an error-state Kalman filter predicts the pose of the IMU from its own samples and corrects it at each pose of motion
// capture. Backward, the modified Bryson-Frazier smoother (Bierman, Factorization Methods for Discrete Sequential Estimation, 1977)
// adds the information of later samples; it inverts no matrix of the size of the state. The error state has 15 elements,
// true = estimate + error, 3 each in this order:
//   angle (in B: R_true = R exp(angle)), position, velocity (both of the IMU, in W), gyro bias, accelerometer bias
//
// Model of the IMU, from flight.toml: a sample is the mean over its interval, centred latency + 1/(2 pi bandwidth) before its t_s.
// Where the declared bandwidth is below that of such a mean, the model adds a first-order low-pass, and the smoother undoes it. Inside
// an interval the signal is the quadratic of BeatAveragedSpline: a sine of w rad/s is off by about (w interval)^4/180 of its amplitude,
// the noise of the gyro remains at about its standard deviation (the body rate is that of the gyro, not smoothed), and a jump, as
// where a wing meets its stop, is spread over two intervals. In simulated hovering (500 Hz, noise 0.052 rad/s, rates of 10 rad/s that
// jump by 2 at the stops) the body rate is off by 0.065 rad/s in the median and by 0.3 in one case of ten; its mean over an interval
// is as good as the gyro.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <filesystem>
#include <vector>

#include "flightlog/beat_averaged_spline.hpp"
#include "flightlog/flight_log.hpp"
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

  /// io::InputError, naming `folder`, where the flight has declared inputs instead of voltages (then it may lack a
  /// gyro), and where fewer than two poses lie within the time of the IMU, latencies taken off.
  Smoother(const FlightLog& log, const std::filesystem::path& folder);

  /// Time of the first and of the last pose that the IMU covers.
  double begin_s() const { return nodes_.front().t_s; }
  double end_s() const { return nodes_.back().t_s; }
  /// Measured instants of the poses that the smoother uses (pose_readings()).
  const std::vector<double>& pose_s() const { return pose_s_; }

  /// The bound between two intervals of the IMU that is nearest to a time. The motion is known best there, because the
  /// mean over an interval says nothing about the motion within it.
  double imu_bound_s(double t_s) const;

  /// Bounds of the IMU's intervals, gaps included.
  const std::vector<double>& bounds_s() const { return bounds_s_; }
  /// Mean of the measured specific force over a time, bias included, in the turning frame B.
  Eigen::Vector3d mean_force_m_s2(double from_s, double to_s) const { return mean(accel_, from_s, to_s); }
  /// Mean of the measured rate over a time, bias included, in B.
  Eigen::Vector3d mean_rate_rad_s(double from_s, double to_s) const { return mean(gyro_, from_s, to_s); }

  /// At any time from begin_s() to end_s(); std::out_of_range elsewhere.
  TorsoMotion at(double t_s) const;
  Eigen::Vector3d gyro_bias_rad_s(double t_s) const { return nodes_[node_before(t_s)].state.gyro_bias; }
  Eigen::Vector3d accel_bias_m_s2(double t_s) const { return nodes_[node_before(t_s)].state.accel_bias; }
  /// Covariance of the smoothed errors at pose `i`.
  const Covariance& covariance(std::size_t i) const { return covariance_[i]; }

  /// Whether the IMU has no gap in this time and motion capture none longer than four of its intervals.
  bool covers(double from_s, double to_s) const;
  /// Mean normalised innovation squared of the forward filter, angle and position: mean of nu^T S^-1 nu / dim(nu),
  /// which is 1 where the declared noise is right, and large where the two streams contradict each other.
  double angle_normalised_innovation() const { return normalised_innovation_[0]; }
  double position_normalised_innovation() const { return normalised_innovation_[1]; }
  /// Mean square of the estimated biases at the start over their prior variance, for gyro or accelerometer, whichever
  /// is larger.
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
  void smooth(const Filtered& filtered, const Noise& noise);

  Eigen::Vector3d mean(const BeatAveragedSpline& signal, double from_s, double to_s) const;
  std::size_t node_before(double t_s) const;
  Reading reading(std::size_t interval, double from_s, double to_s) const;
  static Eigen::Quaterniond to_middle(const State& x, const Reading& r);
  State moved(const State& x, const Reading& r) const;
  Transition transition(const State& x, const Reading& r) const;
  void add_noise(Covariance& p, const Reading& r, const Noise& noise) const;
  Correction correct(State& x, Covariance& p, const Pose& z, const Noise& noise);
  static void displace(State& x, const Eigen::Matrix<double, 15, 1>& error);

  double gravity_m_s2_, longest_unseen_s_;
  Eigen::Vector3d arm_m_;         // position of the IMU, in B
  std::vector<double> bounds_s_;  // bounds of the IMU's intervals
  std::vector<char> gap_;         // for each interval, whether it has no sample
  BeatAveragedSpline gyro_, accel_;
  std::vector<Node> nodes_;  // at every bound and every pose
  std::vector<double> pose_s_;
  std::vector<std::size_t> pose_node_;
  std::vector<Covariance> covariance_;  // at poses
  double normalised_innovation_[3] = {0, 0, 0};
};

/// The voltages at the motors: the commands, scaled by battery_V / battery_nominal_V where there is a power.csv. The
/// battery's voltage is interpolated linearly to the time of each command.
sim::VoltageScript motor_voltages(const FlightLog& log);

/// Left and right stroke, rad, at a time, by a cubic through the four samples around it; NaN where these have a gap.
std::array<double, 2> strokes_at(const WingsStream& wings, double rate_hz, double t_s);

}  // namespace flappy::flightlog
