// Predicts a flight by beat-averaged vehicles (model/beat_averaged.hpp). At each row, recorded motion and inputs give
// force F and moment M. From these follow the specific force f and angular acceleration a that motion capture should
// measure:
//   f = F / m + a_recorded x d + w x (w x d),  d: from the centre of mass to the torso's origin
//   I a = M - w x I w,  M: about the centre of mass
// With beat.trims, moments are compared as means over kTrim_s, and relative to the thrust, so that no fit gains by
// making thrust and moments small together:
//   a = I_n^-1 (M / max(F_z, 0.1 m_n g)) m_n g,  n: mass and inertia of the vehicle that is believed to have flown
// Inputs pass the same low-pass filter as the motion (flightlog/beat_averaged_motion.hpp). Nothing is integrated except
// the swing of a weight on a line, so errors do not accumulate. Rows are about half a period of the bandwidth apart:
// closer ones would not be independent. Loads come from the vehicle file or, if its model is "predicted", from
// predicted.csv (predicted_loads.hpp) through the same filter. Effects act on loads of both sources, except that
// effects of the drive do not act on predicted loads, which contain them.
//
// Channels with rows are the specific forces and, if the vehicle has and compares moments, the angular accelerations.
// If the caller selects channels, only these have rows, as far as the vehicle has what they need. The specific force
// along x has no rows if the pose of the log lacks the pitch. A row counts where motion capture sees the vehicle,
// commands are logged, and the origin is at least the vehicle's extent.below_m above the ground.
#pragma once

#include <map>
#include <mutex>
#include <tuple>

#include "flightlog/beat_averaged_motion.hpp"
#include "flightlog/log_world.hpp"
#include "gap/replay/predicted_flight.hpp"
#include "gap/replay/predicted_loads.hpp"
#include "model/beat_averaged.hpp"

namespace flappy::gap {

/// Smallest number of instants in all flights of a set, references or tests; diagnose() refuses fewer. Choice.
inline constexpr std::size_t kMinInstants = 30;

class BeatAveragedPrediction final : public PredictedFlight {
 public:
  /// `nominal`: the vehicle that is believed to have flown. `channels`: the only ones with rows; empty: all that
  /// `nominal` compares. flightlog::TooLittleSeen if fewer than kMinRows rows count: diagnose() leaves such a flight
  /// out. io::InputError naming `folder` if the log lacks an input of the vehicle, an input is outside of its range, no
  /// channel has rows, or predicted.csv does not fit.
  BeatAveragedPrediction(const std::filesystem::path& folder, flightlog::FlightLog log, const model::Vehicle& nominal,
                         const std::vector<int>& channels = {});

  const std::string& name() const override { return name_; }
  std::string session() const override { return log_.header.session; }
  bool has_ground() const override { return flightlog::world_of(log_.header).has_ground(); }
  std::size_t beats() const override { return rows_.size(); }
  double beats_Hz() const override { return 1 / (motion_.step_s * static_cast<double>(stride_)); }
  /// A disturbed channel has one row for each trim, at the trim's middle: the mean over its kTrim_s. Other beats have
  /// none.
  bool covers(std::size_t beat, int channel) const override {
    return has_rows(channel, 0) && motion_.seen[rows_[beat]] != 0 && (!disturbed(channel) || is_trim_[beat] != 0);
  }
  /// Whether an autopilot counteracts a channel: with beat.trims, the angular accelerations.
  bool disturbed(int channel) const override {
    return nominal_.beat_averaged->trims && channel <= kAngularAccelerationZ;
  }
  /// Yes for means alone, in the channels that the constructor chose.
  bool has_rows(int channel, int coefficient) const override {
    return coefficient == 0 && channel <= kSpecificForceZ && shown_[static_cast<std::size_t>(channel)];
  }
  const Rows& measured() const override { return measured_; }
  const Rows& signal() const override { return signal_; }
  /// Any number of vehicles. None diverges, as nothing is simulated. VehicleHypothesis::sensors is not used.
  std::vector<Rows> predict(const std::vector<const VehicleHypothesis*>& vehicles) const override;
  /// That of motion capture and gyro.
  Rows declared_noise(std::uint64_t seed) const override;
  std::vector<RegimeFunction> functions() const override;
  /// None: functions() has them.
  std::vector<std::pair<std::string, std::string>> products() const override { return {}; }
  std::vector<RegimeQuantity> regimes() const override;
  std::vector<RegimeQuantity> inputs() const override;
  /// How much the controller shakes: logarithm of the rms of the inputs' second differences in the air, in shares of
  /// their ranges. None: no input changes.
  std::optional<double> log_input_noise() const override;
  bool is_averaged() const override { return true; }

 private:
  /// [row] An input, or a column of predicted.csv, after delay, lag and low-pass, and its rate; then the same two of
  /// its product with the battery's voltage over the nominal one. Kept for the next vehicle.
  struct Driven {
    std::vector<double> input, rate, times_battery, rate_times_battery;
  };
  /// `input`: index in inputs_.
  const Driven& driven(std::size_t input, double delay_s, double lag_s) const;
  /// The loads as products of actuator values, motion variables and columns of predicted.csv.
  model::BeatAveragedWrench wrench_of(const model::BeatAveraged& vehicle) const;
  Rows rows_of(const flightlog::BeatAveragedMotion& motion) const;
  Rows predict(const VehicleHypothesis& hypothesis) const;
  void find_trims();
  /// Replaces angular accelerations by their means over trims, at the row of each trim; 0 in all other rows.
  void take_means(Rows& rows) const;
  /// [row][axis] The signal of disturbed channels: the single products of the vehicle's expressions each give an
  /// angular acceleration; this is the root of the sum of their squares.
  std::vector<Eigen::Vector3d> turned_by_single_loads() const;
  template <class Value>
  std::vector<double> each(const Value& value) const;

  std::string name_;
  flightlog::FlightLog log_;
  model::Vehicle nominal_;
  std::array<bool, kSpecificForceZ + 1> shown_{};  ///< [channel]
  flightlog::BeatAveragedMotion motion_;
  std::size_t stride_;
  std::vector<std::size_t> rows_;            ///< [row] index into the grid of the motion
  std::vector<PredictedColumn> predicted_;   ///< without their values, which are in inputs_
  std::vector<std::vector<double>> inputs_;  ///< on the grid: inputs of the vehicle, then columns of predicted.csv
  std::vector<double> battery_;              ///< voltage over the nominal voltage, on the grid; 1 if it is not logged
  std::vector<double> battery_rows_;         ///< [row] the same, low-passed
  struct Trim {
    std::size_t row, first, end;  ///< its row; it is the mean of the rows from `first` to before `end`
  };
  std::vector<Trim> trims_;
  std::vector<char> is_trim_;  ///< [row]
  Rows measured_, signal_;
  mutable std::mutex mutex_;
  mutable std::map<std::tuple<std::size_t, double, double>, Driven> driven_;
};

}  // namespace flappy::gap
