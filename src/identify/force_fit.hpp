// Fits parameters of a vehicle to a measured force map, with an interval for each.
//
//   cost = sum of ((measured - simulated) / sd)^2 over all inputs and channels
//   total error = 100 norm(D (measured - simulated)) / norm(D measured), D = 1/rms of measured forces, of torques
//
// Where no sd is declared, the first fit uses the weights D; its rms residuals in forces and torques are the sd of the
// second fit. Inputs at which the simulated map jumps about the optimum (wings that hardly flip, strokes that meet
// their stops) have no useful slopes: the fit leaves them out, the errors include them. A parameter is unseen if its
// interval is wider than a share of its bounds. Unseen ones return to nominal one at a time, widest interval first, and
// the rest are refitted: if the map determines only a combination of two, fixing one determines the other. A parameter
// whose nominal value contradicts the map stays as fitted. Intervals include the uncertainty of the unseen parameters.
#pragma once

#include <functional>
#include <string>

#include "identify/intervals.hpp"

namespace flappy::identify {

enum class Method { gauss_newton, genetic, cma_es };

struct FitOptions {
  Method method = Method::gauss_newton;
  MapOptions map;
  unsigned population = 200, generations = 200;  ///< for the genetic algorithm and CMA-ES
  int starts = 3;                                ///< for Gauss-Newton: first the nominal vehicle, then random points
  std::uint64_t seed = 1;
  /// Called repeatedly with the stage, the fraction done and the lowest cost so far; returning false stops the fit.
  std::function<bool(const std::string& stage, double done, double cost)> progress;
};

/// Effort of one stage of the fit, and the total error, %, that it reached.
struct Stage {
  std::string name;
  std::size_t evaluations = 0;  ///< number of simulated force maps
  double wall_s = 0, error = 0;
};

struct ForceFit {
  bool stopped = false;  ///< by `progress`: then nothing else is known
  model::Vehicle vehicle;
  Intervals known;
  MapError before, after;
  std::vector<Stage> stages;
  bool sd_declared = false;
  std::vector<std::size_t> left_out;      ///< rows of the measured map at which the simulated one jumps
  std::vector<std::size_t> jumping_kept;  ///< such rows that the fit keeps because too few inputs would remain
  std::vector<std::string> unchecked;     ///< columns whose sign the inputs do not determine
  std::vector<End> ends;                  ///< where each Gauss-Newton start ended, with its cost at that time
  int starts_agreed = 0;                  ///< number of ends at the lowest cost; below 2, a better optimum may exist
};

/// A line for each side with both spring stiffnesses fitted: whether the map tells them apart.
std::vector<std::string> spring_verdicts(const ForceFit& fit);

/// InputError for fewer different inputs than parameters, for all forces or all torques zero, for a vehicle that cannot
/// be simulated at an input, and for a wrong sign (check_signs()).
ForceFit fit_forces(const model::Vehicle& nominal, const MeasuredMap& measured, const FitConfig& config,
                    const FitOptions& options = {});

}  // namespace flappy::identify
