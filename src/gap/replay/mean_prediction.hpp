// A recorded flight, predicted by vehicles that are beat-averaged (model/beat_averaged.hpp): at each instant the recorded motion and inputs
// give force and moment, and these the specific force and the angular acceleration that motion capture should have shown,
//   f = F / m + a x d + w x (w x d),  d: from the centre of mass to the torso's origin      I a = M - w x I w,  M: about the centre of mass
// each seen through the filter that the motion went through (flightlog/mean_motion.hpp). Nothing is integrated, so nothing drifts. Rows are as
// far apart as what is below the bandwidth allows: with more, neighbours would say the same.
//
// What acts on a vehicle says its file, or, of model = "predicted", the flight's predicted.csv (gap/replay/predicted_loads.hpp), whose columns
// go through the same filter; effects act on both alike, but for those between inputs and wings, which predicted forces have in them.
//
// Channels of force are there always, those of torque where the vehicle has moments. The smallest height from which on rows count is the
// vehicle's extent.below_m over the ground.
#pragma once

#include <map>
#include <mutex>
#include <tuple>

#include "flightlog/mean_motion.hpp"
#include "gap/replay/predicted_flight.hpp"
#include "gap/replay/predicted_loads.hpp"
#include "model/beat_averaged.hpp"

namespace flappy::gap {

class MeanPrediction final : public PredictedFlight {
 public:
  /// `nominal`: the vehicle that is believed to have flown; `channels`: that alone have rows, none: all. io::InputError naming `folder` where the log lacks its inputs, or too little of
  /// it was seen.
  MeanPrediction(const std::filesystem::path& folder, flightlog::FlightLog log, const model::Vehicle& nominal,
                 const std::vector<int>& channels = {});

  const std::string& name() const override { return name_; }
  std::size_t beats() const override { return rows_.size(); }
  double beats_Hz() const override { return 1 / (motion_.step_s * static_cast<double>(stride_)); }
  bool covers(std::size_t beat, int channel) const override {
    return has_rows(channel, 0) && motion_.seen[rows_[beat]] != 0;
  }
  bool has_rows(int channel, int coefficient) const override {
    return coefficient == 0 && channel <= kForceZ && shown_[static_cast<std::size_t>(channel)];
  }
  const Rows& measured() const override { return measured_; }
  const Rows& signal() const override { return measured_; }
  std::vector<Rows> predict(const std::vector<const VehicleHypothesis*>& vehicles) const override;
  Rows declared_noise(std::uint64_t seed) const override;
  std::vector<RegimeFunction> functions() const override;
  std::vector<std::pair<std::string, std::string>> products() const override { return {}; }
  std::vector<RegimeQuantity> regimes() const override;
  std::vector<RegimeQuantity> inputs() const override;
  const DiagnosisPolicy& policy() const override { return kBeatAveragedPolicy; }

 private:
  /// An input as an actuator sees it, or a column of predicted.csv, by the rows: late, behind a lag, low-passed.
  struct Driven {
    std::vector<double> input, rate, times_battery, rate_times_battery;
  };
  const Driven& driven(std::size_t input, double delay_s, double lag_s) const;
  /// Of actuators, motion, and columns of predicted.csv.
  model::MeanWrench wrench_of(const model::BeatAveraged& vehicle) const;
  Rows rows_of(const flightlog::MeanMotion& motion) const;
  Rows predict(const VehicleHypothesis& hypothesis) const;
  template <class Value>
  std::vector<double> each(const Value& value) const;

  std::string name_;
  flightlog::FlightLog log_;
  model::Vehicle nominal_;
  std::array<bool, kForceZ + 1> shown_{};  ///< [channel]
  flightlog::MeanMotion motion_;
  std::size_t stride_;
  std::vector<std::size_t> rows_;            ///< of the grid
  std::vector<PredictedColumn> predicted_;   ///< without values, which are among inputs_
  std::vector<std::vector<double>> inputs_;  ///< on the grid: the vehicle's, then columns of predicted.csv
  std::vector<double> battery_;              ///< over the nominal voltage, on the grid; 1 where it is not known
  std::vector<double> battery_rows_;         ///< low-passed
  Rows measured_;
  mutable std::mutex mutex_;
  mutable std::map<std::tuple<std::size_t, double, double>, Driven> driven_;
};

}  // namespace flappy::gap
