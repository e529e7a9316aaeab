// Fits parameters of a vehicle to a measured force map, and says how well each is known.
//
//   cost = sum of ((measured - simulated) / sd)^2 over all inputs and channels
//   total error = 100 norm(D (measured - simulated)) / norm(D measured), D = 1/rms of the measured forces, of the torques
//
// Where no sd is declared the first fit weighs by D, and the scatter it leaves in forces and in torques is the sd of the second.
// Intervals are those of the linearised map at the optimum: in units of the bounds, with Jacobian J of the cost's terms,
// covariance C = (J'J + 12 I)^-1. The 12 is the precision of a uniform distribution over the bounds: what is known before
// anything is measured. A misfit far above the noise (a map no parameters reach) widens C by its ratio.
// Inputs at which the simulated map jumps about the optimum (wings that hardly flip, strokes that meet their stops) can
// neither steer a fit nor tell how well it is known: they are left out of it, but not of the errors.
// A parameter whose interval is wider than a share of its bounds is unseen: it goes back to its nominal value, the
// rest are fitted once more, and their intervals still count what the unseen ones could be.
#pragma once

#include <functional>
#include <string>

#include "identify/fit_config.hpp"
#include "identify/measured_map.hpp"

namespace flappy::identify {

enum class Method { gauss_newton, genetic, cma_es };

struct FitOptions {
  Method method = Method::gauss_newton;
  MapOptions map;
  unsigned population = 200, generations = 200;  ///< of the genetic algorithm and CMA-ES
  int starts = 3;                                ///< of Gauss-Newton: the nominal vehicle, then random ones
  std::uint64_t seed = 1;
  /// Called now and then with the stage, its part done and its lowest cost; false ends the stage.
  std::function<bool(const std::string& stage, double done, double cost)> progress;
};

/// What a part of the fit took, and the total error that it reached.
struct Stage {
  std::string name;
  std::size_t evaluations = 0;  ///< of vehicles: a map each
  double wall_s = 0, error = 0;
};

struct FittedParameter {
  std::string path;
  double nominal = 0, value = 0, low = 0, high = 0;  ///< 95 % interval, within the bounds
  double lower_bound = 0, upper_bound = 0;
  bool seen = true, at_bound = false;
};

/// Two parameters that the map tells apart badly.
struct Confounded {
  std::string first, second;
  double correlation = 0;
};

struct MapError {
  double total = 0;  ///< %
  Wrench rms{};      ///< of measured - simulated, in N and N m
};

struct ForceFit {
  model::Vehicle vehicle;
  std::vector<FittedParameter> parameters;
  std::vector<Confounded> confounded;  ///< beyond +-0.9
  std::vector<double>
      singular_values;  ///< of J, largest first: below sqrt(12) a direction is known from its bounds alone
  MapError before, after;
  std::vector<Stage> stages;
  bool sd_declared = false;
  std::vector<sim::Input> left_out;  ///< inputs at which the map jumps
  double misfit = 0;                 ///< cost per degree of freedom; about 1 where only noise is left
  int starts_agreed = 0, starts = 0;
};

/// For each side whose two spring stiffnesses were both to be fitted: whether the map tells them apart.
std::vector<std::string> spring_verdicts(const ForceFit& fit);

MapError map_error(const std::vector<Wrench>& measured, const std::vector<Wrench>& simulated);

/// InputError where there are fewer inputs than parameters, or check_signs() refuses.
ForceFit fit_forces(const model::Vehicle& nominal, const MeasuredMap& measured, const FitConfig& config,
                    const FitOptions& options = {});

}  // namespace flappy::identify
