// The rules for the question: what is missing in the model of a beat-averaged vehicle, judged by its flights alone,
// without references? What no effect explains counts as noise, scales are held at 1, and held-out flights decide. All
// else is as in Alone.
#pragma once

#include "gap/question/alone.hpp"

namespace flappy::gap {

class BeatAveraged final : public Alone {
 public:
  using Alone::Alone;

  /// None: flights have no offsets.
  std::vector<std::size_t> offsets(const Flights& /*flights*/) const override { return {}; }
  /// 0: what the effect leaves because it follows another law counts as noise.
  BasisCoefficients law_sd(const Evidence& evidence, const std::string& effect, const BasisCoefficients& change,
                           double law_factor) const override;
  /// Takes the residual as autocorrelated noise; scales stay 1 from then on.
  void describe_rest(RobotFit& robot) const override;
  /// None: scales are not fitted.
  std::optional<Scales> larger_background(const RobotFit& robot, const Hypothesis& hypothesis, const Fit& fit,
                                          const Scales& now) const override;
  /// Fits parameters and effects jointly from the start, as simulations cost little.
  Fit fit_set(const Fitter& fitter, const Hypothesis& hypothesis, const Eigen::VectorXd& start,
              const Fit& parameters) const override;
  /// None: fit_set() has fitted them jointly.
  std::optional<Fit> refit_jointly(const Fitter& fitter, const Hypothesis& hypothesis, const Eigen::VectorXd& start,
                                   const Fit& parameters) const override;
  std::size_t max_further() const override { return 1; }
  /// By simulation; what nuisance regressors explain stays in the residual.
  std::vector<TestResiduals> held_out(const Fitter& fitter, const Flights& flights,
                                      const std::vector<FittedHypothesis>& fits, const std::vector<int>& fold,
                                      int threads) const override;
  /// Calls refute_idle_effects() alone; credits no background.
  void refute(const RobotFit& robot, const Fitter& fitter, const Flights& flights, const VerdictRule& rule,
              Inference& d) const override;
  /// The conclusion predicts by its own fit.
  void choose_predicting(Inference& /*d*/) const override {}
  /// Calls validation_of() (validation.hpp).
  std::optional<Validation> validate(const Fitter& fitter, const sim::Randomisation& uncertain, const Flights& flights,
                                     const Inference& d, int threads) const override;

 protected:
  /// Adds no background magnitudes.
  CorrectedParameters by_themselves(const RobotFit& robot, const Fitter& fitter, const Hypothesis& hypothesis,
                                    const Fit& fit) const override;
};

}  // namespace flappy::gap
