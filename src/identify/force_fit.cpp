#include "identify/force_fit.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numeric>

#include "identify/global_search.hpp"
#include "identify/signs.hpp"
#include "identify/units.hpp"
#include "sim/random.hpp"

namespace flappy::identify {
namespace {

using Eigen::VectorXd;

constexpr double kImpossible = 1e30;  // cost of a vehicle whose simulation leaves the plausible range

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Leaves a fit that `progress` stopped, however many stages were to come.
struct Stopped {};

bool tell(const FitOptions& options, const std::string& stage, double done, double cost) {
  if (options.progress && !options.progress(stage, std::min(done, 1.0), cost)) throw Stopped();
  return true;
}

class Fit {
 public:
  Fit(const Problem& problem, const FitOptions& options, ForceFit& result)
      : problem_(problem), options_(options), result_(result) {}

  VectorXd polish(const std::string& name, const VectorXd& start) {
    const auto began = std::chrono::steady_clock::now();
    const LeastSquares found = minimise(problem_, start, [&](const LeastSquares& s) {
      return tell(options_, name, static_cast<double>(s.iterations) / 20, s.cost);
    });
    add(name, found.evaluations, began, found.point);
    cost_ = found.cost;
    return found.point;
  }

  VectorXd optimum(const VectorXd& nominal) {
    if (options_.method == Method::gauss_newton) return from_several(nominal);
    const bool genetic = options_.method == Method::genetic;
    const std::string name = genetic ? "genetic algorithm" : "CMA-ES";
    const auto began = std::chrono::steady_clock::now();
    const auto cost = [&](const std::vector<Point>& points) {
      std::vector<VectorXd> p;
      for (const Point& x : points) p.push_back(Eigen::Map<const VectorXd>(x.data(), nominal.size()));
      std::vector<double> costs;
      for (const VectorXd& r : problem_.residuals<float>(p))
        costs.push_back(std::isfinite(r.squaredNorm()) ? r.squaredNorm() : kImpossible);
      return costs;
    };
    const SearchResult found =
        search(genetic ? Search::genetic : Search::cma_es, cost, {nominal.begin(), nominal.end()},
               {options_.population, options_.generations, options_.seed}, [&](const SearchResult& r) {
                 return tell(options_, name, static_cast<double>(r.generations) / options_.generations, r.cost);
               });
    const VectorXd point = Eigen::Map<const VectorXd>(found.point.data(), nominal.size());
    add(name, found.evaluations, began, point);
    return polish("Gauss-Newton polish", point);
  }

 private:
  void add(const std::string& name, std::size_t evaluations, std::chrono::steady_clock::time_point began,
           const VectorXd& point) {
    const double wall_s = seconds_since(began);
    result_.stages.push_back({name, evaluations, wall_s, problem_.error(point)});
  }

  VectorXd from_several(const VectorXd& nominal) {
    std::vector<double> costs;
    for (int start = 0; start < options_.starts; ++start) {
      VectorXd from = nominal;
      const sim::RandomKey key{options_.seed, static_cast<std::uint32_t>(start), 0, sim::Stream::start};
      for (Eigen::Index i = 0; start > 0 && i < from.size(); ++i)
        from[i] = sim::uniform_pair(key, static_cast<std::uint32_t>(i)).first;
      const VectorXd at =
          polish(start == 0 ? "Gauss-Newton" : "Gauss-Newton, start " + std::to_string(start + 1), from);
      costs.push_back(cost_);
      result_.ends.push_back({cost_, at});
    }
    result_.starts_agreed =
        count_agreed(costs, problem_({nominal}).front().size(), nominal.size(), result_.sd_declared);
    return std::ranges::min_element(result_.ends, {}, &End::cost)->point;
  }

  const Problem& problem_;
  const FitOptions& options_;
  ForceFit& result_;
  double cost_ = 0;
};

/// Puts unseen parameters back to `nominal`, one at a time, and refits the rest, while noise explains the higher cost.
std::vector<Eigen::Index> put_back(const Problem& problem, const FitOptions& options, ForceFit& result, VectorXd& point,
                                   const VectorXd& nominal) {
  const auto began = std::chrono::steady_clock::now();
  std::vector<Eigen::Index> free(problem.size()), back;
  std::iota(free.begin(), free.end(), Eigen::Index{0});
  std::vector<Eigen::Index> candidates = free;
  const VectorXd r = problem({point}).front();
  const double noise = std::max(1.0, variance_left(r.squaredNorm(), r.size(), point.size()));
  Stage stage{"Gauss-Newton, unseen at nominal"};
  for (;;) {
    const Eigen::Index widest = widest_unseen(problem, point, free, candidates);
    if (widest < 0) break;
    std::erase(candidates, widest);
    std::vector<Eigen::Index> rest = free;
    std::erase(rest, widest);
    VectorXd tried = point;
    tried[widest] = nominal[widest];
    const auto whole = [&](const VectorXd& some) {
      VectorXd all = tried;
      all(rest) = some;
      return all;
    };
    const Residuals residuals = [&](const std::vector<VectorXd>& points) {
      std::vector<VectorXd> all;
      for (const VectorXd& p : points) all.push_back(whole(p));
      return problem(all);
    };
    double cost = problem({tried}).front().squaredNorm();
    if (!rest.empty()) {
      double last = std::numeric_limits<double>::infinity();
      const LeastSquares found = minimise(residuals, tried(rest), [&](const LeastSquares& s) {
        const bool gains = s.cost < last - 1e-3 * noise;  // stop at gains far below the noise
        last = s.cost;
        return tell(options, stage.name, 0, s.cost) && gains;
      });
      tried = whole(found.point);
      cost = found.cost;
      stage.evaluations += found.evaluations;
    }
    if (!(cost <= r.squaredNorm() + explained_by_noise(back.size() + 1, noise))) continue;
    point = tried;
    free = rest;
    back.push_back(widest);
  }
  if (stage.evaluations > 0) {
    stage.wall_s = seconds_since(began);
    stage.error = problem.error(point);
    result.stages.push_back(stage);
  }
  return back;
}

void check_inputs(const MeasuredMap& measured, std::size_t parameters) {
  const std::size_t distinct = distinct_inputs(measured.inputs);
  if (distinct >= parameters) return;
  throw io::InputError(
      measured.name + ": has " + std::to_string(distinct) +
      (distinct < measured.size() ? " different inputs in " + std::to_string(measured.size()) + " rows" : " inputs") +
      " for " + std::to_string(parameters) + " parameters; accepted: at least as many inputs as parameters");
}

void check_simulated(const MeasuredMap& measured, const std::vector<Wrench>& simulated) {
  for (std::size_t i = 0; i < simulated.size(); ++i)
    if (!std::ranges::all_of(simulated[i], [](double x) { return std::isfinite(x); }))
      refuse_apart(measured.name + ":" + std::to_string(measured.line(i)), measured.inputs[i]);
}

ForceFit fitted_to(const model::Vehicle& nominal, const MeasuredMap& measured, const FitConfig& config,
                   const FitOptions& options);

}  // namespace

std::vector<std::string> spring_verdicts(const ForceFit& fit) {
  std::vector<std::string> lines;
  for (const std::string side : {"left", "right"}) {
    const std::string positive = side + ".spring.stiffness_positive_Nm_rad";
    const std::string negative = side + ".spring.stiffness_negative_Nm_rad";
    const auto find = [&](const std::string& path) {
      return std::ranges::find(fit.known.parameters, path, &FittedParameter::path);
    };
    const auto p = find(positive), n = find(negative);
    if (p == fit.known.parameters.end() || n == fit.known.parameters.end()) continue;
    const bool confounded = std::ranges::any_of(
        fit.known.confounded, [&](const Confounded& c) { return c.first == positive && c.second == negative; });
    lines.push_back("the map " + std::string(p->seen && n->seen && !confounded ? "tells" : "does not tell") + " the " +
                    side + " spring's two stiffnesses apart");
  }
  return lines;
}

ForceFit fit_forces(const model::Vehicle& nominal, const MeasuredMap& measured, const FitConfig& config,
                    const FitOptions& options) {
  try {
    return fitted_to(nominal, measured, config, options);
  } catch (const Stopped&) {
    ForceFit stopped;
    stopped.stopped = true;
    return stopped;
  }
}

namespace {

ForceFit fitted_to(const model::Vehicle& nominal, const MeasuredMap& measured, const FitConfig& config,
                   const FitOptions& options) {
  const std::size_t count = config.parameters.size();
  check_inputs(measured, count);
  check_scales(measured);
  const std::vector<Wrench> before = force_map<double>(std::span(&nominal, 1), measured.inputs, options.map);
  check_simulated(measured, before);

  ForceFit result;
  check_units(measured, before, nominal);
  result.unchecked = check_signs(measured, before);
  result.before = map_error(measured.wrenches, before);
  result.sd_declared = !measured.sd.empty();
  MeasuredMap fitted = measured;  // the rows that are fitted, with the assumed sd
  const auto scale = group_rms(measured.wrenches);
  if (!result.sd_declared)
    fitted.sd.assign(measured.size(), {scale[0], scale[0], scale[0], scale[1], scale[1], scale[1]});
  std::vector<std::size_t> rows(measured.size());  // rows of `measured` that are in `fitted`
  std::iota(rows.begin(), rows.end(), std::size_t{0});
  const Problem problem(nominal, config, fitted, options.map);
  Fit fit(problem, options, result);
  const VectorXd start = problem.point(nominal);
  VectorXd point = fit.optimum(start);
  const auto estimate_noise = [&] {
    if (result.sd_declared) return;
    fitted.sd = estimated_sd(fitted, problem.maps<double>({point}), count);
    point = fit.polish("Gauss-Newton, noise estimated", point);
  };
  estimate_noise();
  // Repeat: a first fit that jumps misled finds other jumping inputs once it is corrected.
  for (int round = 0; round < 3; ++round) {
    std::vector<std::size_t> smooth(fitted.size()), jumping;
    std::iota(smooth.begin(), smooth.end(), std::size_t{0});
    for (const std::size_t i : jumping_inputs(problem, point)) {
      jumping.push_back(rows[i]);
      std::erase(smooth, i);
    }
    const MeasuredMap rest = selected(fitted, smooth);
    if (distinct_inputs(rest.inputs) < count) result.jumping_kept = jumping;
    if (jumping.empty() || !result.jumping_kept.empty()) break;
    result.left_out.insert(result.left_out.end(), jumping.begin(), jumping.end());
    std::erase_if(rows, [&](std::size_t row) { return std::ranges::count(jumping, row) > 0; });
    fitted = rest;
    point = fit.polish("Gauss-Newton, jumps left out", point);
    estimate_noise();
  }
  std::ranges::sort(result.left_out);

  const std::vector<End> likely = likely_ends(problem, result.ends, point);
  const std::vector<Eigen::Index> back = put_back(problem, options, result, point, start);
  result.known = describe(problem, point, start, likely);
  result.vehicle = problem.vehicle(point);
  // A parameter put back keeps the exact nominal value, without rounding errors.
  model::Vehicle untouched = nominal;
  const std::vector<double*> values = fitted_values(config, result.vehicle), digits = fitted_values(config, untouched);
  for (std::size_t i = 0; i < count; ++i) {
    FittedParameter& p = result.known.parameters[i];
    p.at_nominal = std::ranges::count(back, static_cast<Eigen::Index>(i)) > 0;
    p.nominal = *digits[i];
    if (p.at_nominal) *values[i] = p.nominal, p.seen = p.at_bound = false;
    p.value = *values[i];
  }
  result.after =
      map_error(measured.wrenches, force_map<double>(std::span(&result.vehicle, 1), measured.inputs, options.map));
  return result;
}

}  // namespace
}  // namespace flappy::identify
