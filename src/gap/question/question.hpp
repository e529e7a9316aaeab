// What differs between the questions of a diagnosis:
//   alone          what is missing in the model of a vehicle with wings (alone.cpp)
//   contrast       what changed between reference flights and test flights (contrast.cpp)
//   beat-averaged  what is missing in the model of a vehicle of which only means over beats are predicted
//                  (beat_averaged_question.cpp)
// All else is the same for every question, but for a contrast of a beat-averaged vehicle, which is answered by the
// robot's own sessions alone (by_sessions(), session_contrast.cpp).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "gap/fit/fit_rules.hpp"
#include "gap/question/held_out.hpp"
#include "gap/question/inferred.hpp"
#include "gap/question/rival.hpp"

namespace flappy::gap {

/// Number of further effects that are tried at a time, of a vehicle with wings. Choice.
inline constexpr std::size_t kMaxFurther = 2;

class Question : public FitRules {
 public:
  /// The parameters, fitted to the flights. `reference`: of a contrast.
  virtual RobotFit fit_robot(const Flights& flights, const sim::Randomisation& uncertain,
                             const InferenceOptions& options, const ReferenceFit* reference) const = 0;
  /// The rule with what effects gain by chance.
  virtual VerdictRule rule(const RobotFit& robot, VerdictRule given) const = 0;
  /// Log evidence of the hypothesis none, without its prior.
  virtual double log_evidence_of_none(const RobotFit& robot) const = 0;
  /// Fits a set of effects from `start` on.
  virtual Fit fit_set(const Fitter& fitter, const Hypothesis& hypothesis, const Eigen::VectorXd& start,
                      const Fit& parameters) const = 0;
  /// Fits the parameters again, jointly with the set; none: they are fitted already, or stay.
  virtual std::optional<Fit> refit_jointly(const Fitter& fitter, const Hypothesis& hypothesis,
                                           const Eigen::VectorXd& start, const Fit& parameters) const = 0;
  /// Number of effects that are tried at a time, each jointly with the best set.
  virtual std::size_t max_further() const = 0;
  /// Residuals, [fit][test flight], of predictions by the fit to the other folds, or to all flights if there is one
  /// fold. `fold`: [test flight]; references are never held out.
  virtual std::vector<Residuals> held_out(const Fitter& fitter, const Flights& flights,
                                          const std::vector<FittedHypothesis>& fits, const std::vector<int>& fold,
                                          int threads) const = 0;
  /// Refutes hypotheses, and takes from others the evidence that is none. `fitter`: with the scales of the parameters.
  virtual void refute(const RobotFit& robot, const Fitter& fitter, const Flights& flights, const VerdictRule& rule,
                      Inference& d) const = 0;
  /// Hypotheses of one pool count together (gap/answer/verdict.hpp).
  virtual std::string pool(const ScoredHypothesis& hypothesis) const = 0;
  /// Chooses whose fit predicts for the conclusion.
  virtual void choose_predicting(Inference& d) const = 0;
  /// Parameters and effects of the corrected vehicle.
  virtual CorrectedParameters correct(const RobotFit& robot, const Fitter& fitter, const ReferenceFit* reference,
                                      const Inference& d) const = 0;
  /// Ladder, controls and agreements; none: not of this question.
  virtual std::optional<Validation> validate(const Fitter& fitter, const sim::Randomisation& uncertain,
                                             const Flights& flights, const Inference& d, int threads) const = 0;
  /// A hypothesis as a vehicle that may fly next. It keeps a reference to `uncertain` or to `as_filed`, which has minor
  /// draws of 0.
  virtual Rival rival(const ScoredHypothesis& hypothesis, const Inference& d, const sim::Randomisation& uncertain,
                      const sim::Randomisation& as_filed) const = 0;
  /// The answer by the scatter of the robot's own sessions; none: not of this question.
  virtual std::optional<Inference> by_sessions(const Flights& /*flights*/, const sim::Randomisation& /*uncertain*/,
                                               const InferenceOptions& /*options*/,
                                               const ReferenceFit& /*reference*/) const {
    return std::nullopt;
  }
  /// What changed since the references, whatever the cause; none: not of this question.
  virtual std::vector<SeenQuantity> seen(const RobotFit& /*robot*/) const { return {}; }
  /// Columns of a rival's parameters that are known. `first`: linearisation of the first rival with parameters.
  virtual std::vector<BasisCoefficients> known_columns(const Rival& rival, const std::optional<Fit>& first) const = 0;
};

/// The question that these flights answer.
const Question& question_of(const Flights& flights);
/// The same for flights that are still to be flown, by a vehicle with wings. `references`: none: not of a contrast.
const Question& question_beside(const FlightList& references);

}  // namespace flappy::gap
