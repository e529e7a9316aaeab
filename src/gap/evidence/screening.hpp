// What each effect of the catalogue would explain beside a fit, as far as a linear model shows.
#pragma once

#include "gap/evidence/fit.hpp"

namespace flappy::gap {

/// A magnitude of an effect.
struct Magnitude {
  std::string effect;
  Eigen::Index unknown, unknowns;  ///< which of the effect's unknowns, and how many it has
  bool one_sided;
  double from;  ///< coordinate in the vehicle file
};

/// Vehicles that differ from the fitted one in a magnitude.
struct MagnitudeStep : Magnitude {
  VehicleHypothesis vehicle;               ///< kMagnitudeReach away
  std::vector<VehicleHypothesis> shaped;   ///< the same with each shape parameter a standard deviation away
  std::vector<VehicleHypothesis> further;  ///< of one sign: two steps away, three, .. kMaxSteps
  double near_reach;                       ///< about as far as vehicles without the effect go
  std::vector<VehicleHypothesis> near;     ///< there: above and, where it may be negative, below
};
inline constexpr std::size_t kMaxSteps = 5;
inline constexpr double kMagnitudeReach = 0.4;

/// For each effect of the catalogue but `withheld`, at the given coordinates of the parameters, with shape parameters in the middle of their
/// prior. `background`: for steps as near as a vehicle without the effect; null: none.
std::vector<MagnitudeStep> magnitude_steps(const sim::Randomisation& uncertain, const Eigen::VectorXd& at,
                                           const std::vector<std::string>& withheld,
                                           const ModelDiscrepancy* background = nullptr);

/// Change of the prediction for a unit of a magnitude's coordinate, near the vehicle file's.
struct MagnitudeColumn : Magnitude {
  BasisCoefficients change;
  /// At background magnitudes, above and below: there a wing lands on its stop in another way.
  std::vector<BasisCoefficients> near;
  /// Where the magnitude is large, as a delay of a third of a beat turns the change of a small one.
  struct Large {
    double at;                        ///< coordinate beyond the file's
    BasisCoefficients chord, change;  ///< on the way there, and there
  };
  std::vector<Large> large;
};

struct ScreenedEffect {
  std::string effect;
  double gain = 0;              ///< evidence, nats
  Eigen::VectorXd coordinates;  ///< of its unknowns
};

/// Each effect that has columns, the largest gain first. Columns of one effect follow each other.
std::vector<ScreenedEffect> screen(const Fitter& fitter, const Fit& fit, const std::vector<MagnitudeColumn>& columns);

}  // namespace flappy::gap
