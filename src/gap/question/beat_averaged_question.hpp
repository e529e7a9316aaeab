// The question what is missing in the model of a beat-averaged vehicle, from its flights alone, without references.
// What no effect explains counts as noise, scales are held at 1, and flights held out decide. The rest is as in Alone.
#pragma once

#include "gap/question/alone.hpp"

namespace flappy::gap {

class BeatAveraged final : public Alone {
 public:
  using Alone::Alone;

  /// None: flights have no offsets.
  std::vector<std::size_t> offsets(const Flights& /*flights*/) const override { return {}; }
  /// 0: what another law leaves is noise.
  BasisCoefficients law_sd(const Evidence& evidence, const std::string& effect, const BasisCoefficients& change,
                           double law_factor) const override;
  /// As noise with a memory, which scales no longer follow.
  void describe_rest(RobotFit& robot) const override;
  /// None.
  std::optional<Scales> larger_background(const RobotFit& robot, const Hypothesis& hypothesis, const Fit& fit,
                                          const Scales& now) const override;
  /// Simulations cost little: parameters and effects are fitted jointly from the start.
  Fit fit_set(const Fitter& fitter, const Hypothesis& hypothesis, const Eigen::VectorXd& start,
              const Fit& parameters) const override;
  /// None: fit_set did.
  std::optional<Fit> refit_jointly(const Fitter& fitter, const Hypothesis& hypothesis, const Eigen::VectorXd& start,
                                   const Fit& parameters) const override;
  std::size_t max_further() const override { return 1; }
  /// By simulation; what nuisances explain stays in the residual.
  std::vector<TestResiduals> held_out(const Fitter& fitter, const Flights& flights,
                                      const std::vector<FittedHypothesis>& fits, const std::vector<int>& fold,
                                      int threads) const override;
  /// Refutes idle effects alone; no background is credited.
  void refute(const RobotFit& robot, const Fitter& fitter, const Flights& flights, const VerdictRule& rule,
              Inference& d) const override;
  /// The conclusion predicts by its own fit.
  void choose_predicting(Inference& /*d*/) const override {}
  /// validation_of (validation.hpp).
  std::optional<Validation> validate(const Fitter& fitter, const sim::Randomisation& uncertain, const Flights& flights,
                                     const Inference& d, int threads) const override;

 protected:
  /// Without background magnitudes.
  CorrectedParameters by_themselves(const RobotFit& robot, const Fitter& fitter, const Hypothesis& hypothesis,
                                    const Fit& fit) const override;
};

}  // namespace flappy::gap
