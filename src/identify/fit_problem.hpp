// The cost of a fit: a vehicle is a point of the unit cube, each axis a parameter from lower to upper bound. Residuals
// are simulated less measured forces and torques, over their standard deviations.
#pragma once

#include <algorithm>

#include "identify/fit_config.hpp"
#include "identify/least_squares.hpp"
#include "identify/measured_map.hpp"

namespace flappy::identify {

struct MapError {
  double total = 0;  ///< total error of force_fit.hpp, %
  Wrench rms{};      ///< rms of measured - simulated for each channel, in N and N m
};
MapError map_error(const std::vector<Wrench>& measured, const std::vector<Wrench>& simulated);

/// Root mean square of all forces, N, and of all torques, N m.
std::array<double, 2> group_rms(const std::vector<Wrench>& wrenches);

/// Holds references to the arguments of its constructor; they must outlive it.
class Problem {
 public:
  Problem(const model::Vehicle& vehicle, const FitConfig& config, const MeasuredMap& measured, const MapOptions& map)
      : vehicle_(vehicle), config_(config), measured_(measured), map_(map) {}

  std::size_t size() const { return config_.parameters.size(); }

  model::Vehicle vehicle(const Eigen::VectorXd& point) const {
    model::Vehicle v = vehicle_;
    const std::vector<double*> values = fitted_values(config_, v);
    for (std::size_t i = 0; i < values.size(); ++i) {
      const FitParameter& p = config_.parameters[i];
      *values[i] = std::clamp(p.low + point[static_cast<Eigen::Index>(i)] * (p.high - p.low), p.low, p.high);
    }
    return v;
  }
  Eigen::VectorXd point(model::Vehicle v) const {
    const std::vector<double*> values = fitted_values(config_, v);
    Eigen::VectorXd x(static_cast<Eigen::Index>(size()));
    for (std::size_t i = 0; i < size(); ++i) {
      const FitParameter& p = config_.parameters[i];
      x[static_cast<Eigen::Index>(i)] = (*values[i] - p.low) / (p.high - p.low);
    }
    return x;
  }
  const FitConfig& config() const { return config_; }

  /// Simulated wrenches, [point][input].
  template <class T>
  std::vector<Wrench> maps(const std::vector<Eigen::VectorXd>& points) const {
    std::vector<model::Vehicle> vehicles;
    vehicles.reserve(points.size());
    for (const Eigen::VectorXd& p : points) vehicles.push_back(vehicle(p));
    return force_map<T>(vehicles, measured_.inputs, map_);
  }

  template <class T>
  std::vector<Eigen::VectorXd> residuals(const std::vector<Eigen::VectorXd>& points) const {
    const std::vector<Wrench> simulated = maps<T>(points);
    std::vector<Eigen::VectorXd> all(points.size(),
                                     Eigen::VectorXd(static_cast<Eigen::Index>(measured_.size() * kChannels)));
    for (std::size_t p = 0; p < points.size(); ++p)
      for (std::size_t i = 0; i < measured_.size(); ++i)
        for (std::size_t k = 0; k < kChannels; ++k)
          all[p][static_cast<Eigen::Index>(i * kChannels + k)] =
              (simulated[p * measured_.size() + i][k] - measured_.wrenches[i][k]) / measured_.sd[i][k];
    return all;
  }
  std::vector<Eigen::VectorXd> operator()(const std::vector<Eigen::VectorXd>& points) const {
    return residuals<double>(points);
  }

  double error(const Eigen::VectorXd& point) const {
    return map_error(measured_.wrenches, maps<double>({point})).total;
  }

 private:
  const model::Vehicle& vehicle_;
  const FitConfig& config_;
  const MeasuredMap& measured_;
  MapOptions map_;
};

/// The sd of each value: the rms residual of all forces or of all torques, corrected for the number of `parameters`.
std::vector<Wrench> estimated_sd(const MeasuredMap& measured, const std::vector<Wrench>& simulated,
                                 std::size_t parameters);

/// Inputs at which the simulated map jumps about `point`: a residual's second difference over a small step of a
/// parameter exceeds 1 standard deviation. Where the map is smooth, it stays below 0.2.
std::vector<std::size_t> jumping_inputs(const Problem& problem, const Eigen::VectorXd& point);

}  // namespace flappy::identify
