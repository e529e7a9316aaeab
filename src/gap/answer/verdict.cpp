#include "gap/answer/verdict.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "gap/question/validation.hpp"
#include "model/effects/registry.hpp"

namespace flappy::gap {
namespace {

using Eigen::VectorXd;

/// Refuted only if the regime explains more than this share of the parameters' residual. Choice: less may be chance.
constexpr double kMinExplainable = 0.15;

/// Refutes hypotheses that explain too little of what depends on the regime in held-out flights, however probable.
void refute(const Evidence& evidence, const Flights& flights, double min_share, Inference& d) {
  const double refit = mean_square(evidence, flights.tests, d.refit);
  const double explainable = refit - mean_square(evidence, flights.tests, smoothed_away(evidence, flights, d.refit));
  if (!(explainable > kMinExplainable * refit)) return;
  for (ScoredHypothesis& a : d.hypotheses) {
    if (a.kind == HypothesisKind::unknown) continue;
    const double rest = a.kind == HypothesisKind::none ? mean_square(evidence, flights.tests, d.nominal)
                        : a.fitted()                   ? mean_square(evidence, flights.tests, a.held_out)
                                                       : refit;
    const double share = (refit - rest) / explainable;
    if (share < min_share) a.log_evidence = kRefuted;
  }
}

/// With the probability by evidence and priors.
void conclude_by_evidence(const VerdictRule& rule, const PoolOf& pool_of_each, Inference& d) {
  struct Pool {
    double probability = 0;
    std::size_t best = 0;
  };
  const std::vector<ScoredHypothesis>& all = d.hypotheses;
  std::map<std::string, Pool> pools;  // by key: "/" tells other kinds from groups of effects
  for (std::size_t i = 0; i < all.size(); ++i) {
    const auto [at, fresh] = pools.try_emplace(pool_of_each(all[i]), Pool{0, i});
    at->second.probability += all[i].probability;
    if (all[i].probability > all[at->second.best].probability) at->second.best = i;
  }
  d.verdict = {};
  d.concluded = 0;
  if (pools.empty()) return;
  const auto groups_of = [](const ScoredHypothesis& a) {
    std::set<std::string> groups;
    for (const std::string& e : a.effects) groups.insert(pool_name({e}));
    return groups;
  };
  // where nobody may say "unchanged", the question is only what changed
  const bool changed = changed_plainly(d.seen);
  const auto counted = [&](const auto& named) {
    const auto& [own_name, own] = named;
    if (own_name.starts_with('/')) return own.probability;
    double present = 0;
    for (const ScoredHypothesis& a : all)
      if (std::ranges::includes(groups_of(a), groups_of(all[own.best]))) present += a.probability;
    return changed || present >= rule.naming.least ? own.probability : 0;
  };
  const auto& [name, pool] = *std::ranges::max_element(pools, {}, counted);
  const ScoredHypothesis& best = all[pool.best];
  d.concluded = pool.best;
  d.verdict.effects = best.effects;
  d.verdict.probability = best.probability;
  d.verdict.remainder = best.kind == HypothesisKind::effect && best.has_remainder();
  switch (best.kind) {
    case HypothesisKind::none:
    case HypothesisKind::parameters:
      d.verdict.kind = best.kind == HypothesisKind::none ? VerdictKind::none : VerdictKind::parameters;
      d.verdict.probability = pool.probability;
      return;
    case HypothesisKind::unknown:
      d.verdict.kind = VerdictKind::unknown;
      return;
    case HypothesisKind::effect:
      break;
  }
  d.verdict.kind = VerdictKind::effect;
  if (best.probability >= rule.naming.of_all || best.probability >= rule.naming.of_pool * pool.probability) return;
  d.verdict.kind = VerdictKind::group;
  d.verdict.probability = pool.probability;
  for (const ScoredHypothesis& a : all) {
    if (pool_of_each(a) != name || a.probability < rule.naming.member_of_pool * pool.probability) continue;
    for (const std::string& e : a.effects)
      if (!std::ranges::count(d.verdict.effects, e)) d.verdict.effects.push_back(e);
  }
}

}  // namespace

void widen(Fit& fit, const Hypothesis& hypothesis, const VerdictRule& rule) {
  const VectorXd mean = fit.mean();
  Eigen::MatrixXd& covariance = fit.posterior.covariance;
  for (Eigen::Index i = hypothesis.shared(); i < hypothesis.size(); ++i) {
    covariance.row(i) *= rule.interval.sd_factor;
    covariance.col(i) *= rule.interval.sd_factor;
    if (hypothesis.unknowns()[static_cast<std::size_t>(i)].magnitude)
      covariance(i, i) += std::pow(rule.interval.magnitude_error * mean[i], 2);
  }
}

double beyond_chance(const ScoredHypothesis& a, const std::vector<ScoredHypothesis>& all, const VerdictRule& rule) {
  const auto parameters = std::ranges::find(all, HypothesisKind::parameters, &ScoredHypothesis::kind);
  const double baseline = parameters == all.end() ? 0 : parameters->explained();
  /// Largest gain of fewer effects, or of the same without a remainder.
  const auto gain_of_part = [&](std::size_t effects) {
    double most = 0;
    for (const ScoredHypothesis& b : all)
      if (b.kind == HypothesisKind::effect && !b.has_remainder() && b.effects.size() == effects &&
          std::ranges::all_of(b.effects, [&](const std::string& e) { return std::ranges::count(a.effects, e) > 0; }))
        most = std::max(most, b.explained() - baseline);
    return most;
  };
  const double gain = a.explained() - baseline;
  const bool unknown = a.kind == HypothesisKind::unknown || a.has_remainder();
  double chance = unknown ? rule.gain.by_chance_nats : 0;
  for (const std::string& e : a.effects) chance += rule.gain.chance_of(e);
  for (std::size_t n = 1; n < a.effects.size(); ++n) chance += rule.gain.further_share * gain_of_part(n);
  if (!a.effects.empty() && a.has_remainder()) chance += rule.gain.remainder_share * gain_of_part(a.effects.size());
  return a.log_prior + baseline + std::max(gain - chance, std::min(gain, 0.0));
}

double tempered(double nats, const VerdictRule& rule) {
  return std::exp(-rule.tempering.freedom / 2 * std::log1p(2 * nats / (rule.tempering.nats * rule.tempering.freedom)));
}

void set_probabilities(std::vector<ScoredHypothesis>& hypotheses, const VerdictRule& rule) {
  std::vector<double> explained;
  for (const ScoredHypothesis& a : hypotheses) explained.push_back(beyond_chance(a, hypotheses, rule) - a.log_prior);
  const double most = explained.empty() ? 0 : *std::ranges::max_element(explained);
  double sum = 0;
  for (std::size_t i = 0; i < hypotheses.size(); ++i) {
    ScoredHypothesis& a = hypotheses[i];
    a.probability = std::exp(a.log_prior) * tempered(most - explained[i], rule);
    sum += a.probability;
  }
  for (ScoredHypothesis& a : hypotheses) a.probability /= sum;
  std::ranges::stable_sort(hypotheses, std::greater{}, &ScoredHypothesis::probability);
}

void conclude(const VerdictRule& rule, const PoolOf& pool, Inference& d) {
  conclude_by_evidence(rule, pool, d);
  d.verdict.probability = rule.said(d.verdict.probability);
}

void decide(const Question& question, const RobotFit& robot, const Fitter& fitter, const Flights& flights,
            const VerdictRule& rule, Inference& d) {
  if (rule.refutation.min_share > 0) refute(robot.evidence(), flights, rule.refutation.min_share, d);
  question.refute(robot, fitter, flights, rule, d);
  set_probabilities(d.hypotheses, rule);
  if (changed_plainly(d.seen)) exclude_unchanged(d.hypotheses);
  conclude(
      rule, [&](const ScoredHypothesis& a) { return question.pool(a); }, d);
  question.choose_predicting(d);
}

}  // namespace flappy::gap
