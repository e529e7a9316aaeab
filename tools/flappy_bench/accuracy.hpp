// What a step costs in accuracy: our step, and the integrators it was chosen from.
#pragma once

#include <string>
#include <vector>

#include "flappy/vehicle.hpp"

namespace flappy::bench {

/// Converged mean thrust at 10 V of the nominal vehicle, torso welded, hard stops, N: two independent engines
/// with hard stops tend to 0.12585 and 0.12586 (tests/reference), the published study to 0.1258.
inline constexpr double kConvergedThrust_N = 0.1258;

struct Flight {
  double x_m, y_m, z_m;  // torso's centre of mass after 0.3 s of free flight at 10 V from rest, in W
};

Flight free_flight(const model::Vehicle& vehicle, double step_s);
/// Mean upward aerodynamic force over 17 beats from 1 s, torso welded, 10 V, N.
double mean_thrust_N(const model::Vehicle& vehicle, double step_s);
double distance_m(const Flight& a, const Flight& b);

struct StepRow {
  double step_s, position_error_m, thrust_N;
};
/// Our step from 500 to 5 us; errors against our own 5 us run.
std::vector<StepRow> step_study(const model::Vehicle& vehicle);

struct IntegratorRow {
  std::string integrator;
  double step_s;
  int evaluations;  // of the equations of motion in 0.3 s; those for the stops are not counted
  double position_error_m;
};
/// Integrators at several steps; errors against our 1 us run.
std::vector<IntegratorRow> integrator_study(const model::Vehicle& vehicle);

}  // namespace flappy::bench
