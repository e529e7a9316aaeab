// Fits parameters of a vehicle to a measured force map, and says how well each is known.
//
//   cost = sum of ((measured - simulated) / sd)^2 over all inputs and channels
//   total error = 100 norm(D (measured - simulated)) / norm(D measured), D = 1/rms of the measured forces, of the torques
//
// Where no sd is declared the first fit weighs by D, and the scatter it leaves in forces and in torques is the sd of the second.
// Inputs at which the simulated map jumps about the optimum (wings that hardly flip, strokes that meet their stops) can
// neither steer a fit nor tell how well it is known: they are left out of it, but not of the errors.
// A parameter whose interval is wider than a share of its bounds is unseen. Unseen ones go back to their nominal value one
// at a time, the widest first, and the rest are fitted once more: what two of them share is then known of the other. One
// whose nominal value the map contradicts stays as fitted. All intervals still count what the unseen ones could be.
#pragma once

#include <functional>
#include <string>

#include "identify/intervals.hpp"

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

struct ForceFit {
  model::Vehicle vehicle;
  Intervals known;
  MapError before, after;
  std::vector<Stage> stages;
  bool sd_declared = false;
  std::vector<std::size_t> left_out;      ///< rows of the measured map at which the simulated one jumps
  std::vector<std::size_t> jumping_kept;  ///< the same, fitted all the same: without them too few remain
  std::vector<std::string> unchecked;     ///< columns whose sign these inputs do not tell
  std::vector<End> ends;                  ///< of Gauss-Newton's starts, with costs as the starts had them
  int starts_agreed = 0;                  ///< of them; with fewer than 2, another optimum may lie elsewhere
};

/// For each side whose two spring stiffnesses were both to be fitted: whether the map tells them apart.
std::vector<std::string> spring_verdicts(const ForceFit& fit);

/// InputError where there are fewer different inputs than parameters, forces or torques are all zero, the vehicle cannot be
/// simulated at an input, or check_signs() refuses.
ForceFit fit_forces(const model::Vehicle& nominal, const MeasuredMap& measured, const FitConfig& config,
                    const FitOptions& options = {});

}  // namespace flappy::identify
