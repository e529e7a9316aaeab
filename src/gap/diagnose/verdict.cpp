#include "gap/diagnose/verdict.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "model/effects/registry.hpp"

namespace flappy::gap {

const char* kind_name(Conclusion::Kind kind) {
  static const char* const kNames[] = {"effect", "group", "parameters", "none", "unknown", "data"};
  return kNames[static_cast<int>(kind)];
}

const char* kind_name(ScoredHypothesis::Kind kind) {
  static const char* const kNames[] = {"none", "parameters", "effect", "unknown"};
  return kNames[static_cast<int>(kind)];
}

std::string pool_name(const std::vector<std::string>& effects) {
  std::vector<std::string> groups;
  for (const std::string& e : effects) groups.push_back(model::group_of(e));
  std::ranges::sort(groups);
  std::string name;
  for (const std::string& g : groups) name += (name.empty() ? "" : "+") + g;
  return name;
}

void widen(Fit& fit, const Hypothesis& hypothesis, const VerdictRule& rule) {
  const Eigen::VectorXd mean = fit.mean();
  Eigen::MatrixXd& covariance = fit.posterior.covariance;
  for (Eigen::Index i = hypothesis.shared(); i < hypothesis.size(); ++i) {
    covariance.row(i) *= rule.interval.sd_factor;
    covariance.col(i) *= rule.interval.sd_factor;
    if (hypothesis.unknowns()[static_cast<std::size_t>(i)].size)
      covariance(i, i) += std::pow(rule.interval.size_error * mean[i], 2);
  }
}

double beyond_chance(const ScoredHypothesis& a, double plain, const VerdictRule& rule) {
  const double gain = a.log_evidence - a.log_prior - plain;
  const bool more = a.kind == ScoredHypothesis::Kind::unknown || !a.terms.empty();
  double chance = more ? rule.gain.by_chance_nats : 0;
  for (const std::string& e : a.effects) chance += rule.gain.chance_of(e);
  return a.log_prior + plain + std::max(gain - chance, std::min(gain, 0.0));
}

double kept_against(double nats, const VerdictRule& rule) {
  return std::exp(-rule.doubt.freedom / 2 * std::log1p(2 * nats / (rule.doubt.nats * rule.doubt.freedom)));
}

void set_probabilities(std::vector<ScoredHypothesis>& hypotheses, const VerdictRule& rule) {
  const auto parameters = std::ranges::find(hypotheses, ScoredHypothesis::Kind::parameters, &ScoredHypothesis::kind);
  const double plain = parameters == hypotheses.end() ? 0 : parameters->log_evidence - parameters->log_prior;
  double most = -std::numeric_limits<double>::infinity(), sum = 0;
  for (const ScoredHypothesis& a : hypotheses) most = std::max(most, beyond_chance(a, plain, rule) - a.log_prior);
  for (ScoredHypothesis& a : hypotheses) {
    const double behind = most + a.log_prior - beyond_chance(a, plain, rule);
    a.probability = std::exp(a.log_prior) * kept_against(behind, rule);
    sum += a.probability;
  }
  for (ScoredHypothesis& a : hypotheses) a.probability /= sum;
  std::ranges::stable_sort(hypotheses, std::greater{}, &ScoredHypothesis::probability);
}

Conclusion conclude(const std::vector<ScoredHypothesis>& hypotheses, const VerdictRule& rule) {
  struct Pool {
    double mass = 0;
    std::size_t best = 0;
  };
  std::map<std::string, Pool> pools;  // no effect has the name of another kind
  const auto key = [](const ScoredHypothesis& a) {
    return a.kind == ScoredHypothesis::Kind::effect ? pool_name(a.effects) : "/" + std::string(kind_name(a.kind));
  };
  for (std::size_t i = 0; i < hypotheses.size(); ++i) {
    const auto [at, fresh] = pools.try_emplace(key(hypotheses[i]), Pool{0, i});
    at->second.mass += hypotheses[i].probability;
    if (hypotheses[i].probability > hypotheses[at->second.best].probability) at->second.best = i;
  }
  Conclusion c;
  if (pools.empty()) return c;
  const auto& [name, pool] = *std::ranges::max_element(pools, {}, [](const auto& named) { return named.second.mass; });
  const ScoredHypothesis& best = hypotheses[pool.best];
  c.hypothesis = pool.best;
  c.probability = best.probability;
  c.effects = best.effects;
  c.remainder = best.kind == ScoredHypothesis::Kind::effect && !best.terms.empty();
  switch (best.kind) {
    case ScoredHypothesis::Kind::none:
      c.kind = Conclusion::Kind::none;
      return c;
    case ScoredHypothesis::Kind::parameters:
      c.kind = Conclusion::Kind::parameters;
      return c;
    case ScoredHypothesis::Kind::unknown:
      c.kind = Conclusion::Kind::unknown;
      return c;
    case ScoredHypothesis::Kind::effect:
      break;
  }
  c.kind = Conclusion::Kind::effect;
  if (best.probability >= rule.naming.of_all || best.probability >= rule.naming.of_pool * pool.mass) return c;
  c.kind = Conclusion::Kind::group;
  c.probability = pool.mass;
  for (const ScoredHypothesis& a : hypotheses) {
    if (key(a) != name || a.probability < rule.naming.member_of_pool * pool.mass) continue;
    for (const std::string& e : a.effects)
      if (!std::ranges::count(c.effects, e)) c.effects.push_back(e);
  }
  return c;
}

void fly_the_likeliest(std::vector<ScoredHypothesis>& hypotheses, const Conclusion& conclusion) {
  ScoredHypothesis& concluded = hypotheses[conclusion.hypothesis];
  if (concluded.kind == ScoredHypothesis::Kind::none) return;
  const auto names = [](const ScoredHypothesis& a) { return std::set(a.effects.begin(), a.effects.end()); };
  double most = concluded.log_evidence;
  for (const ScoredHypothesis& a : hypotheses)
    if (a.fitted() && a.terms.empty() == concluded.terms.empty() && a.log_evidence > most &&
        std::ranges::includes(names(a), names(concluded)))
      most = a.log_evidence, concluded.flown_with = a.effects;
}

}  // namespace flappy::gap
