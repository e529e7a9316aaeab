// What flies a flapper, as its user states it: sensors, estimator, controllers. Read from configuration; nothing derived.
#pragma once

#include <string>

#include "flappy/vehicle.hpp"
#include "flight/controllers.hpp"
#include "io/config.hpp"

namespace flappy::flight {

struct ImuSensor {
  double rate_hz = 0, latency_s = 0;
  double low_pass_hz = 0;                             ///< 0: none beyond the mean over a sample's interval
  model::Triple position_m;                           ///< in B
  double gyro_noise_rad_s = 0, accel_noise_m_s2 = 0;  ///< standard deviation of a sample, each axis
  model::Triple gyro_bias_sd_rad_s;                   ///< sampled once for each flight
};

struct MocapSensor {
  double rate_hz = 0, latency_s = 0;
  double position_noise_m = 0, attitude_noise_rad = 0;  ///< standard deviation, each axis
  double loss_probability = 0;                          ///< that a sample begins a burst of losses
  double loss_length = 1;                               ///< mean samples in a burst
};

/// What the estimator is told about noise besides what the sensors declare.
struct EstimatorNoise {
  double angle_drift_rad_sqrt_s = 0;
  double velocity_drift_m_s_sqrt_s = 0;
  double gyro_bias_drift_rad_s_sqrt_s = 0;
  double accel_bias_sd_m_s2 = 0, accel_bias_drift_m_s2_sqrt_s = 0;
  double initial_velocity_sd_m_s = 0;
};

struct Sensors {
  ImuSensor imu;
  MocapSensor mocap;
  EstimatorNoise estimator;
};

/// Share of a new value in a first-order low-pass: 1 - exp(-2 pi f dt).
double low_pass_share(double cutoff_hz, double interval_s);
/// By how much the IMU's low-pass makes its samples late.
double low_pass_lag_s(const ImuSensor& imu);

struct Controller {
  int kind = kNoController;  ///< of controllers.hpp
  ControllerConstants<double> constants{};
  double velocity_low_pass_hz = 0, body_rate_low_pass_hz = 0;  ///< 0: none
};

/// One number of a controller, by its path in the configuration.
struct ControllerField {
  std::string path;
  double* value;
  io::Range range;
};

/// All numbers of a controller of its kind. Pointers live as long as the controller.
std::vector<ControllerField> fields(Controller& controller);
/// As configurations have it; "none" for kNoController, and the other way round.
std::string controller_name(int kind);
int controller_kind(const std::string& name);

/// io::InputError where a key is missing, unknown or out of range.
Sensors read_sensors(const io::Table& table);
Controller read_controller(const io::Table& table);

}  // namespace flappy::flight
