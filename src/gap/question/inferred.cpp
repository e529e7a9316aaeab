#include "gap/question/inferred.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "model/effects/registry.hpp"

namespace flappy::gap {

const ScoredHypothesis& Inference::predicting() const {
  const ScoredHypothesis& c = conclusion();
  if (c.predicted_with.empty()) return c;
  return *std::ranges::find_if(hypotheses, [&](const ScoredHypothesis& a) {
    return a.fitted() && a.effects == c.predicted_with && a.has_remainder() == c.has_remainder();
  });
}

std::string pool_name(const std::vector<std::string>& effects) {
  std::vector<std::string> groups;
  for (const std::string& e : effects) groups.push_back(model::group_of(e));
  std::ranges::sort(groups);
  std::string name;
  for (const std::string& g : groups) name += (name.empty() ? "" : "+") + g;
  return name;
}

bool changed_plainly(const std::vector<SeenQuantity>& seen) {
  return std::ranges::any_of(seen, [](const SeenQuantity& s) { return std::abs(s.times()) > kPlainTimes; });
}

void exclude_unchanged(std::vector<ScoredHypothesis>& hypotheses) {
  double rest = 0;
  for (ScoredHypothesis& a : hypotheses) {
    if (a.kind == HypothesisKind::none || a.kind == HypothesisKind::parameters) a.probability = 0;
    rest += a.probability;
  }
  if (!(rest > 0)) return;
  for (ScoredHypothesis& a : hypotheses) a.probability /= rest;
  std::ranges::stable_sort(hypotheses, std::greater{}, &ScoredHypothesis::probability);
}

void predict_with_the_likeliest(Inference& d) {
  ScoredHypothesis& concluded = d.hypotheses[d.concluded];
  if (concluded.kind == HypothesisKind::none) return;
  const auto names = [](const ScoredHypothesis& a) { return std::set(a.effects.begin(), a.effects.end()); };
  double most = concluded.log_evidence;
  for (const ScoredHypothesis& a : d.hypotheses)
    if (a.fitted() && a.has_remainder() == concluded.has_remainder() && a.log_evidence > most &&
        std::ranges::includes(names(a), names(concluded)))
      most = a.log_evidence, concluded.predicted_with = a.effects;
}

}  // namespace flappy::gap
