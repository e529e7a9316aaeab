// Fits a vehicle's parameters to a robot's flights, and learns what later fits share: noise, scales of the model
// discrepancy, nuisance regressors, and the change by each magnitude of the catalogue. In a contrast it fits no
// parameters: it linearises around those of the references. Diagnoses, plans and learning begin with it.
#pragma once

#include "gap/fit/screening.hpp"

namespace flappy::gap {

/// The lag, or an error of a declared sensor, as flights show it.
struct SensorFinding {
  /// For example "imu_mounting.x_rad", "imu.latency_s", of a beat-averaged vehicle "command.delay_s".
  std::string name;
  double value, sd;  ///< posterior mean and standard deviation, in the unit of the name
  double prior_sd;
};

class RobotFit {
 public:
  /// The whole fit, of flights that are no contrast. Keeps references to `rules` and `flights`, as all others do, but
  /// copies `uncertain`. `withheld`: effects to leave out; `threads`: as for io::parallel_for. io::InputError, from
  /// here and the others, if a flight has other streams, or the simulation of the vehicle file or of the parameters
  /// diverges.
  RobotFit(const FitRules& rules, const Flights& flights, const sim::Randomisation& uncertain,
           const ModelDiscrepancy& discrepancy, std::vector<std::string> withheld, int threads);
  /// Fits the parameters alone, to flights without tests, for a contrast with tests. What the model gets wrong needs no
  /// description, as far as it is the same in references and tests. Without columns of magnitudes and nuisances.
  static RobotFit of_references(const FitRules& rules, const Flights& flights, const sim::Randomisation& uncertain,
                                const ModelDiscrepancy& discrepancy, std::vector<std::string> withheld, int threads);
  /// A contrast: `flights` has the references of `reference`, and test flights of the same robot. Fits no parameters:
  /// linearises around those of `reference`. An effect's magnitude acts in the test flights alone.
  RobotFit(const FitRules& rules, const RobotFit& reference, const Flights& flights);
  /// For flights like those that are planned: fits nothing, and takes the vehicle file, the declared noise and the
  /// prior scales of what models get wrong.
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
  /// The vehicle file under the same noise; without columns and posterior, but for RobotFit::planned.
  const Fit& nominal() const { return nominal_; }
  /// Magnitudes of all effects but withheld ones, those of an effect together; without any whose simulation diverges,
  /// and without the tether unless each test flight has a ground.
  const std::vector<MagnitudeColumn>& magnitudes() const { return magnitudes_; }

  /// Background magnitudes of all effects: one for each magnitude and, if it may be negative, for each side of the
  /// file's value. An effect with a magnitude for each wing has two: the difference of the wings, and the part that
  /// both share (kOfBoth), as an error of a wing model is the same in both. `shapes`: also what another shape parameter
  /// changes.
  std::vector<Background> background(const ModelDiscrepancy& discrepancy, bool shapes) const;
  /// What may change between sessions in which nothing that matters changes: parameters and errors of sensors (all
  /// named kSessionParameters), and each effect's magnitudes (kSessionOf and the effect's name). Only in a contrast;
  /// they act in the test flights alone.
  std::vector<Background> session_changes(const SessionVariation& session) const;
  /// Change of the prediction by one prior sd of each error of declared sensors, then of each minor draw of the vehicle
  /// that FitRules::minors counts. Refers to columns of this object.
  Regressors nuisance_regressors() const;
  /// Nats by which an effect's magnitudes are more probable as those of an effect, a priori, than as its background;
  /// Alone credits the rest to hypotheses without the effect. `magnitudes`: [magnitude of the effect] in prior standard
  /// deviations.
  double beyond_background(const std::string& effect, const Eigen::VectorXd& magnitudes, const Scales& scales) const;
  /// [minor draw] Variates of the minor draws given a joint fit of all flights, for sim::Randomisation::set_minors.
  std::vector<double> minors_given(const Fitter::JointFit& joint) const { return minors_moved_by(joint.means); }
  /// The lag of the sensors, then each error of declared sensors on which the flights have information, given a fit of
  /// `hypothesis`. `fitter`: with the scales that the verdict uses.
  std::vector<SensorFinding> sensors(const Fitter& fitter, const Hypothesis& hypothesis, const Fit& fit) const;

  /// Evidence of a hypothesis with its own scales, searched from `start` and once more with prior scales of its
  /// effects' backgrounds; then with the most probable law factor, if the law of an effect may deviate. The priors of
  /// scales and law factor count. `unknown_penalty_nats`: as in Evidence::weigh.
  ScaledEvidence weigh(const Hypothesis& hypothesis, const Fit& fit, const Scales& start,
                       std::optional<double> unknown_penalty_nats = {}) const;
  /// As fitter(), with the priors of another model discrepancy; for contrasts.
  Fitter fitter_given(const ModelDiscrepancy& discrepancy) const;
  /// Scales given a fit: searched from `start`, then from a larger background of one effect while the evidence grows.
  Scales find_scales(const Hypothesis& hypothesis, const Fit& fit, const Scales& start) const;
  /// The scales with the background of one effect larger, where that gains most; none if no effect gains two nats.
  std::optional<Scales> larger_background(const Hypothesis& hypothesis, const Fit& fit, const Scales& now) const;

  // for FitRules::describe_rest
  /// Starts the next fits with all background magnitudes larger: parameters fitted with small ones make up for a large
  /// one.
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
