#include "gap/question/alone.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <map>

#include "gap/localise/closure.hpp"

namespace flappy::gap {
namespace {

using Eigen::VectorXd;

/// A change follows a function of the place if its square along it is at least this share of the largest. Choice.
constexpr double kFollows = 0.1;
/// Prior standard deviation of the logarithm of the law factor. Choice.
constexpr double kLawFactorSd = 1;
/// Largest law factor, and one over the smallest. Choice.
constexpr double kMaxLawFactor = 32;
/// So often is the point of a body that is not physical moved halfway back. Choice.
constexpr int kMaxHalvings = 10;
/// Beyond this a coordinate is out of its range. Choice: less is rounding.
constexpr double kBeyond = 1e-9;

const ScoredHypothesis& parameters_alone(const std::vector<ScoredHypothesis>& all) {
  return *std::ranges::find(all, HypothesisKind::parameters, &ScoredHypothesis::kind);
}

/// A background magnitude acts linearly, while a simulated effect may explain more. So that this is no evidence for the
/// effect, other hypotheses may have it as background, at the log-prior cost.
void share_backgrounds(const RobotFit& robot, const Scales& scales, double penalty_nats,
                       std::vector<ScoredHypothesis>& all) {
  const double before = parameters_alone(all).log_evidence;
  for (const ScoredHypothesis& a : all) {
    if (!a.fitted()) continue;
    const Hypothesis h(robot.uncertain(), a.effects);
    // an effect whose law deviates from the catalogue's by more counts as one of larger magnitude
    const VectorXd mean = std::max(1.0, a.fit.law_factor) * a.fit.mean();
    std::map<std::string, double> beyond;
    for (const std::string& e : a.effects) {
      std::vector<double> magnitudes;
      for (Eigen::Index i = h.shared(); i < h.size(); ++i) {
        const Unknown& u = h.unknowns()[static_cast<std::size_t>(i)];
        if (u.effect == e && u.magnitude) magnitudes.push_back(mean[i]);
      }
      beyond[e] = robot.beyond_background(
          e, Eigen::Map<VectorXd>(magnitudes.data(), static_cast<Eigen::Index>(magnitudes.size())), scales);
    }
    for (ScoredHypothesis& b : all) {
      if (b.kind == HypothesisKind::none || b.has_remainder() != a.has_remainder()) continue;
      if (b.effects.size() >= a.effects.size() || (b.kind == HypothesisKind::effect && !b.fitted())) continue;
      double explained = a.explained();
      std::size_t shared = 0;
      for (const std::string& e : a.effects)
        if (std::ranges::count(b.effects, e) > 0) ++shared;
        else explained -= std::max(beyond[e], 0.0);
      if (b.kind == HypothesisKind::unknown && !b.has_remainder()) explained -= penalty_nats;
      if (shared < b.effects.size() || b.log_prior + explained <= b.log_evidence) continue;
      b.log_evidence = b.log_prior + explained;
      b.predicted_with = a.predicted_with.empty() ? a.effects : a.predicted_with;
    }
  }
  for (ScoredHypothesis& b : all)
    if (b.kind == HypothesisKind::effect && !b.fitted()) b.log_evidence += parameters_alone(all).log_evidence - before;
}

/// How far a joint fit moves the coordinates of unknowns, by effect and index of the unknown.
using Moves = std::map<std::pair<std::string, Eigen::Index>, double>;

/// Moves by background magnitudes, of effects in of_models only: the background of others belongs to the flights, not
/// to the robot. `first`: NuisanceMean::place of the first background.
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

/// The parameters of a joint fit, and effects with its background magnitudes; one that would leave its accepted range
/// has none.
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
    for (const auto& [unknown, by] : moves) c.at[h.first_of(unknown.first) + unknown.second] += by;
    const VectorXd beyond = c.at - h.bounded(c.at);
    const auto left_out = std::erase_if(background, [&](const Background& b) {
      return std::ranges::any_of(b.moves, [&](const Background::Move& m) {
        return moves.contains({m.effect, m.unknown}) && std::abs(beyond[h.first_of(m.effect) + m.unknown]) > kBeyond;
      });
    });
    if (left_out == 0) return c;
  }
}

}  // namespace

// ---- evidence

/// An offset for each flight would otherwise look like an influence of that flight's height.
std::vector<std::size_t> Alone::offsets(const Flights& flights) const {
  std::vector<std::size_t> all;
  for (std::size_t f = 1; f < flights.size(); ++f) all.push_back(f);
  return all;
}

/// Blocks of few degrees of freedom have tails that hold any model error.
bool Alone::may_be_free(std::size_t block, const RegimeBasis& /*basis*/, const ModelDiscrepancy& discrepancy) const {
  return discrepancy.freedom_of(regimes_of_block(block)) >= discrepancy.spread.place_freedom;
}

Scales Alone::first_scales(const Scales& given, const std::function<double(const Scales&)>& /*log_evidence*/) const {
  return given;
}

// ---- fit

/// Errors of the laws of sensors hide behind those of the model.
bool Alone::law_may_deviate(const Unknown& magnitude) const { return !magnitude.in_log; }

/// The law of an effect by the place (near surfaces, at a tether, in time) may deviate from the catalogue's. An effect
/// acts by the place if more than half of its change follows functions of the place; along each of these, each load may
/// deviate by the rms of the loads times the law factor. Elsewhere the factor, which may be large, does not count, or a
/// heating motor would explain loads that depend on the heading.
BasisCoefficients Alone::law_sd(const Evidence& evidence, const std::string& /*effect*/,
                                const BasisCoefficients& change, double law_factor) const {
  const RegimeBasis& basis = evidence.basis();
  BasisCoefficients sd = BasisCoefficients::Zero(change.rows(), change.cols());
  const auto of_place = [&](int i) { return regimes_of(basis.kind(i)) == Regimes::place; };
  const auto load = [](int g) { return channel_of(g) <= kSpecificForceZ; };
  VectorXd squares = VectorXd::Zero(change.cols());
  double groups = 0, place = 0, all = 0, most = 0;
  for (int g = 0; g < kGroups; ++g) {
    const double signal = evidence.signal(g);
    if (!load(g) || !(signal > 0)) continue;
    squares += (change.row(g).transpose() / signal).cwiseAbs2();
    ++groups;
  }
  for (int i = 1; i < basis.size(); ++i) {
    all += squares[i];
    if (of_place(i)) place += squares[i], most = std::max(most, squares[i]);
  }
  if (!(place > all / 2)) return sd;
  for (int g = 0; g < kGroups; ++g)
    for (int i = 1; i < basis.size(); ++i)
      if (load(g) && of_place(i))
        sd(g, i) =
            (squares[i] > kFollows * most ? law_factor : 1) * std::sqrt(squares[i] / groups) * evidence.signal(g);
  return sd;
}

LawPrior Alone::law_prior(const ModelDiscrepancy& /*discrepancy*/) const { return {kLawFactorSd, kMaxLawFactor}; }

BasisCoefficients Alone::effects_discrepancy_sd(const Fitter& fitter, const Hypothesis& /*hypothesis*/,
                                                const Fit& /*fit*/) const {
  return fitter.evidence().discrepancy_sd(fitter.scales());
}

VectorXd Alone::next_effects(const Fitter& /*fitter*/, const Hypothesis& /*hypothesis*/, const Fit& /*fit*/,
                             const VectorXd& there, const BasisCoefficients& /*sd*/) const {
  return there;
}

NearSteps Alone::near_steps(const ModelDiscrepancy& discrepancy) const {
  return {[&discrepancy](const std::string& effect) {
            double most = 0;
            for (const std::string& name : backgrounds_of(effect))
              most = std::max(most, discrepancy.background_sd(name));
            return most;
          },
          true};
}

std::size_t Alone::minors(const sim::Randomisation& uncertain) const { return uncertain.draws() - uncertain.majors(); }

std::vector<Background> Alone::backgrounds(const RobotFit& robot, const ModelDiscrepancy& discrepancy) const {
  return robot.background(discrepancy, true);
}

void Alone::describe_rest(RobotFit& robot) const { robot.widen_backgrounds(); }

std::optional<Scales> Alone::larger_background(const RobotFit& robot, const Hypothesis& hypothesis, const Fit& fit,
                                               const Scales& now) const {
  return robot.larger_background(hypothesis, fit, now);
}

RobotFit Alone::fit_robot(const Flights& flights, const sim::Randomisation& uncertain, const InferenceOptions& options,
                          const ReferenceFit* /*reference*/) const {
  return RobotFit(*this, flights, uncertain, options.discrepancy, options.withheld, options.threads);
}

Fit Alone::fit_set(const Fitter& fitter, const Hypothesis& hypothesis, const VectorXd& start,
                   const Fit& parameters) const {
  return fitter.fit_effects(hypothesis, start, parameters);
}

std::optional<Fit> Alone::refit_jointly(const Fitter& fitter, const Hypothesis& hypothesis, const VectorXd& start,
                                        const Fit& parameters) const {
  return fitter.fit_given(hypothesis, start, parameters, kFitIterations);
}

// ---- verdict

VerdictRule Alone::rule(const RobotFit& /*robot*/, VerdictRule given) const { return given; }

double Alone::log_evidence_of_none(const RobotFit& robot) const {
  return robot.weigh(robot.no_effects(), robot.nominal(), robot.fitter().scales()).posterior.log_evidence;
}

std::vector<TestResiduals> Alone::held_out(const Fitter& fitter, const Flights& flights,
                                           const std::vector<FittedHypothesis>& fits, const std::vector<int>& fold,
                                           int threads) const {
  return held_out_by_simulation(fitter, flights, fits, fold, true, threads);
}

void Alone::refute(const RobotFit& robot, const Fitter& fitter, const Flights& flights, const VerdictRule& rule,
                   Inference& d) const {
  share_backgrounds(robot, fitter.scales(), rule.unknown.penalty_nats, d.hypotheses);
  const auto acts_on_bench = [&](const std::string& effect) {
    return std::ranges::any_of(robot.magnitudes(), [&](const MagnitudeColumn& m) {
      return m.effect == effect && m.change.bottomRows(kGroups - kFlownGroups).cwiseAbs().maxCoeff() > kNoChange;
    });
  };
  refute_idle_effects(flights.tests, acts_on_bench, d);
}

void refute_idle_effects(const FlightList& tests, const std::function<bool(const std::string&)>& acts_on_bench,
                         Inference& d) {
  const RowContext context = row_context_of(tests, d.noise_sd);
  const Losses alone = losses_of(context, d.refit);
  std::vector<ScoredHypothesis>& all = d.hypotheses;
  std::vector<Losses> losses;
  for (const ScoredHypothesis& a : all) losses.push_back(losses_of(context, a.held_out));
  const auto idle = [&](std::size_t with, const Losses& without, const std::string& effect) {
    if (all[with].held_out.empty() || without.sum.empty()) return false;
    const auto lowers = [&](bool on_bench) {
      const std::optional<double> before = without.mean(on_bench), after = losses[with].mean(on_bench);
      return before && after && *after < *before;  // none after: it diverges
    };
    return !lowers(false) && !(acts_on_bench(effect) && lowers(true));
  };
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (!all[i].fitted()) continue;
    bool refuted = all[i].effects.size() == 1 && idle(i, alone, all[i].effects[0]);
    for (std::size_t k = 0; k < all.size(); ++k) {
      const ScoredHypothesis& part = all[k];
      std::vector<std::string> more;
      std::ranges::copy_if(all[i].effects, std::back_inserter(more),
                           [&](const std::string& e) { return std::ranges::count(part.effects, e) == 0; });
      refuted |= part.fitted() && part.has_remainder() == all[i].has_remainder() &&
                 part.effects.size() + 1 == all[i].effects.size() && more.size() == 1 && idle(i, losses[k], more[0]);
    }
    if (refuted) all[i].log_evidence = kRefuted;
  }
}

std::string pool_of(const ScoredHypothesis& a) {
  return a.kind == HypothesisKind::effect ? pool_name(a.effects) : "/" + std::string(name_of(a.kind));
}

std::string Alone::pool(const ScoredHypothesis& hypothesis) const { return pool_of(hypothesis); }

void Alone::choose_predicting(Inference& d) const { predict_with_the_likeliest(d); }

std::optional<Validation> Alone::validate(const Fitter& /*fitter*/, const sim::Randomisation& /*uncertain*/,
                                          const Flights& /*flights*/, const Inference& /*d*/, int /*threads*/) const {
  return std::nullopt;
}

// ---- corrected vehicle

CorrectedParameters Alone::joint_parameters(const RobotFit& robot, const Fitter& without_background,
                                            const Hypothesis& hypothesis, const Fit& fit) {
  const Fitter::JointFit joint = without_background.joint_fit(hypothesis, fit, without_background.all_flights());
  return {hypothesis.effects(), joint.at, robot.minors_given(joint)};
}

/// Parameters would make up for what background magnitudes explain, so the vehicle has these too. All are fitted once
/// more around them: the columns of `fit` hold only nearby.
CorrectedParameters Alone::by_themselves(const RobotFit& robot, const Fitter& fitter, const Hypothesis& hypothesis,
                                         const Fit& fit) const {
  const Fitter without = fitter.without_background();
  CorrectedParameters c = with_background(robot, fitter, hypothesis, fit);
  const Hypothesis h(robot.uncertain(), c.effects);
  if (const Fit there = without.fit(h, h.bounded(c.at), 0); there.flown())
    c = joint_parameters(robot, without, h, there);
  return c;
}

namespace {

/// Parameters are fitted one by one, so together they may describe a body that cannot exist: halfway to `fit`, which
/// does.
CorrectedParameters made_possible(CorrectedParameters c, const RobotFit& robot, const Fit& fit) {
  sim::Randomisation uncertain = robot.uncertain();
  uncertain.set_minors(c.minors);
  c.minors = uncertain.minors();
  const Hypothesis h(uncertain, c.effects);
  VectorXd possible = h.start();
  possible.head(fit.at.size()) = fit.at;
  for (int n = 0; n < kMaxHalvings && model::physical_fault(h.vehicle(c.at).vehicle); ++n) c.at = (c.at + possible) / 2;
  return c;
}

}  // namespace

CorrectedParameters Alone::correct(const RobotFit& robot, const Fitter& fitter, const ReferenceFit* /*reference*/,
                                   const Inference& d) const {
  const ScoredHypothesis& answer = d.predicting();
  const bool has_effects = answer.kind == HypothesisKind::effect;
  const Hypothesis h(robot.uncertain(), has_effects ? answer.effects : std::vector<std::string>{});
  if (has_effects && !answer.fitted()) return {h.effects(), h.bounded(answer.fit.mean()), d.minors};
  const Fit& fit = has_effects ? answer.fit : d.parameters;
  return made_possible(by_themselves(robot, fitter, h, fit), robot, fit);
}

CorrectedParameters corrected_without_effects(const FlightList& flights, const sim::Randomisation& uncertain,
                                              const InferenceOptions& options) {
  const Flights alone{{}, flights};
  const Question& question = question_of(alone);
  const RobotFit robot = question.fit_robot(alone, uncertain, options, nullptr);
  Inference d;
  d.hypotheses.emplace_back();  // the parameters alone
  d.parameters = robot.parameters();
  return question.correct(robot, robot.fitter(), nullptr, d);
}

// ---- next flight

Rival Alone::rival(const ScoredHypothesis& hypothesis, const Inference& d, const sim::Randomisation& uncertain,
                   const sim::Randomisation& as_filed) const {
  if (hypothesis.kind == HypothesisKind::none) {
    const Hypothesis h(as_filed, hypothesis.effects);
    return certain_rival(hypothesis, h, h.start());
  }
  Rival r = fitted_rival(hypothesis, d, uncertain);
  r.at = r.hypothesis.bounded(std::move(r.at));
  return r;
}

std::vector<SharedColumn> Alone::known_columns(const Rival& rival, const std::optional<Fit>& first) const {
  if (!first) return {};
  return turned(*first, rival.directions, rival.hypothesis.shared());
}

}  // namespace flappy::gap
