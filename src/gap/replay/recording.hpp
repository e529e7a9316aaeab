// A recorded flight, ready to be flown once more by any vehicle: what drove it, where its torso was at every interval of
// the IMU, and what its sensors said there.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "flappy/vehicle.hpp"
#include "flightlog/flight_log.hpp"
#include "flightlog/smoother.hpp"
#include "gap/replay/reset_kernel.hpp"

namespace flappy::gap {

/// At half of it, and twice the time, flights held out are predicted no better. Of a robot with nothing wrong that flew by finer steps the
/// parameters make up for the difference, so that it is not called "none".
inline constexpr double kPredictionStep_s = 2e-4;
/// Of which the hold of a driver is a multiple. Replays have the recorded voltages, whatever held them.
inline constexpr double kHoldStep_s = 1e-4;
/// Beats until wings that were at rest have forgotten it: after three, thirty times the noise remains.
inline constexpr double kSpinUpBeats = 6;
/// Lower than this over its stand a vehicle may still be touching the ground, which no hypothesis knows.
inline constexpr double kLeastClearance_m = 0.01;

/// Means over a beat of what a flight did.
struct BeatMotion {
  double t_s = 0, amplitude_V = 0, difference_V = 0, bias_V = 0, split_cycle = 0;
  Eigen::Vector3d velocity_B_m_s, rate_rad_s, position_m;
  double heading_rad = 0;
};

struct Recording {
  std::string name;
  double least_z_m = 0;      ///< lower, the ground may be touched
  double density_ratio = 1;  ///< of the air that day, over that of the vehicle's file
  /// Voltage of a full battery over its nominal one: commands are volts of the latter. Below it a battery gives way, which is the
  /// robot's affair.
  double full = 1;
  flightlog::FlightLog log;
  flightlog::Smoother smoother;
  sim::World world;

  // the grid: intervals of the IMU on whole physics steps
  double begin_s = 0, last_s = 0;
  std::vector<int> steps;                   ///< of each interval
  std::vector<double> end_s;                ///< of each interval
  std::vector<char> valid;                  ///< whether all streams were there, and the ground was not
  std::vector<TorsoAt> torso;               ///< at every bound: one more than intervals
  std::vector<Eigen::Vector3d> force_m_s2;  ///< measured, mean over the interval
  std::vector<double> left_V, right_V;      ///< of every physics step

  // the beats
  std::vector<double> beat;         ///< at the middle of each interval: whole beats since the start, and the phase
  std::size_t beats = 0;            ///< whole ones
  std::vector<BeatMotion> regimes;  ///< of each

  /// `nominal`: the vehicle that is believed to have flown. InputError naming `folder` where nothing of it can be replayed.
  Recording(const std::filesystem::path& folder, flightlog::FlightLog flight_log, const model::Vehicle& nominal);
  /// The same flight, from the same beat to the same beat, with another log of it: one whose sensors were corrected.
  Recording(const Recording& other, flightlog::FlightLog flight_log);

  double interval_s(std::size_t k) const { return steps[k] * kPredictionStep_s; }
  std::size_t intervals() const { return steps.size(); }
  /// Whole beats since the start, and the phase, at any time.
  double beat_at(double t_s) const;

 private:
  void prepare(const std::string& place);
  void lay_grid();
  std::vector<std::pair<double, double>> undriven_s() const;
  void read_voltages();
  void find_phase();
  void read_regimes();
  std::vector<double> phase_t_s_, phase_beats_;  ///< unwrapped, where the log has it
  double phase_offset_ = 0, phase_hz_ = 0;
  double first_beat_ = 0;  ///< of the command's, that is beat 0
};

}  // namespace flappy::gap
