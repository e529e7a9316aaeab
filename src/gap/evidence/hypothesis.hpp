// What a hypothesis leaves free, as coordinates that are standard normal a priori: the uncertain parameters of the vehicle,
// how late the IMU is, and the sizes and shapes of the effects it assumes.
#pragma once

#include <Eigen/Dense>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gap/replay/predicted_flight.hpp"
#include "sim/randomise.hpp"

namespace flappy::model {
struct EffectEntry;
}

namespace flappy::gap {

/// One coordinate: value = centre + scale x coordinate.
struct Unknown {
  std::string effect;  ///< empty for a parameter of the vehicle
  std::string name;    ///< path of the parameter, or name of the effect's
  double centre = 0, scale = 1;
  double low = -1e30, high = 1e30;  ///< of the value
  bool size = false;                ///< the effect vanishes where all of its sizes are 0
  bool log = false;                 ///< it changes what the log says, not what is flown (replay/sensor_correction.hpp)
  double value(double coordinate) const;
  double coordinate(double of_value) const { return (of_value - centre) / scale; }
};

class Hypothesis {
 public:
  /// `effects`: identifiers, in order.
  Hypothesis(const sim::Randomisation& uncertain, std::vector<std::string> effects);
  Hypothesis(sim::Randomisation&&, std::vector<std::string>) = delete;  // it does not keep what it is of

  const std::vector<std::string>& effects() const { return effects_; }
  const std::vector<Unknown>& unknowns() const { return unknowns_; }
  Eigen::Index size() const { return static_cast<Eigen::Index>(unknowns_.size()); }
  /// Of these, the first are the vehicle's parameters, the same for every hypothesis; then the IMU's lag.
  Eigen::Index parameters() const { return static_cast<Eigen::Index>(uncertain_->majors()); }
  Eigen::Index lag() const { return parameters(); }
  Eigen::Index shared() const { return parameters() + 1; }
  /// Where a vehicle has an effect, its figures there; else sizes start at 0, shapes in the middle of their range.
  Eigen::VectorXd start(const model::Vehicle& vehicle) const;
  Eigen::VectorXd start() const { return start(uncertain_->nominal()); }
  /// Into the accepted ranges.
  Eigen::VectorXd bounded(Eigen::VectorXd coordinates) const;

  /// `minor`: one of the draws that are taken as linear, and by how much farther.
  Candidate candidate(const Eigen::VectorXd& coordinates,
                      std::optional<std::pair<std::size_t, double>> minor = {}) const;

 private:
  const sim::Randomisation* uncertain_;
  std::vector<std::string> effects_;
  std::vector<Unknown> unknowns_;
};

/// What an effect of the catalogue leaves free: its sizes first.
std::vector<Unknown> unknowns_of(const model::EffectEntry& entry);
/// Of one that acts within the beat.
std::vector<Unknown> unknowns_of(const std::string& effect);

}  // namespace flappy::gap
