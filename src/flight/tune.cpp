#include "flight/tune.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <pagmo/algorithm.hpp>
#include <pagmo/algorithms/cmaes.hpp>
#include <pagmo/population.hpp>
#include <pagmo/problem.hpp>
#include <stdexcept>

namespace flappy::flight {
namespace {

constexpr double kStray_m = 0.3;
constexpr int kLook = 5;  // control periods between looks
constexpr double kReach = 3;          // gains stay within e^+-3 of where they start
constexpr double kFirstStep = 0.05;  // of the whole range 2 kReach: 0.3

struct Score {
  double farthest_m = 0, strayed_at = -1;
  double sum = 0, yaw = 0;
  int settled = 0;
};

double square(double x) { return x * x; }

void look(Score& s, const Motion& m, const Target& t, double done, bool settled) {
  if (s.strayed_at >= 0) return;
  double e[3], distance2 = 0;
  for (int i = 0; i < 3; ++i) distance2 += square(e[i] = m.position_m[i] - t.position_m[i]);
  const double distance = std::sqrt(distance2);
  if (!(distance <= kStray_m)) {
    s.strayed_at = done;
    return;
  }
  s.farthest_m = std::max(s.farthest_m, distance);
  if (!settled) return;
  const double w = m.attitude[0], x = m.attitude[1], y = m.attitude[2], z = m.attitude[3];
  const double c = 1 - 2 * (y * y + z * z), d = 2 * (w * z + x * y);
  const double yaw = std::atan2(t.heading_cos * d - t.heading_sin * c, t.heading_cos * c + t.heading_sin * d);
  const double roll = std::atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y));
  const double pitch = std::asin(std::clamp(2 * (w * y - z * x), -1.0, 1.0));
  constexpr double kDegree = std::numbers::pi / 180;
  s.yaw += square(yaw / (10 * kDegree));
  s.sum += square(roll / (5 * kDegree)) + square(pitch / (5 * kDegree)) + distance2 / square(0.05);
  ++s.settled;
}

double cost_of(const Score& s) {
  if (s.strayed_at >= 0) return 4 - s.strayed_at;
  const double n = std::max(1, s.settled);
  return square(s.farthest_m / kStray_m) + s.sum / n + std::min(1.0, s.yaw / n);
}

struct Problem {
  const FleetOptions* options = nullptr;
  const TuneOptions* tune = nullptr;
  std::vector<double> start;

  Controller controller(const std::vector<double>& x) const {
    Controller c = options->controller;
    std::size_t i = 0;
    for (const std::string& path : tune->vary)
      for (const ControllerField& f : fields(c))
        if (f.path == path) *f.value = std::clamp(start[i] * std::exp(x[i]), f.range.low, f.range.high), ++i;
    return c;
  }
  std::vector<double> fitness(const std::vector<double>& x) const {
    return {trial_cost(*options, controller(x), *tune)};
  }
  std::pair<std::vector<double>, std::vector<double>> get_bounds() const {
    return {std::vector<double>(start.size(), -kReach), std::vector<double>(start.size(), kReach)};
  }
};

}  // namespace

double trial_cost(const FleetOptions& options, const Controller& controller, const TuneOptions& tune) {
  double cost = 0, weight = 0;
  FleetOptions o = options;
  o.controller = controller;
  for (const Trial& trial : tune.trials) {
    Fleet<float> fleet(trial.count, trial.vehicles.nominal(), o);
    for (std::size_t i = 0; i < trial.count; ++i)
      fleet.set_vehicle(i, trial.vehicles.sample({.seed = o.seed, .flapper = static_cast<std::uint32_t>(i)}));
    std::vector<Score> scores(trial.count);
    const int ticks = static_cast<int>(std::lround(tune.duration_s / fleet.period_s()));
    for (int k = 1; k <= ticks; ++k) {
      fleet.step();
      if (k % kLook != 0) continue;
      for (std::size_t i = 0; i < trial.count; ++i)
        look(scores[i], fleet.truth(i), fleet.target(i), static_cast<double>(k) / ticks, k * fleet.period_s() >= tune.settled_from_s);
    }
    double sum = 0;
    for (const Score& s : scores) sum += cost_of(s);
    cost += trial.weight * sum / static_cast<double>(trial.count);
    weight += trial.weight;
  }
  return cost / weight;
}

TuneReport tune(const FleetOptions& options, const TuneOptions& tune,
                const std::function<void(unsigned, double, const Controller&)>& progress) {
  Problem problem{&options, &tune, {}};
  Controller c = options.controller;
  for (const std::string& path : tune.vary) {
    for (const ControllerField& f : fields(c))
      if (f.path == path && *f.value > 0) problem.start.push_back(*f.value);
  }
  if (problem.start.size() != tune.vary.size()) throw std::invalid_argument("a gain to vary is unknown or not above 0");

  pagmo::population population(pagmo::problem(problem), tune.population - 1, tune.seed);
  population.push_back(std::vector<double>(problem.start.size(), 0));
  pagmo::cmaes strategy(1, -1, -1, -1, -1, kFirstStep, 0, 0, true, true, tune.seed);
  // the first generation springs from the start, not from a random individual
  for (std::size_t i = 0; i + 1 < population.size(); ++i) {
    std::vector<double> x = population.get_x()[i];
    for (double& v : x) v *= 0.1;
    population.set_x(i, x);
  }
  pagmo::algorithm algorithm(strategy);
  for (unsigned g = 1; g <= tune.generations; ++g) {
    population = algorithm.evolve(population);
    progress(g, population.champion_f()[0], problem.controller(population.champion_x()));
  }
  TuneReport report;
  report.best = problem.controller(population.champion_x());
  report.cost = population.champion_f()[0];
  for (const std::string& path : tune.vary)
    for (const ControllerField& f : fields(report.best))
      if (f.path == path) report.values.push_back(*f.value);
  return report;
}

}  // namespace flappy::flight
