#include "gap/answer/inference.hpp"

#include <numeric>

#include "gap/answer/effect_fits.hpp"
#include "gap/answer/verdict.hpp"
#include "io/parallel.hpp"

namespace flappy::gap {
namespace {

class Progress {
 public:
  explicit Progress(const InferenceOptions& options) : told_(options.progress) {}
  bool operator()(double share, const std::string& what) {
    stopped_ = stopped_ || (told_ && !told_(share, what));
    return !stopped_;
  }
  bool stopped() const { return stopped_; }

 private:
  const std::function<bool(double, const std::string&)>& told_;
  bool stopped_ = false;
};

/// Sets d.refit, and `held_out` of each fitted hypothesis; each test flight is a fold.
void hold_out(const Question& question, const Fitter& fitter, const sim::Randomisation& uncertain,
              const Flights& flights, int threads, Inference& d) {
  std::vector<FittedHypothesis> fits = {{Hypothesis(uncertain, {}), &d.parameters}};
  std::vector<TestResiduals*> of = {&d.refit};
  for (ScoredHypothesis& a : d.hypotheses)
    if (a.fitted()) {
      fits.push_back({Hypothesis(uncertain, a.effects), &a.fit});
      of.push_back(&a.held_out);
    }
  std::vector<int> each(flights.tests.size());
  std::iota(each.begin(), each.end(), 0);
  std::vector<TestResiduals> rest = question.held_out(fitter, flights, fits, each, threads);
  for (std::size_t i = 0; i < of.size(); ++i) *of[i] = std::move(rest[i]);
}

}  // namespace

Inference infer(const Flights& flights, const sim::Randomisation& uncertain, InferenceOptions options,
                const ReferenceFit* reference) {
  const int threads = io::thread_count(options.threads);
  Progress progress(options);

  progress(0, "fitting parameters");
  const Question& question = question_of(flights);
  if (reference != nullptr)
    if (std::optional<Inference> d = question.by_sessions(flights, uncertain, options, *reference))
      return std::move(*d);
  const RobotFit robot = question.fit_robot(flights, uncertain, options, reference);
  const VerdictRule& rule = options.rule = question.rule(robot, options.rule);
  Baselines baselines = weigh_baselines(question, robot, rule);

  progress(0.3, "screening effects");
  const ScreenedCatalogue catalogue = screen_catalogue(robot, options);

  const bool go_on = progress(0.4, "fitting effects");
  const EffectFits fits(question, robot, baselines, options, threads);
  std::vector<ScoredHypothesis> singles = fits.single_effects(catalogue, go_on);
  raise_baselines(question, robot, rule, threads, singles, baselines);
  EffectFits::Sets sets = fits.combine(std::move(singles), std::ref(progress));
  std::vector<ScoredHypothesis> remainders = fits.with_remainders(sets.hypotheses, sets.scales);
  const Fitter fitter = robot.fitter().with_scales(sets.scales);

  Inference d;
  d.complete = !progress.stopped();
  d.untestable = catalogue.untestable;
  d.parameters = robot.parameters();
  d.minors = robot.uncertain().minors();
  d.nominal = tests_of(flights, robot.nominal().residual);
  for (int g = 0; g < kGroups; ++g) d.noise_sd.push_back(robot.evidence().noise_sd(g));
  d.seen = question.seen(robot);
  d.hypotheses = {baselines.none, baselines.parameters, baselines.unknown};
  for (auto* part : {&sets.hypotheses, &remainders})
    for (ScoredHypothesis& a : *part) {
      if (a.fitted()) widen(a.fit, Hypothesis(robot.uncertain(), a.effects), rule);
      d.hypotheses.push_back(std::move(a));
    }

  hold_out(question, fitter, robot.uncertain(), flights, threads, d);
  decide(question, robot, fitter, flights, rule, d);
  const ScoredHypothesis& predicting = d.predicting();
  d.sensors = predicting.fitted()
                  ? robot.sensors(fitter, Hypothesis(robot.uncertain(), predicting.effects), predicting.fit)
                  : robot.sensors(fitter, robot.no_effects(), d.parameters);
  d.corrected = question.correct(robot, fitter, reference, d);
  d.validation = question.validate(fitter, robot.uncertain(), flights, d, threads);
  return d;
}

}  // namespace flappy::gap
