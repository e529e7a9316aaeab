// Screening estimates by linear models how much evidence each effect of the catalogue would gain, fitted jointly with
// the regressors of a fit. It tells which effects are worth a fit by simulation (answer/effect_fits.cpp), and what a
// plan expects (next/separation.cpp). Only the vehicles of magnitude_steps() are simulated, once for each robot
// (RobotFit).
#pragma once

#include "gap/fit/fit.hpp"

namespace flappy::gap {

struct Magnitude {
  std::string effect;
  Eigen::Index unknown, unknowns;  ///< index among the effect's unknowns, and number of these
  bool one_sided;                  ///< cannot be negative
  double from;                     ///< coordinate in the vehicle file
};

/// The vehicles that RobotFit simulates for one magnitude.
struct MagnitudeStep : Magnitude {
  VehicleHypothesis vehicle;               ///< one step, kMagnitudeReach, above the vehicle file's value
  std::vector<VehicleHypothesis> shaped;   ///< the same, each with one shape parameter a standard deviation up
  std::vector<VehicleHypothesis> further;  ///< two to kMaxSteps steps away; only if one_sided
  double near_reach;                       ///< two standard deviations of the background, 0.05 to kMagnitudeReach
  std::vector<VehicleHypothesis> near;     ///< near_reach above and, unless one_sided, below `from` (NearSteps)
};
/// Number of steps along a magnitude that cannot be negative. Choice.
inline constexpr std::size_t kMaxSteps = 5;
/// Length of such a step, in prior standard deviations. Choice.
inline constexpr double kMagnitudeReach = 0.4;
/// Effects none of whose coefficients changes by more than this are not seen. Choice: less is rounding.
inline constexpr double kNoChange = 1e-9;

/// Steps for each effect but `withheld`, with shape parameters in mid-prior. `at`: [coordinate] parameters of the
/// robot, [0, shared()).
std::vector<MagnitudeStep> magnitude_steps(const sim::Randomisation& uncertain, const Eigen::VectorXd& at,
                                           const std::vector<std::string>& withheld, const NearSteps& near = {});

/// How a magnitude changes the prediction, per unit of its coordinate; [group][basis] each. RobotFit makes it of a
/// MagnitudeStep.
struct MagnitudeColumn : Magnitude {
  BasisCoefficients change;  ///< mean slope over the first step from the value in the vehicle file
  /// Mean slopes over the small steps MagnitudeStep::near: the one above the file's value, then the one below it, if
  /// that was simulated. A small magnitude, such as that of a background, may have another slope than a large one.
  /// Contains `change` alone if no small step was simulated.
  std::vector<BasisCoefficients> near;
  /// At large magnitudes, where the effect is not linear: a delay of a third of a beat acts unlike a small one.
  struct Large {
    double at;                        ///< coordinate less that of the vehicle file
    BasisCoefficients chord, change;  ///< mean slope from the vehicle file's value to `at`; slope at `at`
  };
  std::vector<Large> large;
};

/// An effect with its magnitudes at their most probable values, shape parameters in mid-prior.
struct ScreenedEffect {
  std::string effect;
  double gain = 0;  ///< log evidence with the effect less that of the fit alone, nats; no penalty for chance
  Eigen::VectorXd coordinates;  ///< [unknown of the effect]
};

/// Screens each effect of `columns` alone, jointly with the regressors of `fit`. Returns them with the largest gain
/// first. The columns of one effect have to be consecutive. `law_sd`: [group][basis] standard deviation of the
/// deviations of the law of the robot's effect; empty: 0.
std::vector<ScreenedEffect> screen(const Fitter& fitter, const Fit& fit, const std::vector<MagnitudeColumn>& columns,
                                   const BasisCoefficients& law_sd = {});

}  // namespace flappy::gap
