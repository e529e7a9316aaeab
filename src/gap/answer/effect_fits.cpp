#include "gap/answer/effect_fits.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "gap/fit/one_sided.hpp"
#include "io/parallel.hpp"
#include "model/effects/registry.hpp"

namespace flappy::gap {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Number of hypotheses tried with a remainder. Choice.
constexpr std::size_t kMaxRemainders = 3;
/// Number of single effects with which the parameters are fitted again. Choice.
constexpr std::size_t kMaxMoved = 3;

ScoredHypothesis baseline(HypothesisKind kind, double log_evidence, double prior) {
  ScoredHypothesis a;
  a.kind = kind;
  a.log_prior = std::log(prior);
  a.log_evidence = log_evidence + a.log_prior;
  return a;
}

/// The free blocks, each with the function of the regime that takes most of it; the largest gain first.
std::vector<FreeBlock> free_blocks(const ScaledEvidence& w, const Evidence& evidence, double penalty_nats) {
  const RegimeBasis& basis = evidence.basis();
  std::vector<FreeBlock> blocks;
  for (std::size_t block = 0; block < w.scales.free.size(); ++block) {
    if (!w.scales.free[block]) continue;
    double sum = 0, most = 0;
    FreeBlock b{static_cast<int>(block) / kClasses / (kHarmonics + 1) % kChannels,
                static_cast<int>(block) / kClasses % (kHarmonics + 1)};
    for (int g = 0; g < kGroups; ++g)
      for (int i = 0; i < basis.size(); ++i) {
        if (evidence.block_of(g, i) != static_cast<int>(block)) continue;
        const double square = std::pow(w.delta(g, i), 2);
        sum += square;
        if (square > most) most = square, b.function = i;
      }
    b.times = w.scales.blocks[block] / w.scales.centre(block);
    b.gain_nats = 0.5 * sum * (b.times * b.times - 1) - penalty_nats;
    blocks.push_back(b);
  }
  std::ranges::sort(blocks, std::greater{}, &FreeBlock::gain_nats);
  return blocks;
}

/// Evidence with blocks that may be free. Expectation-maximisation finds the nearest maximum, so it starts from `start`
/// and, if known, from the scales of an unknown cause alone, where models are off by more.
ScaledEvidence weigh_freely(const RobotFit& robot, const Hypothesis& hypothesis, const Fit& fit, const Scales& start,
                            const Scales* unknown_scales, double penalty_nats) {
  ScaledEvidence w = robot.weigh(hypothesis, fit, start, penalty_nats);
  if (unknown_scales == nullptr) return w;
  ScaledEvidence other = robot.weigh(hypothesis, fit, *unknown_scales, penalty_nats);
  return other.posterior.log_evidence > w.posterior.log_evidence ? other : w;
}

/// Evidence of a fitted hypothesis with the half-normal priors of its one-sided magnitudes.
double explained_by(const Hypothesis& h, const Fit& fit, const Posterior& p) {
  const Eigen::MatrixXd& axes = fit.directions.axes;
  const Posterior own = Fitter::of_directions(fit, p);
  return p.log_evidence + one_sided(h, fit.at + axes * own.mean, axes * own.covariance * axes.transpose()).log_factor;
}

/// The function of the place along which the law of an effect deviates most from the catalogue's.
FreeBlock largest_deviation(const ScaledEvidence& w, const RegimeBasis& basis) {
  FreeBlock most;
  for (int g = 0; g < kGroups; ++g)
    for (int i = 0; i < basis.size(); ++i) {
      const double gain = 0.5 * std::pow(w.delta(g, i), 2);
      if (regimes_of(basis.kind(i)) == Regimes::place && gain > most.gain_nats)
        most = {channel_of(g), (g % kCoefficients + 1) / 2, i, w.law_factor, gain};
    }
  return most;
}

/// Effects without a beat-averaged form, or that change no row, as effects of the battery where none is logged.
std::vector<std::string> untestable(const RobotFit& robot, const std::vector<std::string>& withheld) {
  std::vector<std::string> list;
  const model::Vehicle& vehicle = robot.uncertain().nominal();
  for (const model::CatalogueEffect& e : model::catalogue_of(vehicle)) {
    double most = 0;
    for (const MagnitudeColumn& m : robot.magnitudes())
      if (m.effect == e.info.id) most = std::max(most, m.change.cwiseAbs().maxCoeff());
    if (!(most > kNoChange)) list.emplace_back(e.info.id);
  }
  for (const model::CatalogueEffect& e : model::effects())
    if (model::find_effect(vehicle, e.info.id) == nullptr) list.emplace_back(e.info.id);
  std::erase_if(list, [&](const std::string& id) { return std::ranges::count(withheld, id) > 0; });
  return list;
}

}  // namespace

Baselines weigh_baselines(const Question& question, const RobotFit& robot, const VerdictRule& rule) {
  const Hypothesis& h = robot.no_effects();
  const Scales& scales = robot.fitter().scales();
  const double penalty = rule.unknown.penalty_nats;
  Baselines b;
  b.none = baseline(HypothesisKind::none, question.log_evidence_of_none(robot), rule.prior.none);
  b.parameters = baseline(HypothesisKind::parameters, robot.weigh(h, robot.parameters(), scales).posterior.log_evidence,
                          rule.prior.parameters);
  const ScaledEvidence unknown = weigh_freely(robot, h, robot.parameters(), scales, nullptr, penalty);
  b.unknown = baseline(HypothesisKind::unknown, unknown.posterior.log_evidence, rule.prior.unknown);
  b.unknown.unexplained = free_blocks(unknown, robot.evidence(), penalty);
  // an unknown cause frees at least one block, so it pays the penalty at least once
  if (!b.unknown.has_remainder()) b.unknown.log_evidence -= penalty;
  b.unknown.fit.law_factor = unknown.law_factor;
  b.unknown_scales = unknown.scales;
  return b;
}

void raise_baselines(const Question& question, const RobotFit& robot, const VerdictRule& rule, int threads,
                     std::vector<ScoredHypothesis>& singles, Baselines& baselines) {
  std::vector<OtherLaws> of_laws(singles.size());
  io::parallel_for(singles.size(), threads, [&](std::size_t i) {
    if (singles[i].fitted())
      of_laws[i] = question.other_laws(robot, Hypothesis(robot.uncertain(), singles[i].effects), singles[i].fit);
  });
  OtherLaws most;
  for (const OtherLaws& laws : of_laws) {
    most.log_evidence = std::max(most.log_evidence, laws.log_evidence);
    most.log_evidence_of_harmless = std::max(most.log_evidence_of_harmless, laws.log_evidence_of_harmless);
  }
  const auto raise = [](ScoredHypothesis& a, double explained) {
    const double gain = std::max(0.0, explained - a.explained());
    a.log_evidence += gain;
    return gain;
  };
  raise(baselines.unknown, most.log_evidence - rule.unknown.penalty_nats);
  const double gain = raise(baselines.parameters, most.log_evidence_of_harmless);
  for (ScoredHypothesis& a : singles)
    if (!a.fitted()) a.log_evidence += gain;
  std::ranges::sort(singles, std::greater{}, &ScoredHypothesis::explained);
}

ScreenedCatalogue screen_catalogue(const RobotFit& robot, const InferenceOptions& options) {
  ScreenedCatalogue c;
  c.untestable = untestable(robot, options.withheld);
  for (ScreenedEffect& s : screen(robot.fitter(), robot.parameters(), robot.magnitudes())) {
    if (std::ranges::count(c.untestable, s.effect)) continue;
    const bool finalist = static_cast<int>(c.finalists.size()) < options.max_finalists;
    (finalist ? c.finalists : c.others).push_back(std::move(s));
  }
  return c;
}

EffectFits::EffectFits(const Question& question, const RobotFit& robot, const Baselines& baselines,
                       const InferenceOptions& options, int threads)
    : question_(question),
      robot_(robot),
      baselines_(baselines),
      options_(options),
      rule_(options.rule),
      threads_(threads),
      catalogue_size_(model::catalogue_of(robot.uncertain().nominal()).size()) {}

double EffectFits::log_prior_of_one() const {
  return std::log(rule_.prior.effect / static_cast<double>(catalogue_size_));
}

/// Gain by chance of the last effect of a hypothesis, nats.
double EffectFits::gain_by_chance(const ScoredHypothesis& a) const { return rule_.gain.chance_of(a.effects.back()); }

VectorXd EffectFits::start(const Hypothesis& h, const std::vector<ScreenedEffect>& set) const {
  VectorXd at = h.start();
  at.head(h.shared()) = robot_.parameters().at.head(h.shared());
  Index next = h.shared();
  for (const ScreenedEffect& s : set) {
    at.segment(next, s.coordinates.size()) = s.coordinates;
    next += s.coordinates.size();
  }
  return h.bounded(at);
}

ScoredHypothesis EffectFits::fitted(const std::vector<ScreenedEffect>& set, const Fitter& fitter) const {
  ScoredHypothesis a;
  a.kind = HypothesisKind::effect;
  for (const ScreenedEffect& s : set) a.effects.push_back(s.effect);
  a.log_evidence = kRefuted;  // until its vehicle has been simulated
  const Hypothesis h(robot_.uncertain(), a.effects);
  a.log_prior = log_prior_of_one();
  for (std::size_t i = 1; i < set.size(); ++i)
    a.log_prior += std::log(rule_.prior.further_effect / static_cast<double>(catalogue_size_));
  take(h, question_.fit_set(fitter, h, start(h, set), robot_.parameters()), fitter.scales(), a);
  return a;
}

/// Refits the parameters jointly with the effects; keeps a better fit.
void EffectFits::move_parameters(const std::vector<ScreenedEffect>& set, const Fitter& fitter,
                                 ScoredHypothesis& a) const {
  const Hypothesis h(robot_.uncertain(), a.effects);
  if (std::optional<Fit> fit = question_.refit_jointly(fitter, h, start(h, set), robot_.parameters()))
    take(h, *std::move(fit), fitter.scales(), a);
}

/// Takes `fit` unless its vehicle could not be simulated or the present fit explains as much.
void EffectFits::take(const Hypothesis& h, Fit fit, const Scales& scales, ScoredHypothesis& a) const {
  if (!fit.flown()) return;
  const ScaledEvidence w = robot_.weigh(h, fit, scales);
  const double log_evidence = explained_by(h, fit, w.posterior) + a.log_prior;
  if (a.fitted() && log_evidence <= a.log_evidence) return;
  fit.law_factor = w.law_factor;
  a.log_evidence = log_evidence;
  a.fit = std::move(fit);
  a.other_law.reset();
  if (w.law_factor > 1) a.other_law = largest_deviation(w, robot_.evidence().basis());
}

/// An effect fitted only linearly counts for no gain. Where flights say little of it, its posterior is near its prior.
ScoredHypothesis EffectFits::linear(const ScreenedEffect& effect) const {
  ScoredHypothesis a;
  a.kind = HypothesisKind::effect;
  a.effects = {effect.effect};
  const Hypothesis h(robot_.uncertain(), a.effects);
  std::vector<BasisCoefficients> columns(static_cast<std::size_t>(h.size() - h.shared()));
  for (const MagnitudeColumn& m : robot_.magnitudes())
    if (m.effect == effect.effect) columns[static_cast<std::size_t>(m.unknown)] = m.change;
  a.fit = robot_.fitter().fit_linear(h, robot_.parameters(), columns);
  a.log_prior = log_prior_of_one();
  a.log_evidence = baselines_.parameters.explained() + std::min(effect.gain, 0.0) + a.log_prior;
  a.fit.posterior.mean =
      a.fit.directions.axes.transpose() * (one_sided(h, a.fit.mean(), a.fit.covariance()).mean - a.fit.at);
  return a;
}

/// Whether all magnitudes of one effect were fitted close to their values in the vehicle file.
bool EffectFits::vanished(const ScoredHypothesis& a) const {
  if (!a.fitted()) return true;
  const Hypothesis h(robot_.uncertain(), a.effects);
  const VectorXd file = h.start();
  for (const std::string& e : a.effects) {
    double largest = 0;
    for (Index i = h.shared(); i < h.size(); ++i) {
      const Unknown& u = h.unknowns()[static_cast<std::size_t>(i)];
      if (u.effect == e && u.magnitude) largest = std::max(largest, std::abs(a.fit.at[i] - file[i]));
    }
    if (largest < rule_.gain.vanished_magnitude) return true;
  }
  return false;
}

/// Fitted coordinates of the effects, as the start of a fit with a further effect.
std::vector<ScreenedEffect> EffectFits::coordinates(const ScoredHypothesis& a) const {
  std::vector<ScreenedEffect> list;
  Index at = robot_.no_effects().size();
  for (const std::string& e : a.effects) {
    const Hypothesis h(robot_.uncertain(), {e});
    const Index n = h.size() - h.shared();
    list.push_back({e, 0, a.fit.at.segment(at, n)});
    at += n;
  }
  return list;
}

std::vector<ScoredHypothesis> EffectFits::single_effects(const ScreenedCatalogue& catalogue, bool by_simulation) const {
  const std::vector<ScreenedEffect>& finalists = catalogue.finalists;
  std::vector<ScoredHypothesis> singles;
  std::vector<ScreenedEffect> open = catalogue.others;
  if (by_simulation) {
    // finalists without screened gain are fitted, too: parameters that compensate hide the gain from the linear model
    std::vector<ScoredHypothesis> fits(finalists.size());
    io::parallel_for(fits.size(), threads_, [&](std::size_t i) { fits[i] = fitted({finalists[i]}, robot_.fitter()); });
    std::vector<std::size_t> order(fits.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, std::greater{}, [&](std::size_t i) { return fits[i].log_evidence; });
    order.resize(std::min(order.size(), kMaxMoved));
    io::parallel_for(order.size(), threads_,
                     [&](std::size_t i) { move_parameters({finalists[order[i]]}, robot_.fitter(), fits[order[i]]); });
    for (std::size_t i = 0; i < fits.size(); ++i) {
      // a fit that explains less than the linear model did not find the effect
      ScoredHypothesis screened = linear(finalists[i]);
      const bool found = !vanished(fits[i]) && !(fits[i].log_evidence < screened.log_evidence);
      singles.push_back(std::move(found ? fits[i] : screened));
    }
  } else {
    open.insert(open.end(), finalists.begin(), finalists.end());
  }
  for (const ScreenedEffect& s : open) singles.push_back(linear(s));
  std::ranges::sort(singles, std::greater{}, &ScoredHypothesis::explained);
  return singles;
}

EffectFits::Sets EffectFits::combine(std::vector<ScoredHypothesis> singles,
                                     const std::function<bool(double, const std::string&)>& progress) const {
  Sets sets{std::move(singles), robot_.fitter().scales()};
  if (!sets.hypotheses.empty() && sets.hypotheses.front().fitted() &&
      sets.hypotheses.front().explained() > baselines_.parameters.explained() + gain_by_chance(sets.hypotheses.front()))
    join_further(progress, sets);
  std::ranges::sort(sets.hypotheses, std::greater{}, &ScoredHypothesis::explained);
  return sets;
}

void EffectFits::join_further(const std::function<bool(double, const std::string&)>& progress, Sets& sets) const {
  std::vector<ScoredHypothesis>& all = sets.hypotheses;
  ScoredHypothesis best = all.front();
  for (int n = 2; n <= options_.max_effects; ++n) {
    if (!progress(0.7 + 0.3 * (n - 1) / options_.max_effects, "fitting another jointly with " + best.effects.back()))
      break;
    // further effects have to exceed the discrepancy left with the best set in force, so the scales are found again
    sets.scales = robot_.find_scales(Hypothesis(robot_.uncertain(), best.effects), best.fit, sets.scales);
    const Fitter fitter = robot_.fitter().with_scales(sets.scales);
    std::vector<MagnitudeColumn> others = robot_.magnitudes();
    std::erase_if(others, [&](const MagnitudeColumn& m) { return std::ranges::count(best.effects, m.effect) > 0; });
    std::vector<ScreenedEffect> further = screen(fitter, best.fit, others);
    std::erase_if(further, [&](const ScreenedEffect& s) { return s.gain < rule_.gain.further_screened_nats; });
    further.resize(std::min(further.size(), question_.max_further()));
    std::vector<ScoredHypothesis> more(further.size());
    std::vector<std::vector<ScreenedEffect>> starts(further.size(), coordinates(best));
    io::parallel_for(more.size(), threads_, [&](std::size_t i) {
      starts[i].push_back(further[i]);
      more[i] = fitted(starts[i], fitter);
    });
    if (const auto first = std::ranges::max_element(more, {}, &ScoredHypothesis::explained); first != more.end())
      move_parameters(starts[static_cast<std::size_t>(first - more.begin())], fitter, *first);
    std::erase_if(more, [&](const ScoredHypothesis& a) {
      return vanished(a) || a.explained() < best.explained() + gain_by_chance(a);
    });
    if (more.empty()) break;
    for (const ScoredHypothesis& a : more) {  // the further effect may explain the flights alone: fit it alone, too
      const ScreenedEffect last = coordinates(a).back();
      const auto single = std::ranges::find(all, std::vector{last.effect}, &ScoredHypothesis::effects);
      if (single == all.end() || single->fitted()) continue;
      if (ScoredHypothesis alone = fitted({last}, fitter); alone.fitted()) *single = std::move(alone);
    }
    all.insert(all.end(), more.begin(), more.end());
    best = *std::ranges::max_element(more, {}, &ScoredHypothesis::explained);
  }
  sets.scales = robot_.find_scales(robot_.no_effects(), robot_.parameters(), sets.scales);
}

std::vector<ScoredHypothesis> EffectFits::with_remainders(const std::vector<ScoredHypothesis>& hypotheses,
                                                          const Scales& scales) const {
  std::size_t asked = 0;
  while (asked < std::min(hypotheses.size(), kMaxRemainders) && hypotheses[asked].fitted() &&
         hypotheses[asked].explained() >= baselines_.parameters.explained())
    ++asked;
  const double penalty = rule_.unknown.penalty_nats;
  std::vector<ScoredHypothesis> found(asked);
  io::parallel_for(asked, threads_, [&](std::size_t i) {
    const ScoredHypothesis& a = hypotheses[i];
    const Hypothesis h(robot_.uncertain(), a.effects);
    const ScaledEvidence w = weigh_freely(robot_, h, a.fit, scales, &baselines_.unknown_scales, penalty);
    std::vector<FreeBlock> blocks = free_blocks(w, robot_.evidence(), penalty);
    if (blocks.empty()) return;
    found[i] = a;
    found[i].unexplained = std::move(blocks);
    found[i].jointly_with = a.effects;
    found[i].fit.law_factor = w.law_factor;
    found[i].log_prior = a.log_prior + std::log(rule_.prior.remainder);
    found[i].log_evidence = explained_by(h, a.fit, w.posterior) + found[i].log_prior;
  });
  std::erase_if(found, [](const ScoredHypothesis& a) { return !a.has_remainder(); });
  return found;
}

}  // namespace flappy::gap
