// Fits a vehicle's parameters to a robot's flights, and learns what later fits share: noise, scales of the model
// discrepancy, nuisance regressors, and the change by each magnitude of the catalogue.
#pragma once

#include "gap/fit/screening.hpp"

namespace flappy::gap {

struct SensorFinding {
  std::string
      name;  ///< for example "imu_mounting.x_rad", "imu.latency_s", of a beat-averaged vehicle "command.delay_s"
  double value, sd;
  double prior_sd;
};

class RobotFit {
 public:
  /// Fits; keeps references to `rules` and `flights`. `withheld`: effects to leave out; `threads`: as for
  /// io::parallel_for.
  RobotFit(const FitRules& rules, const Flights& flights, const sim::Randomisation& uncertain,
           const ModelDiscrepancy& discrepancy, std::vector<std::string> withheld, int threads);
  /// Fits the parameters alone, to flights without tests: what a model of this robot gets wrong cancels in a contrast, so it
  /// needs no further description.
  static RobotFit of_references(const FitRules& rules, const Flights& flights, const sim::Randomisation& uncertain,
                                const ModelDiscrepancy& discrepancy, std::vector<std::string> withheld, int threads);
  /// A contrast: `flights` has the references of `reference`, and test flights of the same robot. Linearises around the parameters of `reference`; an effect's magnitude acts in the test flights alone.
  RobotFit(const FitRules& rules, const RobotFit& reference, const Flights& flights);
  /// For flights like those that are planned: fits nothing, and takes the declared noise and the
  /// prior scales of what models get wrong.
  static RobotFit planned(const FitRules& rules, const Flights& flights, const sim::Randomisation& uncertain,
                          const ModelDiscrepancy& discrepancy, int threads);
  RobotFit(const RobotFit&) = delete;
  RobotFit& operator=(const RobotFit&) = delete;

  const Evidence& evidence() const { return fitter_.evidence(); }
  /// With the scales of the fit of the parameters.
  const Fitter& fitter() const { return fitter_; }
  const FitRules& rules() const { return fitter_.rules(); }
  /// With the minor draws at their estimates.
  const sim::Randomisation& uncertain() const { return uncertain_; }
  const Hypothesis& no_effects() const { return no_effects_; }
  const Fit& parameters() const { return parameters_; }
  /// The vehicle file under the same noise; without columns.
  const Fit& nominal() const { return nominal_; }
  /// Magnitudes of all effects but withheld ones, those of an effect together; without any whose simulation diverges.
  const std::vector<MagnitudeColumn>& magnitudes() const { return magnitudes_; }

  /// Background magnitudes of all effects: one for each magnitude, and for each side of the file's value. An effect with
  /// a magnitude for each wing has two: the difference of the wings, and the part that both share, as an error of a wing
  /// model is the same in both. `shapes`: also with other shape parameters.
  std::vector<Background> background(const ModelDiscrepancy& discrepancy, bool shapes) const;
  /// Changes between sessions in which nothing that matters changes, of parameters (all named kSessionParameters), of
  /// sensors, and of each effect's magnitudes (kSessionOf and its name). Only in a contrast.
  std::vector<Background> session_changes(const SessionVariation& session) const;
  /// Change of the prediction for one prior sd of each error of declared sensors, then of each minor draw of the
  /// vehicle.
  Regressors nuisance_regressors() const;
  /// Nats by which an effect's magnitudes are more probable a priori than as its background.
  /// `magnitudes`: in prior standard deviations. Positive favours the effect.
  double beyond_background(const std::string& effect, const Eigen::VectorXd& magnitudes, const Scales& scales) const;
  /// Minor draws of the vehicle given a joint fit of all flights.
  std::vector<double> minors_given(const Fitter::JointFit& joint) const { return minors_moved_by(joint.means); }
  /// The lag of the sensors, then each error of declared sensors on which the flights have information, given a fit.
  /// `fitter`: with the scales of the fit.
  std::vector<SensorFinding> sensors(const Fitter& fitter, const Hypothesis& hypothesis, const Fit& fit) const;

  /// Evidence of a hypothesis with its own scales, searched from `start` and from prior scales of its effects'
  /// backgrounds, and with its law factor. `unknown_penalty_nats`: as in Evidence::weigh.
  ScaledEvidence weigh(const Hypothesis& hypothesis, const Fit& fit, const Scales& start,
                       std::optional<double> unknown_penalty_nats = {}) const;
  /// As fitter(), with the priors of another model discrepancy. Only in a contrast.
  Fitter fitter_given(const ModelDiscrepancy& discrepancy) const;
  /// Scales given a fit: searched from `start`, then from a larger background of one effect while the evidence grows.
  Scales find_scales(const Hypothesis& hypothesis, const Fit& fit, const Scales& start) const;
  /// The scales with the largest gain from a larger background of one effect; none if none gains.
  std::optional<Scales> larger_background(const Hypothesis& hypothesis, const Fit& fit, const Scales& now) const;

  // for FitRules::describe_rest
  void widen_backgrounds();
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
  BasisCoefficients change(Residuals there, double steps) const;

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
