// A laboratory's record and declarations. Sensors: an inertial unit, cameras that see markers, a converter for
// currents, Hall sensors for wing angles. Declarations are exact or, with conventions, depart as those of real
// laboratories: latencies by up to 0.5 ms (half an averaging interval counted or not), rates rounded, IMU position by
// up to 2 mm, mounting by 1 deg, noise 0.7 to 1.5 times the truth, one stream's clock up to 50 ppm fast; IMU samples
// instantaneous, averaged or held; currents on the battery's side of the bridge.
#pragma once

#include "lab/blind/c/c_robot.hpp"

namespace flappy::blind::c {

enum class Sampling { kInstant, kMean, kHeld };

/// Properties of a robot's sensors, drawn once: true values and declaration.
struct SensorParameters {
  struct Imu {
    std::size_t steps = 10;  ///< steps of the robot between samples
    double bandwidth_hz = 250, latency_s = 1e-3;
    Sampling sampling = Sampling::kInstant;
    Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
    Eigen::Matrix3d gyro_axes = Eigen::Matrix3d::Identity(),
                    accel_axes = Eigen::Matrix3d::Identity();  ///< scale, skew and mounting
    Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero(), gyro_bias_sd = {0.02, 0.03, 0.015};
    double gyro_noise = 0.02, accel_noise = 0.3;
  } imu;
  struct Mocap {
    std::size_t steps = 50;
    double latency_s = 0.01, marker_noise_m = 2e-4, loss = 0.004;
    std::array<Eigen::Vector3d, 4> markers_m, model_m;  ///< true, and as the cameras' software believes
    std::array<Eigen::Vector3d, 6> cameras_W;           ///< directions to the cameras
  } mocap;
  struct Power {
    std::size_t steps = 10;
    double latency_s = 1e-3, voltage_noise = 0.01, current_noise = 0.005;
    std::array<double, 2> offset_A{};
    bool battery_side = false;
  } power;
  struct Wings {
    std::size_t steps = 10;
    double noise_rad = 0.003;
    std::array<double, 4> bend_rad{}, bend_phase{};
  } wings;
  double fast_imu = 0, fast_mocap = 0;  ///< relative excess speed of the streams' clocks
  flightlog::FlightHeader declared;
};

SensorParameters sensor_parameters(const Assignment& a, const Robot& robot);

/// Properties of the sensors' effects that are drawn once.
struct SensorFaults {
  Eigen::Vector3d warm, bend, stalk;  ///< directions of the gyro's bias, the leaning verticals, and the stalks' set
  Eigen::Matrix3d axes;               ///< of the accelerometer, from what acts to what it senses
  double buffer_phase;                ///< from 0 to 1
};
SensorFaults sensor_faults(const Magnitudes& magnitudes, std::uint64_t seed);

class Sensors {
 public:
  Sensors(const Assignment& a, std::size_t flight, const Robot& robot, SensorParameters parameters);
  /// To be called when a step of the robot has ended, at `t_s` of the log.
  void after_step(const Robot& robot, double t_s);
  /// Gives a firmware what has arrived by now and was not given before.
  void hand_over(OnBoard& firmware, double now_s);
  /// Puts the record from t = 0 to `end_s` into a log that already has its commands.
  void finish(flightlog::FlightLog& log, double end_s) const;

 private:
  void imu(const Robot& robot, double t_s);
  void swing(const Motion& now);
  void mocap(const Robot& robot, double t_s);
  void power(const Robot& robot, double t_s);
  void wings(const Robot& robot, double t_s);

  SensorParameters f_;
  bool clamped_, power_, wings_;  ///< a clamped robot's motion is not recorded
  Random imu_noise_, mocap_noise_, power_noise_, wing_noise_, walk_;
  double step_s_, bias_, rectification_, g_sensitivity_, buffer_, bend_, stalk_, notch_;
  SensorFaults faults_;
  Eigen::Vector3d walked_ = Eigen::Vector3d::Zero(), level_ = Eigen::Vector3d::Zero(),
                  stalk_m_ = Eigen::Vector3d::Zero(), stalk_m_s_ = Eigen::Vector3d::Zero(),
                  notched_ = Eigen::Vector3d::Zero(), notched_sum_ = Eigen::Vector3d::Zero();
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  Vector6 passed_ = Vector6::Zero(), sum_ = Vector6::Zero(), held_ = Vector6::Zero();
  std::size_t count_ = 0, lost_ = 0, imu_given_ = 0, mocap_given_ = 0;
  bool settled_ = false;
  flightlog::MocapStream mocap_;
  flightlog::ImuStream imu_;
  flightlog::PowerStream power_log_;
  flightlog::WingsStream wings_log_;
};

}  // namespace flappy::blind::c
