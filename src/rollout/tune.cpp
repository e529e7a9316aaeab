#include "rollout/tune.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <pagmo/algorithm.hpp>
#include <pagmo/algorithms/cmaes.hpp>
#include <pagmo/population.hpp>
#include <pagmo/problem.hpp>
#include <span>

#include "io/text.hpp"
#include "io/toml_writer.hpp"
#include "rollout/flight_score.hpp"
#include "rollout/rollout.hpp"

namespace flappy::rollout {
namespace {

constexpr int kLook = 5;             // control periods between scored ticks
constexpr double kReach = 3;         // gains stay within a factor of e^+-3 of their start
constexpr double kFirstStep = 0.05;  // initial step over the whole range 2 kReach: 0.3

struct Score {
  double farthest_m = 0, strayed_at = -1;
  double sum = 0, yaw = 0;
  int settled = 0;
};

double square(double x) { return x * x; }

void look(Score& s, const flight::Motion& m, const flight::Target& t, double done, bool settled) {
  if (s.strayed_at >= 0) return;
  const auto [roll, pitch, yaw, x, y, z] = errors_of(m, t);
  const double distance = std::hypot(x, y, z);
  if (!(distance <= kFarAway_m)) {
    s.strayed_at = done;
    return;
  }
  s.farthest_m = std::max(s.farthest_m, distance);
  if (!settled) return;
  constexpr double kDegree = std::numbers::pi / 180;
  s.yaw += square(yaw / (10 * kDegree));
  s.sum += square(roll / (5 * kDegree)) + square(pitch / (5 * kDegree)) + square(distance / 0.05);
  ++s.settled;
}

double cost_of(const Score& s) {
  if (s.strayed_at >= 0) return 4 - s.strayed_at;
  const double n = std::max(1, s.settled);
  return square(s.farthest_m / kFarAway_m) + s.sum / n + std::min(1.0, s.yaw / n);
}

/// Rounds a gain to the four digits with which it is written to a file, so that the cost is that of the file.
double four_digits(double gain) { return std::stod(io::format("%.4g", gain)); }

struct Problem {
  const TuneConfig* config = nullptr;

  /// decision: logarithm of each gain over its start value.
  flight::Controller controller(const std::vector<double>& decision) const {
    flight::Controller c = config->start;
    const std::vector<flight::ControllerField> all = fields(c);
    for (std::size_t i = 0; i < decision.size(); ++i) {
      const flight::ControllerField& f = *std::ranges::find(all, config->vary[i], &flight::ControllerField::path);
      *f.value = four_digits(std::clamp(*f.value * std::exp(decision[i]), f.range.low, f.range.high));
    }
    return c;
  }
  std::vector<double> fitness(const std::vector<double>& decision) const {
    return {cost_of(*config, controller(decision))};
  }
  std::pair<std::vector<double>, std::vector<double>> get_bounds() const {
    return {std::vector<double>(config->vary.size(), -kReach), std::vector<double>(config->vary.size(), kReach)};
  }
};

void judge(const TuneConfig& config, FlyConfig fly, std::span<Score> scores) {
  Rollout<float> flights(std::move(fly), scores.size());
  const flight::Fleet<float>& fleet = flights.fleet();
  const auto ticks = static_cast<double>(flights.ticks(flights.config()));
  while (!flights.over()) {
    flights.step();
    if (flights.tick() % kLook != 0) continue;
    for (std::size_t i = 0; i < scores.size(); ++i)
      look(scores[i], fleet.truth(i), fleet.target(i), static_cast<double>(flights.tick()) / ticks,
           flights.t_s() >= config.settle_s);
  }
}

double cost_of_trial(const TuneConfig& config, const Trial& trial, const flight::Controller& controller) {
  FlyConfig fly = trial.fly;
  fly.fleet.controller = controller;
  fly.fleet.seed = config.seed;
  fly.duration_s = config.duration_s;
  const auto [first, last] = io::own_share(config.ranks, trial.count);
  fly.fleet.first_flapper += static_cast<std::uint32_t>(first);
  std::vector<Score> scores(trial.count);
  if (last > first) judge(config, std::move(fly), std::span(scores).subspan(first, last - first));
  if (config.ranks != nullptr)
    config.ranks->share(reinterpret_cast<std::byte*>(scores.data()), trial.count, sizeof scores[0]);
  double sum = 0;
  for (const Score& s : scores) sum += cost_of(s);
  return sum / static_cast<double>(trial.count);
}
}  // namespace

TuneConfig read_tune_config(const std::filesystem::path& path, const std::vector<std::string>& overrides) {
  const io::Table root = io::Config::load(path, overrides).root();
  root.schema(1);
  root.accept({"schema", "vary", "duration_s", "settle_s", "seed", "population", "generations", "trial"});
  TuneConfig c;
  c.vary = root.strings("vary");
  c.duration_s = root.number("duration_s", io::positive(1000));
  c.settle_s = root.number("settle_s", io::non_negative(1000));
  if (c.settle_s >= c.duration_s) root.fail("settle_s", "is not before the end", "less than duration_s");
  c.seed = static_cast<std::uint64_t>(root.integer("seed", 0, INT64_MAX));
  c.population = static_cast<unsigned>(root.integer("population", 5, 10000));
  c.generations = static_cast<unsigned>(root.integer("generations", 1, 100000));
  for (const io::Table& t : root.tables("trial")) {
    c.trials.push_back({read_fly_config(t.file("fly")), static_cast<std::size_t>(t.integer("count", 1, 100000)),
                        t.number("weight", io::positive(1e6))});
    const FlyConfig& fly = c.trials.back().fly;
    if (fly.welded || fly.actor || fly.excitation.acts())
      t.fail("fly", "is held on a stand, excited or flown by an actor", "flights of a controller alone");
  }
  if (c.trials.empty()) root.fail("trial", "is missing", "at least one [[trial]]");
  if (c.vary.empty()) root.fail("vary", "is empty", "paths of the controller's file");
  c.start = c.trials[0].fly.fleet.controller;
  std::vector<std::string> known;
  for (const flight::ControllerField& f : fields(c.start)) known.push_back(f.path);
  for (const std::string& gain : c.vary) {
    const auto found = std::ranges::find(known, gain);
    if (found == known.end())
      root.fail("vary", "no gain \"" + gain + "\"", "paths of the controller's file" + io::did_you_mean(gain, known));
    if (!(*fields(c.start)[static_cast<std::size_t>(found - known.begin())].value > 0))
      root.fail("vary", gain + " starts at 0", "gains above 0");
  }
  root.finish();
  return c;
}

double cost_of(const TuneConfig& config, const flight::Controller& controller) {
  double cost = 0, weight = 0;
  for (const Trial& trial : config.trials) {
    cost += trial.weight * cost_of_trial(config, trial, controller);
    weight += trial.weight;
  }
  return cost / weight;
}

TuneResult tune(const TuneConfig& config, const std::function<bool(const TuneResult&)>& progress) {
  const Problem problem{&config};
  const auto seed = static_cast<unsigned>(config.seed);
  // the first generation starts from the given controller: all others cost 1e9
  pagmo::population population(pagmo::problem(problem), 0, seed);
  for (unsigned i = 0; i < config.population; ++i)
    population.push_back(std::vector<double>(config.vary.size(), 0), {i == 0 ? cost_of(config, config.start) : 1e9});
  const pagmo::algorithm algorithm(pagmo::cmaes(1, -1, -1, -1, -1, kFirstStep, 0, 0, true, true, seed));
  TuneResult result{config.start, population.get_f()[0][0], 0};
  while (result.generations < config.generations) {
    population = algorithm.evolve(population);
    ++result.generations;
    const double cost = population.get_f()[population.best_idx()][0];
    if (cost < result.cost)
      result = {problem.controller(population.get_x()[population.best_idx()]), cost, result.generations};
    if (!progress(result)) break;
  }
  return result;
}

std::string controller_text(flight::Controller c, const std::string& origin) {
  std::string text = "# " + origin + "\nschema = 1\nkind = \"" + flight::controller_name(c.kind) + "\"\n";
  for (const flight::ControllerField& f : fields(c)) text += f.path + " = " + io::toml_number(*f.value) + "\n";
  return text;
}

}  // namespace flappy::rollout
