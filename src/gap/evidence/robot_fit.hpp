// The flights of a robot with its vehicle's parameters fitted to them, and what is learnt with these: the noise, the scales of the model
// discrepancy, nuisance regressors, and the change that each magnitude of the catalogue makes. All other stages of a diagnosis start here.
#pragma once

#include "gap/evidence/screening.hpp"

namespace flappy::gap {

/// Error of a declared sensor.
struct SensorFinding {
  std::string name;  ///< as "imu_mounting.x_rad", or "imu.latency_s"
  double value, sd;
  double prior_sd;
};

class RobotFit {
 public:
  /// Fits. `flights` are referred to; `withheld`: effects that the catalogue is to lack; `threads`: as for io::parallel_for.
  RobotFit(const Flights& flights, const sim::Randomisation& uncertain, const ModelDiscrepancy& discrepancy,
           std::vector<std::string> withheld, int threads);
  RobotFit(const RobotFit&) = delete;
  RobotFit& operator=(const RobotFit&) = delete;

  const Evidence& evidence() const { return fitter_.evidence(); }
  /// With the scales of the parameters' fit.
  const Fitter& fitter() const { return fitter_; }
  /// With the minor draws that the flights show.
  const sim::Randomisation& uncertain() const { return uncertain_; }
  /// The hypothesis without effects.
  const Hypothesis& no_effects() const { return no_effects_; }
  const Fit& parameters() const { return parameters_; }
  /// The vehicle file under the same noise; without columns.
  const Fit& nominal() const { return nominal_; }
  const std::vector<MagnitudeColumn>& magnitudes() const { return magnitudes_; }

  /// Background magnitudes of all effects. Of an effect with a magnitude for each wing: the difference of the wings, and what both share, for
  /// there a model of a wing is off in both alike. `shapes`: with changes by another shape parameter.
  std::vector<Background> background(const ModelDiscrepancy& discrepancy, bool shapes) const;
  /// Errors of declared sensors, then minor draws of the vehicle, for one standard deviation each.
  Regressors nuisance_regressors() const;
  /// Nats by which magnitudes of an effect are more probable as an effect than as its background.
  double beyond_background(const std::string& effect, const Eigen::VectorXd& magnitudes, const Scales& scales) const;
  /// Errors of declared sensors, given a fit. `fitter`: with scales of the fit.
  std::vector<SensorFinding> sensors(const Fitter& fitter, const Hypothesis& hypothesis, const Fit& fit) const;

  /// Evidence of a hypothesis with its own scales, searched from `start` on. `unknown_penalty_nats`: as in Evidence::weigh.
  ScaledEvidence weigh(const Hypothesis& hypothesis, const Fit& fit, const Scales& start,
                       std::optional<double> unknown_penalty_nats = {}) const;
  /// Scales given a fit, searched from `start` on; also where one effect's background magnitude is much larger.
  Scales find_scales(const Hypothesis& hypothesis, const Fit& fit, const Scales& start) const;

 private:
  void fit_parameters();
  void refit_with_nuisances();
  void learn_remainder();
  void find_magnitudes();
  void find_linear_magnitudes();
  void find_nuisances();
  void set_nuisances();
  void widen_effects();
  bool refit_with_minors();
  void take_scales() { fitter_ = fitter_.with_scales(find_scales(no_effects_, parameters_, fitter_.scales())); }
  void take_evidence(Evidence evidence) {
    fitter_ = fitter_.with_evidence(std::make_shared<const Evidence>(std::move(evidence)));
  }
  std::optional<Scales> larger_effect(const Hypothesis& hypothesis, const Fit& fit, const Scales& now) const;
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
