#include "lab/benchmark/calibrate.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <set>

#include "gap/answer/verdict.hpp"
#include "gap/question/alone.hpp"
#include "gap/question/contrast.hpp"
#include "io/files.hpp"
#include "io/program.hpp"
#include "io/text.hpp"
#include "lab/benchmark/records.hpp"

namespace flappy::benchmark {
namespace {

namespace fs = std::filesystem;
using gap::ScoredHypothesis;
using gap::VerdictRule;

/// Least probability of a right answer in the score, so that no single case decides.
constexpr double kMinProbability = 1e-3;
/// Standard deviations of slope and offset of what verdicts say (VerdictRule::Said) before any robot was seen. Choice.
constexpr double kPriorOfSaid = 0.5;
/// Price of the square of the steps that a constant moves; with ten robots a part, some constants would else go to
/// their limits. Chosen by cross-validation over the families on 83 development robots: 0.03 to 1 are alike, and 0 is
/// worse by 0.12 in the mean log probability.
constexpr double kPriceOfMoving = 0.1;

struct Constant {
  const char *table, *key;
  std::function<double&(VerdictRule&)> of;
  double low, high;
  double step = 0;  ///< 0: a factor of e

  double moved(double x, double steps) const {
    return std::clamp(step > 0 ? x + step * steps : x * std::exp(steps), low, high);
  }
  double steps_between(double from, double to) const { return step > 0 ? (to - from) / step : std::log(to / from); }
};

/// Place of a number in the text of a TOML file: first character and length. None: the file lacks it.
std::optional<std::pair<std::size_t, std::size_t>> find_number(const std::string& text, const std::string& table,
                                                               const std::string& key) {
  const std::size_t header = text.find("\n[" + table + "]");
  if (header == std::string::npos) return std::nullopt;
  const std::size_t end = text.find("\n[", header + 1), at = text.find("\n" + key + " = ", header);
  if (at >= end) return std::nullopt;
  const std::size_t begin = at + key.size() + 4;
  return std::pair{begin, text.find_first_of(" \n", begin) - begin};
}

/// Comments and layout stay.
void set_number(std::string& text, const std::string& table, const std::string& key, const std::string& value) {
  if (const auto place = find_number(text, table, key)) text.replace(place->first, place->second, value);
}

/// The constants that a verdict file has.
std::vector<Constant> constants_of(const std::string& file) {
  std::vector<Constant> all = {
      {"tempering", "nats", [](VerdictRule& r) -> double& { return r.tempering.nats; }, 0.1, 100},
      {"tempering", "freedom", [](VerdictRule& r) -> double& { return r.tempering.freedom; }, 0.3, 30},
      {"gain", "by_chance_nats", [](VerdictRule& r) -> double& { return r.gain.by_chance_nats; }, 0, 300, 10},
      {"gain.outside", "by_chance_nats", [](VerdictRule& r) -> double& { return r.gain.outside_by_chance_nats; }, 0,
       300, 10},
      {"another_law", "further_share", [](VerdictRule& r) -> double& { return r.gain.further_share; }, 0, 1, 0.2},
      {"another_law", "remainder_share", [](VerdictRule& r) -> double& { return r.gain.remainder_share; }, 0, 1, 0.2},
      {"prior", "parameters", [](VerdictRule& r) -> double& { return r.prior.parameters; }, 0.01, 0.9},
      {"prior", "unknown", [](VerdictRule& r) -> double& { return r.prior.unknown; }, 0.01, 0.8},
      {"prior", "remainder", [](VerdictRule& r) -> double& { return r.prior.remainder; }, 0.001, 1},
  };
  std::erase_if(all, [&](const Constant& c) { return !find_number(file, c.table, c.key); });
  return all;
}

struct Case {
  CaseTruth truth;
  std::string family;
  bool contrast = false;
  std::vector<ScoredHypothesis> hypotheses;
  std::vector<gap::SeenQuantity> seen;
  double weight = 0;
  std::size_t part = 0;
};

double moved_prior(const ScoredHypothesis& a, const VerdictRule& from, const VerdictRule& to) {
  using Kind = gap::HypothesisKind;
  const auto move = [](double before, double now) { return std::log(now / before); };
  switch (a.kind) {
    case Kind::none:
      return move(from.prior.none, to.prior.none);
    case Kind::parameters:
      return move(from.prior.parameters, to.prior.parameters);
    case Kind::unknown:
      return move(from.prior.unknown, to.prior.unknown);
    case Kind::effect:
      return move(from.prior.effect, to.prior.effect) +
             (!a.has_remainder() ? 0 : move(from.prior.remainder, to.prior.remainder));
  }
  return 0;
}

/// The rule by which a folder was scored. InputError if it differs from `start` in a constant that is not learnt.
VerdictRule scored_by(const fs::path& folder, const VerdictRule& start) {
  const fs::path file = verdict_of_predictions(folder);
  if (!fs::exists(file))
    throw io::InputError(file.string() + ": is missing; accepted: a folder that this version of score has scored");
  const VerdictRule own = gap::read_verdict_rule(file);
  const auto others = [](const VerdictRule& r) {
    return std::array{r.unknown.penalty_nats, r.gain.further_screened_nats, r.gain.vanished_magnitude,
                      r.prior.further_effect, r.refutation.min_share,       r.naming.least};
  };
  if (others(own) != others(start))
    throw io::InputError(folder.string() +
                         ": was scored with other constants that calibrate does not learn; accepted: a "
                         "--verdict that has those of " +
                         file.string());
  return own;
}

class Calibration {
 public:
  explicit Calibration(const CalibrateCommand& command)
      : rule_(gap::read_verdict_rule(command.verdict)), constants_(constants_of(io::read_text(command.verdict))) {
    std::map<std::string, std::size_t> parts;
    std::vector<double> counts;
    for (const fs::path& folder : command.folders) {
      const Manifest manifest = read_manifest(folder);
      families_.insert(manifest.family);
      if (!fs::exists(true_fits(folder)))
        throw io::InputError(folder.string() + ": was not scored; accepted: folders of flappy-blind score");
      const VerdictRule own_rule = scored_by(folder, rule_);
      std::map<std::size_t, CaseTruth> truths;
      const Json sealed = open_labels(folder, manifest);
      for (const Json& json : sealed.at("cases")) {
        const Label l = label_from(json);
        truths[l.planned.number] = l.truth();
      }
      for (const PublicCase& c : manifest.cases) {
        const Prediction p = read_prediction(prediction_file(folder, c.number));
        Case own{.truth = truths.at(c.number), .family = manifest.family, .contrast = !c.references(folder).empty()};
        for (const gap::RankedHypothesis& h : p.diagnosis.hypotheses) {
          ScoredHypothesis a;
          a.kind = h.kind;
          a.effects = h.effects;
          a.log_evidence = h.log_evidence;
          a.log_prior = h.log_prior;
          if (h.remainder) a.unexplained.emplace_back();
          const double move = moved_prior(a, own_rule, rule_);
          a.log_prior += move, a.log_evidence += move;
          own.hypotheses.push_back(std::move(a));
        }
        own.seen = p.diagnosis.seen;
        if (own.hypotheses.empty()) continue;  // its data were faulty
        if (!own.truth.counts()) continue;     // as the score does
        own.part = parts.try_emplace(manifest.family + " " + own.truth.part, counts.size()).first->second;
        if (own.part == counts.size()) counts.push_back(0);
        counts[own.part] += 1;
        cases_.push_back(std::move(own));
      }
    }
    for (Case& c : cases_) c.weight = 1 / (counts[c.part] * static_cast<double>(counts.size()));
  }

  std::size_t cases() const { return cases_.size(); }
  const VerdictRule& start() const { return rule_; }
  const std::vector<Constant>& constants() const { return constants_; }

  /// Weighted mean logarithm of the probability of the right answers. `without`: a family that does not count.
  double score(const VerdictRule& rule, const std::string& without = "") const {
    double sum = 0, weights = 0;
    for (const Case& c : cases_) {
      if (c.family == without) continue;
      weights += c.weight;
      double probability = 0;
      for (const ScoredHypothesis& a : moved(c, rule))
        if (right(c.truth, {.kind = a.has_remainder() ? "remainder" : name_of(a.kind), .effects = a.effects}))
          probability += a.probability;
      sum += c.weight * std::log(kMinProbability + (1 - kMinProbability) * probability);
    }
    return sum / weights;
  }

  /// Maximises the score less the price of what moved along one constant after another, with shrinking steps (Hooke,
  /// Jeeves 1961).
  VerdictRule best(const std::string& without = "") const {
    VerdictRule rule = rule_;
    double value = score(rule, without);
    for (double step = 2; step > 0.01; step /= 2)
      for (bool better = true; better;) {
        better = false;
        for (const Constant& c : constants_)
          for (const double way : {step, -step}) {
            VerdictRule there = rule;
            double& x = c.of(there);
            x = c.moved(x, way);
            if (std::ranges::count(shared(there), &x)) share(there, x);
            const double now = score(there, without) - price(there);
            if (now > value + 1e-6) rule = there, value = now, better = true;
          }
      }
    return rule;
  }

  /// Slope and offset of what a verdict says, from the verdicts of each family by what the others taught.
  VerdictRule::Said said() const {
    std::vector<Claim> verdicts;
    std::vector<double> weights;
    for (const std::string& family : families_) {
      VerdictRule rule = families_.size() > 1 ? best(family) : rule_;
      rule.said = {};
      for (const Case& c : cases_) {
        if (c.family != family) continue;
        gap::Inference d;
        d.hypotheses = moved(c, rule);
        d.seen = c.seen;
        gap::conclude(
            rule, [&](const ScoredHypothesis& a) { return c.contrast ? gap::contrast_pool_of(a) : gap::pool_of(a); },
            d);
        const Answer answer{.kind = d.verdict.remainder ? "remainder" : name_of(d.verdict.kind),
                            .effects = d.verdict.effects};
        verdicts.push_back({d.verdict.probability, right(c.truth, answer)});
        weights.push_back(c.weight * static_cast<double>(cases_.size()));
      }
    }
    return learn_said(verdicts, weights);
  }
  std::string families() const { return io::joined({families_.begin(), families_.end()}); }

 private:
  /// The hypotheses of a case with the probabilities of another rule.
  std::vector<ScoredHypothesis> moved(const Case& c, const VerdictRule& rule) const {
    std::vector<ScoredHypothesis> all = c.hypotheses;
    for (ScoredHypothesis& a : all) {
      const double move = moved_prior(a, rule_, rule);
      a.log_prior += move;
      a.log_evidence += move;
    }
    set_probabilities(all, rule);
    if (gap::changed_plainly(c.seen)) gap::exclude_unchanged(all);
    return all;
  }

  double price(VerdictRule& rule) const {
    VerdictRule start = rule_;
    double sum = 0;
    for (const Constant& c : constants_) sum += std::pow(c.steps_between(c.of(start), c.of(rule)), 2);
    return kPriceOfMoving * sum;
  }
  /// The priors that add up to 1.
  static std::array<double*, 4> shared(VerdictRule& rule) {
    return {&rule.prior.none, &rule.prior.parameters, &rule.prior.effect, &rule.prior.unknown};
  }
  /// Scales the other priors so that all add up to 1 with `one`.
  static void share(VerdictRule& rule, const double& one) {
    double others = 0;
    for (const double* p : shared(rule))
      if (p != &one) others += *p;
    for (double* p : shared(rule))
      if (p != &one) *p *= (1 - one) / others;
  }

  VerdictRule rule_;
  std::vector<Constant> constants_;
  std::vector<Case> cases_;
  std::set<std::string> families_;
};

constexpr double kMinSlope = 0.05;  // more evidence never says less

std::string rounded(double x) { return io::format("%.4g", x); }

}  // namespace

VerdictRule::Said learn_said(const std::vector<Claim>& claims, const std::vector<double>& weights) {
  constexpr double kEdge = 1e-6;
  const Eigen::Vector2d before(1, 0);
  const auto fitted = [&](Eigen::Vector2d at, bool slope_is_free) {
    for (int i = 0; i < 50; ++i) {
      Eigen::Vector2d gradient = (before - at) / (kPriorOfSaid * kPriorOfSaid);
      Eigen::Matrix2d curvature = Eigen::Matrix2d::Identity() / (kPriorOfSaid * kPriorOfSaid);
      for (std::size_t k = 0; k < claims.size(); ++k) {
        const double p = std::clamp(claims[k].probability, kEdge, 1 - kEdge);
        const Eigen::Vector2d x(std::log(p / (1 - p)), 1);
        const double q = 1 / (1 + std::exp(-at.dot(x)));
        gradient += weights[k] * (claims[k].right - q) * x;
        curvature += weights[k] * q * (1 - q) * x * x.transpose();
      }
      const Eigen::Vector2d step = slope_is_free ? Eigen::Vector2d(curvature.ldlt().solve(gradient))
                                                 : Eigen::Vector2d(0, gradient[1] / curvature(1, 1));
      at += std::min(1.0, 1 / step.norm()) * step;  // far from the optimum Newton's step can be too long
      if (step.norm() < 1e-9) break;
    }
    return at;
  };
  Eigen::Vector2d at = fitted(before, true);
  if (at[0] < kMinSlope) at = fitted({kMinSlope, at[1]}, false);
  return {at[0], at[1]};
}

namespace {

/// Replaces the table [said], which is the last of a file, or appends it.
void set_said(std::string& text, const VerdictRule::Said& said, const std::string& learnt) {
  const std::string begin = "\n# What a verdict says";
  text.erase(std::min(text.find(begin), text.size()));
  text += begin +
          " whose probability by evidence and priors is p: 1 / (1 + exp(-(slope logit(p) + offset))). Learnt:\n"
          "# flappy-blind calibrate, " +
          learnt + ".\n[said]\nslope = " + rounded(said.slope) + "\noffset = " + rounded(said.offset) + "\n";
}

/// Says at the head of a file where its constants come from.
void set_origin(std::string& text, const std::string& learnt) {
  const std::string begin = "# Learnt: flappy-blind calibrate";
  const std::string line = begin + ", " + learnt + ".\n";
  if (const std::size_t at = text.find(begin); at != std::string::npos)
    text.replace(at, text.find('\n', at) + 1 - at, line);
  else text.insert(text.find("schema = "), line);
}

}  // namespace

Json calibrate(const CalibrateCommand& command) {
  io::check_output(command.out);
  const Calibration calibration(command);
  const std::string learnt = std::to_string(calibration.cases()) + " development robots of families " +
                             calibration.families() + ", commit " + io::commit();
  VerdictRule before = calibration.start(), after = calibration.best();
  after.prior.none = std::stod(rounded(after.prior.none));
  after.prior.parameters = std::stod(rounded(after.prior.parameters));
  after.prior.unknown = std::stod(rounded(after.prior.unknown));
  after.prior.effect = 1 - after.prior.none - after.prior.parameters - after.prior.unknown;
  std::string text = io::read_text(command.verdict);
  Json json = {
      {"cases", calibration.cases()}, {"score_before", calibration.score(before)}, {"score", calibration.score(after)}};
  for (const Constant& c : calibration.constants()) {
    set_number(text, c.table, c.key, rounded(c.of(after)));
    json[std::string(c.table) + "." + c.key] = c.of(after);
    std::printf("%-12s %-24s %10.4g, was %.4g\n", c.table, c.key, c.of(after), c.of(before));
  }
  for (const auto& [key, value] : {std::pair{"none", after.prior.none}, {"effect", after.prior.effect}})
    set_number(text, "prior", key, io::format("%.6g", value));
  std::printf("mean log probability of what is right: %.3f, was %.3f, of %zu cases\n", json["score"].get<double>(),
              json["score_before"].get<double>(), calibration.cases());
  set_origin(text, learnt);
  const VerdictRule::Said said = calibration.said();
  set_said(text, said, learnt);
  json["said.slope"] = said.slope, json["said.offset"] = said.offset;
  std::printf("a verdict says 1 / (1 + exp(-(%s logit(p) %+.4g)))\n", rounded(said.slope).c_str(), said.offset);
  gap::parse_verdict_rule(text, command.out.string());  // a file that no program reads is not written
  io::write_atomically(command.out, text);
  return json;
}

}  // namespace flappy::benchmark
