#include "lab/benchmark/score.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iterator>
#include <map>
#include <set>
#include <tuple>

#include "gap/localise/ladder.hpp"
#include "io/statistics.hpp"
#include "io/text.hpp"
#include "lab/benchmark/change_over_sessions.hpp"
#include "model/effects/registry.hpp"

namespace flappy::benchmark {
namespace {

using model::group_of;

using Names = std::vector<std::string>;
using Cases = std::vector<const ScoredCase*>;

constexpr double kConfident = 0.8, kSureOfGain = 2, kFalseAlarms = 0.05;

bool same(Names a, Names b) {
  std::ranges::sort(a);
  std::ranges::sort(b);
  return a == b;
}

bool holds(const Names& all, const Names& some) {
  return std::ranges::all_of(some, [&](const std::string& s) { return std::ranges::count(all, s) > 0; });
}

/// Whether a verdict states a set of effects, alone or with a remainder.
bool names_set(const std::string& kind) { return kind == "effect" || kind == "remainder"; }
bool names_effects(const Answer& p) { return names_set(p.kind) || p.kind == "group"; }

bool group_holds(const ScoredCase& c) {
  return c.prediction.kind == "group" && holds(c.prediction.effects, c.truth.effects);
}

bool named_alone(const ScoredCase& c) {
  return names_set(c.prediction.kind) && same(c.prediction.effects, c.truth.effects);
}

bool right_group(const ScoredCase& c) {
  const Names& named = c.prediction.effects;
  return group_holds(c) || (names_set(c.prediction.kind) && named.size() == 1 &&
                            group_of(named.front()) == group_of(c.truth.effects.front()));
}

/// Whether the truth is one of the three most probable answers.
bool among_three(const ScoredCase& c) {
  const Answer& p = c.prediction;
  if (group_holds(c) || (p.kind == "remainder" && named_alone(c))) return true;
  for (const gap::RankedHypothesis& s : p.sets) {
    if (!same(s.effects, c.truth.effects)) continue;
    const double mine = s.probability;
    std::ptrdiff_t above =
        std::ranges::count_if(p.sets, [&](const gap::RankedHypothesis& o) { return o.probability > mine; });
    above += (p.none > mine) + (p.parameters > mine) + (p.unknown > mine);
    return mine > 0 && above < 3;
  }
  return false;
}

bool false_alarm(const ScoredCase& c) { return c.prediction.kind != "none" && c.prediction.kind != "parameters"; }

const gap::RankedHypothesis* fitted(const Answer& p, const Names& effects) {
  for (const gap::RankedHypothesis& s : p.sets)
    if (same(s.effects, effects)) return &s;
  return nullptr;
}

/// For a group, of its most probable set.
Names at_work(const Answer& p) {
  if (names_set(p.kind)) return p.effects;
  if (p.kind != "group") return {};
  const auto most =
      std::ranges::find_if(p.sets, [&](const gap::RankedHypothesis& s) { return holds(p.effects, s.effects); });
  return most == p.sets.end() ? Names() : most->effects;
}

/// F1 of the named effects over all cases together. `which`: cases that count, maybe several times.
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

template <class Is>
ScoreValue share(const Cases& cases, const Is& is) {
  return proportion(static_cast<std::size_t>(std::ranges::count_if(cases, [&](const ScoredCase* c) { return is(*c); })),
                    cases.size());
}

/// A rival's name and score.
using NamedScore = std::optional<std::pair<std::string, ScoreValue>>;

/// The best of the rivals. One that has no answer for a case, as its logs are faulty, names nothing there.
template <class Score>
NamedScore best_of_rivals(const Cases& cases, const Score& score) {
  static const Rival kSilent;
  NamedScore best;
  std::set<std::string> names;
  for (const ScoredCase* c : cases)
    for (const auto& [name, rival] : c->prediction.rivals) names.insert(name);
  for (const std::string& name : names) {
    const ScoreValue value = score([&](const ScoredCase& c) -> const Rival& {
      const auto at = c.prediction.rivals.find(name);
      return at == c.prediction.rivals.end() ? kSilent : at->second;
    });
    if (value.value && (!best || *value.value > *best->second.value)) best = {name, value};
  }
  return best;
}

template <class Is>
NamedScore of_rivals(const Cases& cases, const Is& is) {
  return best_of_rivals(
      cases, [&](const auto& of) { return share(cases, [&](const ScoredCase& c) { return is(c.truth, of(c)); }); });
}

bool rival_first(const CaseTruth& t, const Rival& b) {
  return !b.named.empty() && !b.ranking.empty() && b.ranking.front() == t.effects.front();
}

bool rival_group(const CaseTruth& t, const Rival& b) {
  return !b.named.empty() && !b.ranking.empty() && group_of(b.ranking.front()) == group_of(t.effects.front());
}

bool rival_among_three(const CaseTruth& t, const Rival& b) {
  const auto end = b.ranking.begin() + static_cast<std::ptrdiff_t>(std::min<std::size_t>(3, b.ranking.size()));
  return !b.named.empty() && std::find(b.ranking.begin(), end, t.effects.front()) != end;
}

enum class Bar { at_least, at_most };

/// A row of the table.
ScoreLine line(std::string key, std::string what, Bar bar, double must, double aim, ScoreValue score,
               NamedScore rival = {}) {
  const auto text = [&](double b) { return io::format(bar == Bar::at_least ? "%.2f" : "at most %.2f", b); };
  ScoreLine l{std::move(key), std::move(what), text(must), text(aim), score, {}, {}, {}, {}};
  if (rival) l.rival_name = rival->first, l.rival = rival->second;
  if (score.value) {
    const auto meets = [&](double b) { return bar == Bar::at_most ? *score.value <= b : *score.value >= b; };
    l.meets_must = meets(must);
    l.meets_aim = meets(aim);
  }
  return l;
}

ScoreLine calibration_line(const std::vector<ScoredCase>& cases) {
  std::vector<Claim> claims;
  for (const ScoredCase& c : cases) claims.push_back({c.prediction.probability, right(c.truth, c.prediction)});
  return line("ece", "calibration error (ECE) over all parts", Bar::at_most, 0.06, 0.03, calibration_score(claims));
}

ScoreLine closure_line(const Cases& cases) {
  std::vector<double> values;
  for (const ScoredCase* c : cases)
    if (const auto v = closure(*c)) values.push_back(*v);
  return line("closure_median", "how far: closure as a share of the truth's, median", Bar::at_least, 0.80, 0.95,
              resampled(values.size(), [&](const std::vector<std::size_t>& which) -> std::optional<double> {
                std::vector<double> some;
                for (const std::size_t i : which) some.push_back(values[i]);
                return io::median(std::move(some));
              }));
}

ScoreLine first_line(const char* key, const char* what, double must, double aim, const Cases& cases) {
  return line(key, what, Bar::at_least, must, aim, share(cases, named_alone), of_rivals(cases, rival_first));
}

/// Calls use(case, case of `singles` of the same robot) where the same draw flew.
template <class Use>
void for_same_robots(const Cases& cases, const Cases& singles, const Use& use) {
  std::map<std::pair<std::uint64_t, std::uint64_t>, const ScoredCase*> by_robot;
  for (const ScoredCase* c : singles) by_robot[{c->truth.seed, c->truth.draw}] = c;
  for (const ScoredCase* c : cases)
    if (const auto at = by_robot.find({c->truth.seed, c->truth.draw}); at != by_robot.end()) use(*c, *at->second);
}

ScoreLine redeclared_line(const Cases& cases, const Cases& singles) {
  std::size_t unchanged = 0, count = 0;
  for_same_robots(cases, singles, [&](const ScoredCase& c, const ScoredCase& single) {
    ++count;
    unchanged += single.prediction.kind == c.prediction.kind && same(single.prediction.effects, c.prediction.effects);
  });
  return line("redeclared_same", "verdict unchanged when only the declarations change", Bar::at_least, 0.90, 0.98,
              proportion(unchanged, count));
}

/// A maker's word, and how the channels and regimes of a diagnosis that it covers begin.
constexpr std::pair<const char*, const char*> kCovers[] = {{"mocap", "path_"},
                                                           {"mocap", "rotate_"},
                                                           {"gyro", "angular_acceleration_"},
                                                           {"gyro", "rotate_"},
                                                           {"accelerometer", "specific_force_"},
                                                           {"accelerometer", "path_"},
                                                           {"current", "current_"},
                                                           {"current", "battery"},
                                                           {"place", "height"},
                                                           {"place", "ceiling"},
                                                           {"place", "wall"},
                                                           {"temperature", "time"},
                                                           {"stroke", "always"}};

bool covered(const Names& sealed, const std::string& said) {
  return std::ranges::any_of(sealed, [&](const std::string& word) {
    return word == said ||
           std::ranges::any_of(kCovers, [&](const auto& c) { return c.first == word && said.starts_with(c.second); });
  });
}

bool described(const ScoredCase& c) {
  const std::optional<Where>& w = c.prediction.where;
  return w && covered(c.truth.channels, w->channel) && covered(c.truth.regimes, w->regime);
}

bool next_brings_truth(const ScoredCase& c) {
  const std::optional<Answer>& v = c.after_next;
  return v && names_set(v->kind) && same(v->effects, c.truth.effects);
}

ScoreLine pairs_line(const Cases& cases, double must = 0.75) {
  std::vector<std::pair<Names, Names>> own;
  for (const ScoredCase* c : cases) own.emplace_back(at_work(c->prediction), c->truth.effects);
  return line("pairs_f1", "pairs: F1 of names", Bar::at_least, must, 0.92, f1_score(own),
              best_of_rivals(cases, [&](const auto& of) {
                std::vector<std::pair<Names, Names>> others;
                for (const ScoredCase* c : cases) others.emplace_back(of(*c).named, c->truth.effects);
                return f1_score(others);
              }));
}

bool is_harmless(const CaseTruth& t) { return t.effects.empty(); }

/// What rivals say counts from a strength on with which they raise no more alarms at harmless robots than the diagnosis does. Without
/// harmless robots they say nothing.
void silence_rivals(std::vector<ScoredCase>& cases) {
  std::set<std::string> names;
  std::size_t allowed = 0;
  for (const ScoredCase& c : cases) {
    for (const auto& [name, rival] : c.prediction.rivals) names.insert(name);
    allowed += is_harmless(c.truth) && false_alarm(c);
  }
  for (const std::string& name : names) {
    std::vector<double> alarms;
    bool any = false;
    for (const ScoredCase& c : cases) {
      const auto rival = c.prediction.rivals.find(name);
      if (!is_harmless(c.truth) || rival == c.prediction.rivals.end()) continue;
      any = true;
      if (!rival->second.named.empty()) alarms.push_back(rival->second.strength);
    }
    std::ranges::sort(alarms, std::greater{});
    const double above = alarms.size() > allowed ? alarms[allowed] : 0;
    for (ScoredCase& c : cases) {
      const auto rival = c.prediction.rivals.find(name);
      if (rival == c.prediction.rivals.end()) continue;
      if (!any) c.prediction.rivals.erase(rival);
      else if (!(rival->second.strength > above)) rival->second.named.clear();
    }
  }
}

/// The rung whose effects are most probable; none: no effect is.
std::size_t most_probable_rung(const Answer& a) {
  const std::array<double, gap::kRungs> of_rung = gap::rung_probabilities(a.sets);
  const auto most = std::ranges::max_element(of_rung);
  return *most > 0 ? static_cast<std::size_t>(most - of_rung.begin()) : gap::kRungs;
}

/// Adds the rows that score diagnoses of flights and bench together; none if no robot was on a bench.
void add_bench(const std::vector<ScoredCase>& cases, const Cases& singles, std::vector<ScoreLine>& lines) {
  const Cases both = of_parts(cases, {"singles_bench"}), harmless = of_parts(cases, {"own_parameters_bench"});
  if (both.empty() && harmless.empty()) return;
  Cases on_bench = both;
  std::erase_if(on_bench,
                [](const ScoredCase* c) { return gap::rung_of_effect(c->truth.effects.front()) == gap::kBodyRung; });
  lines.push_back(first_line("bench_top1", "with a bench: right effect first, of drive, hinges, stops, wings", 0.60,
                             0.80, on_bench));
  lines.push_back(first_line("bench_all_top1", "with a bench: right effect first, all", 0.55, 0.75, both));
  lines.push_back(line("bench_rung", "with a bench: right rung of the ladder", Bar::at_least, 0.85, 0.95,
                       share(both, [](const ScoredCase& c) {
                         return most_probable_rung(c.prediction) == gap::rung_of_effect(c.truth.effects.front());
                       })));
  lines.push_back(line("false_alarm_bench", "false alarm with a bench: own parameters", Bar::at_most, kFalseAlarms,
                       0.02, share(harmless, false_alarm)));
  std::size_t with = 0, without = 0, count = 0;
  for_same_robots(both, singles, [&](const ScoredCase& c, const ScoredCase& single) {
    ++count, with += named_alone(c), without += named_alone(single);
  });
  for (const auto& [key, what, right] :
       {std::tuple{"bench_pair_with", "the same robots, with a bench: right first", with},
        {"bench_pair_without", "the same robots, by flights: right first", without}})
    lines.push_back({key, what, "", "", proportion(right, count), {}, {}, {}, {}});
}

std::vector<ScoreLine> absolute_lines(const std::vector<ScoredCase>& cases);
std::vector<ScoreLine> contrast_lines(const std::vector<ScoredCase>& cases);
void add_hidden_lines(const std::string& key, const std::string& part, const std::vector<ScoredCase>& counting,
                      const std::vector<ScoredCase>& hidden, std::vector<ScoreLine>& lines);

}  // namespace

Answer answer_of(const Prediction& p) {
  const gap::Diagnosis& d = p.diagnosis;
  Answer a;
  a.kind = p.crashed ? "crashed" : d.verdict.remainder ? "remainder" : name_of(d.verdict.kind);
  a.effects = d.verdict.effects;
  a.probability = d.verdict.probability;
  a.nominal = d.nominal_loss;
  a.refit = d.refit_loss;
  if (d.refit_loss) a.floor = d.noise_floor;
  if (!d.unexplained.empty()) a.where = Where{d.unexplained.front().channel, d.unexplained.front().regime};
  if (d.next) a.manoeuvre = d.next->manoeuvre;
  a.rivals = p.rivals;
  for (const gap::Suspect& s : d.suspects) a.suspects.push_back(s.effect);
  for (const gap::RankedHypothesis& h : d.hypotheses) {
    a.hypotheses.push_back(h);
    if (h.kind == gap::HypothesisKind::none) a.none = h.probability;
    if (h.kind == gap::HypothesisKind::parameters) a.parameters = h.probability;
    if (h.kind == gap::HypothesisKind::unknown) a.unknown = h.probability;
    if (h.kind != gap::HypothesisKind::effect) continue;
    if (const auto same = std::ranges::find(a.sets, h.effects, &gap::RankedHypothesis::effects); same != a.sets.end()) {
      same->probability += h.probability;  // hypotheses with and without a remainder count together
      continue;
    }
    a.sets.push_back(h);
  }
  return a;
}

bool abstains(const Answer& a) { return a.kind == "group" || a.probability < 0.5; }

bool CaseTruth::counts() const {
  // in hover, effects are asked about that hover does not show
  return part == "hover" || std::ranges::all_of(over_sessions, [](double ratio) { return ratio >= kCounts; });
}

ScoredCase by_what_counts(ScoredCase c) {
  std::vector<double>& ratios = c.truth.over_sessions;
  const auto visible = std::ranges::count_if(ratios, [](double ratio) { return ratio >= kCounts; });
  if (ratios.size() != c.truth.effects.size() || visible == 0 || visible == std::ssize(ratios)) return c;
  for (std::size_t i = ratios.size(); i-- > 0;) {
    if (ratios[i] >= kCounts) continue;
    const std::string id = c.truth.effects[i];
    std::erase(c.truth.effects, id);
    ratios.erase(ratios.begin() + static_cast<std::ptrdiff_t>(i));
    std::erase(c.prediction.effects, id);
    for (auto& [name, rival] : c.prediction.rivals) std::erase(rival.named, id), std::erase(rival.ranking, id);
  }
  return c;
}

bool right(const CaseTruth& t, const Answer& p) {
  // what sessions hide may be called unchanged
  if (!t.counts() && (p.kind == "none" || p.kind == "parameters")) return true;
  if (t.part.starts_with("unchanged")) return p.kind == "none" || p.kind == "parameters";
  if (t.part == "changed_withheld" || t.part == "changed_outside") return p.kind == "unknown" || p.kind == "remainder";
  if (t.part == "none" || t.part == "conventions") return p.kind == "none" || p.kind == "parameters";
  if (t.part == "parameters" || t.part == "own_parameters") return p.kind == "parameters";
  if (t.part == "withheld" || t.part == "outside") return p.kind == "unknown";
  return (names_set(p.kind) && same(p.effects, t.effects)) || (p.kind == "group" && holds(p.effects, t.effects));
}

std::optional<double> realised_nats(const ScoredCase& c) {
  if (c.truth.effects.size() != 1) return std::nullopt;
  std::optional<double> own, rival;
  for (const gap::RankedHypothesis& h : c.prediction.hypotheses) {
    std::optional<double>& best = std::ranges::count(h.effects, c.truth.effects.front()) > 0 ? own : rival;
    best = std::max(best.value_or(h.explained()), h.explained());
  }
  if (!own || !rival) return std::nullopt;
  return *own - *rival;
}

std::optional<double> closure(const ScoredCase& c) {
  if (c.prediction.kind == "data") return 0;
  const gap::RankedHypothesis* truth = fitted(c.prediction, c.truth.effects);
  std::optional<double> refit = c.prediction.refit;
  if ((truth == nullptr || !truth->loss) && c.true_fit) {
    truth = fitted(*c.true_fit, c.truth.effects);
    refit = c.true_fit->refit;
  }
  if (truth == nullptr || !truth->loss || !refit || !c.prediction.refit) return std::nullopt;
  const double closable = *refit - *truth->loss;
  if (closable < kSureOfGain * truth->loss_gain_sd || closable <= 0) return std::nullopt;
  const gap::RankedHypothesis* named = fitted(c.prediction, at_work(c.prediction));
  if (named == nullptr || !named->loss) return 0;
  return (*c.prediction.refit - *named->loss) / closable;
}

bool needs_true_fit(const ScoredCase& c) {
  if ((c.truth.part != "singles" && c.truth.part != "changed") || !c.truth.counts()) return false;
  const gap::RankedHypothesis* truth = fitted(c.prediction, c.truth.effects);
  return c.prediction.kind != "data" && (truth == nullptr || !truth->loss);
}

Scores score(const std::vector<ScoredCase>& cases) {
  Scores s;
  std::array<std::vector<ScoredCase>, 2> all, counting, hidden;  // absolute, contrasts
  for (const ScoredCase& c : cases)
    all[std::ranges::count(kContrastParts, c.truth.part) > 0].push_back(by_what_counts(c));
  std::map<std::string, Cases> harmless;
  for (const ScoredCase& c : cases)
    for (const auto& [name, rival] : c.prediction.rivals)
      if (is_harmless(c.truth)) harmless[name].push_back(&c);
  for (const auto& [name, list] : harmless)
    s.unbounded_alarms[name] =
        share(list, [&](const ScoredCase& c) { return !c.prediction.rivals.at(name).named.empty(); });
  for (const std::size_t half : {0U, 1U}) {
    silence_rivals(all[half]);
    for (ScoredCase& c : all[half]) (c.truth.counts() ? counting : hidden)[half].push_back(std::move(c));
  }
  if (!counting[0].empty() || !hidden[0].empty()) {
    s.lines = absolute_lines(counting[0]);
    add_hidden_lines("", "singles", counting[0], hidden[0], s.lines);
  }
  if (!counting[1].empty() || !hidden[1].empty()) {
    std::ranges::move(contrast_lines(counting[1]), std::back_inserter(s.lines));
    add_hidden_lines("contrast", "changed", counting[1], hidden[1], s.lines);
  }
  for (const ScoreLine& l : s.lines)
    if (l.rival && l.rival->value && l.score.value && *l.rival->value > *l.score.value) s.beaten_on.push_back(l.key);
  return s;
}

namespace {

/// How the plans of cases compare with what became of them; nothing without plans.
void add_foresight(const std::string& key, const std::string& what, const Cases& cases, std::vector<ScoreLine>& lines) {
  constexpr std::ptrdiff_t kFewestWrong = 10;
  std::vector<Claim> claims;
  std::vector<double> expected, realised;
  for (const ScoredCase* c : cases) {
    const std::optional<double> nats = realised_nats(*c);
    if (!c->foreseen || !nats) continue;
    claims.push_back({c->foreseen->probability, named_alone(*c)});
    expected.push_back(c->foreseen->nats);
    realised.push_back(*nats);
  }
  if (claims.empty()) return;
  const auto some = [](const auto& all, const std::vector<std::size_t>& which) {
    std::decay_t<decltype(all)> chosen;
    for (const std::size_t i : which) chosen.push_back(all[i]);
    return chosen;
  };
  lines.push_back(line(key + "_rank", what + ": rank correlation of expected and realised nats", Bar::at_least, 0.60,
                       0.80, resampled(claims.size(), [&](const std::vector<std::size_t>& which) {
                         return rank_correlation(some(expected, which), some(realised, which));
                       })));
  const std::ptrdiff_t wrong = std::ranges::count(claims, false, &Claim::right);
  lines.push_back(
      line(key + "_auc", what + ": area under the curve for \"named first\"", Bar::at_least, 0.75, 0.90,
           wrong < kFewestWrong ? ScoreValue{} : resampled(claims.size(), [&](const std::vector<std::size_t>& which) {
             return area_under_curve(some(claims, which));
           })));
  lines.push_back(line(key + "_ece", what + ": calibration error of \"named first\"", Bar::at_most, 0.06, 0.03,
                       calibration_score(claims)));
  ScoreLine hope{key + "_hope", what + ": expected over realised nats, of medians", "", "",
                 resampled(claims.size(), [&](const std::vector<std::size_t>& which) -> std::optional<double> {
                   const double brought = io::median(some(realised, which));
                   if (!(brought > 0)) return std::nullopt;
                   return io::median(some(expected, which)) / brought;
                 })};
  lines.push_back(std::move(hope));
}

std::vector<ScoreLine> absolute_lines(const std::vector<ScoredCase>& cases) {
  std::vector<ScoreLine> l;
  const Cases singles = of_parts(cases, {"singles"}), strange = of_parts(cases, {"withheld", "outside"}),
              hover = of_parts(cases, {"hover"});
  l.push_back(first_line("top1_mocap_imu", "right effect first, mocap and IMU", 0.85, 0.95, singles));
  l.push_back(first_line("top1_current", "right effect first, current logged too", 0.88, 0.97,
                         of_parts(cases, {"singles_current"})));
  l.push_back(line("group_top1", "right group first", Bar::at_least, 0.92, 0.98, share(singles, right_group),
                   of_rivals(singles, rival_group)));
  l.push_back(line("top3", "right effect among three", Bar::at_least, 0.95, 0.99, share(singles, among_three),
                   of_rivals(singles, rival_among_three)));
  l.push_back(line("suspects", "given that an effect is missing: it is among the three named", Bar::at_least, 0.60,
                   0.80, share(singles, [](const ScoredCase& c) {
                     return std::ranges::count(c.prediction.suspects, c.truth.effects.front()) > 0;
                   })));
  for (const auto& [part, what] : {std::pair{"none", "false alarm: none"},
                                   {"parameters", "false alarm: parameters"},
                                   {"own_parameters", "false alarm: own parameters"},
                                   {"conventions", "false alarm: other conventions"}}) {
    const Cases harmless = of_parts(cases, {part});
    l.push_back(
        line(std::string("false_alarm_") + part, what, Bar::at_most, kFalseAlarms, 0.02, share(harmless, false_alarm)));
  }
  l.push_back(redeclared_line(of_parts(cases, {"redeclared"}), singles));
  l.push_back(line("unknown", "withheld or outside: \"unknown\"", Bar::at_least, 0.75, 0.90,
                   share(strange, [](const ScoredCase& c) { return c.prediction.kind == "unknown"; })));
  l.push_back(line("unknown_wrong", "withheld or outside: a wrong name above 0.8", Bar::at_most, 0.05, 0.02,
                   share(strange, [](const ScoredCase& c) {
                     return names_effects(c.prediction) && c.prediction.probability > kConfident;
                   })));
  Cases unknown = strange;
  std::erase_if(unknown, [](const ScoredCase* c) { return c->prediction.kind != "unknown"; });
  l.push_back(line("unknown_where", "unknown: where it acts is described as sealed", Bar::at_least, 0.80, 0.95,
                   share(unknown, described)));
  l.push_back(calibration_line(cases));
  l.push_back(closure_line(singles));
  l.push_back(pairs_line(of_parts(cases, {"pairs"})));
  l.push_back(line("hover_abstain", "hover only: abstains", Bar::at_least, 0.85, 0.95,
                   share(hover, [](const ScoredCase& c) { return abstains(c.prediction); })));
  l.push_back(line("hover_next", "hover only: the proposed flight, flown, brings the truth to first place",
                   Bar::at_least, 0.60, 0.85, share(hover, next_brings_truth)));
  Cases followed = singles;
  std::erase_if(followed, [](const ScoredCase* c) { return !c->after_next; });
  if (!followed.empty())
    l.push_back(line("undecided_next", "undecided singles: the proposal, flown, brings the truth to first place",
                     Bar::at_least, 0.75, 0.90, share(followed, next_brings_truth)));
  add_foresight("plan", "plan", singles, l);
  add_bench(cases, singles, l);
  return l;
}

std::vector<ScoreLine> contrast_lines(const std::vector<ScoredCase>& cases) {
  std::vector<ScoreLine> l;
  const auto of = [&](const char* part) { return of_parts(cases, {part}); };
  const Cases changed = of("changed"), strange = of_parts(cases, {"changed_withheld", "changed_outside"});
  l.push_back(first_line("contrast_top1", "contrast: right effect first", 0.85, 0.95, changed));
  const auto noticed = [](const CaseTruth&, const Rival& r) { return !r.named.empty(); };
  l.push_back(line("contrast_noticed", "contrast: that something changed, whatever is named", Bar::at_least, 0.95, 0.99,
                   share(changed, false_alarm), of_rivals(changed, noticed)));
  l.push_back(line("contrast_group_top1", "contrast: right group first", Bar::at_least, 0.92, 0.98,
                   share(changed, right_group), of_rivals(changed, rival_group)));
  l.push_back(line("contrast_top3", "contrast: right effect among three", Bar::at_least, 0.97, 0.99,
                   share(changed, among_three), of_rivals(changed, rival_among_three)));
  l.push_back(first_line("contrast_short_reference", "contrast: right first, reference of 10 s", 0.75, 0.90,
                         of("changed_short_reference")));
  l.push_back(
      first_line("contrast_short_test", "contrast: right first, test of 10 s", 0.75, 0.90, of("changed_short_test")));
  l.push_back(first_line("contrast_calm_top1", "contrast: right first, reference in hover and on slow paths", 0.70,
                         0.85, of("changed_calm")));
  for (const auto& [part, key, what] :
       {std::tuple{"unchanged", "false_alarm_contrast", "contrast: harmless session, anything named"},
        {"unchanged_calm", "false_alarm_contrast_calm", "contrast: harmless, reference in hover and on slow paths"}}) {
    const Cases harmless = of(part);
    l.push_back(line(key, what, Bar::at_most, kFalseAlarms, 0.02, share(harmless, false_alarm)));
  }
  const auto left = [](const ScoredCase& c) {
    return c.prediction.kind == "unknown" || c.prediction.kind == "remainder";
  };
  l.push_back(line("contrast_unknown", "contrast, withheld or outside: \"unknown\" or a remainder", Bar::at_least, 0.75,
                   0.90, share(strange, left)));
  l.push_back(line("contrast_unknown_wrong", "contrast, withheld or outside: a wrong name above 0.8", Bar::at_most,
                   0.08, 0.02, share(strange, [&](const ScoredCase& c) {
                     return names_effects(c.prediction) && !left(c) && c.prediction.probability > kConfident;
                   })));
  Cases unknown = strange;
  std::erase_if(unknown, [&](const ScoredCase* c) { return !left(*c); });
  l.push_back(line("contrast_where", "contrast, unknown or a remainder: where it acts is as sealed", Bar::at_least,
                   0.80, 0.95, share(unknown, described)));
  ScoreLine ece = calibration_line(cases);
  ece.key = "contrast_ece", ece.what = "contrast: calibration error (ECE) over all parts";
  l.push_back(std::move(ece));
  ScoreLine closed = closure_line(changed);
  closed.key = "contrast_closure", closed.what = "contrast: closure as a share of the truth's, median";
  l.push_back(std::move(closed));
  ScoreLine pairs = pairs_line(of("changed_pairs"), 0.80);
  pairs.key = "contrast_pairs_f1", pairs.what = "contrast: pairs, F1 of names";
  l.push_back(std::move(pairs));
  add_foresight("contrast_plan", "contrast, plan", changed, l);
  return l;
}

/// What the other rows leave out, so that no choice of what counts hides a case. `part`: whose cases are added up.
void add_hidden_lines(const std::string& key, const std::string& part, const std::vector<ScoredCase>& counting,
                      const std::vector<ScoredCase>& hidden, std::vector<ScoreLine>& lines) {
  const auto add = [&](const char* end, const char* what, const ScoreValue& score, const NamedScore& rival = {}) {
    ScoreLine l;
    l.key = key.empty() ? end : key + "_" + end;
    l.what = key.empty() ? what : key + ", " + what;
    l.score = score;
    if (rival) l.rival_name = rival->first, l.rival = rival->second;
    lines.push_back(std::move(l));
  };
  Cases every = of_parts(counting, {part}), own;
  std::ranges::move(of_parts(hidden, {part}), std::back_inserter(every));
  for (const ScoredCase& c : hidden) own.push_back(&c);
  const auto is_right = [](const ScoredCase& c) { return right(c.truth, c.prediction); };
  add("all_top1", "right first, also of effects that sessions hide", share(every, named_alone),
      of_rivals(every, rival_first));
  add("hidden_right", "effects that sessions hide: unchanged, or right", share(own, is_right));
  add("hidden_wrong", "effects that sessions hide: a wrong name",
      share(own, [&](const ScoredCase& c) { return names_effects(c.prediction) && !is_right(c); }));
}

}  // namespace

}  // namespace flappy::benchmark
