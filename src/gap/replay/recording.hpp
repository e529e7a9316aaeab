// A recorded flight of a vehicle with wings and motors, prepared for replay: motor voltages, motion of the torso at the
// bounds of the IMU's intervals, measured force in each interval. ResetPrediction replays it. For a clamped robot, the
// torso rests upright at the origin, and an interval spans one or more samples of the force sensor of its stand.
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
/// Longest interval of a clamped robot's grid. Choice: seven of them make a period of the highest harmonic, and a
/// sensor that is faster is averaged.
inline constexpr double kClampedInterval_s = 1e-3;
/// Below this height above its stand, a vehicle may touch the ground, which no hypothesis models. Choice.
inline constexpr double kMinClearance_m = 0.01;

/// Inputs and motion in one beat. Inputs are computed from the motor voltages. All are 0 in a beat without intervals.
struct BeatMotion {
  double t_s = 0;           ///< mean of the times at which the beat's intervals end
  double amplitude_V = 0;   ///< first harmonic of the voltage (its cosine): mean of both sides
  double difference_V = 0;  ///< first harmonic likewise: half of left less right
  double bias_V = 0;        ///< mean voltage of both sides
  double split_cycle = 0;   ///< second harmonic (its sine): half of left less right, over amplitude_V
  /// Means over the ends of the beat's intervals: velocity of the torso origin in B, body rate in B, position of the
  /// torso origin in W.
  Eigen::Vector3d velocity_B_m_s, rate_rad_s, position_m;
  double heading_rad = 0;  ///< of the body's x axis in W, at the end of the beat's last interval
};

struct Recording {
  std::string name;
  double least_z_m = 0;      ///< below this height of the torso origin in W, the vehicle may touch the ground
  double density_ratio = 1;  ///< air density of the flight over that of the vehicle file
  /// Battery voltage at the start over the nominal voltage, to which commands refer; 1 if no voltage is logged or the
  /// ratio is below 1.02. The vehicle's model predicts how the voltage falls from there.
  double full = 1;
  double mass_kg = 0;             ///< of the robot, by the vehicle file
  Eigen::Vector3d inertia_kg_m2;  ///< moments of inertia of the torso, by the vehicle file
  flightlog::FlightLog log;
  std::optional<flightlog::Smoother> smoother;  ///< none: the robot was clamped, or drop_streams() was called
  sim::World world;

  // The grid: intervals of the IMU, each rounded to whole physics steps of kPredictionStep_s. A gap of the IMU is cut
  // into intervals of usual length.
  double begin_s = 0;         ///< where the first interval begins
  double last_s = 0;          ///< no interval ends later
  std::vector<int> steps;     ///< [interval] number of physics steps
  std::vector<double> end_s;  ///< [interval]
  /// [interval] Whether it counts: IMU and motion capture have data, the commands have no gap in the interval or in the
  /// kSpinUpBeats beats before it, and the torso is above least_z_m. Gaps of wings.csv and power.csv are not considered
  /// here: ResetPrediction treats them.
  std::vector<char> valid;
  std::vector<TorsoAt> torso;  ///< [bound of an interval] one more than intervals
  /// [interval] Mean specific force at the IMU, bias included, in B. For a clamped robot: the force on its stand,
  /// zeroed at rest, over the robot's mass.
  std::vector<Eigen::Vector3d> force_m_s2;
  /// [interval] Only for a clamped robot: the moment on its stand about the torso origin, in B, over the moments of
  /// inertia of the torso.
  std::vector<Eigen::Vector3d> turn_rad_s2;
  /// Number of samples of the force sensor in an interval: as many as fit into kClampedInterval_s, but at least 1. In
  /// flight: 1.
  std::size_t samples_per_interval = 1;
  std::vector<double> left_V, right_V;  ///< [physics step] commanded voltage times `full`

  std::vector<double> beat;  ///< [interval] time of its middle, in beats since beat 0 began (beat_at)
  /// Number of beats, counted by the phase of the commands. The grid may begin within beat 0, so beat 0 may be
  /// incomplete.
  std::size_t beats = 0;
  std::vector<BeatMotion> regimes;  ///< [beat]

  /// `folder`: folder of the log. `nominal`: the vehicle that is believed to have flown. io::InputError naming `folder`
  /// if no interval has motion capture around it, if the smoother refuses the log, or if the log has a density of air
  /// while the vehicle file has a vacuum.
  Recording(const std::filesystem::path& folder, flightlog::FlightLog flight_log, const model::Vehicle& nominal);
  /// The same flight over the same beats, with a changed copy of `other.log`, such as one in which errors of sensors
  /// were undone. Its times are those of regular clocks already (flightlog::on_its_clocks).
  Recording(const Recording& other, flightlog::FlightLog flight_log);

  /// Frees the streams and the smoother, for a copy that is only replayed.
  void drop_streams();
  bool clamped() const { return log.header.rig.has_value(); }
  double interval_s(std::size_t k) const { return steps[k] * kPredictionStep_s; }
  std::size_t intervals() const { return steps.size(); }
  /// Time in beats since beat 0 began; its fraction is the phase of the beat. Negative before.
  double beat_at(double t_s) const;

 private:
  void prepare(const std::string& place);
  void lay_grid();
  void lay_clamped_grid();
  void take_load(std::size_t first, std::size_t end);
  std::vector<std::pair<double, double>> undriven_s() const;
  void read_voltages();
  void find_phase();
  void read_regimes();
  std::vector<double> phase_t_s_, phase_beats_;  ///< unwrapped phase of the commands; empty: not logged
  double phase_offset_ = 0, phase_hz_ = 0;       ///< fitted to the voltages where no phase is logged
  std::optional<double> phase_from_s_;           ///< begin_s for which the phase was found; none: not found yet
  double first_beat_ = 0;                        ///< number of beat 0 when counted by the phase of the commands
};

}  // namespace flappy::gap
