// A recorded flight, prepared for replay: motor voltages, motion of the torso at the bounds of the IMU's intervals, and
// the measurements in each.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "flappy/vehicle.hpp"
#include "flightlog/flight_log.hpp"
#include "flightlog/smoother.hpp"
#include "gap/replay/reset_kernel.hpp"

namespace flappy::gap {

/// Time step of replays. A faultless robot simulated with finer steps gets the verdict "parameters" rather than "none",
/// as fitted parameters absorb the difference. Choice: half of it costs twice the time and predicts no better.
inline constexpr double kPredictionStep_s = 2e-4;
/// The hold time of a motor driver has to be a multiple of this. Replays hold recorded voltages for kPredictionStep_s.
/// Choice.
inline constexpr double kHoldStep_s = 1e-4;
/// Beats until the transient of wings that start at rest has decayed. Choice: after three it is thirty times the noise.
inline constexpr double kSpinUpBeats = 6;
/// Below this height above its stand, a vehicle may touch the ground, which no hypothesis models. Choice.
inline constexpr double kMinClearance_m = 0.01;

/// Inputs and motion of a flight, as means over one beat.
struct BeatMotion {
  double t_s = 0, amplitude_V = 0, difference_V = 0, bias_V = 0, split_cycle = 0;
  Eigen::Vector3d velocity_B_m_s, rate_rad_s, position_m;
  double heading_rad = 0;  ///< in the beat's last interval, not a mean
};

struct Recording {
  std::string name;
  double least_z_m = 0;      ///< below this height of the torso origin in W, the vehicle may touch the ground
  double density_ratio = 1;  ///< air density of the flight over that of the vehicle file
  /// Battery voltage at the start over nominal, which commands refer to. Its later fall is left to the vehicle's model.
  double full = 1;
  flightlog::FlightLog log;
  flightlog::Smoother smoother;
  sim::World world;

  // the grid: intervals of the IMU, rounded to whole physics steps
  double begin_s = 0, last_s = 0;
  std::vector<int> steps;                   ///< [interval] number of physics steps
  std::vector<double> end_s;                ///< [interval]
  std::vector<char> valid;                  ///< [interval] all streams have data, and the ground is not touched
  std::vector<TorsoAt> torso;               ///< at the bounds of the intervals: one more than intervals
  std::vector<Eigen::Vector3d> force_m_s2;  ///< [interval] measured specific force, mean over the interval
  std::vector<double> left_V, right_V;      ///< [physics step]

  std::vector<double> beat;         ///< [interval] time at its middle, in beats since the start (beat_at)
  std::size_t beats = 0;            ///< number of whole beats
  std::vector<BeatMotion> regimes;  ///< [beat]

  /// `nominal`: the vehicle that is believed to have flown. InputError naming `folder` if no part can be replayed.
  Recording(const std::filesystem::path& folder, flightlog::FlightLog flight_log, const model::Vehicle& nominal);
  /// The same flight over the same beats, with another log, in which errors of sensors were corrected.
  Recording(const Recording& other, flightlog::FlightLog flight_log);

  double interval_s(std::size_t k) const { return steps[k] * kPredictionStep_s; }
  std::size_t intervals() const { return steps.size(); }
  /// Time in beats since the start of beat 0; its fraction is the phase of the beat.
  double beat_at(double t_s) const;

 private:
  void prepare(const std::string& place);
  void lay_grid();
  std::vector<std::pair<double, double>> undriven_s() const;
  void read_voltages();
  void find_phase();
  void read_regimes();
  std::vector<double> phase_t_s_, phase_beats_;  ///< unwrapped phase of the commands; empty: not logged
  double phase_offset_ = 0, phase_hz_ = 0;       ///< fitted to the voltages where no phase is logged
  double first_beat_ = 0;                        ///< number, counted by the command's phase, of the beat that is beat 0
};

}  // namespace flappy::gap
