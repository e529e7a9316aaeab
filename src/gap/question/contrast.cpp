#include "gap/question/contrast.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "gap/question/alone.hpp"
#include "gap/question/changes_seen.hpp"
#include "io/parallel.hpp"
#include "model/effects/registry.hpp"

namespace flappy::gap {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Another law of the same cause changes a coefficient of the tests by a share of the effect's change:
/// half of the square where the effect changes it, half in other harmonics and axes of channels of the same kind.
BasisCoefficients spread_of(const Evidence& evidence, const BasisCoefficients& change) {
  const RegimeBasis& basis = evidence.basis();
  const auto kind = [](int g) {
    const int channel = channel_of(g);
    return channel <= kAngularAccelerationZ ? 0 : channel <= kSpecificForceZ ? 1 : 2;
  };
  MatrixXd squares = MatrixXd::Zero(3, basis.size());
  VectorXd groups = VectorXd::Zero(3);
  for (int g = 0; g < kGroups; ++g) {
    if (!(evidence.signal(g) > 0)) continue;
    squares.row(kind(g)) += (change.row(g) / evidence.signal(g)).cwiseAbs2();
    groups[kind(g)] += 1;
  }
  BasisCoefficients spread = BasisCoefficients::Zero(change.rows(), change.cols());
  for (int g = 0; g < kGroups; ++g)
    for (int i = 0; i < basis.size(); ++i)
      if (basis.of_tests(i) && evidence.signal(g) > 0)
        spread(g, i) = std::sqrt(0.5 * std::pow(change(g, i), 2) +
                                 0.5 * std::pow(evidence.signal(g), 2) * squares(kind(g), i) / groups[kind(g)]);
  return spread;
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

}  // namespace

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
    const Eigen::Index to = h.first_of(effect), from = of_reference.first_of(effect);
    for (Eigen::Index k = 0; k < static_cast<Eigen::Index>(unknowns_of(effect).size()); ++k) {
      if (alone) c.at[to + k] = reference.at[from + k];
      else if (h.unknowns()[static_cast<std::size_t>(to + k)].magnitude)
        c.at[to + k] += reference.at[from + k] - of_reference.start()[from + k];
    }
  }
  c.at = h.bounded(std::move(c.at));
  return c;
}

ReferenceFit::ReferenceFit(const FlightList& references, const sim::Randomisation& uncertain,
                           const InferenceOptions& options)
    : flights{references, {}},
      fit(RobotFit::of_references(question_of(flights), flights, uncertain, options.discrepancy, options.withheld,
                                  options.threads)),
      corrected{{}, fit.parameters().at, fit.uncertain().minors()} {
  // a contrast needs no description of what the model gets wrong, but a corrected vehicle with wings does
  if (!flights[0]->is_averaged()) corrected = corrected_without_effects(references, uncertain, options);
}

// ---- evidence

/// The first flight of each session has none.
std::vector<std::size_t> Contrast::offsets(const Flights& flights) const {
  std::vector<std::size_t> all;
  for (std::size_t f = 1; f < flights.size(); ++f)
    if (f != flights.references.size()) all.push_back(f);
  return all;
}

std::vector<std::size_t> Contrast::apart(const Flights& flights) const {
  std::vector<std::size_t> tests;
  for (std::size_t f = flights.references.size(); f < flights.size(); ++f) tests.push_back(f);
  return tests;
}

/// Errors of the model cancel in the test flights, if references show them.
bool Contrast::may_be_free(std::size_t block, const RegimeBasis& basis, const ModelDiscrepancy& /*discrepancy*/) const {
  return block_of_tests(block) && basis.covers(regimes_of_block(block));
}

/// All scales of the test flights times the power of two with the largest evidence: single steps are short. First in
/// steps of four, over the whole range: with deviations of a law the evidence has a valley between two hills.
Scales Contrast::first_scales(const Scales& given, const std::function<double(const Scales&)>& log_evidence) const {
  // Factors on the given scales. Choice.
  constexpr double kFirst[] = {0.25, 4, 16, 64, 256}, kThen[] = {0.5, 2};
  Scales best = given;
  double most = log_evidence(given);
  const auto search = [&](const Scales from, std::span<const double> factors) {
    for (const double factor : factors) {
      Scales next = from;
      next.session *= factor;
      for (std::size_t b = 0; b < kBlocks; ++b)
        if (block_of_tests(b) && !next.free[b]) next.blocks[b] *= factor;
      if (const double value = log_evidence(next); value > most) most = value, best = next;
    }
  };
  search(given, kFirst);
  search(best, kThen);
  return best;
}

// ---- fit

BasisCoefficients Contrast::law_sd(const Evidence& evidence, const std::string& effect, const BasisCoefficients& change,
                                   double law_factor) const {
  return law_factor * evidence.discrepancy().session.law_error_of(effect) * spread_of(evidence, change);
}

LawPrior Contrast::law_prior(const ModelDiscrepancy& discrepancy) const {
  return {discrepancy.session.law_spread, discrepancy.session.law_most};
}

/// What another law of the cause leaves is larger than what sessions differ by.
BasisCoefficients Contrast::effects_discrepancy_sd(const Fitter& fitter, const Hypothesis& hypothesis,
                                                   const Fit& fit) const {
  return fitter.discrepancy_sd(hypothesis, fit);
}

/// The point with the largest evidence among a fit, points from it to `there`, and points from it to no effect: the
/// step of a linear model may lead to where the model does not hold.
VectorXd Contrast::next_effects(const Fitter& fitter, const Hypothesis& hypothesis, const Fit& fit,
                                const VectorXd& there, const BasisCoefficients& sd) const {
  const Index shared = hypothesis.shared(), effects = hypothesis.size() - shared;
  for (Index i = shared; i < hypothesis.size(); ++i)
    if (hypothesis.unknowns()[static_cast<std::size_t>(i)].in_log) return there;  // linear
  // Points on the way from a fit to where the linear model leads, as shares of it. Choice.
  constexpr double kOnTheWay[] = {1, 0.5, 0.2};
  // Magnitudes of further points, as shares of those of the fit. Choice.
  constexpr double kShrunk[] = {0.5, 0.2};
  std::vector<VectorXd> tries;
  for (const double share : kOnTheWay) tries.push_back(hypothesis.bounded(fit.at + share * (there - fit.at)));
  for (const double share : kShrunk) {
    tries.push_back(fit.at);
    tries.back().tail(effects) *= share;
    tries.back() = hypothesis.bounded(tries.back());
  }
  std::vector<VehicleHypothesis> vehicles;
  for (const VectorXd& at : tries) vehicles.push_back(hypothesis.vehicle(at));
  std::vector<Residuals> rest = residuals(fitter.flights(), vehicles, fitter.threads());
  rest.push_back(fit.residual);
  tries.push_back(fit.at);
  Fit parameters = fit;
  parameters.columns.resize(static_cast<std::size_t>(shared));
  parameters.directions.axes.conservativeResize(Eigen::NoChange, shared);
  const Regressors r = fitter.regressors(parameters);
  const VectorXd prior_mean = r.prior_mean();
  std::vector<SufficientStatistics> statistics(rest.size());
  io::parallel_for(rest.size(), fitter.threads(), [&](std::size_t i) {
    if (!rest[i].empty()) statistics[i] = fitter.evidence().statistics(rest[i]);
  });
  const std::vector<std::optional<Reduced>> reduced =
      fitter.evidence().reduce_each(statistics, r.columns, fitter.all_flights(), sd);
  std::vector<double> values(tries.size(), -std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < tries.size(); ++i)
    if (reduced[i])
      values[i] = Evidence::posterior(*reduced[i], r.all, prior_mean, false).log_evidence -
                  0.5 * tries[i].tail(effects).squaredNorm();
  return tries[static_cast<std::size_t>(std::ranges::max_element(values) - values.begin())];
}

/// Sessions differ by small magnitudes.
NearSteps Contrast::near_steps(const ModelDiscrepancy& discrepancy) const {
  return {[&discrepancy](const std::string& effect) { return discrepancy.session.background_sd(effect); }, false, true};
}

/// What changes between sessions; then, where references do not cover the regimes of the tests, so that errors of the
/// model do not cancel, what the model gets wrong in both.
std::vector<Background> Contrast::backgrounds(const RobotFit& robot, const ModelDiscrepancy& discrepancy) const {
  std::vector<Background> list = robot.session_changes(discrepancy.session);
  if (robot.evidence().basis().covers_all()) return list;
  for (const Background& b : robot.background(discrepancy, false))
    list.push_back({kModelOf + b.effect, robot.evidence().basis().in_all(b.column)});
  return list;
}

std::optional<Scales> Contrast::larger_background(const RobotFit& robot, const Hypothesis& hypothesis, const Fit& fit,
                                                  const Scales& now) const {
  return robot.larger_background(hypothesis, fit, now);
}

/// An effect's magnitude acts in the test flights alone; the parameters are those of the references.
RobotFit Contrast::fit_robot(const Flights& flights, const sim::Randomisation& /*uncertain*/,
                             const InferenceOptions& /*options*/, const ReferenceFit* reference) const {
  return RobotFit(*this, reference->fit, flights);
}

Fit Contrast::fit_set(const Fitter& fitter, const Hypothesis& hypothesis, const VectorXd& start,
                      const Fit& parameters) const {
  return fitter.fit_effects(hypothesis, start, parameters);
}

std::optional<Fit> Contrast::refit_jointly(const Fitter& /*fitter*/, const Hypothesis& /*hypothesis*/,
                                           const VectorXd& /*start*/, const Fit& /*parameters*/) const {
  return std::nullopt;
}

// ---- verdict

/// Effects of models gain more by chance where references do not cover the regimes of the tests.
VerdictRule Contrast::rule(const RobotFit& robot, VerdictRule given) const {
  if (robot.evidence().basis().covers_all()) return given;
  given.gain.outside_by_chance_nats = given.gain.by_chance_nats;
  given.gain.by_chance_nats = given.gain.uncovered_by_chance_nats;
  for (const model::CatalogueEffect& e : model::catalogue_of(robot.uncertain().nominal()))
    if (!std::ranges::count(robot.evidence().discrepancy().of_models, e.info.id))
      given.gain.outside.emplace_back(e.info.id);
  return given;
}

/// Nothing at all changed since the references.
double Contrast::log_evidence_of_none(const RobotFit& robot) const {
  // Under the hypothesis none, changes are so small a share of those between sessions. Choice: they have no effect.
  constexpr double kNothing = 1e-3;
  ModelDiscrepancy d = robot.evidence().discrepancy();
  for (auto& channel : d.session.shares)
    for (auto& harmonic : channel)
      for (double& share : harmonic) share *= kNothing;
  for (auto& [effect, sd] : d.session.background) sd *= kNothing;
  for (auto& [name, sd] : d.session.parameters) sd *= kNothing;
  const Fitter unchanged = robot.fitter_given(d);
  return unchanged.evidence()
      .weigh(robot.parameters().statistics, unchanged.unscaled_regressors(robot.parameters()), unchanged.all_flights(),
             {}, unchanged.scales())
      .posterior.log_evidence;
}

namespace {

/// Nats that deviations of t times those of a harmless change of standard magnitude cost (contrast.hpp).
double cost_of_other_law(double t, const SessionVariation& session) {
  // Step of the grid of log f. Choice.
  constexpr double kGrid = 0.1;
  double least = std::numeric_limits<double>::infinity();
  for (double log_f = 0; log_f <= std::log(session.law_most); log_f += kGrid)
    least = std::min(least, 0.5 * std::pow(log_f / session.law_spread, 2) + 0.5 * std::pow(t / std::exp(log_f), 2));
  return least;
}

}  // namespace

OtherLaws Contrast::other_laws(const RobotFit& robot, const Hypothesis& hypothesis, const Fit& fit) const {
  // Factors F that are tried, from the largest on. Choice: deviations of what sessions differ by are smaller than those
  // of an effect.
  constexpr double kFactors[] = {4, 2, 1, 0.5, 0.25, 0.125, 0.0625};
  const SessionVariation& session = robot.evidence().discrepancy().session;
  const std::string& effect = hypothesis.effects().front();
  const double s = session.of_magnitude(kSessionOf + effect).centre * session.background_sd(effect);
  double m2 = 0;
  for (Index i = hypothesis.shared(); i < hypothesis.size(); ++i)
    if (hypothesis.unknowns()[static_cast<std::size_t>(i)].magnitude) m2 += fit.at[i] * fit.at[i];
  OtherLaws best;
  const Regressors regressors = robot.fitter().unscaled_regressors(robot.parameters());
  for (const double factor : kFactors) {
    const double value = robot.evidence()
                             .weigh(robot.parameters().statistics, regressors, robot.fitter().all_flights(),
                                    robot.fitter().law_sd(hypothesis, fit, factor), robot.fitter().scales())
                             .posterior.log_evidence;
    const double harmless =
        s > 0 ? value - cost_of_other_law(factor * std::sqrt(m2) / s, session) : best.log_evidence_of_harmless;
    if (value < best.log_evidence && harmless < best.log_evidence_of_harmless) break;
    best.log_evidence = std::max(best.log_evidence, value);
    best.log_evidence_of_harmless = std::max(best.log_evidence_of_harmless, harmless);
  }
  return best;
}

/// References hold the parameters where they were linearised, so the columns predict.
std::vector<TestResiduals> Contrast::held_out(const Fitter& fitter, const Flights& flights,
                                              const std::vector<FittedHypothesis>& fits, const std::vector<int>& fold,
                                              int /*threads*/) const {
  const std::size_t first = flights.references.size();
  const std::vector<std::vector<char>> others = others_of(flights, fold);
  std::vector<TestResiduals> rest(fits.size(), TestResiduals(fold.size()));
  for (std::size_t i = 0; i < fits.size(); ++i)
    for (std::size_t k = 0; k < others.size(); ++k) {
      const BasisCoefficients explained = fitter.explained(*fits[i].fit, others[k]);
      for (std::size_t f = 0; f < fold.size(); ++f)
        if (fold[f] == static_cast<int>(k))
          rest[i][f] = fitter.evidence().without(first + f, fits[i].fit->residual[first + f], explained);
    }
  return rest;
}

/// In none and parameters, nothing that matters changed.
std::string contrast_pool_of(const ScoredHypothesis& hypothesis) {
  if (hypothesis.kind == HypothesisKind::none) return "/" + std::string(name_of(HypothesisKind::parameters));
  return pool_of(hypothesis);
}

std::string Contrast::pool(const ScoredHypothesis& hypothesis) const { return contrast_pool_of(hypothesis); }

void Contrast::choose_predicting(Inference& d) const { predict_with_the_likeliest(d); }

std::optional<Validation> Contrast::validate(const Fitter& /*fitter*/, const sim::Randomisation& /*uncertain*/,
                                             const Flights& /*flights*/, const Inference& /*d*/,
                                             int /*threads*/) const {
  return std::nullopt;
}

std::vector<SeenQuantity> Contrast::seen(const RobotFit& robot) const { return changes_seen(robot); }

// ---- corrected vehicle

/// The parameters of the references, moved by changed_since, and the effects of the tests.
CorrectedParameters Contrast::correct(const RobotFit& robot, const Fitter& fitter, const ReferenceFit* reference,
                                      const Inference& d) const {
  const ScoredHypothesis& answer = d.predicting();
  const bool has_effects = answer.kind == HypothesisKind::effect;
  const Hypothesis h(robot.uncertain(), has_effects ? answer.effects : std::vector<std::string>{});
  CorrectedParameters c =
      with_effects(robot.uncertain(), reference->corrected, h, has_effects ? answer.fit.mean() : h.start());
  c.at.head(h.shared()) += changed_since(robot, fitter, answer, d);
  c.at = Hypothesis(robot.uncertain(), c.effects).bounded(std::move(c.at));
  return c;
}

// ---- next flight

/// All rivals have the parameters of the references, so they differ by their effects alone.
Rival Contrast::rival(const ScoredHypothesis& hypothesis, const Inference& d, const sim::Randomisation& uncertain,
                      const sim::Randomisation& /*as_filed*/) const {
  const Hypothesis h(uncertain, hypothesis.effects);
  if (hypothesis.kind != HypothesisKind::effect) return certain_rival(hypothesis, h, d.parameters.at);
  Rival r = fitted_rival(hypothesis, d, uncertain);
  r.at.head(h.shared()) = d.parameters.at;
  r.at = h.bounded(std::move(r.at));
  r.covariance.topRows(h.shared()).setZero();
  r.covariance.leftCols(h.shared()).setZero();
  return r;
}

/// The parameters are certain: no columns.
std::vector<SharedColumn> Contrast::known_columns(const Rival& rival, const std::optional<Fit>& /*first*/) const {
  return std::vector<SharedColumn>(static_cast<std::size_t>(rival.hypothesis.shared()));
}

}  // namespace flappy::gap
