// A robot's flights with its vehicle's parameters fitted to them, and what is learnt on the way: its noise, how far models of it are
// off, what its sensors and small effects do beside every hypothesis. Every further question starts here.
#pragma once

#include "gap/evidence/screening.hpp"

namespace flappy::gap {

/// A number that a header has wrong by so much.
struct SensorFinding {
  std::string name;  ///< as "imu_mounting.x_rad", or "imu.latency_s"
  double value, sd;
  double believed_sd;  ///< before the flights
};

class RobotFit {
 public:
  /// `withheld`: entries that the catalogue is to lack. `flights` are kept.
  RobotFit(const std::vector<PredictedFlight>& flights, const sim::Randomisation& uncertain,
           const ModelDiscrepancy& discrepancy, std::vector<std::string> withheld, int threads);

  /// Parameters, noise, and how far models of this robot are off.
  void fit_parameters();
  /// The same beside what sensors may have and every vehicle has a little of, which is found first.
  void refit_beside_background();

  void set_discrepancy(const ModelDiscrepancy& discrepancy) { evidence_.set_discrepancy(discrepancy); }
  const Evidence& evidence() const { return evidence_; }
  const Fitter& fitter() const { return fitter_; }
  /// With what the flights say of its minor draws.
  const sim::Randomisation& uncertain() const { return uncertain_; }
  const Hypothesis& plain() const { return plain_; }
  const Fit& parameters() const { return parameters_; }
  /// The vehicle's file, weighed by the same noise.
  const Linearised& nominal() const { return nominal_; }
  /// What every size of the catalogue changes.
  const std::vector<SizeColumn>& sizes() const { return sizes_; }
  /// What it makes of that to have another shape, by a standard deviation of each.
  const std::vector<SizeColumn>& shapes() const { return shapes_; }
  /// What every vehicle has of each entry. Of one that has a size for each wing, what the wings have apart, and what both have: there a
  /// model of a wing is off for both alike. `shapes`: with what other shapes make of it.
  std::vector<Background> background(bool shapes) const;
  /// What each number that a header may have wrong, and each minor figure of the vehicle, changes for one standard deviation, and what is
  /// thought of its coefficient, from what is flown on.
  Columns lines() const;
  /// Nats by which coordinates of an entry's sizes are more probable of an effect than of what every vehicle has of it.
  double beyond_background(const std::string& effect, const Eigen::VectorXd& sizes) const;
  /// What sensors are off by beyond their headers, given a fit.
  std::vector<SensorFinding> sensors(const Hypothesis& hypothesis, const Fit& fit) const;

  /// From now on models of this robot are off by what they are beside a fit.
  void take_scales(const Hypothesis& hypothesis, const Linearised& at);
  /// A hypothesis, with scales of its own, looked for from `start` on.
  Weighed weigh(const Hypothesis& hypothesis, const Linearised& at, const Scales& start,
                std::optional<double> freeing_nats = {}) const;
  Weighed weigh(const Hypothesis& hypothesis, const Linearised& at, std::optional<double> freeing_nats = {}) const {
    return weigh(hypothesis, at, evidence_.scales(), freeing_nats);
  }

 private:
  void learn_remainder();
  void find_sizes();
  void set_lines();
  void find_lines();
  void set_background();
  void set_scales(const Scales& scales);
  void widen_entries();
  bool refit_with_minors();
  std::optional<Scales> larger_entry(const Hypothesis& hypothesis, const Linearised& at) const;
  BasisCoefficients change(Residuals there, double steps) const;

  const std::vector<PredictedFlight>& flights_;
  sim::Randomisation uncertain_;
  std::vector<std::string> withheld_;
  int threads_;
  Evidence evidence_;
  Fitter fitter_;
  Hypothesis plain_;
  Linearised nominal_;
  Fit parameters_;
  std::vector<SizeColumn> sizes_, shapes_;
  std::vector<BasisCoefficients> nuisances_, minors_;
};

}  // namespace flappy::gap
