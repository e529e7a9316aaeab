// Accuracy against step size, for our step and for the integrators that it was chosen from.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "flappy/vehicle.hpp"

namespace flappy::bench {

/// Converged mean thrust at 10 V of the nominal vehicle, torso welded, hard stops, N: two independent engines
/// with hard stops tend to 0.12585 and 0.12586 (tests/reference), the published study to 0.1258.
inline constexpr double kConvergedThrust_N = 0.1258;

/// 0.3 s of free flight at 10 V from rest.
struct Flight {
  double x_m, y_m, z_m;                             // torso's centre of mass at the end, in W
  std::array<double, 4> attitude;                   // at the end: w, x, y, z
  std::vector<std::array<double, 2>> stroke_rad{};  // every millisecond, left and right; only of our step
  std::vector<std::array<double, 2>> rotation_rad{};
};

Flight free_flight(const model::Vehicle& vehicle, double step_s);
/// Mean upward aerodynamic force over 17 beats from 1 s, torso welded, 10 V, N.
double mean_thrust_N(const model::Vehicle& vehicle, double step_s);
double distance_m(const Flight& a, const Flight& b);
/// Angle of the rotation between the final attitudes.
double turn_rad(const Flight& a, const Flight& b);

struct StepRow {
  double step_s, position_error_m, attitude_error_rad;
  double stroke_error_rad, rotation_error_rad;  // rms over both wings and the flight
  double thrust_N;
};
/// Our step from 500 to 5 us; errors against our own 5 us run.
std::vector<StepRow> step_study(const model::Vehicle& vehicle);

struct IntegratorRow {
  std::string integrator;
  double step_s;
  int evaluations;  // of the equations of motion in 0.3 s, without those for the stops
  double position_error_m, attitude_error_rad;
};
/// Integrators at several steps; errors against our 1 us run.
std::vector<IntegratorRow> integrator_study(const model::Vehicle& vehicle);

}  // namespace flappy::bench
