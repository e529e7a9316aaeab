#include "gap/question/beat_averaged_question.hpp"

#include "gap/question/validation.hpp"

namespace flappy::gap {

BasisCoefficients BeatAveraged::law_sd(const Evidence& /*evidence*/, const std::string& /*effect*/,
                                       const BasisCoefficients& change, double /*law_factor*/) const {
  return BasisCoefficients::Zero(change.rows(), change.cols());
}

void BeatAveraged::describe_rest(RobotFit& robot) const { robot.learn_rest_as_noise(); }

/// Scales are not fitted.
std::optional<Scales> BeatAveraged::larger_background(const RobotFit& /*robot*/, const Hypothesis& /*hypothesis*/,
                                                      const Fit& /*fit*/, const Scales& /*now*/) const {
  return std::nullopt;
}

Fit BeatAveraged::fit_set(const Fitter& fitter, const Hypothesis& hypothesis, const Eigen::VectorXd& start,
                          const Fit& parameters) const {
  return fitter.fit_given(hypothesis, start, parameters, kFitIterations);
}

std::optional<Fit> BeatAveraged::refit_jointly(const Fitter& /*fitter*/, const Hypothesis& /*hypothesis*/,
                                               const Eigen::VectorXd& /*start*/, const Fit& /*parameters*/) const {
  return std::nullopt;
}

std::vector<TestResiduals> BeatAveraged::held_out(const Fitter& fitter, const Flights& flights,
                                                  const std::vector<FittedHypothesis>& fits,
                                                  const std::vector<int>& fold, int threads) const {
  return held_out_by_simulation(fitter, flights, fits, fold, false, threads);
}

void BeatAveraged::refute(const RobotFit& /*robot*/, const Fitter& /*fitter*/, const Flights& flights,
                          const VerdictRule& /*rule*/, Inference& d) const {
  refute_idle_effects(
      flights.tests, [](const std::string&) { return false; }, d);
}

std::optional<Validation> BeatAveraged::validate(const Fitter& fitter, const sim::Randomisation& uncertain,
                                                 const Flights& flights, const Inference& d, int threads) const {
  return validation_of(*this, fitter, uncertain, flights, d, threads);
}

CorrectedParameters BeatAveraged::by_themselves(const RobotFit& robot, const Fitter& fitter,
                                                const Hypothesis& hypothesis, const Fit& fit) const {
  return joint_parameters(robot, fitter.without_background(), hypothesis, fit);
}

}  // namespace flappy::gap
