#include "gap/question/session_contrast.hpp"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <numeric>
#include <set>

#include "io/parallel.hpp"
#include "model/effects/registry.hpp"

namespace flappy::gap {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr const char* kActuatorLoss = "actuator_loss";
constexpr double kStep = 0.02;  ///< of differences, in coordinates
constexpr int kIterations = 12;

double log_normal_integral(double x) {  // log Phi(x)
  return x > -5 ? std::log(0.5 * std::erfc(-x / std::numbers::sqrt2))
                : -0.5 * x * x - std::log(-x * std::sqrt(2 * std::numbers::pi)) - 1 / (x * x);
}

/// Test flights as one session.
class TestSession {
 public:
  TestSession(const FlightList& tests, const std::vector<FlightQuantities>& quantities, const SessionDensity& density,
              const SessionPrior& prior)
      : tests_(tests), quantities_(quantities), shares_(flight_shares(quantities, prior)), density_(density) {
    noise_variance_ = VectorXd::Zero(density.difference().size());
    const std::vector<SessionQuantity>& all = quantities.front().quantities();
    for (std::size_t q = 0; q < all.size(); ++q)
      if (all[q].block == "noise") noise_variance_[static_cast<Index>(q)] = std::pow(prior.of(all[q]).unknown, 2);
  }
  /// [quantity] Variance of the inputs' noise where something shakes.
  const VectorXd& noise_variance() const { return noise_variance_; }
  const SessionDensity& density() const { return density_; }
  void take_unchanged(const VehicleHypothesis& robot) {
    for (const auto& t : tests_) unchanged_.push_back(std::move(t->predict({&robot}).front()));
  }
  /// [vehicle] What a vehicle shifts.
  std::vector<VectorXd> shifts(const std::vector<VehicleHypothesis>& vehicles) const {
    std::vector<const VehicleHypothesis*> pointers;
    for (const VehicleHypothesis& v : vehicles) pointers.push_back(&v);
    std::vector<VectorXd> all(vehicles.size(), VectorXd::Zero(shares_.cols()));
    for (std::size_t f = 0; f < tests_.size(); ++f) {
      std::vector<Rows> rows = tests_[f]->predict(pointers);
      for (std::size_t v = 0; v < rows.size(); ++v) {
        for (std::size_t i = 0; i < rows[v].size(); ++i) rows[v][i] -= unchanged_[f][i];
        all[v] += shares_.row(static_cast<Index>(f)).transpose().cwiseProduct(quantities_[f].change(rows[v]));
      }
    }
    return all;
  }

 private:
  const FlightList& tests_;
  const std::vector<FlightQuantities>& quantities_;
  MatrixXd shares_;
  const SessionDensity& density_;
  VectorXd noise_variance_;
  std::vector<Rows> unchanged_;
};

struct EffectFit {
  VectorXd at;          ///< all coordinates of the hypothesis
  MatrixXd covariance;  ///< of all coordinates
  double explained = -std::numeric_limits<double>::infinity();
  VectorXd shift;
  std::vector<Index> free;
};

bool one_sided(const Unknown& u) { return u.magnitude && u.low >= u.centre; }

/// Most probable coordinates among `free`, and the evidence.
EffectFit fit_effects(const TestSession& tests, const Hypothesis& h, VectorXd at, const std::vector<Index>& free,
                      const VectorXd& more) {
  const SessionDensity& density = tests.density();
  const auto n = static_cast<Index>(free.size());
  const auto coordinates = [&](const VectorXd& z) {
    VectorXd full = at;
    for (Index i = 0; i < n; ++i) full[free[static_cast<std::size_t>(i)]] = z[i];
    return h.bounded(full);
  };
  const auto part = [&](const VectorXd& full) {
    VectorXd z(n);
    for (Index i = 0; i < n; ++i) z[i] = full[free[static_cast<std::size_t>(i)]];
    return z;
  };
  VectorXd z = part(at);
  VectorXd shift = tests.shifts({h.vehicle(coordinates(z))}).front();
  const auto value = [&](const VectorXd& s, const VectorXd& c) {
    return density.log_density(s, more) - 0.5 * c.squaredNorm();
  };
  double now = value(shift, z);
  MatrixXd j(shift.size(), n), hessian;
  VectorXd gradient;
  const auto linearise = [&] {
    std::vector<VehicleHypothesis> vehicles;
    std::vector<double> steps;
    for (Index i = 0; i < n; ++i) {
      VectorXd there = z;
      there[i] += kStep;
      if (part(coordinates(there))[i] <= z[i]) there[i] = z[i] - kStep;
      steps.push_back(there[i] - z[i]);
      vehicles.push_back(h.vehicle(coordinates(there)));
    }
    const std::vector<VectorXd> moved = tests.shifts(vehicles);
    for (Index i = 0; i < n; ++i)
      j.col(i) = (moved[static_cast<std::size_t>(i)] - shift) / steps[static_cast<std::size_t>(i)];
    const VectorXd precision = density.precision(shift, more);
    hessian = j.transpose() * precision.asDiagonal() * j + MatrixXd::Identity(n, n);
    gradient = j.transpose() * precision.cwiseProduct(density.difference() - shift) - z;
  };
  const auto at_bound = [&](Index i) {
    const Unknown& u = h.unknowns()[static_cast<std::size_t>(free[static_cast<std::size_t>(i)])];
    const double value_here = u.value(z[i]);
    return (value_here <= u.low && gradient[i] < 0) || (value_here >= u.high && gradient[i] > 0);
  };
  std::vector<Index> open;
  const auto find_open = [&] {
    open.clear();
    for (Index i = 0; i < n; ++i)
      if (!at_bound(i)) open.push_back(i);
  };
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    linearise();
    find_open();
    if (open.empty()) break;
    const VectorXd step = MatrixXd(hessian(open, open)).ldlt().solve(VectorXd(gradient(open)));
    double gained = 0;
    for (double share = 1; share > 0.05; share /= 2) {
      VectorXd there = z;
      for (std::size_t i = 0; i < open.size(); ++i) there[open[i]] += share * step[static_cast<Index>(i)];
      there = part(coordinates(there));
      const VectorXd moved = tests.shifts({h.vehicle(coordinates(there))}).front();
      const double next = value(moved, there);
      if (!(next > now)) continue;
      gained = next - now;
      z = there, shift = moved, now = next;
      break;
    }
    if (gained < 1e-3) break;
  }
  linearise();
  find_open();
  EffectFit fit{coordinates(z), MatrixXd::Zero(h.size(), h.size()), now, shift, free};
  MatrixXd inverse;
  if (!open.empty()) inverse = MatrixXd(hessian(open, open)).inverse();
  if (!open.empty()) fit.explained -= 0.5 * std::log(MatrixXd(hessian(open, open)).determinant());
  for (std::size_t a = 0; a < open.size(); ++a) {
    const auto ia = static_cast<Index>(a);
    for (std::size_t b = 0; b < open.size(); ++b)
      fit.covariance(free[static_cast<std::size_t>(open[a])], free[static_cast<std::size_t>(open[b])]) =
          inverse(ia, static_cast<Index>(b));
    const Unknown& u = h.unknowns()[static_cast<std::size_t>(free[static_cast<std::size_t>(open[a])])];
    if (one_sided(u))
      fit.explained +=
          std::log(2.0) + log_normal_integral((z[open[a]] - u.coordinate(u.low)) / std::sqrt(inverse(ia, ia)));
  }
  for (Index i = 0; i < n; ++i) {
    if (std::ranges::count(open, i)) continue;
    const Unknown& u = h.unknowns()[static_cast<std::size_t>(free[static_cast<std::size_t>(i)])];
    const double precision = hessian(i, i), slope = -std::abs(gradient[i]) / std::sqrt(precision);
    fit.explained += (one_sided(u) ? std::log(2.0) : 0) - 0.5 * std::log(precision) + 0.5 * slope * slope +
                     log_normal_integral(slope);
    fit.covariance(free[static_cast<std::size_t>(i)], free[static_cast<std::size_t>(i)]) = 1 / precision;
  }
  return fit;
}

double log_sum(const std::vector<double>& values) {
  const double most = *std::ranges::max_element(values);
  double sum = 0;
  for (const double v : values) sum += std::exp(v - most);
  return most + std::log(sum);
}

/// Coordinates that are free together, and points to start from.
struct Way {
  std::vector<Index> free;
  std::vector<VectorXd> starts;
};

/// Ways in which the last effect of a hypothesis may act besides `before`, the coordinates of the others: by all of its
/// unknowns, from several values of its first shape parameter on; a loss of actuators also by each actuator alone.
std::vector<Way> ways_of(const Hypothesis& h, const VectorXd& base, const std::vector<Index>& before) {
  constexpr double kStart = 0.3;  // of magnitudes, which have no slope to their shapes at 0
  constexpr double kShapeStarts[] = {-1, 0, 1, 2, 3};
  const std::string& last = h.effects().back();
  std::vector<Index> magnitudes, shapes;
  for (Index i = h.first_of(last); i < h.size(); ++i)
    (h.unknowns()[static_cast<std::size_t>(i)].magnitude ? magnitudes : shapes).push_back(i);
  Way all{before, {}};
  all.free.insert(all.free.end(), magnitudes.begin(), magnitudes.end());
  all.free.insert(all.free.end(), shapes.begin(), shapes.end());
  for (const double shape : kShapeStarts) {
    if (shapes.empty() && shape != 0) continue;
    VectorXd start = base;
    if (!magnitudes.empty()) start[magnitudes.front()] = kStart;
    if (!shapes.empty()) start[shapes.front()] = shape;
    all.starts.push_back(h.bounded(start));
  }
  std::vector<Way> ways = {all};
  if (last != kActuatorLoss) return ways;
  for (const Index m : magnitudes) {
    Way one{before, {base}};
    one.free.push_back(m);
    one.starts[0][m] = kStart;
    ways.push_back(std::move(one));
  }
  return ways;
}

/// The evidence of all ways, which are equally probable, and the most probable one. `first`: fit of the effects before
/// the last; null: none. An actuator that lost some of its loads may shake, or not.
EffectFit fit_each_way(const TestSession& tests, const Hypothesis& h, const VectorXd& robot, const EffectFit* first) {
  VectorXd base = h.start();
  base.head(h.shared()) = robot.head(h.shared());
  if (first != nullptr) base.head(first->at.size()) = first->at;
  EffectFit best;
  std::vector<double> evidence;
  double most = -std::numeric_limits<double>::infinity();
  const VectorXd none = VectorXd::Zero(tests.density().difference().size());
  std::vector<VectorXd> shaking = {none};
  if (std::ranges::count(h.effects(), std::string(kActuatorLoss)) > 0) shaking.push_back(tests.noise_variance());
  for (const Way& way : ways_of(h, base, first != nullptr ? first->free : std::vector<Index>{}))
    for (const VectorXd& more : shaking) {
      EffectFit of_way;
      for (const VectorXd& start : way.starts) {
        EffectFit f = fit_effects(tests, h, start, way.free, more);
        if (f.explained > of_way.explained) of_way = std::move(f);
      }
      evidence.push_back(of_way.explained);
      if (of_way.explained > most) most = of_way.explained, best = of_way;
    }
  best.explained = log_sum(evidence) - std::log(static_cast<double>(evidence.size()));
  return best;
}

/// Whether an effect of the size that its prior allows changes what the flights show.
bool shows(const TestSession& tests, const Hypothesis& h, const VectorXd& robot) {
  constexpr double kLeast = 0.1;  // of the standard deviation between sessions
  std::vector<VehicleHypothesis> vehicles;
  for (Index i = h.shared(); i < h.size(); ++i)
    for (const double z : {1.0, -1.0}) {
      if (!h.unknowns()[static_cast<std::size_t>(i)].magnitude) continue;
      VectorXd there = h.start();
      there.head(h.shared()) = robot.head(h.shared());
      there[i] = z;
      vehicles.push_back(h.vehicle(h.bounded(there)));
    }
  for (const VectorXd& shift : tests.shifts(vehicles))
    if ((shift.array() / tests.density().variance().array().sqrt()).abs().maxCoeff() > kLeast) return true;
  return false;
}

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

}  // namespace

std::optional<Inference> SessionContrast::by_sessions(const Flights& flights, const sim::Randomisation& uncertain,
                                                      const InferenceOptions& options,
                                                      const ReferenceFit& reference) const {
  const Hypothesis no_effects(uncertain, {});
  const VectorXd& at = reference.fit.parameters().at;
  const VehicleHypothesis robot = no_effects.vehicle(at);
  const CommonTrend trend = common_trend(flights.references, robot);
  std::vector<std::optional<FlightQuantities>> made(flights.size());
  io::parallel_for(flights.size(), options.threads, [&](std::size_t f) { made[f].emplace(*flights[f], robot, trend); });
  std::vector<FlightQuantities> of_references, of_tests;
  for (std::size_t f = 0; f < made.size(); ++f)
    (flights.is_reference(f) ? of_references : of_tests).push_back(std::move(*made[f]));
  std::vector<int> sessions(of_references.size());
  std::iota(sessions.begin(), sessions.end(), 0);
  const std::vector<SessionQuantity>& quantities = of_references.front().quantities();
  const SessionScatter scatter(quantities, session_values(of_references, sessions, options.sessions), options.sessions);
  const SessionValues tests_values = session_values(of_tests, std::vector<int>(of_tests.size(), 0), options.sessions);
  const SessionDensity density(scatter, tests_values.values.row(0).transpose(),
                               tests_values.variances.row(0).transpose(), options.sessions);
  if (std::getenv("SEEN") != nullptr)
    for (Index q = 0; q < density.difference().size(); ++q) {
      std::printf("%-36s %10.5f sd %9.5f noise %9.5f times %6.2f |",
                  quantities[static_cast<std::size_t>(q)].name.c_str(), density.difference()[q],
                  std::sqrt(scatter.variance()[q]), std::sqrt(tests_values.variances(0, q)), density.times(q));
      for (const auto& f : of_references) std::printf(" %.5f", f.values()[q]);
      std::printf(" /");
      for (const auto& f : of_tests) std::printf(" %.5f(%.5f)", f.values()[q], std::sqrt(f.variances()[q]));
      std::printf("\n");
    }
  TestSession tests(flights.tests, of_tests, density, options.sessions);
  tests.take_unchanged(robot);

  Inference d;
  const VectorXd zero = VectorXd::Zero(density.difference().size());
  std::vector<std::string> ids;
  for (const model::CatalogueEffect& e : model::catalogue_of(uncertain.nominal())) {
    if (std::ranges::count(options.withheld, e.info.id)) continue;
    (shows(tests, Hypothesis(uncertain, {e.info.id}), at) ? ids : d.untestable).emplace_back(e.info.id);
  }
  std::vector<EffectFit> singles(ids.size());
  io::parallel_for(ids.size(), options.threads, [&](std::size_t i) {
    singles[i] = fit_each_way(tests, Hypothesis(uncertain, {ids[i]}), at, nullptr);
  });
  const auto scored = [&](HypothesisKind kind, double explained, double prior) {
    ScoredHypothesis s;
    s.kind = kind;
    s.log_prior = std::log(prior);
    s.log_evidence = explained + s.log_prior;
    return s;
  };
  d.hypotheses.push_back(
      scored(HypothesisKind::parameters, density.log_density(zero, zero), options.sessions.unchanged));
  d.hypotheses.push_back(scored(HypothesisKind::unknown, log_density_of_unknown(density, quantities, options.sessions),
                                options.sessions.unknown));
  const auto add = [&](const std::vector<std::string>& effects, const EffectFit& fit, double prior) {
    ScoredHypothesis s = scored(HypothesisKind::effect, fit.explained, prior);
    s.effects = effects;
    s.fit.at = fit.at;
    s.fit.directions = {MatrixXd::Identity(fit.at.size(), fit.at.size()), VectorXd::Ones(fit.at.size())};
    s.fit.posterior.mean = VectorXd::Zero(fit.at.size());
    s.fit.posterior.covariance = fit.covariance;
    s.fit.residual = residuals(flights, {Hypothesis(uncertain, effects).vehicle(fit.at)}, options.threads).front();
    s.held_out = tests_of(flights, s.fit.residual);
    d.hypotheses.push_back(std::move(s));
  };
  const double each = options.sessions.effect / static_cast<double>(ids.size());
  for (std::size_t i = 0; i < ids.size(); ++i) add({ids[i]}, singles[i], each);
  // pairs
  std::vector<std::size_t> order(ids.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, std::greater{}, [&](std::size_t i) { return singles[i].explained; });
  struct Pair {
    std::size_t first, second;
    EffectFit fit;
  };
  std::vector<Pair> pairs;
  for (std::size_t a = 0; a < std::min<std::size_t>(3, order.size()); ++a)
    for (std::size_t b = 0; b < ids.size(); ++b)
      if (order[a] != b &&
          std::ranges::none_of(pairs, [&](const Pair& p) { return p.first == b && p.second == order[a]; }))
        pairs.push_back({order[a], b, {}});
  io::parallel_for(pairs.size(), options.threads, [&](std::size_t i) {
    const std::vector<std::string> both = {ids[pairs[i].first], ids[pairs[i].second]};
    pairs[i].fit = fit_each_way(tests, Hypothesis(uncertain, both), at, &singles[pairs[i].first]);
  });
  std::ranges::sort(pairs, std::greater{}, [&](const Pair& p) {
    return p.fit.explained + std::log(options.sessions.further(ids[p.first], ids[p.second], ids.size() - 1));
  });
  for (std::size_t i = 0; i < std::min<std::size_t>(6, pairs.size()); ++i)
    add({ids[pairs[i].first], ids[pairs[i].second]}, pairs[i].fit,
        each * options.sessions.further(ids[pairs[i].first], ids[pairs[i].second], ids.size() - 1));

  d.parameters = reference.fit.parameters();
  d.parameters.residual = residuals(flights, {robot}, options.threads).front();
  d.refit = tests_of(flights, d.parameters.residual);
  d.nominal = tests_of(flights, residuals(flights, {no_effects.vehicle(no_effects.start())}, options.threads).front());
  d.minors = uncertain.minors();
  for (int g = 0; g < kGroups; ++g) d.noise_sd.push_back(reference.fit.evidence().noise_sd(g));
  double most = -1e300, sum = 0;
  for (const ScoredHypothesis& s : d.hypotheses) most = std::max(most, s.log_evidence);
  for (ScoredHypothesis& s : d.hypotheses) sum += s.probability = std::exp(s.log_evidence - most);
  for (ScoredHypothesis& s : d.hypotheses) s.probability /= sum;
  std::ranges::stable_sort(d.hypotheses, std::greater{}, &ScoredHypothesis::probability);
  if (std::getenv("SEEN") != nullptr)
    for (const ScoredHypothesis& s : d.hypotheses) {
      std::printf("%.3f %8.2f", s.probability, s.log_evidence - s.log_prior);
      for (const std::string& e : s.effects) std::printf(" %s", e.c_str());
      if (s.effects.empty()) std::printf(" (%s)", name_of(s.kind));
      else {
        const Hypothesis h(uncertain, s.effects);
        for (Index i = h.shared(); i < h.size(); ++i) {
          const Unknown& u = h.unknowns()[static_cast<std::size_t>(i)];
          std::printf("  %s %.4g", u.name.c_str(), u.value(s.fit.at[i]));
        }
      }
      std::printf("\n");
      if (s.fit.flown()) {
        const VectorXd shift = tests.shifts({Hypothesis(uncertain, s.effects).vehicle(s.fit.at)}).front();
        const VectorXd v = density.variance();
        for (Index q = 0; q < v.size(); ++q)
          std::printf(" %s %.1f", quantities[static_cast<std::size_t>(q)].name.substr(0, 14).c_str(),
                      (density.difference()[q] - shift[q]) / std::sqrt(v[q]));
        std::printf("\n");
      }
    }
  return d;
}

CorrectedParameters SessionContrast::correct_by_sessions(const sim::Randomisation& uncertain,
                                                         const ReferenceFit& reference, const Inference& d) const {
  const ScoredHypothesis& answer = d.predicting();
  const bool effects = answer.kind == HypothesisKind::effect;
  const Hypothesis h(uncertain, effects ? answer.effects : std::vector<std::string>{});
  return with_effects(uncertain, reference.corrected, h, effects ? answer.fit.mean() : h.start());
}

}  // namespace flappy::gap
