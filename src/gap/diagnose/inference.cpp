#include "gap/diagnose/inference.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "gap/diagnose/effect_fits.hpp"
#include "gap/diagnose/held_out.hpp"
#include "gap/diagnose/verdict.hpp"
#include "io/parallel.hpp"
#include "model/effects/registry.hpp"

namespace flappy::gap {
namespace {

using Eigen::VectorXd;

constexpr int kMaxHalvings = 10;
/// Beyond this a coordinate is out of its range; less is rounding.
constexpr double kBeyond = 1e-9;

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

/// How far a joint fit moves the coordinates of unknowns, by effect and index of the unknown.
using Moves = std::map<std::pair<std::string, Eigen::Index>, double>;

/// Moves by background magnitudes, of effects in of_models only: the background of others belongs to the flights, not to
/// the robot. `first`: NuisanceMean::place of the first background.
Moves moves_of(const ModelDiscrepancy& discrepancy, const std::vector<Background>& background,
               const Fitter::JointFit& joint, std::size_t first) {
  Moves moves;
  for (const Fitter::NuisanceMean& n : joint.means) {
    if (n.place < first) continue;
    for (const Background::Move& m : background[n.place - first].moves)
      if (std::ranges::count(discrepancy.of_models, m.effect)) moves[{m.effect, m.unknown}] += m.by * n.mean;
  }
  return moves;
}

/// Index of the first unknown of an effect.
Eigen::Index first_of(const Hypothesis& h, const std::string& effect) {
  return std::ranges::find(h.unknowns(), effect, &Unknown::effect) - h.unknowns().begin();
}

/// The parameters of a joint fit, and effects with its background magnitudes; one that would leave its accepted range has
/// none.
CorrectedParameters with_background(const RobotFit& robot, const Fitter& fitter, const Hypothesis& hypothesis,
                                    const Fit& fit) {
  const Regressors nuisances = robot.nuisance_regressors();
  const ModelDiscrepancy& discrepancy = fitter.evidence().discrepancy();
  std::vector<Background> background = robot.background(discrepancy, false);
  for (;;) {
    const Fitter::JointFit joint =
        fitter.with_nuisances(nuisances, background, fit).joint_fit(hypothesis, fit, fitter.all_flights());
    const Moves moves = moves_of(discrepancy, background, joint, nuisances.columns.size());
    CorrectedParameters c{hypothesis.effects(), {}, robot.minors_given(joint)};
    for (const auto& [unknown, by] : moves)
      if (!std::ranges::count(c.effects, unknown.first)) c.effects.push_back(unknown.first);
    const Hypothesis h(robot.uncertain(), c.effects);
    c.at = h.start();
    c.at.head(joint.at.size()) = joint.at;
    for (const auto& [unknown, by] : moves) c.at[first_of(h, unknown.first) + unknown.second] += by;
    const VectorXd beyond = c.at - h.bounded(c.at);
    const auto left_out = std::erase_if(background, [&](const Background& b) {
      return std::ranges::any_of(b.moves, [&](const Background::Move& m) {
        return moves.contains({m.effect, m.unknown}) && std::abs(beyond[first_of(h, m.effect) + m.unknown]) > kBeyond;
      });
    });
    if (left_out == 0) return c;
  }
}

/// Parameters and effects that predict the flights by themselves. Parameters would make up for what background
/// magnitudes explain, so a vehicle with wings has these too. All are fitted once more around them: the columns of `fit`
/// hold only nearby.
CorrectedParameters corrected_parameters(const RobotFit& robot, const Fitter& fitter, const Hypothesis& hypothesis,
                                         const Fit& fit) {
  const Fitter without = fitter.without_background();
  const auto jointly = [&](const Hypothesis& h, const Fit& around) {
    const Fitter::JointFit joint = without.joint_fit(h, around, fitter.all_flights());
    return CorrectedParameters{h.effects(), joint.at, robot.minors_given(joint)};
  };
  CorrectedParameters c;
  if (fitter.evidence().policy().background_in_corrected) {
    c = with_background(robot, fitter, hypothesis, fit);
    const Hypothesis h(robot.uncertain(), c.effects);
    if (const Fit there = without.fit(h, h.bounded(c.at), 0); there.flown()) c = jointly(h, there);
  } else {
    c = jointly(hypothesis, fit);
  }
  // parameters are fitted one by one, so together they may describe a body that cannot exist
  sim::Randomisation uncertain = robot.uncertain();
  uncertain.set_minors(c.minors);
  c.minors = uncertain.minors();
  const Hypothesis h(uncertain, c.effects);
  VectorXd possible = h.start();
  possible.head(fit.at.size()) = fit.at;
  for (int n = 0; n < kMaxHalvings && model::physical_fault(h.vehicle(c.at).vehicle); ++n) c.at = (c.at + possible) / 2;
  return c;
}

/// The references' parameters and background, and the test flights' effects. The magnitudes of an effect that both have
/// add up.
CorrectedParameters with_effects(const sim::Randomisation& uncertain, const CorrectedParameters& reference,
                                 const Hypothesis& tests, const VectorXd& at) {
  CorrectedParameters c{tests.effects(), {}, reference.minors};
  for (const std::string& effect : reference.effects)
    if (!std::ranges::count(c.effects, effect)) c.effects.push_back(effect);
  const Hypothesis h(uncertain, c.effects), of_reference(uncertain, reference.effects);
  c.at = h.start();
  c.at.head(tests.size()) = at;
  c.at.head(h.shared()) = reference.at.head(h.shared());
  for (const std::string& effect : reference.effects) {
    const bool alone = !std::ranges::count(tests.effects(), effect);
    const Eigen::Index to = first_of(h, effect), from = first_of(of_reference, effect);
    for (Eigen::Index k = 0; k < static_cast<Eigen::Index>(unknowns_of(effect).size()); ++k) {
      if (alone) c.at[to + k] = reference.at[from + k];
      else if (h.unknowns()[static_cast<std::size_t>(to + k)].magnitude)
        c.at[to + k] += reference.at[from + k] - of_reference.start()[from + k];
    }
  }
  c.at = h.bounded(std::move(c.at));
  return c;
}

/// By how much parameters changed from the references to the test flights, as sessions differ, given the answer.
VectorXd changed_since(const RobotFit& robot, const Fitter& fitter, const ScoredHypothesis& answer,
                       const Inference& d) {
  const bool fitted = answer.kind == HypothesisKind::effect && answer.fitted();
  const Hypothesis h(robot.uncertain(), fitted ? answer.effects : std::vector<std::string>{});
  const Fitter::JointFit joint = fitter.joint_fit(h, fitted ? answer.fit : d.parameters, fitter.all_flights());
  const std::vector<Background> changes = robot.session_changes(fitter.evidence().discrepancy().session);
  const std::size_t first = robot.nuisance_regressors().columns.size();
  VectorXd moved = VectorXd::Zero(h.shared());
  for (const Fitter::NuisanceMean& n : joint.means) {
    if (n.place < first || n.place >= first + changes.size()) continue;
    for (const Background::Move& m : changes[n.place - first].moves)
      if (m.effect.empty()) moved[m.unknown] += m.by * n.mean;
  }
  return moved;
}

/// Parameters and effects of the corrected vehicle. In a contrast, the parameters are those of the references, moved by
/// changed_since.
CorrectedParameters correct(const RobotFit& robot, const Fitter& fitter, const ReferenceFit* reference,
                            const Inference& d) {
  const ScoredHypothesis& answer = d.predicting();
  const bool has_effects = answer.kind == HypothesisKind::effect;
  const Hypothesis h(robot.uncertain(), has_effects ? answer.effects : std::vector<std::string>{});
  if (reference != nullptr) {
    CorrectedParameters c =
        with_effects(robot.uncertain(), reference->corrected, h, has_effects ? answer.fit.mean() : h.start());
    c.at.head(h.shared()) += changed_since(robot, fitter, answer, d);
    c.at = Hypothesis(robot.uncertain(), c.effects).bounded(std::move(c.at));
    return c;
  }
  if (has_effects && !answer.fitted()) return {h.effects(), h.bounded(answer.fit.mean()), d.minors};
  return corrected_parameters(robot, fitter, h, has_effects ? answer.fit : d.parameters);
}

}  // namespace

const ScoredHypothesis& Inference::predicting() const {
  const ScoredHypothesis& c = conclusion();
  if (c.predicted_with.empty()) return c;
  return *std::ranges::find_if(hypotheses, [&](const ScoredHypothesis& a) {
    return a.fitted() && a.effects == c.predicted_with && a.has_remainder() == c.has_remainder();
  });
}

VerdictRule rule_for(const RobotFit& robot, VerdictRule rule) {
  if (!robot.evidence().contrasts() || robot.evidence().basis().covers_all()) return rule;
  rule.gain.outside_by_chance_nats = rule.gain.by_chance_nats;
  rule.gain.by_chance_nats = rule.gain.uncovered_by_chance_nats;
  for (const model::CatalogueEffect& e : model::causes_of(robot.uncertain().nominal()))
    if (!std::ranges::count(robot.evidence().discrepancy().of_models, e.info.id))
      rule.gain.outside.emplace_back(e.info.id);
  return rule;
}

ReferenceFit::ReferenceFit(const FlightList& references, const sim::Randomisation& uncertain,
                           const InferenceOptions& options)
    : flights{references, {}},
      fit(RobotFit::of_references(flights, uncertain, options.discrepancy, options.withheld, options.threads)),
      corrected{{}, fit.parameters().at, fit.uncertain().minors()} {
  if (uncertain.nominal().beat_averaged) return;
  // a contrast needs no description of what the model gets wrong, but a corrected vehicle does; effects act in it
  const Flights alone{{}, references};
  const RobotFit robot(alone, uncertain, options.discrepancy, options.withheld, options.threads);
  corrected = corrected_parameters(robot, robot.fitter(), robot.no_effects(), robot.parameters());
}

Inference infer(const Flights& flights, const sim::Randomisation& uncertain, InferenceOptions options,
                const ReferenceFit* reference) {
  const int threads = io::thread_count(options.threads);
  Progress progress(options);

  progress(0, "fitting parameters");
  const RobotFit robot = reference != nullptr
                             ? RobotFit(reference->fit, flights)
                             : RobotFit(flights, uncertain, options.discrepancy, options.withheld, threads);
  const VerdictRule& rule = options.rule = rule_for(robot, options.rule);
  const Baselines baselines = weigh_baselines(robot, rule);

  progress(0.3, "screening effects");
  const ScreenedCatalogue catalogue = screen_catalogue(robot, options);

  const bool go_on = progress(0.4, "fitting effects");
  const EffectFits fits(robot, baselines, options, threads);
  EffectFits::Sets sets = fits.combine(fits.single_effects(catalogue, go_on), std::ref(progress));
  std::vector<ScoredHypothesis> remainders = fits.with_remainders(sets.hypotheses, sets.scales);
  const Fitter fitter = robot.fitter().with_scales(sets.scales);

  Inference d;
  d.complete = !progress.stopped();
  d.untestable = catalogue.untestable;
  d.parameters = robot.parameters();
  d.minors = robot.uncertain().minors();
  d.nominal = tests_of(flights, robot.nominal().residual);
  for (int g = 0; g < kGroups; ++g) d.noise_sd.push_back(robot.evidence().noise_sd(g));
  d.hypotheses = {baselines.none, baselines.parameters, baselines.unknown};
  for (auto* part : {&sets.hypotheses, &remainders})
    for (ScoredHypothesis& a : *part) {
      if (a.fitted()) widen(a.fit, Hypothesis(robot.uncertain(), a.effects), rule);
      d.hypotheses.push_back(std::move(a));
    }

  hold_out(fitter, robot.uncertain(), flights, threads, d);
  decide(robot, fitter, flights, rule, d);
  const ScoredHypothesis& predicting = d.predicting();
  d.sensors = predicting.fitted()
                  ? robot.sensors(fitter, Hypothesis(robot.uncertain(), predicting.effects), predicting.fit)
                  : robot.sensors(fitter, robot.no_effects(), d.parameters);
  d.corrected = correct(robot, fitter, reference, d);
  if (robot.evidence().policy().validate && reference == nullptr)
    d.validation = validate(fitter, robot.uncertain(), flights, d, threads);
  return d;
}

}  // namespace flappy::gap
