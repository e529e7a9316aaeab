// The motion of a recorded flight: motion capture and IMU through a fixed-interval smoother.
//
// Forward, an error-state Kalman filter carries the pose of the IMU by its own samples and corrects it where motion
// capture saw the torso; backward, the modified smoother of Bryson and Frazier (Bierman, Factorization Methods for Discrete Sequential
// Estimation, 1977), which inverts nothing as large as the state, gives every instant what was learnt after it. Errors, true = estimate +
// error, 15 in this order, 3 each:
//   angle (in B: R_true = R exp(angle)), position, velocity (both of the IMU, in W), gyro bias, accelerometer bias
//
// The IMU is taken as flight.toml declares it: a sample is the mean over its interval, centred latency + 1/(2 pi
// bandwidth) before its t_s. Where the bandwidth is below that of such a mean, a first-order low-pass is taken to follow
// it, and is undone. Inside an interval the signal is the quadratic of a cubic spline through the integral of the
// samples: a sine of w rad/s is off by about (w interval)^4/180 of its size, a gyro's noise remains at about its size
// (the body rate is that of the gyro, not smoothed), and a jump, as where a wing meets its stop, is spread over two
// intervals. Of simulated hovering (500 Hz, noise 0.052 rad/s, rates of 10 rad/s that jump by 2 at the stops) the body rate
// is off by 0.065 rad/s in the median, 0.3 in one of ten; its mean over an interval is as good as the gyro.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <filesystem>
#include <vector>

#include "flightlog/flight_log.hpp"
#include "flightlog/mean_spline.hpp"
#include "sim/replay.hpp"

namespace flappy::flightlog {

/// Of the torso origin; body to world, rate in B.
struct TorsoMotion {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  Eigen::Quaterniond attitude = Eigen::Quaterniond::Identity();
  Eigen::Vector3d velocity_m_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d body_rate_rad_s = Eigen::Vector3d::Zero();
};

class Smoother {
 public:
  using Covariance = Eigen::Matrix<double, 15, 15>;

  /// io::InputError, naming `folder`, where the flight has no voltages, and so perhaps no gyro, and where motion capture and IMU, less their latencies, share fewer than two poses.
  Smoother(const FlightLog& log, const std::filesystem::path& folder);

  /// Between the first and the last pose that the IMU covers.
  double begin_s() const { return nodes_.front().t_s; }
  double end_s() const { return nodes_.back().t_s; }
  /// Instants at which motion capture saw the torso; a pose that repeats the one before is a lost one.
  const std::vector<double>& pose_s() const { return pose_s_; }

  /// Where an interval of the IMU ends, nearest to a time: what is known best, for the mean of an interval says nothing of
  /// the motion within it.
  double imu_bound_s(double t_s) const;

  /// Bounds of the IMU's intervals, gaps among them.
  const std::vector<double>& bounds_s() const { return bounds_s_; }
  /// Mean specific force that the IMU showed over a time, in B as it turned.
  Eigen::Vector3d mean_force_m_s2(double from_s, double to_s) const { return mean(accel_, from_s, to_s); }
  /// The same of the rate, bias and all.
  Eigen::Vector3d mean_rate_rad_s(double from_s, double to_s) const { return mean(gyro_, from_s, to_s); }

  /// At any time from begin_s() to end_s(); std::out_of_range elsewhere.
  TorsoMotion at(double t_s) const;
  Eigen::Vector3d gyro_bias_rad_s(double t_s) const { return nodes_[node_before(t_s)].state.gyro_bias; }
  Eigen::Vector3d accel_bias_m_s2(double t_s) const { return nodes_[node_before(t_s)].state.accel_bias; }
  /// Of the smoothed errors at pose `i`.
  const Covariance& covariance(std::size_t i) const { return covariance_[i]; }

  /// Whether the IMU has no gap there, and motion capture none longer than four of its intervals.
  bool covers(double from_s, double to_s) const;
  /// Mean normalised innovation squared of the forward filter, angle and position: mean of nu^T S^-1 nu / dim(nu), which is 1
  /// where the declared noise is right, and large where the two streams do not describe one motion.
  double angle_normalised_innovation() const { return normalised_innovation_[0]; }
  double position_normalised_innovation() const { return normalised_innovation_[1]; }
  /// The same of the biases found, gyro or accelerometer, whichever is larger.
  double bias_normalised_innovation() const { return normalised_innovation_[2]; }

 private:
  struct State {
    Eigen::Quaterniond attitude = Eigen::Quaterniond::Identity();
    Eigen::Vector3d position_m = Eigen::Vector3d::Zero(), velocity_m_s = Eigen::Vector3d::Zero();
    Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero(), accel_bias = Eigen::Vector3d::Zero();
  };
  struct Node {
    double t_s;
    std::size_t interval;  ///< of the IMU, that begins here or goes on
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

  Eigen::Vector3d mean(const MeanSpline& signal, double from_s, double to_s) const;
  std::size_t node_before(double t_s) const;
  Reading reading(std::size_t interval, double from_s, double to_s) const;
  static Eigen::Quaterniond to_middle(const State& x, const Reading& r);
  State moved(const State& x, const Reading& r) const;
  Transition transition(const State& x, const Reading& r) const;
  void add_noise(Covariance& p, const Reading& r, const Noise& noise) const;
  Correction correct(State& x, Covariance& p, const Pose& z, const Noise& noise);
  static void displace(State& x, const Eigen::Matrix<double, 15, 1>& error);

  double gravity_m_s2_, longest_unseen_s_;
  Eigen::Vector3d arm_m_;         // of the IMU, in B
  std::vector<double> bounds_s_;  // of the IMU's intervals
  std::vector<char> gap_;         // whether no sample was there
  MeanSpline gyro_, accel_;
  std::vector<Node> nodes_;  // at every bound and every pose
  std::vector<double> pose_s_;
  std::vector<std::size_t> pose_node_;
  std::vector<Covariance> covariance_;  // at poses
  double normalised_innovation_[3] = {0, 0, 0};
};

/// What drove the motors: the commands, scaled by the battery's voltage where power.csv has it (between its samples on
/// a line, as it was when each command was applied).
sim::VoltageScript motor_voltages(const FlightLog& log);

/// Strokes, left and right, by a cubic through the four samples around a time; not a number where these have a gap.
std::array<double, 2> strokes_at(const WingsStream& wings, double rate_hz, double t_s);

}  // namespace flappy::flightlog
