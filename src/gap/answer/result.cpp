#include "gap/answer/result.hpp"

#include <algorithm>
#include <cmath>

#include "gap/answer/verdict.hpp"
#include "gap/localise/closure.hpp"
#include "gap/localise/ladder.hpp"

namespace flappy::gap {
namespace {

/// Smallest error of a sensor that is reported, in prior standard deviations. Choice.
constexpr double kMinSensorError = 0.25;

std::vector<std::pair<std::string, double>> moved_parameters(const Fit& fit, const Hypothesis& hypothesis) {
  std::vector<std::pair<std::string, double>> moved;
  const Eigen::VectorXd mean = fit.mean();
  for (Eigen::Index i = 0; i < hypothesis.parameters(); ++i)
    moved.emplace_back(hypothesis.unknowns()[static_cast<std::size_t>(i)].name, mean[i]);
  std::ranges::stable_sort(moved, std::greater{}, [](const auto& m) { return std::abs(m.second); });
  return moved;
}

const ScoredHypothesis* best_fitted(const Inference& d) {
  const auto best = std::ranges::find_if(d.hypotheses, &ScoredHypothesis::fitted);
  return best == d.hypotheses.end() ? nullptr : &*best;
}

UnexplainedTerm term_of(const FreeBlock& b, const RegimeBasis& basis) {
  return {channel_name(b.channel),    b.harmonic, basis.name(b.function),
          basis.quantity(b.function), b.times,    b.gain_nats};
}

void add_hypotheses(const RowContext& context, const sim::Randomisation& uncertain, const Inference& d, Diagnosis& r) {
  r.noise_floor = huber_floor();
  const Losses refit = losses_of(context, d.refit);
  r.nominal_loss = losses_of(context, d.nominal).mean();
  r.refit_loss = refit.mean();
  std::vector<RankedHypothesis> without_effects;
  for (const ScoredHypothesis& a : d.hypotheses) {
    const bool effect = a.kind == HypothesisKind::effect;
    RankedHypothesis h = a;
    h.group = effect ? pool_name(a.effects) : name_of(a.kind);
    h.remainder = effect && a.has_remainder();
    if (effect) h.parameters = estimates_of(a, uncertain);
    if (a.fitted()) {
      const Losses rest = losses_of(context, a.held_out);
      h.loss = rest.mean();
      h.loss_gain_sd = sd_of_difference(refit, rest);
      h.closure = closure_of(refit, rest, r.noise_floor);
      if (&a == best_fitted(d)) r.effect_loss = h.loss, r.closure = h.closure;
    }
    (effect ? r.hypotheses : without_effects).push_back(std::move(h));
  }
  r.hypotheses.insert(r.hypotheses.end(), without_effects.begin(), without_effects.end());
}

/// Number of suspects. Size: of a list that is printed.
constexpr std::size_t kSuspects = 3;

/// Sums the probabilities of all hypotheses that contain an effect.
std::vector<Suspect> suspects_of(const std::vector<RankedHypothesis>& hypotheses) {
  std::vector<Suspect> all;
  double any = 0;
  for (const RankedHypothesis& h : hypotheses) {
    if (h.kind != HypothesisKind::effect) continue;
    any += h.probability;
    for (const std::string& e : h.effects) {
      auto at = std::ranges::find(all, e, &Suspect::effect);
      if (at == all.end()) at = all.insert(all.end(), {e, 0, {}});
      at->probability += h.probability;
      if (h.effects.size() == 1 && !h.remainder) at->closure = h.closure;
    }
  }
  if (!(any > 0)) return {};  // all effects are refuted
  std::ranges::stable_sort(all, std::greater{}, &Suspect::probability);
  all.resize(std::min(all.size(), kSuspects));
  for (Suspect& s : all) s.probability /= any;
  return all;
}

}  // namespace

std::vector<Estimate> estimates_of(const ScoredHypothesis& hypothesis, const sim::Randomisation& uncertain) {
  std::vector<Estimate> estimates;
  if (hypothesis.fit.at.size() == 0) return estimates;
  const Hypothesis h(uncertain, hypothesis.effects);
  const Eigen::VectorXd mean = hypothesis.fit.mean();
  const Eigen::MatrixXd covariance = hypothesis.fit.covariance();
  for (Eigen::Index i = h.shared(); i < h.size(); ++i) {
    const Unknown& u = h.unknowns()[static_cast<std::size_t>(i)];
    const double reach = kHalf90 * std::sqrt(covariance(i, i));
    estimates.push_back({u.effect + "." + u.name, u.value(mean[i]), u.value(mean[i] - reach), u.value(mean[i] + reach),
                         unit_of(u.name)});
  }
  return estimates;
}

Diagnosis result_of(const std::vector<std::string>& folders, const Flights& flights,
                    const sim::Randomisation& uncertain, const Inference& inference) {
  Diagnosis r;
  r.flights = folders;
  r.complete = inference.complete;
  r.verdict = inference.verdict;
  r.validation = inference.validation;
  r.untestable = inference.untestable;
  r.seen = inference.seen;
  r.odd = inference.odd;
  const RowContext context = row_context_of(flights.tests, inference.noise_sd);
  add_hypotheses(context, uncertain, inference, r);
  r.suspects = suspects_of(r.hypotheses);

  const ScoredHypothesis& concluded = inference.conclusion();
  const ScoredHypothesis& unknown =
      concluded.has_remainder()
          ? concluded
          : *std::ranges::find(inference.hypotheses, HypothesisKind::unknown, &ScoredHypothesis::kind);
  const RegimeBasis basis(question_of(flights), flights);
  for (const FreeBlock& b : unknown.unexplained) r.unexplained.push_back(term_of(b, basis));
  if (concluded.other_law) r.other_law = term_of(*concluded.other_law, basis);
  r.jointly_with = unknown.jointly_with;

  for (const SensorFinding& s : inference.sensors) {
    const double reach = kHalf90 * s.sd;
    if (std::abs(s.value) > std::max(reach, kMinSensorError * s.prior_sd))
      r.sensors.push_back({s.name, s.value, s.value - reach, s.value + reach, unit_of(s.name)});
  }
  const ScoredHypothesis& predicting = inference.predicting();
  const bool effects = predicting.kind == HypothesisKind::effect;
  r.moved_parameters =
      moved_parameters(effects ? predicting.fit : inference.parameters, Hypothesis(uncertain, predicting.effects));
  if (effects) r.background = estimates_of(predicting, uncertain);
  std::erase_if(r.background, [&](const Estimate& e) {
    return std::ranges::any_of(concluded.effects,
                               [&](const std::string& effect) { return e.name.starts_with(effect + "."); });
  });

  const ScoredHypothesis* best = best_fitted(inference);
  const TestResiduals* with_effect = best != nullptr ? &best->held_out : nullptr;
  const std::pair<Fitted, const TestResiduals*> fits[] = {
      {Fitted::nominal, &inference.nominal}, {Fitted::refit, &inference.refit}, {Fitted::effect, with_effect}};
  if (!flights.tests.front()->is_averaged())
    r.ladder = ladder_of(context, inference.nominal, inference.refit, with_effect, r.hypotheses);
  for (const auto& [fitted, residual] : fits) {
    if (residual == nullptr) continue;
    std::vector<ResidualLocation> locations = locate(context, *residual, fitted);
    r.locations.insert(r.locations.end(), std::make_move_iterator(locations.begin()),
                       std::make_move_iterator(locations.end()));
  }
  return r;
}

Diagnosis result_of(const std::vector<std::string>& folders, std::vector<flightlog::DataFault> faults) {
  Diagnosis r;
  r.flights = folders;
  r.faults = std::move(faults);
  r.verdict.kind = VerdictKind::data;
  r.verdict.probability = 1;
  return r;
}

}  // namespace flappy::gap
