// What the blind robot's own sensors make of its motion, on the clock of the flight, as rows of a flight log.
//
// IMU: a first-order low-pass, the mean over the interval, constant bias, white noise and a tenth of it that drifts.
// Motion capture: pose of the torso origin with noise, late, arriving with jitter; short bursts are lost.
#pragma once

#include "blind/a/robot.hpp"
#include "flightlog/flight_log.hpp"

namespace flappy::blind {

/// What a flight log declares of its sensors.
struct SensorSet {
  flightlog::MocapHeader mocap;
  flightlog::ImuHeader imu;
  std::optional<flightlog::PowerHeader> power;
  std::optional<flightlog::WingsHeader> wings;
  double imu_low_pass_hz = 0, imu_transport_s = 0;  ///< behind the header's bandwidth and latency
  Matrix3d imu_turned = Matrix3d::Identity();       ///< from B to the IMU's own axes
};

/// Declares bandwidth and latency of an IMU of this rate, low-pass and transport.
void declare_imu(SensorSet& set);

/// The sensors of a robot: rates differ from robot to robot.
SensorSet sensors_of(std::uint64_t seed, bool power, bool wings);

/// The IMU alone, for whoever moves a torso along a path of his own.
class RobotImu {
 public:
  struct Sample {
    double arrival_s;
    Vector3d gyro_rad_s, accel_m_s2;
  };
  RobotImu(const SensorSet& set, const Sizes& sizes, std::uint64_t seed, std::uint64_t flight, double step_s);
  /// After a step that ended at `t_s` on the log's clock; a sample where its interval ended.
  std::optional<Sample> after_step(const Robot& robot, double t_s);
  const Vector3d& constant_bias_rad_s() const { return bias_; }

 private:
  const SensorSet set_;
  const Sizes sizes_;
  double step_s_, share_;
  int steps_, count_ = 0;
  bool begun_ = false;
  Random random_, drift_random_;
  Vector3d bias_, warm_up_, rectifies_;
  Matrix3d misaligned_ = Matrix3d::Identity();
  Vector3d gyro_ = Vector3d::Zero(), accel_ = Vector3d::Zero(), slow_accel_ = Vector3d::Zero();
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
  RobotMocap(const SensorSet& set, const Sizes& sizes, std::uint64_t seed, std::uint64_t flight);
  /// The pose at `t_s`, unless it is lost.
  std::optional<Sample> look(const Torso& torso, double t_s);

 private:
  const SensorSet set_;
  const Sizes sizes_;
  Random random_, delay_random_;
  Quaterniond tilt_ = Quaterniond::Identity();
  Vector3d marker_m_ = Vector3d::Zero();
  int to_lose_ = 0, seen_ = 0, lost_ = 0;
  double last_s_ = -1;
};

/// Where the mean over an interval behind a first-order low-pass lets 1/sqrt(2) through.
double bandwidth_hz(double interval_s, double low_pass_hz);

}  // namespace flappy::blind
