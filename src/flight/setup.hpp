// Sensors, estimator and controller as the configuration states them; constants.hpp derives the working numbers.
#pragma once

#include <optional>
#include <string>

#include "flappy/vehicle.hpp"
#include "flight/controllers.hpp"
#include "io/config.hpp"

namespace flappy::flight {

struct ImuSensor {
  double rate_hz = 0, latency_s = 0;
  double low_pass_hz = 0;                             ///< 0: no low-pass after the mean over the sample interval
  model::Triple position_m;                           ///< in B
  double gyro_noise_rad_s = 0, accel_noise_m_s2 = 0;  ///< standard deviation of a sample, each axis
  model::Triple gyro_bias_sd_rad_s;                   ///< sampled once for each flight
};

struct MocapSensor {
  double rate_hz = 0, latency_s = 0;
  double position_noise_m = 0, attitude_noise_rad = 0;  ///< standard deviation, each axis
  double loss_probability = 0;                          ///< probability that a sample begins a burst of losses
  double loss_length = 1;                               ///< mean number of samples in a burst
  double jitter_s = 0;              ///< most by which a sample is later than latency_s; its mean if exponential
  bool jitter_exponential = false;  ///< law of that lateness: exponential, else uniform from 0
  bool jitter_drawn = false;        ///< each flight draws a jitter of its own, uniform from 0 to jitter_s

  double longest_jitter_s() const { return jitter_exponential ? kJitterCut * jitter_s : jitter_s; }
};

/// Noise that the estimator assumes in addition to what the sensors declare.
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
double low_pass_lag_s(const ImuSensor& imu);

struct Controller {
  int kind = kNoController;  ///< index in Controllers (controllers.hpp)
  ControllerConstants<double> constants{};
  double velocity_low_pass_hz = 0, body_rate_low_pass_hz = 0;  ///< 0: none
};

struct ControllerField {
  std::string path;
  double* value;
  io::Range range;
  std::optional<double> otherwise;  ///< value if the configuration does not give one; none: it has to
};

/// All parameters of a controller of its kind. The pointers are valid as long as the controller.
std::vector<ControllerField> fields(Controller& controller);
/// Name of a kind of controller in configurations; "none" for kNoController.
std::string controller_name(int kind);
/// Kind of a name; kNoController for "none" and for unknown names.
int controller_kind(const std::string& name);

/// Both throw io::InputError if a key is missing, unknown or out of range.
Sensors read_sensors(const io::Table& table);
Controller read_controller(const io::Table& table, double control_hz);

}  // namespace flappy::flight
