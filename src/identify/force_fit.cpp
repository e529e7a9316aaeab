#include "identify/force_fit.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "identify/global_search.hpp"
#include "identify/least_squares.hpp"
#include "sim/random.hpp"

namespace flappy::identify {
namespace {

using Eigen::MatrixXd, Eigen::VectorXd;

constexpr double kUniformPrecision = 12;  // of a uniform distribution over [0, 1]
constexpr double kNormal95 = 1.959964;
constexpr double kJump = 1;           // second difference, in standard deviations
constexpr double kImpossible = 1e30;  // cost of a vehicle that comes apart

double square(double x) { return x * x; }

/// Root mean square of forces and of torques.
std::array<double, 2> group_rms(const std::vector<Wrench>& wrenches) {
  std::array<double, 2> sum{};
  for (const Wrench& w : wrenches)
    for (int k = 0; k < kChannels; ++k) sum[is_force(k) ? 0 : 1] += square(w[static_cast<std::size_t>(k)]);
  for (double& s : sum) s = std::sqrt(s / (3 * static_cast<double>(wrenches.size())));
  return sum;
}

/// Vehicles as points of the unit cube, judged against a measured map with its sd.
class Problem {
 public:
  Problem(const model::Vehicle& vehicle, const FitConfig& config, const MeasuredMap& measured, const MapOptions& map)
      : vehicle_(vehicle), config_(config), measured_(measured), map_(map) {}

  std::size_t size() const { return config_.parameters.size(); }

  model::Vehicle vehicle(const VectorXd& point) const {
    model::Vehicle v = vehicle_;
    const std::vector<double*> values = fitted_values(config_, v);
    for (std::size_t i = 0; i < values.size(); ++i) {
      const FitParameter& p = config_.parameters[i];
      *values[i] = std::clamp(p.low + point[static_cast<Eigen::Index>(i)] * (p.high - p.low), p.low, p.high);
    }
    return v;
  }
  VectorXd point(model::Vehicle v) const {
    const std::vector<double*> values = fitted_values(config_, v);
    VectorXd x(static_cast<Eigen::Index>(size()));
    for (std::size_t i = 0; i < size(); ++i) {
      const FitParameter& p = config_.parameters[i];
      x[static_cast<Eigen::Index>(i)] = (*values[i] - p.low) / (p.high - p.low);
    }
    return x;
  }

  /// Simulated wrenches of each point, one point after the other.
  template <class T>
  std::vector<Wrench> maps(const std::vector<VectorXd>& points) const {
    std::vector<model::Vehicle> vehicles;
    vehicles.reserve(points.size());
    for (const VectorXd& p : points) vehicles.push_back(vehicle(p));
    return force_map<T>(vehicles, measured_.inputs, map_);
  }

  template <class T>
  std::vector<VectorXd> residuals(const std::vector<VectorXd>& points) const {
    const std::vector<Wrench> simulated = maps<T>(points);
    std::vector<VectorXd> all(points.size(), VectorXd(static_cast<Eigen::Index>(measured_.size() * kChannels)));
    for (std::size_t p = 0; p < points.size(); ++p)
      for (std::size_t i = 0; i < measured_.size(); ++i)
        for (std::size_t k = 0; k < kChannels; ++k)
          all[p][static_cast<Eigen::Index>(i * kChannels + k)] =
              (simulated[p * measured_.size() + i][k] - measured_.wrenches[i][k]) / measured_.sd[i][k];
    return all;
  }
  std::vector<VectorXd> operator()(const std::vector<VectorXd>& points) const { return residuals<double>(points); }

  double error(const VectorXd& point) const { return map_error(measured_.wrenches, maps<double>({point})).total; }

 private:
  const model::Vehicle& vehicle_;
  const FitConfig& config_;
  const MeasuredMap& measured_;
  MapOptions map_;
};

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

class Fit {
 public:
  Fit(const Problem& problem, const FitOptions& options, ForceFit& result)
      : problem_(problem), options_(options), result_(result) {}

  /// Downhill from `start`, as a stage of its own.
  VectorXd polish(const std::string& name, const VectorXd& start) {
    const auto began = std::chrono::steady_clock::now();
    const LeastSquares found = minimise(problem_, start, [&](const LeastSquares& s) {
      return progress(name, static_cast<double>(s.iterations) / 20, s.cost);
    });
    add(name, found.evaluations, began, found.point);
    cost_ = found.cost;
    return found.point;
  }

  /// The optimum, by the method chosen.
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
                 return progress(name, static_cast<double>(r.generations) / options_.generations, r.cost);
               });
    const VectorXd point = Eigen::Map<const VectorXd>(found.point.data(), nominal.size());
    add(name, found.evaluations, began, point);
    return polish("Gauss-Newton polish", point);
  }

 private:
  bool progress(const std::string& stage, double done, double cost) const {
    return !options_.progress || options_.progress(stage, std::min(done, 1.0), cost);
  }

  void add(const std::string& name, std::size_t evaluations, std::chrono::steady_clock::time_point began,
           const VectorXd& point) {
    const double wall_s = seconds_since(began);
    result_.stages.push_back({name, evaluations, wall_s, problem_.error(point)});
  }

  VectorXd from_several(const VectorXd& nominal) {
    VectorXd best;
    double lowest = 0;
    std::vector<double> costs;
    for (int start = 0; start < options_.starts; ++start) {
      VectorXd from = nominal;
      const sim::RandomKey key{options_.seed, static_cast<std::uint32_t>(start), 0, sim::Stream::start};
      for (Eigen::Index i = 0; start > 0 && i < from.size(); ++i)
        from[i] = sim::uniform_pair(key, static_cast<std::uint32_t>(i)).first;
      const VectorXd at =
          polish(start == 0 ? "Gauss-Newton" : "Gauss-Newton, start " + std::to_string(start + 1), from);
      costs.push_back(cost_);
      if (start == 0 || cost_ < lowest) lowest = cost_, best = at;
    }
    result_.starts = options_.starts;
    result_.starts_agreed =
        static_cast<int>(std::ranges::count_if(costs, [&](double c) { return c <= lowest * 1.01 + 1; }));
    return best;
  }

  const Problem& problem_;
  const FitOptions& options_;
  ForceFit& result_;
  double cost_ = 0;
};

/// What is left of forces and of torques, as the noise of each value.
std::vector<Wrench> estimated_sd(const MeasuredMap& measured, const std::vector<Wrench>& simulated,
                                 std::size_t parameters) {
  std::vector<Wrench> left = simulated;
  for (std::size_t i = 0; i < left.size(); ++i)
    for (std::size_t k = 0; k < kChannels; ++k) left[i][k] -= measured.wrenches[i][k];
  const auto rms = group_rms(left), scale = group_rms(measured.wrenches);
  const auto n = static_cast<double>(measured.size() * kChannels);
  const double lost = std::sqrt(n / std::max(1.0, n - static_cast<double>(parameters)));
  Wrench sd;
  for (int k = 0; k < kChannels; ++k) {
    const std::size_t g = is_force(k) ? 0 : 1;
    sd[static_cast<std::size_t>(k)] = std::max(rms[g] * lost, 1e-9 * scale[g]);
  }
  return std::vector<Wrench>(measured.size(), sd);
}

/// Inputs whose second differences about `point` are no curvature: smooth ones stay below 0.2 standard deviations.
std::vector<std::size_t> jumping_inputs(const Problem& problem, const VectorXd& point) {
  std::vector<VectorXd> points = {point};
  for (Eigen::Index i = 0; i < point.size(); ++i) {
    if (point[i] < kDifference || point[i] > 1 - kDifference) continue;
    for (const double way : {-kDifference, kDifference}) {
      points.push_back(point);
      points.back()[i] += way;
    }
  }
  const std::vector<VectorXd> r = problem(points);
  std::vector<std::size_t> jumping;
  for (Eigen::Index input = 0; input < r[0].size() / kChannels; ++input) {
    double worst = 0;
    for (std::size_t i = 1; i < r.size(); i += 2)
      worst = std::max(worst, (r[i] + r[i + 1] - 2 * r[0]).segment<kChannels>(input * kChannels).cwiseAbs().maxCoeff());
    if (!(worst <= kJump)) jumping.push_back(static_cast<std::size_t>(input));
  }
  return jumping;
}

MeasuredMap without(const MeasuredMap& map, const std::vector<std::size_t>& inputs) {
  MeasuredMap kept{map.name, {}, {}, {}};
  for (std::size_t i = 0; i < map.size(); ++i) {
    if (std::ranges::count(inputs, i) > 0) continue;
    kept.inputs.push_back(map.inputs[i]);
    kept.wrenches.push_back(map.wrenches[i]);
    kept.sd.push_back(map.sd[i]);
  }
  return kept;
}

void describe(ForceFit& result, const FitConfig& config, const Problem& problem, const VectorXd& point,
              const VectorXd& nominal) {
  const VectorXd left = problem({point}).front();
  const double freedom = std::max(1.0, static_cast<double>(left.size() - point.size()));
  result.misfit = left.squaredNorm() / freedom;
  const double widened = result.misfit > 1 + 3 * std::sqrt(2 / freedom) ? result.misfit : 1;
  const MatrixXd j = jacobian(problem, point) / std::sqrt(widened);
  const Eigen::JacobiSVD<MatrixXd> svd(j);
  result.singular_values.assign(svd.singularValues().begin(), svd.singularValues().end());
  const Eigen::Index n = point.size();
  const MatrixXd c = (j.transpose() * j + kUniformPrecision * MatrixXd::Identity(n, n)).inverse();
  result.parameters.clear();
  result.confounded.clear();
  for (Eigen::Index i = 0; i < n; ++i) {
    const FitParameter& p = config.parameters[static_cast<std::size_t>(i)];
    const double range = p.high - p.low, value = p.low + point[i] * range;
    const double half = kNormal95 * std::sqrt(c(i, i)) * range;
    result.parameters.push_back({p.path, p.low + nominal[i] * range, value, std::max(p.low, value - half),
                                 std::min(p.high, value + half), p.low, p.high, 2 * half <= config.unseen_share * range,
                                 point[i] <= 0 || point[i] >= 1});
    for (Eigen::Index k = 0; k < i; ++k)
      if (const double r = c(i, k) / std::sqrt(c(i, i) * c(k, k)); std::abs(r) > 0.9)
        result.confounded.push_back({config.parameters[static_cast<std::size_t>(k)].path, p.path, r});
  }
}

}  // namespace

std::vector<std::string> spring_verdicts(const ForceFit& fit) {
  std::vector<std::string> lines;
  for (const std::string side : {"left", "right"}) {
    const std::string positive = side + ".spring.stiffness_positive_Nm_rad";
    const std::string negative = side + ".spring.stiffness_negative_Nm_rad";
    const auto find = [&](const std::string& path) {
      return std::ranges::find(fit.parameters, path, &FittedParameter::path);
    };
    const auto p = find(positive), n = find(negative);
    if (p == fit.parameters.end() || n == fit.parameters.end()) continue;
    const bool confounded = std::ranges::any_of(
        fit.confounded, [&](const Confounded& c) { return c.first == positive && c.second == negative; });
    lines.push_back("the map " + std::string(p->seen && n->seen && !confounded ? "tells" : "does not tell") + " the " +
                    side + " spring's two stiffnesses apart");
  }
  return lines;
}

MapError map_error(const std::vector<Wrench>& measured, const std::vector<Wrench>& simulated) {
  const auto scale = group_rms(measured);
  MapError e;
  double off = 0, all = 0;
  for (std::size_t i = 0; i < measured.size(); ++i)
    for (int k = 0; k < kChannels; ++k) {
      const auto c = static_cast<std::size_t>(k);
      const double d = scale[is_force(k) ? 0 : 1] > 0 ? 1 / scale[is_force(k) ? 0 : 1] : 0;
      const double difference = measured[i][c] - simulated[i][c];
      off += square(d * difference);
      all += square(d * measured[i][c]);
      e.rms[c] += square(difference) / static_cast<double>(measured.size());
    }
  for (double& r : e.rms) r = std::sqrt(r);
  e.total = 100 * std::sqrt(off / all);
  return e;
}

ForceFit fit_forces(const model::Vehicle& nominal, const MeasuredMap& measured, const FitConfig& config,
                    const FitOptions& options) {
  const std::size_t count = config.parameters.size();
  if (measured.size() < count)
    throw io::InputError(measured.name + ": has " + std::to_string(measured.size()) + " inputs for " +
                         std::to_string(count) + " parameters; accepted: at least as many inputs as parameters");
  const std::vector<Wrench> before = force_map<double>(std::span(&nominal, 1), measured.inputs, options.map);
  check_signs(measured, before);

  ForceFit result;
  result.before = map_error(measured.wrenches, before);
  result.sd_declared = !measured.sd.empty();
  MeasuredMap fitted = measured;  // with the sd that the fit assumes
  const auto scale = group_rms(measured.wrenches);
  if (!result.sd_declared)
    fitted.sd.assign(measured.size(), {scale[0], scale[0], scale[0], scale[1], scale[1], scale[1]});
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
  // a fit that jumps have led astray sees others once it is back
  for (int round = 0; round < 3; ++round) {
    const std::vector<std::size_t> jumping = jumping_inputs(problem, point);
    if (jumping.empty() || fitted.size() - jumping.size() < count) break;
    for (const std::size_t i : jumping) result.left_out.push_back(fitted.inputs[i]);
    fitted = without(fitted, jumping);
    point = fit.polish("Gauss-Newton, jumps left out", point);
    estimate_noise();
  }
  describe(result, config, problem, point, start);

  std::vector<bool> seen;
  for (const FittedParameter& p : result.parameters) seen.push_back(p.seen);
  if (std::ranges::count(seen, false) > 0) {
    FitConfig rest{{}, config.unseen_share};
    for (std::size_t i = 0; i < count; ++i)
      if (seen[i]) rest.parameters.push_back(config.parameters[i]);
      else point[static_cast<Eigen::Index>(i)] = start[static_cast<Eigen::Index>(i)];
    if (!rest.parameters.empty()) {
      const model::Vehicle from = problem.vehicle(point);
      const Problem smaller(from, rest, fitted, options.map);
      Fit again(smaller, options, result);
      point = problem.point(smaller.vehicle(again.polish("Gauss-Newton, unseen at nominal", smaller.point(from))));
    }
    describe(result, config, problem, point, start);
    for (std::size_t i = 0; i < count; ++i) result.parameters[i].seen = seen[i];
  }
  result.vehicle = problem.vehicle(point);
  // an unseen parameter keeps its nominal digits
  const std::vector<double*> values = fitted_values(config, result.vehicle);
  for (std::size_t i = 0; i < count; ++i) {
    if (!seen[i]) *values[i] = result.parameters[i].nominal;
    result.parameters[i].value = *values[i];
  }
  result.after =
      map_error(measured.wrenches, force_map<double>(std::span(&result.vehicle, 1), measured.inputs, options.map));
  return result;
}

}  // namespace flappy::identify
