// Error against step size over many flights, as one flight alone is luck; and against time, beside other engines.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "flappy/batch.hpp"
#include "flappy/vehicle.hpp"

namespace flappy::bench {

/// Flights that errors are measured on: vehicles randomised as published, each with amplitude, difference, bias, split cycle and
/// wings' start of its own. 0.3 s of free flight from rest, and mean thrust on a stand.
struct Manoeuvre {
  std::size_t flights = 256;
  double low_V = 6, high_V = 18;  ///< amplitude is uniform between them
  std::string effect;             ///< at its typical size, if any
  double exact_step_s = 1e-6;     ///< of the run that errors are against
};

/// Rms over flights at the end of free flight; of mean thrust, a share of the mean over flights.
struct Errors {
  double position_m, attitude_rad, thrust;
};

/// Errors at each step against our own fine run, in double.
std::vector<Errors> errors_of(const model::Vehicle& vehicle, const Manoeuvre& manoeuvre,
                              const std::vector<double>& steps_s);

/// One engine at one of its settings and one step.
struct WorkPrecisionRow {
  std::string engine, settings;
  double step_s, position_error_m, attitude_error_rad, flapper_s_per_cpu_s;
};

/// Errors at the end of free flights about hover against our 1 us run, and flight per second of one processor. Peers fly as many as
/// take no longer than a minute, and go on to finer steps until they are within half of `enough_m`; ours flies in float.
std::vector<WorkPrecisionRow> work_precision(const model::Vehicle& vehicle, double enough_m, bool peers,
                                             const std::function<void(double done, const std::string& now)>& tell);

}  // namespace flappy::bench
