// Finds the most probable unknowns of a hypothesis: Gauss-Newton on the rows of whole flights. Derivatives are differences between vehicles that
// fly side by side as lanes of a batch.
#pragma once

#include <map>
#include <memory>

#include "gap/evidence/evidence.hpp"
#include "gap/evidence/hypothesis.hpp"

namespace flappy::gap {

/// Orthonormal directions through the coordinates of a hypothesis.
struct Directions {
  Eigen::MatrixXd axes;   ///< a column each
  Eigen::VectorXd reach;  ///< half the step of the difference along each
};

/// A hypothesis linearised at given coordinates, and its posterior there.
struct Fit {
  Eigen::VectorXd at;
  Directions directions;
  Residuals residual;               ///< empty: it was not flown, or the vehicle comes apart
  SufficientStatistics statistics;  ///< of the residual, averaged over points around
  std::vector<BasisCoefficients>
      columns;  ///< change of the prediction for a unit along each direction; empty: the vehicle comes apart there
  double law_factor = 1;  ///< by how much the laws of its effects deviate from the catalogue's (Fitter::law_sd)
  Posterior posterior;    ///< along the directions, relative to `at`
  bool flown() const { return !residual.empty(); }
  /// Of the coordinates.
  Eigen::VectorXd mean() const;
  Eigen::MatrixXd covariance() const;
};

/// Background magnitude of an effect: a regressor of standard normal coefficient.
struct Background {
  std::string effect;
  BasisCoefficients column;
};

/// Fits hypotheses to flights, given their evidence, nuisance regressors, and scales. Immutable: with_... return another.
class Fitter {
 public:
  /// Magnitudes by [effect, name].
  using LinearMagnitudes = std::map<std::pair<std::string, std::string>, BasisCoefficients>;

  /// Without nuisance regressors; scales are 1. `flights` are referred to.
  Fitter(const Flights& flights, std::shared_ptr<const Evidence> evidence, int threads);
  Fitter with_evidence(std::shared_ptr<const Evidence> evidence) const;
  /// Regressors that are fitted jointly with every hypothesis: nuisances, the same for every robot, then background magnitudes, also of effects that
  /// a hypothesis names. Those that the flights say nothing of, given `fit`, are left out.
  Fitter with_nuisances(const Regressors& nuisances, const std::vector<Background>& background, const Fit& fit) const;
  /// Magnitudes whose change is the same at any value, and need not be flown.
  Fitter with_linear_magnitudes(LinearMagnitudes magnitudes) const;
  Fitter with_scales(Scales scales) const;

  const Evidence& evidence() const { return *evidence_; }
  const Scales& scales() const { return scales_; }
  /// Names of Scales::effects.
  const std::vector<std::string>& effects() const { return effects_; }
  /// Place of an effect in Scales::effects; -1: none.
  int place_of(const std::string& effect) const;
  std::vector<char> all_flights() const { return std::vector<char>(flights_->size(), 1); }

  /// Posterior of a nuisance regressor, given a fit.
  struct NuisanceEstimate {
    std::size_t place;  ///< among the nuisances as they were given
    double mean, sd;
  };
  /// Without those that the flights say nothing of.
  std::vector<NuisanceEstimate> nuisances(const Fit& fit) const;

  /// The columns of a fit, without those along which the vehicle comes apart.
  static Regressors own_regressors(const Fit& fit);
  /// Those, then nuisances and background magnitudes, with the scales of this robot. An effect that a hypothesis names has its background
  /// magnitude as well: its model may be off along the effect.
  Regressors regressors(const Fit& fit) const;
  /// The same with scales of 1.
  Regressors unscaled_regressors(const Fit& fit) const;

  /// Posterior along all directions of a fit by some flights alone. `use`: [flight].
  Posterior posterior(const Hypothesis& hypothesis, const Fit& fit, const std::vector<char>& use) const;
  /// The most probable coordinates by some flights alone, and what nuisance regressors then explain.
  struct JointFit {
    Eigen::VectorXd at;
    BasisCoefficients nuisances;
  };
  JointFit joint_fit(const Hypothesis& hypothesis, const Fit& fit, const std::vector<char>& use,
                     bool with_background = true) const;
  /// Standard deviation, [group][basis], of what the laws of effects that act by the place may deviate from the catalogue's.
  BasisCoefficients law_sd(const Hypothesis& hypothesis, const Fit& fit) const {
    return law_sd(hypothesis, fit, fit.law_factor);
  }
  BasisCoefficients law_sd(const Hypothesis& hypothesis, const Fit& fit, double law_factor) const;
  /// Whether one of its effects acts by the place.
  bool acts_by_place(const Hypothesis& hypothesis, const Fit& fit) const;

  /// Without a posterior. `known`: columns of the first directions, which need not be flown.
  Fit linearise(const Hypothesis& hypothesis, const Eigen::VectorXd& at, Directions directions,
                const std::vector<BasisCoefficients>& known = {}) const;
  /// Every coordinate.
  static Directions axes(const Hypothesis& hypothesis);
  /// At most `max_iterations` linearisations from `start` on. Not flown where the vehicle comes apart at once.
  Fit fit(const Hypothesis& hypothesis, Eigen::VectorXd start, int max_iterations) const;
  /// The same with the directions and columns of the parameters of another fit.
  Fit fit_given(const Hypothesis& hypothesis, const Eigen::VectorXd& start, const Fit& parameters,
                int max_iterations) const;
  /// The effects alone, with the parameters where another fit has them: so all effects are compared by the same columns.
  Fit fit_effects(const Hypothesis& hypothesis, const Eigen::VectorXd& start, const Fit& parameters) const;
  /// On from another fit, along its directions.
  Fit refit(const Hypothesis& hypothesis, const Fit& before, int max_iterations) const;
  /// On from another fit, along its directions, without background magnitudes.
  Fit refit_without_background(const Hypothesis& hypothesis, const Fit& before) const;
  /// Without a residual: linear in the unknowns of the effects, from magnitudes as the vehicle file has them. `effects`: columns of these
  /// unknowns; empty: not seen.
  Fit fit_linear(const Hypothesis& hypothesis, const Fit& parameters,
                 const std::vector<BasisCoefficients>& effects) const;

 private:
  std::map<std::string, BasisCoefficients> changes(const Hypothesis& hypothesis, const Fit& fit) const;
  BasisCoefficients law_sd_of(const BasisCoefficients& change, double law_factor) const;
  BasisCoefficients discrepancy_sd(const Hypothesis& hypothesis, const Fit& fit) const;
  /// Null: the direction is not a linear magnitude.
  const BasisCoefficients* linear_column(const Hypothesis& hypothesis, Eigen::Index direction) const;
  static Directions joint_directions(const Hypothesis& hypothesis, const Fit& parameters);
  static std::vector<BasisCoefficients> shared_columns(const Hypothesis& hypothesis, const Fit& parameters);
  static Directions principal(const Hypothesis& hypothesis, const Fit& fit);
  Fit improve(const Hypothesis& hypothesis, Fit fit, int max_iterations, const Fit* parameters,
              bool columns_are_here) const;
  std::vector<Eigen::VectorXd> around(const Hypothesis& hypothesis, const Eigen::VectorXd& at,
                                      const Directions& directions, const std::vector<BasisCoefficients>& known,
                                      std::vector<VehicleHypothesis>& vehicles) const;
  void average(const std::vector<Residuals>& rows, const std::vector<Eigen::VectorXd>& shifts, Fit& fit) const;
  Reduced reduce(const Fit& fit, const Regressors& regressors) const;
  Posterior solve(const Fit& fit, const Regressors& regressors, Reduced reduced, double damping = 0) const;
  double cost(const Regressors& nuisances, const Eigen::MatrixXd& sums, const SufficientStatistics& residual,
              const Eigen::VectorXd& at) const;

  /// A nuisance regressor or a background magnitude.
  struct Nuisance {
    BasisCoefficients column, scaled;
    double prior_mean;
    int effect;  ///< in effects_; -1: none
    ScalePrior prior;
  };
  void add_nuisances(bool scaled, Regressors& to) const;

  const Flights* flights_;
  std::shared_ptr<const Evidence> evidence_;
  int threads_;
  Scales scales_;
  LinearMagnitudes linear_;
  std::vector<Nuisance> nuisances_;
  std::vector<std::size_t> places_;  ///< of the nuisances that come first and belong to no effect, as they were given
  std::vector<std::string> effects_;
};

}  // namespace flappy::gap
