// What measures a clamped robot: a six-axis force sensor on its stand, and a film of the wings.
//
// The sensor gets the wrench (f, n) of the robot about the torso's origin, in B, less that at rest. About its own point
// p, in its own axes, which Q turns to B:
//   F = Q^T f,   M = Q^T (n - p x f)
// Robot, transducer and stand sway: each of the six axes reads the strain x of an oscillator,
//   x'' + 2 z w x' + w^2 x = w^2 u,      u one of F, M
// exact for u that is linear over a step; so the mean is read as it is, and a harmonic near w is read too large [1].
// Then come cross-talk between the axes, drift r T (1 - exp(-t / T)) since the zero, noise, range and steps.
// Assumed: the torso sways by micrometres, which does not act back on the wings; axes sway apart; no filter precedes the
// converter, so what is faster than half its rate is folded; gains are exact.
//
// Range and steps are those of the smallest six-axis transducer on the market [2]. Chosen, within what laboratories
// report of such benches: natural frequency 250 to 700 Hz for the softest axis, 1 to 3 % of critical damping (bolted
// metal), cross-talk 0.2 to 1 % of full scale, drift 2 to 6 mN a minute, rate 1 to 10 kHz. A film is digitised by hand
// or by markers to half a degree.
// 1 Den Hartog, Mechanical Vibrations (1956), chapter 2: base and force excitation of one degree of freedom
// 2 ATI Industrial Automation, data sheet of the Nano17, calibration SI-12-0.12: 12 N and 0.12 Nm in steps of 1/320 N
// and 1/64 Nmm
#pragma once

#include <array>

#include "lab/blind/b/b_robot.hpp"
#include "lab/blind/family.hpp"

namespace flappy::blind::b {

inline constexpr double kForceRange_N = 12, kMomentRange_Nm = 0.12;             ///< [2]
inline constexpr double kForceStep_N = 1.0 / 320, kMomentStep_Nm = 1.0 / 64e3;  ///< [2]
inline constexpr double kSensorLever_m = kMomentRange_Nm / kForceRange_N;       ///< compares moments with forces
inline constexpr double kSoftest_hz = 250, kStiffest_hz = 700;                  ///< lowest natural frequency
inline constexpr double kMinCrossTalk = 2e-3, kMaxCrossTalk = 1e-2;             ///< of full scale
inline constexpr double kMinDrift_N_s = 2e-3 / 60, kMaxDrift_N_s = 6e-3 / 60;   ///< 2 to 6 mN a minute
inline constexpr double kDriftSettles_s = 120;                                  ///< T: warming up, minutes
inline constexpr double kFilm_hz = 2000, kFilmNoise_rad = 0.5 * kDegree;
inline constexpr double kHidden = 0.2;                                        ///< share of the frames that are left out
inline constexpr double kMisturned_rad = 0.3 * kDegree, kMisplaced_m = 5e-4;  ///< of the sensor, at most

/// True properties of sensor and camera. Axes: three of force, three of moment.
struct RigTruth {
  double rate_hz = 1000, late_s = 5e-4, clock = 1;
  Vector3d place_m = Vector3d::Zero();   ///< p, in B
  Matrix3d turn = Matrix3d::Identity();  ///< Q
  double force_noise_N = 2e-3, moment_noise_Nm = 2e-5;
  std::array<double, 6> frequency_hz{}, damping{};
  Eigen::Matrix<double, 6, 6> cross_talk = Eigen::Matrix<double, 6, 6>::Identity();  ///< in N and Nm
  double camera_clock = 1, camera_late_s = 0;
  double hidden_at = 0;  ///< share of the beat at whose middle one wing hides the other from the camera
};

/// Draws the rig and its declaration. The film is declared by whoever films.
RigTruth draw_rig(const Assignment& a, flightlog::RigHeader& header);

class ForceSensor {
 public:
  /// `begins_s`: the first step; `number`: under which it draws.
  ForceSensor(const RigTruth& truth, std::uint64_t seed, std::uint64_t number, double begins_s);
  /// Called for each step with the wrench of the robot about the torso's origin, in B, at `time_s`, its start.
  void take(const Wrench& by_robot, double time_s);
  /// Makes the mean strain since the last call, or the start, read zero.
  void zero();
  /// Strains now, before cross-talk and all that follows.
  const Vector6d& strain() const { return strain_; }
  flightlog::ForcesStream stream(double end_s) const;

 private:
  void sample(const Vector6d& strain, double time_s);

  RigTruth truth_;
  Random random_;
  Vector6d drift_N_s_;   ///< r, in N/s and Nm/s
  double zeroed_s_ = 0;  ///< from the zero to the log's start
  Vector6d load_ = Vector6d::Zero(), strain_ = Vector6d::Zero(), rate_ = Vector6d::Zero(), zero_ = Vector6d::Zero(),
           sum_ = Vector6d::Zero();
  long count_ = 0;
  double before_s_ = 0, next_s_;
  bool begun_ = false;
  std::vector<double> t_s_;
  std::vector<Vector6d> samples_;
};

/// A film of the wings between two times. Frames in which a wing is hidden, for a while of each beat, or in glare, are
/// left out.
class Film {
 public:
  Film(const RigTruth& truth, std::uint64_t seed, std::uint64_t number, double flapping_Hz, double from_s, double to_s);
  /// Called after each step, with the number of the step since the log's start.
  void take(const State& x, long step);
  flightlog::WingsStream stream(double end_s) const;

 private:
  bool hidden(double time_s);

  RigTruth truth_;
  Random random_;
  double flapping_Hz_, from_s_, to_s_;
  long first_step_, beat_ = -1;
  double hides_s_ = 0, glare_begins_s_, glare_ends_s_;
  flightlog::WingsStream film_;
};

}  // namespace flappy::blind::b
