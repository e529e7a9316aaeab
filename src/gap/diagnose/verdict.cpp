#include "gap/diagnose/verdict.hpp"

#include <algorithm>
#include <cmath>
#include <map>

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

bool refuted(const Losses& parameters, const Losses& effects, const VerdictRule& rule) {
  const auto before = parameters.mean(), after = effects.mean();
  return before && after && *after - *before > rule.refutation.share_of_gap * (*before - huber_floor());
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

void set_probabilities(std::vector<ScoredHypothesis>& hypotheses, const VerdictRule& rule) {
  std::ranges::sort(hypotheses, std::greater{}, &ScoredHypothesis::log_evidence);
  const double most = hypotheses.empty() ? 0 : hypotheses.front().log_evidence;
  double sum = 0, of_effects = 0, effects = 0;
  for (ScoredHypothesis& a : hypotheses) sum += a.probability = std::exp(a.log_evidence - most);
  for (ScoredHypothesis& a : hypotheses) {
    a.probability /= sum;
    if (a.kind == ScoredHypothesis::Kind::effect) of_effects += a.probability, effects += 1;
  }
  for (ScoredHypothesis& a : hypotheses) {
    if (a.kind == ScoredHypothesis::Kind::unknown) a.probability += rule.doubt.unknown * of_effects;
    if (a.kind == ScoredHypothesis::Kind::effect)
      a.probability +=
          rule.doubt.confused * of_effects / effects - (rule.doubt.unknown + rule.doubt.confused) * a.probability;
  }
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

}  // namespace flappy::gap
