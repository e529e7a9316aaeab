// What differs between the questions of a diagnosis. A class for each:
//   Alone            what is missing in the model of a vehicle with wings (alone.cpp)
//   Contrast         what changed in a vehicle with wings from the reference flights to the test flights (contrast.cpp)
//   BeatAveraged     what is missing in the model of a beat-averaged vehicle (beat_averaged_question.cpp)
//   SessionContrast  what changed in a beat-averaged vehicle since the references (session_contrast.cpp)
// All else is the same for every question (gap/answer/inference.hpp), but SessionContrast takes a way of its own, by
// the robot's own sessions (by_sessions()).
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

/// Number of further effects that are tried at a time, of a vehicle with wings. Choice.
inline constexpr std::size_t kMaxFurther = 2;

/// Log evidence of deviations from all laws, without an effect and its prior; minus infinity: not of this question.
struct OtherLaws {
  double log_evidence = -std::numeric_limits<double>::infinity();  ///< of anything that has them
  /// Of a harmless change that follows another law, with what it costs that it is as large.
  double log_evidence_of_harmless = -std::numeric_limits<double>::infinity();
};

class Question : public FitRules {
 public:
  /// The parameters, fitted to the flights; in a contrast, linearised around those of `reference`, else not used.
  virtual RobotFit fit_robot(const Flights& flights, const sim::Randomisation& uncertain,
                             const InferenceOptions& options, const ReferenceFit* reference) const = 0;
  /// `given`, with what effects gain by chance in these flights.
  virtual VerdictRule rule(const RobotFit& robot, VerdictRule given) const = 0;
  /// Log evidence of the hypothesis none, without its prior.
  virtual double log_evidence_of_none(const RobotFit& robot) const = 0;
  /// What deviations explain that are proportional to those of the law of this one effect, as fitted.
  virtual OtherLaws other_laws(const RobotFit& /*robot*/, const Hypothesis& /*hypothesis*/, const Fit& /*fit*/) const {
    return {};
  }
  /// Fits a set of effects from `start` on, [coordinate]. `parameters`: their own fit, without effects.
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
  /// Lowers the log evidence of hypotheses to kRefuted, and credits others with what is no evidence against them,
  /// before probabilities are set. `fitter`: with the scales of the parameters.
  virtual void refute(const RobotFit& robot, const Fitter& fitter, const Flights& flights, const VerdictRule& rule,
                      Inference& d) const = 0;
  /// Hypotheses of one pool count together (gap/answer/verdict.hpp).
  virtual std::string pool(const ScoredHypothesis& hypothesis) const = 0;
  /// Chooses whose fit predicts for the conclusion (ScoredHypothesis::predicted_with).
  virtual void choose_predicting(Inference& d) const = 0;
  /// Parameters and effects of the corrected vehicle. `reference`: of a contrast.
  virtual CorrectedParameters correct(const RobotFit& robot, const Fitter& fitter, const ReferenceFit* reference,
                                      const Inference& d) const = 0;
  /// Ladder, controls and agreements; none: not of this question.
  virtual std::optional<Validation> validate(const Fitter& fitter, const sim::Randomisation& uncertain,
                                             const Flights& flights, const Inference& d, int threads) const = 0;
  /// A hypothesis as a vehicle that may fly next, for rank_experiments(). Keeps a reference to `uncertain` or, for the
  /// vehicle file, to `as_filed`, the same with minor draws of 0.
  virtual Rival rival(const ScoredHypothesis& hypothesis, const Inference& d, const sim::Randomisation& uncertain,
                      const sim::Randomisation& as_filed) const = 0;
  /// The whole answer by the scatter of the robot's own sessions, in place of all else; none: not of this question.
  virtual std::optional<Inference> by_sessions(const Flights& /*flights*/, const sim::Randomisation& /*uncertain*/,
                                               const InferenceOptions& /*options*/,
                                               const ReferenceFit& /*reference*/) const {
    return std::nullopt;
  }
  /// What changed since the references, whatever the cause; none: not of this question.
  virtual std::vector<SeenQuantity> seen(const RobotFit& /*robot*/) const { return {}; }
  /// [direction] Columns of a rival's parameters that need no simulation. `first`: linearisation of the first rival
  /// with parameters; none: not yet.
  virtual std::vector<BasisCoefficients> known_columns(const Rival& rival, const std::optional<Fit>& first) const = 0;
};

/// The question that these flights answer: by the kind of vehicle, and whether there are references and tests.
/// References without tests are fitted as Alone, for a contrast.
const Question& question_of(const Flights& flights);
/// The question that test flights of a vehicle with wings will answer besides these references; empty: no contrast.
const Question& question_beside(const FlightList& references);

}  // namespace flappy::gap
