#include "gap/question/session_fit.hpp"

#include <algorithm>
#include <cmath>

#include "gap/fit/one_sided.hpp"

namespace flappy::gap {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

TestSession::TestSession(const FlightList& tests, const std::vector<FlightQuantities>& quantities,
                         const SessionDensity& density, const SessionPrior& prior, const VehicleHypothesis& robot)
    : tests_(tests),
      quantities_(quantities),
      shares_(flight_shares(quantities, prior)),
      density_(density),
      noise_variance_(VectorXd::Zero(density.difference().size())) {
  const std::vector<SessionQuantity>& all = quantities.front().quantities();
  for (std::size_t q = 0; q < all.size(); ++q)
    if (all[q].block == "noise") noise_variance_[static_cast<Index>(q)] = std::pow(prior.of(all[q]).unknown, 2);
  for (const auto& t : tests_) unchanged_.push_back(std::move(t->predict({&robot}).front()));
}

std::vector<VectorXd> TestSession::shifts(const std::vector<VehicleHypothesis>& vehicles) const {
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

namespace {

/// Step of differences, in coordinates. Choice.
constexpr double kStep = 0.02;
/// Largest number of Gauss-Newton steps. Choice.
constexpr int kMaxNewtonSteps = 12;
/// A step that gains less ends the search. Choice.
constexpr double kMinStepGain_nats = 1e-3;

/// The most probable coordinates among `free`, and the evidence.
EffectFit fit_effects(const TestSession& tests, const Hypothesis& h, VectorXd at, const std::vector<Index>& free,
                      const VectorXd& more, double law_error) {
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
  const auto with_law = [&](const VectorXd& s) -> VectorXd { return more + (law_error * s).cwiseAbs2(); };
  const auto value = [&](const VectorXd& s, const VectorXd& c) {
    return density.log_density(s, with_law(s)) - 0.5 * c.squaredNorm();
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
    const VectorXd precision = density.precision(shift, with_law(shift));
    hessian = j.transpose() * precision.asDiagonal() * j + MatrixXd::Identity(n, n);
    gradient = j.transpose() * precision.cwiseProduct(density.difference() - shift) - z;
  };
  const auto unknown_of = [&](Index i) -> const Unknown& {
    return h.unknowns()[static_cast<std::size_t>(free[static_cast<std::size_t>(i)])];
  };
  const auto at_bound = [&](Index i) {
    const Unknown& u = unknown_of(i);
    const double value_here = u.value(z[i]);
    return (value_here <= u.low && gradient[i] < 0) || (value_here >= u.high && gradient[i] > 0);
  };
  std::vector<Index> open;
  const auto find_open = [&] {
    open.clear();
    for (Index i = 0; i < n; ++i)
      if (!at_bound(i)) open.push_back(i);
  };
  for (int iteration = 0; iteration < kMaxNewtonSteps; ++iteration) {
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
    if (gained < kMinStepGain_nats) break;
  }
  linearise();
  find_open();
  EffectFit fit{coordinates(z), MatrixXd::Zero(h.size(), h.size()), now, free};
  MatrixXd inverse;
  if (!open.empty()) {
    const MatrixXd own = hessian(open, open);
    inverse = own.inverse();
    fit.explained -= 0.5 * std::log(own.determinant());
  }
  for (std::size_t a = 0; a < open.size(); ++a) {
    const auto ia = static_cast<Index>(a);
    for (std::size_t b = 0; b < open.size(); ++b)
      fit.covariance(free[static_cast<std::size_t>(open[a])], free[static_cast<std::size_t>(open[b])]) =
          inverse(ia, static_cast<Index>(b));
    const Unknown& u = unknown_of(open[a]);
    if (u.one_sided())
      fit.explained += log_twice_positive(z[open[a]] - u.coordinate(u.low), std::sqrt(inverse(ia, ia)));
  }
  for (Index i = 0; i < n; ++i) {
    if (std::ranges::count(open, i)) continue;
    const double precision = hessian(i, i), slope = -std::abs(gradient[i]) / std::sqrt(precision);
    fit.explained += log_twice_positive(slope, 1) - (unknown_of(i).one_sided() ? 0 : std::log(2.0)) -
                     0.5 * std::log(precision) + 0.5 * slope * slope;
    fit.covariance(free[static_cast<std::size_t>(i)], free[static_cast<std::size_t>(i)]) = 1 / precision;
  }
  return fit;
}

/// Where magnitudes start, in coordinates. Choice: at 0 they have no slope to their shapes.
constexpr double kStart = 0.3;
/// Where the first shape parameter starts, in coordinates. Choice.
constexpr double kShapeStarts[] = {-1, 0, 1, 2, 3};
/// Smallest change that shows, in standard deviations between sessions. Choice.
constexpr double kMinShown = 0.1;

/// Coordinates that are free together, and points to start from.
struct Way {
  std::vector<Index> free;
  std::vector<VectorXd> starts;
};

/// Ways in which the last effect of a hypothesis may act besides `before`, the coordinates of the others: by all of its
/// unknowns, from several values of its first shape parameter on; a loss of actuators also by each actuator alone.
std::vector<Way> ways_of(const Hypothesis& h, const VectorXd& base, const std::vector<Index>& before) {
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

}  // namespace

double log_sum(const std::vector<double>& values) {
  const double most = *std::ranges::max_element(values);
  double sum = 0;
  for (const double v : values) sum += std::exp(v - most);
  return most + std::log(sum);
}

EffectFit fit_each_way(const TestSession& tests, const Hypothesis& h, const VectorXd& robot, const EffectFit* first,
                       double law_error) {
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
        EffectFit f = fit_effects(tests, h, start, way.free, more, law_error);
        if (f.explained > of_way.explained) of_way = std::move(f);
      }
      evidence.push_back(of_way.explained);
      if (of_way.explained > most) most = of_way.explained, best = of_way;
    }
  best.explained = log_sum(evidence) - std::log(static_cast<double>(evidence.size()));
  return best;
}

bool shows(const TestSession& tests, const Hypothesis& h, const VectorXd& robot) {
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
    if ((shift.array() / tests.density().variance().array().sqrt()).abs().maxCoeff() > kMinShown) return true;
  return false;
}

}  // namespace flappy::gap
