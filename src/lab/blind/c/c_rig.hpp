// The record of a clamped robot: a six-axis sensor on a stand, and a film of the wings. In the axes of the sensor, R from
// there to B, about its point p, the robot exerts F' = R^T F, M' = R^T (M - p x F). Robot and sensor rest on the sensor's
// springs, whose strain is what it reads, y, in each axis, of natural frequency w and damping ratio z [1]:
//   y'' + 2 z w y' + w^2 y = w^2 F'
// solved exactly for the mean force of a step. The reading is X y + drift + noise, in steps of the converter, less the mean
// reading while the wings rested. X: the identity plus cross-talk. The robot gives way by less than 10 um and a hundredth of
// the wings' accelerations, which is neglected.
// Sensors: ranges and resolutions like those of ATI's Nano17 Titanium and Nano17 [2]. Cross-talk of 0.1 to
// 1 % of the range, drift of 1 to 5 mN/min, natural frequencies of 250 Hz up, rates of 1 to 10 kHz: choices, as benches have
// them. Without conventions all declarations are exact. With them: latency within 0.5 ms, half an averaging interval counted
// or not; sensor mounted up to 0.3 deg and 0.5 mm from where it is said to be, axes turned by right angles or upside down
// as declared; noise 0.7 to 1.5 times the truth; resonance rounded or not known; the film up to 0.5 ms and the clock of
// sensor or camera up to 50 ppm off.
// [1] Doebelin, Measurement Systems (McGraw-Hill 2003), chapter 5: elastic force transducers.
// [2] ATI Industrial Automation, F/T Transducer Compendium: Nano17, Nano17 Titanium.
#pragma once

#include "lab/blind/c/c_robot.hpp"

namespace flappy::blind::c {

/// True values, and what is declared. Axes: force x, y, z, then moment.
struct RigParameters {
  std::size_t steps = 20;  ///< steps of the robot between samples
  double latency_s = 0;
  bool mean = false;  ///< samples are means over their interval
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  Eigen::Matrix3d R_BS = Eigen::Matrix3d::Identity();  ///< from the sensor's axes to B
  std::array<double, 6> natural_hz{}, damping{};
  Eigen::Matrix<double, 6, 6> crosstalk = Eigen::Matrix<double, 6, 6>::Identity();
  double force_range_N = 0, moment_range_Nm = 0, force_digit_N = 0, moment_digit_Nm = 0, force_noise_N = 0,
         moment_noise_Nm = 0;               ///< noise without the converter's
  double drift_N_s = 0, walk_N_root_s = 0;  ///< sizes; of moments in proportion to the range
  struct Film {
    std::size_t steps = 10;
    double noise_rad = 0.5 * kDegree, late_s = 0;
    double hidden = 0.2, hidden_frames = 8;  ///< share, and mean length of a stretch
    double hidden_phase = 0;                 ///< of the beat, near which stretches begin, twice a beat
  } film;
  double fast_sensor = 0, fast_film = 0;  ///< relative excess speed of their clocks
  flightlog::RigHeader declared;
  flightlog::WingsHeader declared_film;
};

RigParameters rig_parameters(const Assignment& a, const Robot& robot);

class Rig {
 public:
  using Vector6 = Eigen::Matrix<double, 6, 1>;

  Rig(const Assignment& a, std::size_t stream, const Robot& robot, const RigParameters& parameters);
  /// To be called when a step has ended, at `t_s` of the log. Before t = 0 the wings rest, and the sensor is zeroed.
  void after_step(const Robot& robot, double t_s, bool filmed);
  /// As after_step(), of the sensor alone, for a wrench in B about the torso's origin.
  void load(const Wrench& wrench, double t_s);
  /// Puts the record into a log; a film only if there is one.
  void finish(flightlog::FlightLog& log, double end_s) const;

 private:
  void film(const Robot& robot, double t_s);

  RigParameters f_;
  double step_s_, flapping_Hz_;
  Random noise_, walk_, film_noise_, hiding_;
  Vector6 drift_per_s_, walked_ = Vector6::Zero(), read_ = Vector6::Zero(), rate_ = Vector6::Zero(),
                        sum_ = Vector6::Zero(), zero_ = Vector6::Zero();
  std::array<std::array<double, 4>, 6> swing_{};  ///< of a step: y - F' and y' from y - F' and y'
  std::size_t count_ = 0;
  double zeroed_ = 0;
  bool settled_ = false, hidden_ = false;
  flightlog::ForcesStream forces_;
  flightlog::WingsStream film_;
};

}  // namespace flappy::blind::c
