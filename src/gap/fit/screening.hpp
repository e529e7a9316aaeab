// Screening: the evidence that each effect of the catalogue would gain jointly with a fit, by linear models. It finds
// which effects are worth a fit by simulation (answer/effect_fits.cpp), and what a plan expects (next/separation.cpp).
// Only the vehicles of magnitude_steps() are simulated, once for each robot (RobotFit).
#pragma once

#include "gap/fit/fit.hpp"

namespace flappy::gap {

struct Magnitude {
  std::string effect;
  Eigen::Index unknown, unknowns;  ///< index among the effect's unknowns, and their number
  bool one_sided;                  ///< cannot be negative
  double from;                     ///< coordinate in the vehicle file
};

struct MagnitudeStep : Magnitude {
  VehicleHypothesis vehicle;               ///< one step, kMagnitudeReach, away
  std::vector<VehicleHypothesis> shaped;   ///< one step away, with one shape parameter a standard deviation away
  std::vector<VehicleHypothesis> further;  ///< two to kMaxSteps steps away; only if one_sided
  double near_reach;                       ///< about as large as background magnitudes become
  std::vector<VehicleHypothesis> near;     ///< near_reach away: above and, unless one_sided, below
};
/// Number of steps along a magnitude of one sign. Choice.
inline constexpr std::size_t kMaxSteps = 5;
/// Length of such a step, in prior standard deviations. Choice.
inline constexpr double kMagnitudeReach = 0.4;
/// Effects whose change is at most this are not seen. Choice: less is rounding.
inline constexpr double kNoChange = 1e-9;

/// Steps for each effect but `withheld`, with shape parameters in mid-prior. `at`: [coordinate] parameters of the
/// robot, [0, shared()). `background`: reach of near steps; null: no near and no shaped steps.
std::vector<MagnitudeStep> magnitude_steps(const sim::Randomisation& uncertain, const Eigen::VectorXd& at,
                                           const std::vector<std::string>& withheld,
                                           const ModelDiscrepancy* background = nullptr);

/// Change of the prediction for a unit of a magnitude's coordinate, near its value in the vehicle file.
struct MagnitudeColumn : Magnitude {
  BasisCoefficients change;
  /// Change per unit at background magnitudes, above and below: small magnitudes may act differently.
  std::vector<BasisCoefficients> near;
  /// Change at large magnitudes, where the effect is not linear: a delay of a third of a beat acts unlike a small one.
  struct Large {
    double at;                        ///< coordinate less that of the vehicle file
    BasisCoefficients chord, change;  ///< per unit: mean on the way to `at`; local at `at`
  };
  std::vector<Large> large;
};

/// An effect with its magnitudes at their most probable values, shape parameters in mid-prior.
struct ScreenedEffect {
  std::string effect;
  double gain = 0;  ///< log evidence with the effect less that of the fit alone, nats; no penalty for chance
  Eigen::VectorXd coordinates;  ///< [unknown of the effect]
};

/// Screens each effect that has columns; the largest gain first. The columns of one effect have to be consecutive.
/// `law_sd`: [group][basis] standard deviation of what the law of the robot's effect deviates by; empty: 0.
std::vector<ScreenedEffect> screen(const Fitter& fitter, const Fit& fit, const std::vector<MagnitudeColumn>& columns,
                                   const BasisCoefficients& law_sd = {});

}  // namespace flappy::gap
