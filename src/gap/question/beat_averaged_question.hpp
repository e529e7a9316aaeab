// What is missing in the model of a vehicle of which only means over beats are predicted, from its flights alone. What no
// effect explains counts as noise, and flights held out decide.
#pragma once

#include "gap/question/alone.hpp"

namespace flappy::gap {

class BeatAveraged final : public Alone {
 public:
  using Alone::Alone;

  std::vector<std::size_t> offsets(const Flights& /*flights*/) const override { return {}; }
  /// The rest is noise, so laws do not deviate.
  BasisCoefficients law_sd(const Evidence& evidence, const std::string& effect, const BasisCoefficients& change,
                           double law_factor) const override;
  void describe_rest(RobotFit& robot) const override;
  std::optional<Scales> larger_background(const RobotFit& robot, const Hypothesis& hypothesis, const Fit& fit,
                                          const Scales& now) const override;
  /// Simulations cost little: parameters and effects are fitted jointly from the start.
  Fit fit_set(const Fitter& fitter, const Hypothesis& hypothesis, const Eigen::VectorXd& start,
              const Fit& parameters) const override;
  std::optional<Fit> refit_jointly(const Fitter& fitter, const Hypothesis& hypothesis, const Eigen::VectorXd& start,
                                   const Fit& parameters) const override;
  std::size_t max_further() const override { return 1; }
  /// Nuisances are no noise of the flights held out.
  std::vector<Residuals> held_out(const Fitter& fitter, const Flights& flights,
                                  const std::vector<FittedHypothesis>& fits, const std::vector<int>& fold,
                                  int threads) const override;
  void refute(const RobotFit& robot, const Fitter& fitter, const Flights& flights, const VerdictRule& rule,
              Inference& d) const override;
  void choose_predicting(Inference& /*d*/) const override {}
  std::optional<Validation> validate(const Fitter& fitter, const sim::Randomisation& uncertain, const Flights& flights,
                                     const Inference& d, int threads) const override;

 protected:
  CorrectedParameters by_themselves(const RobotFit& robot, const Fitter& fitter, const Hypothesis& hypothesis,
                                    const Fit& fit) const override;
};

}  // namespace flappy::gap
