// What a laboratory records of a robot of family C: an inertial unit, markers seen by cameras, currents through a converter, strokes by
// Hall sensors; and what it declares about them.
//
// Declarations are exact in the log format's meaning, or those of an assignment with conventions, where each departs from the truth
// as laboratories' do, and within these bounds: latencies by up to 0.5 ms (half an averaging interval counted or not), rates
// rounded, the place of the IMU by up to 2 mm, its mounting turned by up to 1 deg, noise 0.7 to 1.5 times the truth, the clock of
// one stream up to 50 ppm fast; IMU samples that are instants, means or held; currents on the battery's side of the bridge.
#pragma once

#include "blind/c/robot.hpp"

namespace flappy::blind::c {

enum class Sampling { kInstant, kMean, kHeld };

/// Everything drawn once for a robot's sensors: the truth, and beside it the declaration.
struct SensorFigures {
  struct Imu {
    std::size_t steps = 10;  ///< between samples
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
    std::array<Eigen::Vector3d, 4> markers_m;
    std::array<Eigen::Vector3d, 6> cameras_W;  ///< directions to them
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
  double fast_imu = 0, fast_mocap = 0;  ///< shares by which a stream's clock runs fast
  flightlog::FlightHeader declared;
};

SensorFigures sensor_figures(const Assignment& a, const Robot& robot);

class Sensors {
 public:
  Sensors(const Assignment& a, std::size_t flight, const Robot& robot, SensorFigures figures);
  /// After each step of the robot, at the time of the log.
  void after_step(const Robot& robot, double t_s);
  /// Puts what was recorded from t = 0 on into a log whose commands are there.
  void finish(flightlog::FlightLog& log, double end_s) const;

 private:
  void imu(const Robot& robot, double t_s);
  void mocap(const Robot& robot, double t_s);
  void power(const Robot& robot, double t_s);
  void wings(const Robot& robot, double t_s);

  SensorFigures f_;
  bool power_, wings_;
  Random imu_noise_, mocap_noise_, power_noise_, wing_noise_, walk_;
  // effects
  double bias_size_, rectification_, g_sensitivity_, delay_s_;
  Eigen::Vector3d warm_ = Eigen::Vector3d::Zero(), walked_ = Eigen::Vector3d::Zero(),
                  marker_offset_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d misaligned_ = Eigen::Matrix3d::Identity(), tilt_ = Eigen::Matrix3d::Identity();
  double mount_rate_ = 0;
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  Vector6 passed_ = Vector6::Zero(), sum_ = Vector6::Zero(), held_ = Vector6::Zero(), foam_ = Vector6::Zero(),
          foam_rate_ = Vector6::Zero();
  std::size_t count_ = 0, lost_ = 0;
  bool settled_ = false;
  flightlog::MocapStream mocap_;
  flightlog::ImuStream imu_;
  flightlog::PowerStream power_log_;
  flightlog::WingsStream wings_log_;
};

}  // namespace flappy::blind::c
