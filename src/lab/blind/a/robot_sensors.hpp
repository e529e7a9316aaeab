// Sensors turn the robot's motion into rows of a flight log, on the flight's clock. IMU: first-order low-pass, mean
// over the sampling interval, constant gyro bias, white noise, slow noise of a tenth of its sd. Motion capture: pose of
// the torso origin with noise, latency, jitter of the arrival, and short lost bursts.
#pragma once

#include "flightlog/flight_log.hpp"
#include "lab/blind/a/a_robot.hpp"

namespace flappy::blind {

struct SensorSet {
  flightlog::MocapHeader mocap;
  flightlog::ImuHeader imu;
  std::optional<flightlog::PowerHeader> power;
  std::optional<flightlog::WingsHeader> wings;
  double imu_low_pass_hz = 0, imu_transport_s = 0;  ///< true values behind `imu`'s bandwidth and latency
  Matrix3d imu_turned = Matrix3d::Identity();       ///< from B to the IMU's axes
  Vector3d marker_m = Vector3d::Zero();             ///< of the tracked marker body, in B
  Quaterniond marker_turned = Quaterniond::Identity();
  double mocap_late_s = 0;  ///< beyond the declared latency
};

/// Derives the declared bandwidth and latency from the IMU's rate, low-pass and transport delay.
void declare_imu(SensorSet& set);

/// Draws the sensors of a robot; the rates of IMU and motion capture depend on the seed.
SensorSet sensors_of(std::uint64_t seed, bool power, bool wings);

/// The IMU alone; usable with any caller that moves a robot.
class RobotImu {
 public:
  struct Sample {
    double arrival_s;
    Vector3d gyro_rad_s, accel_m_s2;
  };
  RobotImu(const SensorSet& set, const Magnitudes& magnitudes, std::uint64_t seed, std::uint64_t flight, double step_s);
  /// Called after each step, which ends at `t_s` of the log. Returns a sample if a sampling interval ended.
  std::optional<Sample> after_step(const Robot& robot, double t_s);
  const Vector3d& constant_bias_rad_s() const { return bias_; }

 private:
  const SensorSet set_;
  const Magnitudes magnitudes_;
  double step_s_, share_;
  int steps_, count_ = 0;
  bool begun_ = false;
  Random random_, drift_random_;
  Vector3d bias_, warm_up_, rectifies_;
  laws::Element element_;
  Matrix3d misaligned_ = Matrix3d::Identity();
  Vector3d gyro_ = Vector3d::Zero(), accel_ = Vector3d::Zero();
  Vector3d gyro_sum_ = Vector3d::Zero(), accel_sum_ = Vector3d::Zero();
  Vector3d gyro_drift_ = Vector3d::Zero(), accel_drift_ = Vector3d::Zero(), walk_ = Vector3d::Zero();
};

class RobotMocap {
 public:
  struct Sample {
    double arrival_s;
    Vector3d position_m;
    Quaterniond attitude;
  };
  RobotMocap(const SensorSet& set, const Magnitudes& magnitudes, std::uint64_t seed, std::uint64_t flight);
  /// Measures the pose at `t_s`; returns nothing if the frame is lost.
  std::optional<Sample> look(const Torso& torso, double t_s);

 private:
  const SensorSet set_;
  const Magnitudes magnitudes_;
  Random random_;
  laws::Frame frame_;
  laws::Moved marker_;
  int to_lose_ = 0, seen_ = 0, lost_ = 0;
  double last_s_ = -1;
};

/// Frequency at which a first-order low-pass followed by the mean over an interval has a gain of 1/sqrt(2).
double bandwidth_hz(double interval_s, double low_pass_hz);

}  // namespace flappy::blind
