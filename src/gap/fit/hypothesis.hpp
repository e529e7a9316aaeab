// The unknowns of a hypothesis as coordinates: the vehicle's uncertain parameters, the lag of the sensors, the
// magnitudes and shape parameters of its effects. A priori each coordinate is standard normal, but for two corrections:
// a magnitude that cannot be negative is half-normal (one_sided.hpp), and every coordinate is bounded.
#pragma once

#include <Eigen/Dense>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gap/replay/predicted_flight.hpp"
#include "sim/randomise.hpp"

namespace flappy::model {
struct CatalogueEffect;
}

namespace flappy::gap {

/// Half a 90 % interval of a normal distribution, also the 90 % quantile of a half-normal, in standard deviations.
/// Derived: the 95 % quantile of the normal distribution.
inline constexpr double kHalf90 = 1.645;

/// One coordinate: value = centre + scale x coordinate.
struct Unknown {
  std::string effect;  ///< empty for a parameter of the vehicle and the lag
  std::string name;    ///< path of the parameter, name of the lag, or name of the effect's parameter
  double centre = 0, scale = 1;
  double low = -1e30, high = 1e30;  ///< bounds of the value
  bool magnitude = false;           ///< an effect vanishes if all its magnitudes are 0
  bool in_log = false;              ///< it changes the log, not the simulation (gap/replay/sensor_correction.hpp)
  /// Whether the prior is half-normal: a magnitude that cannot be negative.
  bool one_sided() const { return magnitude && low >= 0; }
  /// Magnitudes of effects of sensors act linearly, except delays.
  bool linear() const { return in_log && name != "delay_s"; }
  double value(double coordinate) const;  ///< within the bounds
  double coordinate(double of_value) const { return (of_value - centre) / scale; }
};

class Hypothesis {
 public:
  /// Keeps a reference to `uncertain`. `effects`: identifiers, in the order of their unknowns; all are in the vehicle's
  /// catalogue.
  Hypothesis(const sim::Randomisation& uncertain, std::vector<std::string> effects);
  Hypothesis(sim::Randomisation&&, std::vector<std::string>) = delete;

  const std::vector<std::string>& effects() const { return effects_; }
  const std::vector<Unknown>& unknowns() const { return unknowns_; }
  Eigen::Index size() const { return static_cast<Eigen::Index>(unknowns_.size()); }
  /// Order of the unknowns: [0, parameters()) the vehicle's major parameters; lag() the lag of the sensors (for a
  /// beat-averaged vehicle, the delay of the command); [shared(), size()) those of the effects. All before shared() are
  /// the same for every hypothesis of a robot.
  Eigen::Index parameters() const { return static_cast<Eigen::Index>(uncertain_->majors()); }
  Eigen::Index lag() const { return parameters(); }
  Eigen::Index shared() const { return parameters() + 1; }
  /// Index of the first unknown of an effect; size() if the hypothesis lacks it.
  Eigen::Index first_of(const std::string& effect) const;
  /// Coordinates of `vehicle`, which has the parameters of the file: the coordinates of parameters and lag are 0.
  /// Effects that it lacks have magnitudes of 0, and shape parameters in mid-prior.
  Eigen::VectorXd start(const model::Vehicle& vehicle) const;
  Eigen::VectorXd start() const { return start(uncertain_->nominal()); }
  /// The nearest coordinates within the accepted ranges; for a parameter, the range is a few prior standard deviations.
  Eigen::VectorXd bounded(Eigen::VectorXd coordinates) const;

  /// The vehicle at these coordinates, as replay takes it, with the minor draws of `uncertain`. `minor`: a minor draw
  /// to move: its index among all draws, and by how many standard deviations.
  VehicleHypothesis vehicle(const Eigen::VectorXd& coordinates,
                            std::optional<std::pair<std::size_t, double>> minor = {}) const;

 private:
  const sim::Randomisation* uncertain_;
  std::vector<std::string> effects_;
  std::vector<Unknown> unknowns_;
};

/// Unknowns of an effect of the catalogue: its magnitudes, then its shape parameters, without those whose prior is a
/// single value.
std::vector<Unknown> unknowns_of(const model::CatalogueEffect& effect);
/// Unknowns of an effect of vehicles with wings and motors, by its identifier.
std::vector<Unknown> unknowns_of(const std::string& effect);

}  // namespace flappy::gap
