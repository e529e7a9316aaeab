#include "benchmark/score.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>

#include "io/statistics.hpp"
#include "model/effects/registry.hpp"

namespace flappy::benchmark {
namespace {

using model::group_of;

using Names = std::vector<std::string>;
using Cases = std::vector<const ScoredCase*>;

constexpr double kConfident = 0.9, kSureOfGain = 2;
/// Of rich flights with motion capture and IMU, each robot once: what claims are judged by.
constexpr const char* kClaiming[] = {"singles", "none", "parameters", "withheld", "pairs"};

bool same(Names a, Names b) {
  std::ranges::sort(a);
  std::ranges::sort(b);
  return a == b;
}

bool holds(const Names& all, const Names& some) {
  return std::ranges::all_of(some, [&](const std::string& s) { return std::ranges::count(all, s) > 0; });
}

bool names_effects(const Prediction& p) { return p.kind == "effect" || p.kind == "group"; }

bool group_holds(const ScoredCase& c) {
  return c.prediction.kind == "group" && holds(c.prediction.effects, c.truth.effects);
}

bool named_alone(const ScoredCase& c) {
  return c.prediction.kind == "effect" && same(c.prediction.effects, c.truth.effects);
}

bool right_group(const ScoredCase& c) {
  const Names& named = c.prediction.effects;
  return group_holds(c) || (c.prediction.kind == "effect" && named.size() == 1 &&
                            group_of(named.front()) == group_of(c.truth.effects.front()));
}

/// Whether the truth is one of the three most probable answers.
bool among_three(const ScoredCase& c) {
  const Prediction& p = c.prediction;
  if (group_holds(c)) return true;
  for (const FittedSet& s : p.sets) {
    if (!same(s.effects, c.truth.effects)) continue;
    const double mine = s.probability;
    std::ptrdiff_t above = std::ranges::count_if(p.sets, [&](const FittedSet& o) { return o.probability > mine; });
    above += (p.none > mine) + (p.parameters > mine) + (p.unknown > mine);
    return mine > 0 && above < 3;
  }
  return false;
}

bool false_alarm(const ScoredCase& c) { return c.prediction.kind != "none" && c.prediction.kind != "parameters"; }

const FittedSet* fitted(const Prediction& p, const Names& effects) {
  for (const FittedSet& s : p.sets)
    if (same(s.effects, effects)) return &s;
  return nullptr;
}

/// What of the true values lies within the intervals that the verdict gives, where it names the truth.
void count_covered(const ScoredCase& c, std::size_t& covered, std::size_t& all) {
  if (!named_alone(c) && !group_holds(c)) return;
  const FittedSet* set = fitted(c.prediction, c.truth.effects);
  if (set == nullptr) return;
  for (const auto& [name, value] : c.truth.true_values) {
    const auto e = set->values.find(name);
    if (e == set->values.end()) continue;
    covered += e->second.low <= value && value <= e->second.high;
    ++all;
  }
}

/// What a verdict says is at work; of a group, its most probable member.
Names at_work(const Prediction& p) {
  if (p.kind == "effect") return p.effects;
  if (p.kind != "group") return {};
  const auto most = std::ranges::find_if(p.sets, [&](const FittedSet& s) { return holds(p.effects, s.effects); });
  return most == p.sets.end() ? Names() : most->effects;
}

/// Over the names of all cases together.
std::optional<double> f1(const std::vector<std::pair<Names, Names>>& named_and_true,
                         const std::vector<std::size_t>& which) {
  double hits = 0, sum = 0;
  for (const std::size_t i : which) {
    const auto& [named, truth] = named_and_true[i];
    for (const std::string& n : named) hits += std::ranges::count(truth, n) > 0 ? 1 : 0;
    sum += static_cast<double>(named.size() + truth.size());
  }
  if (sum == 0) return std::nullopt;
  return 2 * hits / sum;
}

ScoreValue f1_score(const std::vector<std::pair<Names, Names>>& named_and_true) {
  return resampled(named_and_true.size(),
                   [&](const std::vector<std::size_t>& which) { return f1(named_and_true, which); });
}

Cases of_parts(const std::vector<ScoredCase>& cases, const std::set<std::string>& parts) {
  Cases list;
  for (const ScoredCase& c : cases)
    if (parts.contains(c.truth.part)) list.push_back(&c);
  return list;
}

Cases separable(Cases cases) {
  std::erase_if(cases, [](const ScoredCase* c) { return !c->truth.separable; });
  return cases;
}

template <class Is>
ScoreValue share(const Cases& cases, const Is& is) {
  return proportion(static_cast<std::size_t>(std::ranges::count_if(cases, [&](const ScoredCase* c) { return is(*c); })),
                    cases.size());
}

/// The same of every baseline that all of the cases have.
template <class Is>
std::map<std::string, ScoreValue> of_baselines(const Cases& cases, const Is& is) {
  std::map<std::string, ScoreValue> scores;
  for (const char* name : kBaselines) {
    Cases had = cases;
    std::erase_if(had, [&](const ScoredCase* c) { return !c->prediction.baselines.contains(name); });
    if (!had.empty())
      scores[name] =
          share(had, [&](const ScoredCase& c) { return is(c.truth, c.prediction.baselines.find(name)->second); });
  }
  return scores;
}

bool baseline_first(const CaseTruth& t, const Baseline& b) {
  return !b.named.empty() && b.ranking.front() == t.effects.front();
}

bool baseline_group(const CaseTruth& t, const Baseline& b) {
  return !b.named.empty() && group_of(b.ranking.front()) == group_of(t.effects.front());
}

bool baseline_among_three(const CaseTruth& t, const Baseline& b) {
  const auto end = b.ranking.begin() + static_cast<std::ptrdiff_t>(std::min<std::size_t>(3, b.ranking.size()));
  return std::find(b.ranking.begin(), end, t.effects.front()) != end;
}

enum class Bar { at_least, at_most, within };

/// A line of the table; of `within`, must and aim are ranges.
ScoreLine line(std::string key, std::string what, Bar bar, double must, double aim, ScoreValue score,
               std::map<std::string, ScoreValue> baselines = {}, double must_high = 0, double aim_high = 0) {
  const auto text = [&](double b, double high) {
    char t[40];
    if (bar == Bar::within) std::snprintf(t, sizeof t, "%.2f to %.2f", b, high);
    else std::snprintf(t, sizeof t, bar == Bar::at_least ? "%.2f" : "at most %.2f", b);
    return std::string(t);
  };
  ScoreLine l{std::move(key),      std::move(what), text(must, must_high), text(aim, aim_high), score, {}, {},
              std::move(baselines)};
  if (score.value) {
    const double v = *score.value;
    const auto meets = [&](double b, double high) {
      return bar == Bar::at_most ? v <= b : v >= b && (bar == Bar::at_least || v <= high);
    };
    l.meets_must = meets(must, must_high);
    l.meets_aim = meets(aim, aim_high);
  }
  return l;
}

std::vector<Claim> claims_of(const Cases& cases) {
  std::vector<Claim> claims;
  for (const ScoredCase* c : cases) claims.push_back({c->prediction.probability, right(c->truth, c->prediction)});
  return claims;
}

ScoreLine calibration_line(const Cases& cases, double& calibrated_95) {
  const std::vector<Claim> claims = claims_of(cases);
  const ScoreValue s = resampled(claims.size(), [&](const std::vector<std::size_t>& which) -> std::optional<double> {
    std::vector<Claim> some;
    for (const std::size_t i : which) some.push_back(claims[i]);
    return calibration_error(std::move(some));
  });
  calibrated_95 = claims.empty() ? 0 : calibrated_error_95(claims);
  return line("ece",
              "calibration error of the top answer's probability; aim: 95th percentile of a calibrated predictor",
              Bar::at_most, 0.08, calibrated_95, s);
}

ScoreLine closure_line(const Cases& cases) {
  std::vector<double> values;
  for (const ScoredCase* c : cases)
    if (const auto v = closure(*c)) values.push_back(*v);
  return line("closure_median", "closure, median", Bar::at_least, 0.80, 0.95,
              resampled(values.size(), [&](const std::vector<std::size_t>& which) -> std::optional<double> {
                std::vector<double> some;
                for (const std::size_t i : which) some.push_back(values[i]);
                return io::median(std::move(some));
              }));
}

ScoreLine coverage_line(const Cases& cases) {
  std::size_t covered = 0, all = 0;
  for (const ScoredCase* c : cases) count_covered(*c, covered, all);
  return line("interval_coverage", "90 % intervals of size that hold the true one", Bar::within, 0.80, 0.88,
              proportion(covered, all), {}, 0.97, 0.92);
}

void add_naming(std::vector<ScoreLine>& lines, const Cases& cases) {
  lines.push_back(line("group_top1", "right group first", Bar::at_least, 0.90, 0.97, share(cases, right_group),
                       of_baselines(cases, baseline_group)));
  lines.push_back(line("top3", "right effect among three", Bar::at_least, 0.93, 0.99, share(cases, among_three),
                       of_baselines(cases, baseline_among_three)));
}

ScoreLine first_line(const char* key, const char* what, double must, double aim, const Cases& cases) {
  const Cases judged = separable(cases);
  return line(key, what, Bar::at_least, must, aim, share(judged, named_alone), of_baselines(judged, baseline_first));
}

ScoreLine pairs_line(const Cases& cases) {
  std::vector<std::pair<Names, Names>> own;
  std::map<std::string, std::vector<std::pair<Names, Names>>> others;
  for (const ScoredCase* c : cases) {
    own.emplace_back(at_work(c->prediction), c->truth.effects);
    for (const auto& [name, b] : c->prediction.baselines) others[name].emplace_back(b.named, c->truth.effects);
  }
  std::map<std::string, ScoreValue> baselines;
  for (const auto& [name, list] : others) baselines[name] = f1_score(list);
  return line("pairs_f1", "pairs: F1 of names", Bar::at_least, 0.65, 0.88, f1_score(own), std::move(baselines));
}

}  // namespace

bool right(const CaseTruth& t, const Prediction& p) {
  if (t.part == "none") return p.kind == "none" || p.kind == "parameters";
  if (t.part == "parameters") return p.kind == "parameters";
  if (t.part == "withheld") return p.kind == "unknown";
  return (p.kind == "effect" && same(p.effects, t.effects)) || (p.kind == "group" && holds(p.effects, t.effects));
}

std::optional<double> closure(const ScoredCase& c) {
  if (c.prediction.kind == "data") return 0;
  const FittedSet* truth = fitted(c.prediction, c.truth.effects);
  std::optional<double> refit = c.prediction.refit;
  if ((truth == nullptr || !truth->left) && c.true_fit) {
    truth = fitted(*c.true_fit, c.truth.effects);
    refit = c.true_fit->refit;
  }
  if (truth == nullptr || !truth->left || !refit || !c.prediction.refit) return std::nullopt;
  const double closable = *refit - *truth->left;
  if (closable < kSureOfGain * truth->gain_sd || closable <= 0) return std::nullopt;
  const FittedSet* named = fitted(c.prediction, at_work(c.prediction));
  if (named == nullptr || !named->left) return 0;
  return (*c.prediction.refit - *named->left) / closable;
}

bool needs_true_fit(const ScoredCase& c) {
  if (c.truth.part != "singles" && c.truth.part != "typical") return false;
  const FittedSet* truth = fitted(c.prediction, c.truth.effects);
  return c.prediction.kind != "data" && (truth == nullptr || !truth->left);
}

Scores score(const std::vector<ScoredCase>& cases) {
  Scores s;
  const Cases singles = of_parts(cases, {"singles"}), harmless = of_parts(cases, {"none", "parameters"}),
              withheld = of_parts(cases, {"withheld"}), hover = of_parts(cases, {"hover"});
  s.main.push_back(first_line("top1_mocap_imu", "right effect first, mocap and IMU", 0.80, 0.92, singles));
  s.main.push_back(first_line("top1_current", "right effect first, current logged too", 0.85, 0.95,
                              of_parts(cases, {"singles_current"})));
  add_naming(s.main, singles);
  s.main.push_back(line("false_alarm", "false alarm on none and on parameters only", Bar::at_most, 0.05, 0.02,
                        share(harmless, false_alarm),
                        of_baselines(harmless, [](const CaseTruth&, const Baseline& b) { return !b.named.empty(); })));
  s.main.push_back(line("withheld_unknown", "effect withheld or outside the catalogue: \"unknown\"", Bar::at_least,
                        0.60, 0.85,
                        share(withheld, [](const ScoredCase& c) { return c.prediction.kind == "unknown"; })));
  s.main.push_back(line("withheld_confidently_wrong", "withheld: a wrong name at more than 0.9", Bar::at_most, 0.15,
                        0.03, share(withheld, [](const ScoredCase& c) {
                          return names_effects(c.prediction) && c.prediction.probability > kConfident;
                        })));
  s.main.push_back(
      calibration_line(of_parts(cases, {std::begin(kClaiming), std::end(kClaiming)}), s.ece_calibrated_95));
  s.main.push_back(closure_line(singles));
  s.main.push_back(coverage_line(singles));
  s.main.push_back(pairs_line(of_parts(cases, {"pairs"})));
  s.main.push_back(line("hover_abstain", "hover only: abstains where not identifiable", Bar::at_least, 0.80, 0.80,
                        share(hover, [](const ScoredCase& c) { return abstains(c.prediction); })));
  s.main.push_back(line("hover_proposes", "and proposes a manoeuvre that tells the truth from a rival", Bar::at_least,
                        0, 0.80, share(hover, [](const ScoredCase& c) {
                          return abstains(c.prediction) && holds(c.prediction.next, c.truth.effects);
                        })));
  s.main.back().must = "-";
  s.main.back().meets_must.reset();
  const Cases typical = of_parts(cases, {"typical"});
  s.typical.push_back(first_line("top1_mocap_imu", "right effect first, mocap and IMU", 0.80, 0.92, typical));
  add_naming(s.typical, typical);
  s.typical.push_back(calibration_line(typical, s.typical_ece_calibrated_95));
  s.typical.push_back(closure_line(typical));
  s.typical.push_back(coverage_line(typical));
  return s;
}

}  // namespace flappy::benchmark
