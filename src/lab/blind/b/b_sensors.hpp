// Sensors, and what the log declares about them. IMU: specific force and rate at its place and axes; effects;
// first-order low-pass; samples with jitter, instantaneous, averaged or held from its own clock; bias with thermal
// drift, noise, range, resolution. Motion capture: noise, lost bursts, swapped markers, arrival with jitter. Currents:
// instantaneous, in mid-tick, or just before or after the driver's switching. Wings: an encoder of 4096 steps a turn.
// Declarations are exact, or within the habits of laboratories. The log's clock is 0 at its start.
#pragma once

#include <cmath>
#include <deque>
#include <optional>
#include <vector>

#include "lab/blind/b/b_laws.hpp"
#include "lab/blind/b/b_robot.hpp"
#include "lab/blind/family.hpp"

namespace flappy::blind::b {

enum class Sample { kInstant, kMean, kHeld };

inline double in_steps(double x, double step) { return step * std::round(x / step); }

/// Matrix of a rotation vector.
Matrix3d turned(const Vector3d& rotation_rad);

/// Soft mount of the IMU: an oscillator of 90 Hz over the square root of the magnitude; rigid at magnitude 0.
class SoftMount {
 public:
  explicit SoftMount(double magnitude);
  Vector3d shaken(const Vector3d& by);

 private:
  double frequency_rad_s_;
  bool begun_ = false;
  Vector3d now_ = Vector3d::Zero(), rate_ = Vector3d::Zero();
};

/// True properties of the sensors.
struct SensorTruth {
  Sample sample = Sample::kInstant;
  double imu_rate_hz = 1000, imu_late_s = 2e-3, bandwidth_hz = 250, averaging_s = 0, own_clock_hz = 1125;
  Vector3d imu_place_m = Vector3d::Zero();
  Matrix3d imu_turn = Matrix3d::Identity();  ///< from B to the IMU
  double gyro_noise_rad_s = 0.05, accel_noise_m_s2 = 0.5;
  Vector3d marker_m = Vector3d::Zero();         ///< displacement of the markers in B since session 0
  Matrix3d marker_turn = Matrix3d::Identity();  ///< turn of the markers in B since session 0
  double mocap_rate_hz = 200, mocap_late_s = 0.015, position_noise_m = 1e-4, attitude_noise_rad = 5e-3;
  double power_rate_hz = 500, power_late_s = 2e-4, voltage_noise_V = 0.02, current_noise_A = 5e-3;
  int power_step = kStepsPerTick / 2;  ///< step of the tick that samples currents; 0: before the driver switches
  double wings_rate_hz = 500, wings_noise_rad = 1e-3;
  double imu_clock = 1, mocap_clock = 1, power_clock = 1;  ///< relative speed of each stream's clock
};

/// Draws the sensors and their declarations; fills the header except for vehicle and surroundings.
SensorTruth draw_sensors(const Assignment& a, double battery_nominal_V, flightlog::FlightHeader& header);

struct ImuSample {
  double arrival_s = 0;
  Vector3d gyro_rad_s = Vector3d::Zero(), accel_m_s2 = Vector3d::Zero();
};
struct MocapSample {
  double arrival_s = 0, stamp_s = 0;  ///< true, and by the clock of motion capture
  Vector3d position_m = Vector3d::Zero();
  Eigen::Quaterniond attitude = Eigen::Quaterniond::Identity();
};

/// Sensors of one flight, which starts `trim_s` before the log.
class Sensors {
 public:
  Sensors(const Assignment& a, const SensorTruth& truth, const Robot& robot, std::uint64_t flight, double trim_s,
          bool power, bool wings);

  /// Called after each step. `time_s`: end of the step; `step`: its number within the tick, from 1 on.
  void after_step(const Robot& robot, double time_s, int step);
  /// Called before the driver switches.
  void before_tick(const Robot& robot, double time_s);

  /// The next sample that has arrived by `now_s` and was not returned before.
  std::optional<ImuSample> imu(double now_s);
  std::optional<MocapSample> mocap(double now_s);

  /// Writes all streams from 0 to `end_s` into the log.
  void write(double end_s, flightlog::FlightLog& log) const;

 private:
  void imu_step(const Robot& robot, double time_s);
  void imu_sample(double time_s, const Vector3d& gyro, const Vector3d& accel);
  void mocap_step(const Robot& robot, double time_s);
  void power_sample(const Robot& robot, double time_s);

  SensorTruth truth_;
  EffectMagnitudes effect_magnitudes_;
  double trim_s_;
  bool power_, wings_;
  Random imu_random_, mocap_random_, power_random_, wings_random_, drift_random_;
  Vector3d gyro_bias_, accel_bias_, warming_, wandering_ = Vector3d::Zero();
  Vector3d gyro_felt_ = Vector3d::Zero(), accel_felt_ = Vector3d::Zero();
  Vector3d gyro_ = Vector3d::Zero(), accel_ = Vector3d::Zero(), gyro_before_ = Vector3d::Zero(),
           accel_before_ = Vector3d::Zero();
  SoftMount gyro_mount_, accel_mount_;
  bool settled_ = false;
  std::deque<std::array<Vector3d, 2>> window_;
  std::array<Vector3d, 2> held_{Vector3d::Zero(), Vector3d::Zero()};
  double next_imu_s_, imu_jitter_s_ = 0, next_own_s_, next_mocap_s_, next_wings_s_, next_power_s_;
  int lost_ = 0;
  Eigen::Quaterniond tilt_;
  double scale_ = 0;
  Misfit misfit_;
  Eigen::Quaterniond last_attitude_ = Eigen::Quaterniond::Identity();
  std::vector<ImuSample> imu_samples_;
  std::vector<MocapSample> mocap_samples_;
  std::size_t imu_taken_ = 0, mocap_taken_ = 0;
  flightlog::PowerStream power_samples_;
  flightlog::WingsStream wings_samples_;
  double nominal_V_;
};

}  // namespace flappy::blind::b
