// Vehicles as points of the unit cube of a fit's bounds, judged against a measured map with its standard deviations.
#pragma once

#include <algorithm>

#include "identify/fit_config.hpp"
#include "identify/least_squares.hpp"
#include "identify/measured_map.hpp"

namespace flappy::identify {

struct MapError {
  double total = 0;  ///< %
  Wrench rms{};      ///< of measured - simulated, in N and N m
};
MapError map_error(const std::vector<Wrench>& measured, const std::vector<Wrench>& simulated);

/// Root mean square of forces and of torques.
std::array<double, 2> group_rms(const std::vector<Wrench>& wrenches);

/// Refers to all that it is made of.
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

  /// Simulated wrenches of each point, one point after the other.
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

/// What is left of forces and of torques, as the noise of each value.
std::vector<Wrench> estimated_sd(const MeasuredMap& measured, const std::vector<Wrench>& simulated,
                                 std::size_t parameters);

/// Inputs whose second differences about `point` are no curvature: smooth ones stay below 0.2 standard deviations.
std::vector<std::size_t> jumping_inputs(const Problem& problem, const Eigen::VectorXd& point);

}  // namespace flappy::identify
