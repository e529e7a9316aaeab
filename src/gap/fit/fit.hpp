// Finds the most probable unknowns of a hypothesis by Gauss-Newton on whole flights. Derivatives are differences
// between vehicles that are simulated together, as lanes of a batch.
//
// Coordinates are those of a hypothesis (hypothesis.hpp), in prior standard deviations: [0, shared()) are the
// parameters and the lag of the sensors, then come the unknowns of its effects. Evidence is in nats.
//
//   function     parameters  effects    who calls it, and when
//   linearise    stay        stay       all fits, for columns at a point; the next experiment, for what rivals predict
//   fit          move        move       RobotFit, for the robot's parameters; Alone, again for the corrected vehicle
//   refit        move        move       RobotFit, once noise, scales or nuisance regressors are known better
//   fit_linear   linear      linear     EffectFits, for effects that screening found too little of to simulate
//   fit_effects  linear      move       Question::fit_set of Alone and Contrast, for sets of effects; learn_discrepancy
//   fit_given    move        move       Question::refit_jointly of Alone, for the best effects; fit_set of BeatAveraged
//   joint_fit    linear      linear     after one of these: flights held out, corrected vehicle, changes of sessions
//
// "linear": their posterior follows from the columns, the derivatives; nothing is simulated for it.
#pragma once

#include <map>
#include <memory>

#include "gap/evidence/evidence.hpp"
#include "gap/fit/fit_rules.hpp"
#include "gap/fit/hypothesis.hpp"

namespace flappy::gap {

/// Orthonormal directions through the coordinates of a hypothesis, in prior standard deviations.
struct Directions {
  Eigen::MatrixXd axes;   ///< [coordinate][direction]
  Eigen::VectorXd reach;  ///< [direction] distance from the point to each side of the difference
};

/// [group][basis] A column that copies share: the fits of a robot's hypotheses have those of its parameters in common.
class SharedColumn {
 public:
  SharedColumn(BasisCoefficients column = {})  // NOLINT(google-explicit-constructor): stands wherever a column does
      : column_(std::make_shared<const BasisCoefficients>(std::move(column))) {}
  operator const BasisCoefficients&() const { return *column_; }  // NOLINT(google-explicit-constructor)
  const BasisCoefficients& operator*() const { return *column_; }
  Eigen::Index size() const { return column_->size(); }

 private:
  std::shared_ptr<const BasisCoefficients> column_;
};

/// A hypothesis linearised at given coordinates, and its posterior there.
struct Fit {
  Eigen::VectorXd at;  ///< [coordinate]
  Directions directions;
  Residuals residual;               ///< [flight] measured less predicted at `at`; empty: not simulated, or it diverged
  SufficientStatistics statistics;  ///< statistics of the residual, averaged over points around `at`
  /// [direction][group][basis] change of the prediction per unit along the direction; empty if the simulation diverges
  /// there.
  std::vector<SharedColumn> columns;
  double law_factor = 1;  ///< factor on how far the laws of its effects may deviate from the catalogue's (law_sd)
  Posterior posterior;    ///< [direction], relative to `at`; its log evidence is with the fitter's scales, in nats
  bool flown() const { return !residual.empty(); }
  /// Posterior mean, [coordinate], and covariance of the coordinates.
  Eigen::VectorXd mean() const;
  Eigen::MatrixXd covariance() const;
};

/// Background magnitude of an effect, as a regressor. A priori its coefficient is standard normal, times a scale
/// (Scales::effects). In a contrast also a change between sessions (RobotFit::session_changes).
struct Background {
  /// By how much the column moves the coordinate of an unknown. `unknown`: index among the unknowns of `effect`; if
  /// that is "", among those that all hypotheses share.
  struct Move {
    std::string effect;
    Eigen::Index unknown;
    double by;
  };
  std::string effect;            ///< name of its scale: an effect, perhaps with kOfBoth, kModelOf or kSessionOf
  BasisCoefficients column;      ///< [group][basis]
  std::vector<Move> moves = {};  ///< empty: the column belongs to no unknown, as that of a shape or sensor
};

/// Fits hypotheses, given evidence, nuisance regressors and scales. Immutable: with_... return a changed copy.
class Fitter {
 public:
  /// [effect, name] Columns of magnitudes: change of the prediction per prior standard deviation.
  using LinearMagnitudes = std::map<std::pair<std::string, std::string>, BasisCoefficients>;

  /// Without nuisance regressors; scales are 1. Keeps references to `rules` and `flights`.
  Fitter(const FitRules& rules, const Flights& flights, std::shared_ptr<const Evidence> evidence, int threads);
  Fitter with_evidence(std::shared_ptr<const Evidence> evidence) const;
  /// A fitter that fits `nuisances` and `background`, in this order, jointly with every hypothesis. A hypothesis keeps
  /// the background of its own effects, too. The fitter leaves out a regressor if the flights carry no information on
  /// it, by the columns of `fit`.
  Fitter with_nuisances(const Regressors& nuisances, const std::vector<Background>& background, const Fit& fit) const;
  /// A fitter with these columns of magnitudes, which act linearly and are not simulated.
  Fitter with_linear_magnitudes(LinearMagnitudes magnitudes) const;
  Fitter with_scales(Scales scales) const;
  Fitter without_background() const;

  const FitRules& rules() const { return *rules_; }
  const Flights& flights() const { return *flights_; }
  int threads() const { return threads_; }
  const Evidence& evidence() const { return *evidence_; }
  const Scales& scales() const { return scales_; }
  /// [index in Scales::effects] Names.
  const std::vector<std::string>& effects() const { return effects_; }
  /// Index of a name in effects(), so in Scales::effects; -1: none.
  int place_of(const std::string& effect) const;
  std::vector<char> all_flights() const { return std::vector<char>(flights_->size(), 1); }

  struct NuisanceMean {
    std::size_t place;  ///< index in `nuisances` of with_nuisances, followed by `background`
    double mean;        ///< posterior mean of the coefficient of the column given to with_nuisances
  };
  /// Posterior of a nuisance regressor, given a fit.
  struct NuisanceEstimate : NuisanceMean {
    double sd;
  };
  /// Posteriors of the errors of sensors and the minor draws that were not left out; none of background magnitudes.
  std::vector<NuisanceEstimate> nuisances(const Fit& fit) const;

  /// The columns of a fit, without empty ones.
  static Regressors own_regressors(const Fit& fit);
  /// The posterior along the fit's directions, out of `posterior`, which is of own_regressors() and then others.
  /// Directions without a column keep their prior.
  static Posterior of_directions(const Fit& fit, const Posterior& posterior);
  /// The columns of a fit, then nuisances and background magnitudes with the fitter's scales. An effect of the
  /// hypothesis keeps its background, as the model may have errors that look like the effect.
  Regressors regressors(const Fit& fit) const;
  /// As regressors(), with scales of 1.
  Regressors unscaled_regressors(const Fit& fit) const;

  /// Posterior along all directions of a fit, from some flights alone. `use`: [flight] whether it counts.
  Posterior posterior(const Hypothesis& hypothesis, const Fit& fit, const std::vector<char>& use) const;
  /// Result of joint_fit(), which solves the linear model of a fit and simulates nothing. The flights in `use` determine
  /// the coordinates and the nuisances. The corrected vehicle, and the changes of a contrast, use all flights.
  struct JointFit {
    Eigen::VectorXd at;               ///< [coordinate] within the accepted ranges
    BasisCoefficients nuisances;      ///< [group][basis]
    std::vector<NuisanceMean> means;  ///< left out: regressors that the flights have no information on
  };
  JointFit joint_fit(const Hypothesis& hypothesis, const Fit& fit, const std::vector<char>& use) const;
  /// [group][basis] The part of a fit's residual that all regressors and delta together explain, learnt from the
  /// flights in `use` alone. In a contrast it contains changes of the parameters, errors of the model in both sessions,
  /// and differences between sessions. Effects follow the laws of the catalogue. Contrast predicts flights held out
  /// with it.
  BasisCoefficients explained(const Fit& fit, const std::vector<char>& use) const;
  /// Standard deviation, [group][basis], of the deviations of effects from the catalogue's laws.
  BasisCoefficients law_sd(const Hypothesis& hypothesis, const Fit& fit) const {
    return law_sd(hypothesis, fit, fit.law_factor);
  }
  BasisCoefficients law_sd(const Hypothesis& hypothesis, const Fit& fit, double law_factor) const;
  /// The same for one effect. `change`: [group][basis] what it adds to the prediction.
  BasisCoefficients law_sd_of(const std::string& effect, const BasisCoefficients& change, double law_factor) const {
    return rules_->law_sd(*evidence_, effect, change, law_factor);
  }
  /// Whether the law of any effect of the hypothesis may deviate.
  bool law_may_deviate(const Hypothesis& hypothesis, const Fit& fit) const;
  /// Standard deviation, [group][basis], of delta, with the fitter's scales, and deviations of laws together.
  BasisCoefficients discrepancy_sd(const Hypothesis& hypothesis, const Fit& fit) const;

  /// Returns a fit without a posterior: simulates the vehicle at `at` and at both sides of each direction. No
  /// directions: only the residual. `known`: columns of the first directions, which are not simulated again. Not
  /// flown() if the simulation at `at` diverges. `forward`: simulates one side alone, and no points around `at`; for
  /// points on the way to the last one of a fit.
  Fit linearise(const Hypothesis& hypothesis, const Eigen::VectorXd& at, Directions directions,
                const std::vector<SharedColumn>& known = {}, bool forward = false) const;
  /// One direction for each coordinate, with the reach of first differences.
  static Directions axes(const Hypothesis& hypothesis);
  /// A fit from `start` on, [coordinate], where no columns are known yet. At most `max_iterations` iterations; 0 or 1:
  /// no step, only a posterior there. Not flown() if the simulation diverges at the start.
  Fit fit(const Hypothesis& hypothesis, Eigen::VectorXd start, int max_iterations) const;
  /// As fit(), but takes directions and columns of the parameters from `parameters`, their fit without effects. So only
  /// the effects' columns are simulated, and the fits of all effects share those of the parameters.
  Fit fit_given(const Hypothesis& hypothesis, const Eigen::VectorXd& start, const Fit& parameters,
                int max_iterations) const;
  /// Moves the effects alone, a few steps. The parameters stay at those of `parameters`; in the posterior they vary
  /// along its columns. The cheapest fit by simulation: every set of effects gets one.
  Fit fit_effects(const Hypothesis& hypothesis, const Eigen::VectorXd& start, const Fit& parameters) const;
  /// Continues the fit `before` from its point and residual on, with this fitter's evidence and nuisances. New columns
  /// go along the principal axes of the posterior so far.
  Fit refit(const Hypothesis& hypothesis, const Fit& before, int max_iterations) const;
  /// Returns a posterior around the magnitudes of the vehicle file, without a simulation and so without a residual.
  /// `effects`: [unknown of the effects] its column, from screening; an unknown with an empty column is not fitted.
  Fit fit_linear(const Hypothesis& hypothesis, const Fit& parameters,
                 const std::vector<BasisCoefficients>& effects) const;

 private:
  std::map<std::string, BasisCoefficients> changes(const Hypothesis& hypothesis, const Fit& fit) const;
  /// Null: the direction is not a linear magnitude.
  const BasisCoefficients* linear_column(const Hypothesis& hypothesis, Eigen::Index direction) const;
  static Directions joint_directions(const Hypothesis& hypothesis, const Fit& parameters);
  static std::vector<SharedColumn> shared_columns(const Hypothesis& hypothesis, const Fit& parameters);
  static Directions principal(const Hypothesis& hypothesis, const Fit& fit);
  /// Whether columns are of a fit's own point, and by which differences.
  enum class Columns { elsewhere, forward, central };
  Fit improve(const Hypothesis& hypothesis, Fit fit, int max_iterations, const Fit* parameters, Columns columns) const;
  std::vector<Eigen::VectorXd> around(const Hypothesis& hypothesis, const Eigen::VectorXd& at,
                                      const Directions& directions, const std::vector<SharedColumn>& known,
                                      std::vector<VehicleHypothesis>& vehicles) const;
  void average(std::vector<SufficientStatistics> around, const std::vector<Eigen::VectorXd>& shifts, Fit& fit) const;
  Reduced reduce(const Fit& fit, const Regressors& regressors) const;
  Posterior solve(const Fit& fit, const Regressors& regressors, Reduced reduced, double damping = 0) const;

  struct Nuisance {
    SharedColumn column;
    double prior_mean;
    int effect;  ///< in effects_; -1: none
    ScalePrior prior;
    std::size_t place;  ///< as NuisanceMean::place
    double scale = 1;
    SharedColumn scaled = {};
  };
  void add_nuisances(bool scaled, Regressors& to) const;

  const FitRules* rules_;
  const Flights* flights_;
  std::shared_ptr<const Evidence> evidence_;
  int threads_;
  Scales scales_;
  LinearMagnitudes linear_;
  std::vector<Nuisance> nuisances_;
  std::vector<std::string> effects_;
};

}  // namespace flappy::gap
