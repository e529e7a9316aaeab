// Fits a vehicle's parameters to a robot's flights, and learns what later fits share: noise, scales of the model
// discrepancy, nuisance regressors, and what each magnitude of the catalogue changes in the prediction. In a contrast
// it fits no parameters: it linearises around those of the references. Diagnoses, plans and learning begin with it.
#pragma once

#include "gap/fit/screening.hpp"

namespace flappy::gap {

/// The lag, or an error of a declared sensor, as flights show it.
struct SensorFinding {
  /// For example "imu_mounting.x_rad", "imu.latency_s"; for a beat-averaged vehicle, "command.delay_s".
  std::string name;
  double value, sd;  ///< posterior mean and standard deviation, in the unit of the name
  double prior_sd;
};

class RobotFit {
 public:
  /// The whole fit, to flights that are no contrast. `withheld`: effects to leave out; `threads`: as for
  /// io::parallel_for. This and all other ways to make a RobotFit keep references to `rules` and `flights`, but copy
  /// `uncertain`; they throw io::InputError if flights have different streams, or if the simulation of the vehicle file
  /// or of the parameters diverges.
  RobotFit(const FitRules& rules, const Flights& flights, const sim::Randomisation& uncertain,
           const ModelDiscrepancy& discrepancy, std::vector<std::string> withheld, int threads);
  /// Fits the parameters alone, to references without tests, for a later contrast with tests. Errors of the model that
  /// are the same in references and tests cancel there, so the fit has no columns of magnitudes and nuisances.
  static RobotFit of_references(const FitRules& rules, const Flights& flights, const sim::Randomisation& uncertain,
                                const ModelDiscrepancy& discrepancy, std::vector<std::string> withheld, int threads);
  /// A contrast: `flights` has the references of `reference`, and test flights of the same robot. Fits no parameters:
  /// linearises around those of `reference`. An effect's magnitude acts in the test flights alone.
  RobotFit(const FitRules& rules, const RobotFit& reference, const Flights& flights);
  /// For a plan: `flights` are like those that are planned. Fits nothing, and takes the vehicle file, the declared
  /// noise and the prior scales of the model discrepancy.
  static RobotFit planned(const FitRules& rules, const Flights& flights, const sim::Randomisation& uncertain,
                          const ModelDiscrepancy& discrepancy, int threads);
  RobotFit(const RobotFit&) = delete;
  RobotFit& operator=(const RobotFit&) = delete;

  const Evidence& evidence() const { return fitter_.evidence(); }
  /// With the scales that the parameters alone have.
  const Fitter& fitter() const { return fitter_; }
  const FitRules& rules() const { return fitter_.rules(); }
  /// With the minor draws at their estimates.
  const sim::Randomisation& uncertain() const { return uncertain_; }
  const Hypothesis& no_effects() const { return no_effects_; }
  const Fit& parameters() const { return parameters_; }
  /// The vehicle file under the same noise; without a posterior and, except in RobotFit::planned, without columns.
  const Fit& nominal() const { return nominal_; }
  /// Columns of the magnitudes of all effects, those of one effect next to each other. Left out are withheld effects,
  /// magnitudes whose simulation diverges, and the tether unless each test flight has a ground.
  const std::vector<MagnitudeColumn>& magnitudes() const { return magnitudes_; }

  /// Background magnitudes of all effects: one for each magnitude or, if it may be negative, one for each side of the
  /// file's value. An effect with a magnitude for each wing has two: the difference of the wings, and the part that
  /// both share (kOfBoth), as an error of a wing model is the same in both. Each is apart in flight and on a bench
  /// (kOnBench) if there are both. `shapes`: also what a move of each shape parameter changes.
  std::vector<Background> background(const ModelDiscrepancy& discrepancy, bool shapes) const;
  /// Changes between sessions though nothing that matters has changed: of parameters and errors of sensors (all named
  /// kSessionParameters), and of each effect's magnitudes (kSessionOf and the effect's name). They act in the test
  /// flights alone. Only in a contrast.
  std::vector<Background> session_changes(const SessionVariation& session) const;
  /// Change of the prediction by one prior sd of each error of declared sensors, then of each minor draw of the vehicle
  /// that FitRules::minors counts. Refers to columns of this object.
  Regressors nuisance_regressors() const;
  /// By how many nats these magnitudes are more probable, a priori, as those of the effect than as its background.
  /// Alone credits the effect's evidence less these nats to hypotheses without it. `magnitudes`: [magnitude of the
  /// effect] in prior standard deviations.
  double beyond_background(const std::string& effect, const Eigen::VectorXd& magnitudes, const Scales& scales) const;
  /// [minor draw] Variates of the minor draws given a joint fit of all flights, for sim::Randomisation::set_minors.
  std::vector<double> minors_given(const Fitter::JointFit& joint) const { return minors_moved_by(joint.means); }
  /// The lag of the sensors, then each error of declared sensors on which the flights have information, given a fit of
  /// `hypothesis`. `fitter`: with the scales that the verdict uses.
  std::vector<SensorFinding> sensors(const Fitter& fitter, const Hypothesis& hypothesis, const Fit& fit) const;

  /// Evidence of a hypothesis with its own scales, and with the most probable law factor if the law of an effect may
  /// deviate. It includes the priors of both. The scales are searched from `start` and from priors of some of them;
  /// the best ones count. `unknown_penalty_nats`: as in Evidence::weigh.
  ScaledEvidence weigh(const Hypothesis& hypothesis, const Fit& fit, const Scales& start,
                       std::optional<double> unknown_penalty_nats = {}) const;
  /// As fitter(), with the priors of another model discrepancy; for contrasts.
  Fitter fitter_given(const ModelDiscrepancy& discrepancy) const;
  /// The scales of weigh(), searched from `start`, then from a larger background of one effect as long as the evidence
  /// grows.
  Scales find_scales(const Hypothesis& hypothesis, const Fit& fit, const Scales& start) const;
  /// The scales `now` with a larger background of the one effect that gains most; none if no effect gains two nats.
  std::optional<Scales> larger_background(const Hypothesis& hypothesis, const Fit& fit, const Scales& now) const;

  // for FitRules::describe_rest
  /// Makes the scales of all background magnitudes larger for the next fits. With small scales the parameters would
  /// make up for a large background.
  void widen_backgrounds();
  /// Takes as noise what all magnitudes of the catalogue together leave of the residual.
  void learn_rest_as_noise();

 private:
  /// planned: fits nothing; parameters: fits them alone; all: fits them with all nuisances.
  enum class Extent { planned, parameters, all };
  RobotFit(Extent extent, const FitRules& rules, const Flights& flights, const sim::Randomisation& uncertain,
           const ModelDiscrepancy& discrepancy, std::vector<std::string> withheld, int threads);
  void fit_parameters();
  void linearise_around(const Fit& parameters);
  void find_nuisance_columns();
  void refit_with_nuisances();
  void find_magnitudes();
  void find_linear_magnitudes();
  void find_nuisances();
  void set_nuisances();
  bool refit_with_minors();
  /// The minor draws moved by the means of their nuisance regressors. `means`: of Fitter::NuisanceMean.
  template <class Means>
  std::vector<double> minors_moved_by(const Means& means) const {
    std::vector<double> minors = uncertain_.minors();
    for (const Fitter::NuisanceMean& n : means)
      if (n.place >= sensor_errors_.size() && n.place < sensor_errors_.size() + minors_.size())
        minors[n.place - sensor_errors_.size()] += n.mean;
    return minors;
  }
  void take_scales() { fitter_ = fitter_.with_scales(find_scales(no_effects_, parameters_, fitter_.scales())); }
  void take_evidence(Evidence evidence) {
    fitter_ = fitter_.with_evidence(std::make_shared<const Evidence>(std::move(evidence)));
  }
  /// Where weigh() also begins: with the backgrounds of the effects of `hypothesis` at their prior scales; in a contrast,
  /// also with those of the test flights and of all backgrounds.
  std::vector<Scales> further_starts(const Hypothesis& hypothesis, const Scales& start) const;
  BasisCoefficients change(Residuals there, double steps) const;  ///< [group][basis]

  const Flights& flights_;
  sim::Randomisation uncertain_;
  std::vector<std::string> withheld_;
  int threads_;
  Fitter fitter_;
  Hypothesis no_effects_;
  Fit nominal_, parameters_;
  std::vector<MagnitudeColumn> magnitudes_, shapes_;
  std::vector<BasisCoefficients> sensor_errors_, minors_;
};

}  // namespace flappy::gap
