// A question is what a diagnosis asks of its flights. This is what differs between the questions; each has a class:
//   Alone            what is missing in the model of a vehicle with wings (alone.cpp)
//   Contrast         what changed in a vehicle with wings from the reference flights to the test flights (contrast.cpp)
//   BeatAveraged     what is missing in the model of a beat-averaged vehicle (beat_averaged_question.cpp)
//   SessionContrast  what changed in a beat-averaged vehicle since the references (session_contrast.cpp)
// All else is the same for every question (gap/answer/inference.hpp). Only SessionContrast goes its own way, by the
// sessions of the robot itself (by_sessions()).
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "gap/fit/fit_rules.hpp"
#include "gap/question/held_out.hpp"
#include "gap/question/inferred.hpp"
#include "gap/question/rival.hpp"

namespace flappy::gap {

/// For a vehicle with wings, the number of further effects that are tried at a time. Choice.
inline constexpr std::size_t kMaxFurther = 2;

/// Log evidence of deviations from the catalogue's laws alone, without an effect and without priors of hypotheses.
/// Minus infinity: not part of this question.
struct OtherLaws {
  double log_evidence = -std::numeric_limits<double>::infinity();  ///< whatever has these deviations
  /// The same for a harmless change that follows another law, less the cost of deviations as large as these.
  double log_evidence_of_harmless = -std::numeric_limits<double>::infinity();
};

class Question : public FitRules {
 public:
  /// The vehicle with its parameters fitted to the flights. In a contrast it is linearised around the parameters of
  /// `reference`; else `reference` is not used.
  virtual RobotFit fit_robot(const Flights& flights, const sim::Randomisation& uncertain,
                             const InferenceOptions& options, const ReferenceFit* reference) const = 0;
  /// `given`, adapted to what effects gain by chance in these flights.
  virtual VerdictRule rule(const RobotFit& robot, VerdictRule given) const = 0;
  /// Log evidence of the hypothesis none, without its prior.
  virtual double log_evidence_of_none(const RobotFit& robot) const = 0;
  /// Log evidence of deviations that are proportional to those from the law of this one effect, as fitted.
  virtual OtherLaws other_laws(const RobotFit& /*robot*/, const Hypothesis& /*hypothesis*/, const Fit& /*fit*/) const {
    return {};
  }
  /// Fits a set of effects, beginning at `start`, [coordinate]. `parameters`: the fit of the parameters without
  /// effects.
  virtual Fit fit_set(const Fitter& fitter, const Hypothesis& hypothesis, const Eigen::VectorXd& start,
                      const Fit& parameters) const = 0;
  /// Fits the parameters again, jointly with the set of `hypothesis`; none: fit_set() did, or the parameters stay.
  /// Called for the few best sets.
  virtual std::optional<Fit> refit_jointly(const Fitter& fitter, const Hypothesis& hypothesis,
                                           const Eigen::VectorXd& start, const Fit& parameters) const = 0;
  /// Number of further effects that are tried at a time, each jointly with the best set so far.
  virtual std::size_t max_further() const = 0;
  /// [fit] Residuals of the test flights; each is predicted by the fit to the flights of other folds, or to all flights
  /// if there is one fold. `fold`: [test flight] number of its fold; references are never held out.
  virtual std::vector<TestResiduals> held_out(const Fitter& fitter, const Flights& flights,
                                              const std::vector<FittedHypothesis>& fits, const std::vector<int>& fold,
                                              int threads) const = 0;
  /// Sets the log evidence of refuted hypotheses to kRefuted, and raises that of others where the gain of a hypothesis
  /// is no evidence against them. Called before probabilities are set. `fitter`: with the scales of the parameters.
  virtual void refute(const RobotFit& robot, const Fitter& fitter, const Flights& flights, const VerdictRule& rule,
                      Inference& d) const = 0;
  /// Name of the pool of a hypothesis. Hypotheses of one pool count together (gap/answer/verdict.hpp).
  virtual std::string pool(const ScoredHypothesis& hypothesis) const = 0;
  /// Chooses the hypothesis whose fit is used for predictions of the conclusion (ScoredHypothesis::predicted_with).
  virtual void choose_predicting(Inference& d) const = 0;
  /// Parameters and effects of the corrected vehicle. `reference`: that of a contrast; else not used.
  virtual CorrectedParameters correct(const RobotFit& robot, const Fitter& fitter, const ReferenceFit* reference,
                                      const Inference& d) const = 0;
  /// The validation: ladder, controls and agreements (validation.hpp); none: not part of this question.
  virtual std::optional<Validation> validate(const Fitter& fitter, const sim::Randomisation& uncertain,
                                             const Flights& flights, const Inference& d, int threads) const = 0;
  /// A hypothesis as a vehicle that may fly next, for rank_experiments(). `as_filed`: `uncertain` with minor draws of
  /// 0. Keeps a reference to `uncertain` or, for the vehicle file, to `as_filed`.
  virtual Rival rival(const ScoredHypothesis& hypothesis, const Inference& d, const sim::Randomisation& uncertain,
                      const sim::Randomisation& as_filed) const = 0;
  /// The whole answer, by the scatter of the robot's own sessions; infer() then calls nothing else. None: not part of
  /// this question.
  virtual std::optional<Inference> by_sessions(const Flights& /*flights*/, const sim::Randomisation& /*uncertain*/,
                                               const InferenceOptions& /*options*/,
                                               const ReferenceFit& /*reference*/) const {
    return std::nullopt;
  }
  /// What changed since the references, whatever the cause; empty: not part of this question.
  virtual std::vector<SeenQuantity> seen(const RobotFit& /*robot*/) const { return {}; }
  /// [direction] Columns of a rival's parameters that are known without simulation. `first`: linearisation of the first
  /// rival with parameters; none: there is none yet.
  virtual std::vector<SharedColumn> known_columns(const Rival& rival, const std::optional<Fit>& first) const = 0;
};

/// The question that these flights answer: by the kind of vehicle, and whether there are references and tests.
/// References without tests are fitted as Alone, for a contrast.
const Question& question_of(const Flights& flights);
/// The question that test flights of a vehicle with wings will answer, given these references; empty: no contrast.
const Question& question_beside(const FlightList& references);

}  // namespace flappy::gap
