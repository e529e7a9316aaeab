#include "gap/question/session_contrast.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include "gap/question/session_fit.hpp"
#include "gap/session/odd_flights.hpp"
#include "io/parallel.hpp"
#include "model/effects/registry.hpp"

namespace flappy::gap {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Single effects that are joined by another. Choice.
constexpr std::size_t kJoined = 3;
/// Sets of two effects that are kept. Choice.
constexpr std::size_t kKept = 6;
/// A flight changes within itself beyond this many standard deviations. Choice.
constexpr double kStepTimes = 6;
/// And beyond this many times the clearest step of the references. Choice.
constexpr double kStepBeyond = 1.5;
/// A group has at most so many sets of effects. Choice.
constexpr std::size_t kMaxSets = 3;
/// Step of the derivative by an actuator's share. Choice.
constexpr double kLoss = 0.01;
/// Smallest probability of what is named, and of "unchanged". Choice.
constexpr double kMoreThanNot = 0.5;

/// Any one or two kinds of quantities change, or all, each choice as probable as any other.
double log_density_of_unknown(const SessionDensity& density, const std::vector<SessionQuantity>& quantities,
                              const SessionPrior& prior) {
  const std::vector<std::vector<Index>>& blocks = density.blocks();
  const VectorXd none = VectorXd::Zero(density.difference().size());
  std::vector<double> values;
  const auto with = [&](const std::set<std::size_t>& chosen) {
    VectorXd more = none;
    for (const std::size_t b : chosen)
      for (const Index q : blocks[b]) more[q] = std::pow(prior.of(quantities[static_cast<std::size_t>(q)]).unknown, 2);
    values.push_back(density.log_density(none, more));
  };
  std::set<std::size_t> all;
  for (std::size_t a = 0; a < blocks.size(); ++a) {
    with({a});
    all.insert(a);
    for (std::size_t b = a + 1; b < blocks.size(); ++b) with({a, b});
  }
  if (blocks.size() > 2) with(all);
  return log_sum(values) - std::log(static_cast<double>(values.size()));
}

/// Quantities of all reference and test flights.
struct Sessions {
  CommonTrend trend;
  std::vector<FlightQuantities> references, tests;
  Sessions(const Flights& flights, const VehicleHypothesis& robot, int threads)
      : trend(common_trend(flights.references, robot)) {
    std::vector<std::optional<FlightQuantities>> made(flights.size());
    io::parallel_for(made.size(), threads, [&](std::size_t f) { made[f].emplace(*flights[f], robot, trend); });
    for (std::size_t f = 0; f < made.size(); ++f)
      (flights.is_reference(f) ? references : tests).push_back(std::move(*made[f]));
  }
  const std::vector<SessionQuantity>& quantities() const { return references.front().quantities(); }
};

SessionScatter scatter_of(const Flights& flights, const Sessions& sessions, const SessionPrior& prior) {
  const std::vector<std::string> names = session_names(flights.references);
  return {sessions.quantities(), session_values(sessions.references, session_numbers(names), prior),
          session_times(names, session_names(flights.tests)), prior};
}

SessionDensity density_of(const Sessions& sessions, const SessionScatter& scatter, const SessionPrior& prior) {
  const SessionValues one = session_values(sessions.tests, std::vector<int>(sessions.tests.size(), 0), prior);
  return {scatter, one.values.row(0).transpose(), one.variances.row(0).transpose(), prior};
}

/// The share of its thrust that each actuator has more or less, from thrust and moments; empty: these do not tell.
std::vector<SeenQuantity> actuators_seen(const TestSession& tests, const std::vector<SessionQuantity>& quantities,
                                         const VehicleHypothesis& robot) {
  const std::vector<model::BeatAveraged::Actuator>& actuators = robot.vehicle.beat_averaged->actuators;
  std::vector<Index> used;
  for (std::size_t q = 0; q < quantities.size(); ++q)
    if (quantities[q].block == "thrust" || quantities[q].block == "moment" || quantities[q].block == "yaw")
      used.push_back(static_cast<Index>(q));
  if (actuators.size() < 2 || used.size() < actuators.size()) return {};
  std::vector<VehicleHypothesis> vehicles(actuators.size(), robot);
  for (std::size_t k = 0; k < actuators.size(); ++k)
    vehicles[k].vehicle.beat_averaged->actuators[k].load_share *= 1 + kLoss;
  const std::vector<VectorXd> shifts = tests.shifts(vehicles);
  MatrixXd columns(static_cast<Index>(used.size()), static_cast<Index>(actuators.size()));
  VectorXd sd(columns.rows()), difference(columns.rows());
  for (Index i = 0; i < columns.rows(); ++i) {
    const Index q = used[static_cast<std::size_t>(i)];
    sd[i] = std::sqrt(tests.density().variance()[q]);
    difference[i] = tests.density().difference()[q] / sd[i];
    for (Index k = 0; k < columns.cols(); ++k) columns(i, k) = shifts[static_cast<std::size_t>(k)][q] / kLoss / sd[i];
  }
  const Eigen::ColPivHouseholderQR<MatrixXd> qr(columns);
  if (qr.rank() < columns.cols()) return {};
  const VectorXd share = qr.solve(difference);
  const MatrixXd covariance = (columns.transpose() * columns).inverse();
  std::vector<SeenQuantity> seen;
  for (Index k = 0; k < share.size(); ++k)
    seen.push_back({"thrust of " + actuators[static_cast<std::size_t>(k)].name, "share", 0, share[k],
                    std::sqrt(covariance(k, k))});
  return seen;
}

std::vector<SeenQuantity> all_seen(const TestSession& tests, const SessionScatter& scatter,
                                   const VehicleHypothesis& robot) {
  const std::vector<SessionQuantity>& quantities = scatter.quantities();
  const SessionDensity& density = tests.density();
  std::vector<SeenQuantity> seen = actuators_seen(tests, quantities, robot);
  for (std::size_t i = 0; i < quantities.size(); ++i) {
    const auto q = static_cast<Index>(i);
    const double reference = scatter.mean()[q];
    seen.push_back({quantities[i].name, quantities[i].unit, reference, reference + density.difference()[q],
                    std::sqrt(density.variance()[q])});
  }
  return seen;
}

std::vector<OddFlight> all_odd(const Flights& flights, const Sessions& sessions, const SessionScatter& scatter,
                               const SessionPrior& prior, const VehicleHypothesis& robot, int threads) {
  std::vector<OddFlight> odd;
  for (const auto& [list, quantities] :
       {std::pair(&flights.references, &sessions.references), std::pair(&flights.tests, &sessions.tests)}) {
    std::vector<std::string> names;
    for (const auto& f : *list) names.push_back(f->name());
    for (OddFlight& o : odd_flights(names, *quantities, scatter, prior)) odd.push_back(std::move(o));
  }
  std::vector<std::optional<StepWithin>> steps(flights.size());
  io::parallel_for(steps.size(), threads,
                   [&](std::size_t f) { steps[f] = step_within(*flights[f], robot, sessions.trend); });
  double usual = kStepTimes;
  for (std::size_t f = 0; f < flights.references.size(); ++f)
    if (steps[f]) usual = std::max(usual, kStepBeyond * steps[f]->times);
  for (std::size_t f = flights.references.size(); f < steps.size(); ++f)
    if (steps[f] && steps[f]->times > usual)
      odd.push_back({flights[f]->name(), steps[f]->quantity, steps[f]->times, steps[f]->since_s, steps[f]->step});
  return odd;
}

/// Hypotheses with their evidence.
class Weighing {
 public:
  Weighing(const Flights& flights, const sim::Randomisation& uncertain, const InferenceOptions& options,
           const VectorXd& robot, const TestSession& tests)
      : flights_(flights), uncertain_(uncertain), options_(options), robot_(robot), tests_(tests) {
    for (const model::CatalogueEffect& e : model::catalogue_of(uncertain.nominal()))
      if (!std::ranges::count(options.withheld, e.info.id))
        (shows(tests, Hypothesis(uncertain, {e.info.id}), robot) ? effects_ : untestable_).emplace_back(e.info.id);
  }
  const std::vector<std::string>& untestable() const { return untestable_; }

  /// `go_on`: false to fit no more.
  std::vector<ScoredHypothesis> all(const std::vector<SessionQuantity>& quantities,
                                    const std::function<bool(double share, const std::string& what)>& go_on) const {
    const SessionPrior& prior = options_.sessions;
    const VectorXd none = VectorXd::Zero(tests_.density().difference().size());
    std::vector<ScoredHypothesis> list = {
        scored(HypothesisKind::parameters, tests_.density().log_density(none, none), prior.unchanged),
        scored(HypothesisKind::unknown, log_density_of_unknown(tests_.density(), quantities, prior), prior.unknown)};
    if (effects_.empty() || !go_on(0.4, "fitting effects")) {
      set_probabilities(list);
      return list;
    }
    const double each = prior.effect / static_cast<double>(effects_.size());
    std::vector<EffectFit> singles(effects_.size());
    io::parallel_for(singles.size(), options_.threads, [&](std::size_t i) {
      singles[i] =
          fit_each_way(tests_, Hypothesis(uncertain_, {effects_[i]}), robot_, nullptr, law_error_of({effects_[i]}));
    });
    for (std::size_t i = 0; i < effects_.size(); ++i) list.push_back(with({effects_[i]}, singles[i], each));
    const bool further_ones = go_on(0.7, "fitting another jointly");
    for (const Pair& p : further_ones ? pairs(singles) : std::vector<Pair>()) {
      const std::vector<std::string> both = {effects_[p.first], effects_[p.second]};
      list.push_back(with(both, p.fit, each * further(p)));
    }
    set_probabilities(list);
    return list;
  }

 private:
  struct Pair {
    std::size_t first, second;
    EffectFit fit;
  };
  /// The largest of the effects' stages.
  double law_error_of(const std::vector<std::string>& effects) const {
    double error = 0;
    for (const std::string& e : effects) error = std::max(error, options_.discrepancy.session.law_error_of(e));
    return error;
  }
  double further(const Pair& p) const {
    return options_.sessions.further(effects_[p.first], effects_[p.second], effects_.size() - 1);
  }
  /// The best single effects, each with any other; the most probable sets.
  std::vector<Pair> pairs(const std::vector<EffectFit>& singles) const {
    std::vector<std::size_t> order(singles.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, std::greater{}, [&](std::size_t i) { return singles[i].explained; });
    std::vector<Pair> pairs;
    for (std::size_t a = 0; a < std::min(kJoined, order.size()); ++a)
      for (std::size_t b = 0; b < singles.size(); ++b)
        if (order[a] != b &&
            std::ranges::none_of(pairs, [&](const Pair& p) { return p.first == b && p.second == order[a]; }))
          pairs.push_back({order[a], b, {}});
    io::parallel_for(pairs.size(), options_.threads, [&](std::size_t i) {
      const Hypothesis both(uncertain_, {effects_[pairs[i].first], effects_[pairs[i].second]});
      pairs[i].fit = fit_each_way(tests_, both, robot_, &singles[pairs[i].first], law_error_of(both.effects()));
    });
    std::ranges::stable_sort(pairs, std::greater{},
                             [&](const Pair& p) { return p.fit.explained + std::log(further(p)); });
    pairs.resize(std::min(pairs.size(), kKept));
    return pairs;
  }
  static ScoredHypothesis scored(HypothesisKind kind, double explained, double prior) {
    ScoredHypothesis s;
    s.kind = kind;
    s.log_prior = std::log(prior);
    s.log_evidence = explained + s.log_prior;
    return s;
  }
  ScoredHypothesis with(const std::vector<std::string>& effects, const EffectFit& fit, double prior) const {
    ScoredHypothesis s = scored(HypothesisKind::effect, fit.explained, prior);
    s.effects = effects;
    s.fit.at = fit.at;
    s.fit.directions = {MatrixXd::Identity(fit.at.size(), fit.at.size()), VectorXd::Ones(fit.at.size())};
    s.fit.posterior.mean = VectorXd::Zero(fit.at.size());
    s.fit.posterior.covariance = fit.covariance;
    s.fit.residual = residuals(flights_, {Hypothesis(uncertain_, effects).vehicle(fit.at)}, options_.threads).front();
    s.held_out = tests_of(flights_, s.fit.residual);
    return s;
  }
  /// The evidence counts as it is.
  static void set_probabilities(std::vector<ScoredHypothesis>& list) {
    std::vector<double> each;
    for (const ScoredHypothesis& s : list) each.push_back(s.log_evidence);
    const double all = log_sum(each);
    for (ScoredHypothesis& s : list) s.probability = std::exp(s.log_evidence - all);
    std::ranges::stable_sort(list, std::greater{}, &ScoredHypothesis::probability);
  }

  const Flights& flights_;
  const sim::Randomisation& uncertain_;
  const InferenceOptions& options_;
  const VectorXd& robot_;
  const TestSession& tests_;
  std::vector<std::string> effects_, untestable_;
};

/// Unchanged, if that is more probable than not. Else the few most probable sets of effects that are so together: the
/// best of them, if all share an effect, else a group; or something unknown.
void conclude_by_sessions(Inference& d) {
  const std::vector<ScoredHypothesis>& all = d.hypotheses;
  const auto find = [&](HypothesisKind kind) {
    return static_cast<std::size_t>(std::ranges::find(all, kind, &ScoredHypothesis::kind) - all.begin());
  };
  const std::size_t unchanged = find(HypothesisKind::parameters), unknown = find(HypothesisKind::unknown);
  d.verdict = {};
  std::vector<std::size_t> sets;
  double together = 0;
  for (std::size_t i = 0; i < all.size() && sets.size() < kMaxSets && together < kMoreThanNot; ++i)
    if (all[i].kind == HypothesisKind::effect && all[i].probability > all[unknown].probability / 2)
      sets.push_back(i), together += all[i].probability;
  if (all[unchanged].probability >= kMoreThanNot) {
    d.concluded = unchanged;
    d.verdict.kind = VerdictKind::parameters;
    d.verdict.probability = all[unchanged].probability;
  } else if (together >= kMoreThanNot) {
    d.concluded = sets.front();
    const std::vector<std::string>& best = all[sets.front()].effects;
    const bool shared = std::ranges::any_of(best, [&](const std::string& e) {
      return std::ranges::all_of(sets, [&](std::size_t i) { return std::ranges::count(all[i].effects, e) > 0; });
    });
    d.verdict.kind = shared ? VerdictKind::effect : VerdictKind::group;
    d.verdict.probability = together;
    d.verdict.effects = best;
    for (const std::size_t i : sets)
      for (const std::string& e : all[i].effects)
        if (!shared && !std::ranges::count(d.verdict.effects, e)) d.verdict.effects.push_back(e);
  } else {
    d.concluded = unknown;
    d.verdict.kind = VerdictKind::unknown;
    d.verdict.probability = 1 - all[unchanged].probability;
  }
}

}  // namespace

std::optional<Inference> SessionContrast::by_sessions(const Flights& flights, const sim::Randomisation& uncertain,
                                                      const InferenceOptions& options,
                                                      const ReferenceFit& reference) const {
  const Hypothesis no_effects(uncertain, {});
  const VectorXd& at = reference.fit.parameters().at;
  const VehicleHypothesis robot = no_effects.vehicle(at);
  const Sessions sessions(flights, robot, options.threads);
  const SessionScatter scatter = scatter_of(flights, sessions, options.sessions);
  const SessionDensity density = density_of(sessions, scatter, options.sessions);
  const TestSession tests(flights.tests, sessions.tests, density, options.sessions, robot);
  const Weighing weighing(flights, uncertain, options, at, tests);

  Inference d;
  d.untestable = weighing.untestable();
  d.hypotheses = weighing.all(sessions.quantities(), [&](double share, const std::string& what) {
    d.complete = d.complete && (!options.progress || options.progress(share, what));
    return d.complete;
  });
  d.seen = all_seen(tests, scatter, robot);
  d.odd = all_odd(flights, sessions, scatter, options.sessions, robot, options.threads);
  d.parameters = reference.fit.parameters();
  d.parameters.residual = residuals(flights, {robot}, options.threads).front();
  d.refit = tests_of(flights, d.parameters.residual);
  d.nominal = tests_of(flights, residuals(flights, {no_effects.vehicle(no_effects.start())}, options.threads).front());
  d.minors = uncertain.minors();
  for (int g = 0; g < kGroups; ++g) d.noise_sd.push_back(reference.fit.evidence().noise_sd(g));
  if (changed_plainly(d.seen)) exclude_unchanged(d.hypotheses);
  conclude_by_sessions(d);
  choose_predicting(d);
  const ScoredHypothesis& answer = d.predicting();
  const bool effects = answer.kind == HypothesisKind::effect;
  const Hypothesis h(uncertain, effects ? answer.effects : std::vector<std::string>{});
  d.corrected = with_effects(uncertain, reference.corrected, h, effects ? answer.fit.mean() : h.start());
  return d;
}

}  // namespace flappy::gap
