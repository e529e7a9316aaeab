// Error against step size over many flights, as the error of a single flight is random; and error against processor time, compared with
// other engines.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "flappy/batch.hpp"
#include "flappy/vehicle.hpp"

namespace flappy::bench {

/// Flights on which errors are measured. Each has a vehicle randomised as published and its own amplitude, difference, bias, split cycle
/// and initial wing angles. It lasts 0.3 s from rest; mean thrust is measured on a stand.
struct Manoeuvre {
  std::size_t flights = 256;
  double low_V = 6, high_V = 18;  ///< range of the uniform amplitude
  std::string effect;             ///< at its typical magnitude; empty: none
  double exact_step_s = 1e-6;     ///< step of the reference run
};

/// Rms over flights at the end of free flight; for mean thrust, as a share of its mean over flights.
struct Errors {
  double position_m, attitude_rad, thrust;
};

/// Errors at each step size against our own fine run, in double.
std::vector<Errors> errors_of(const model::Vehicle& vehicle, const Manoeuvre& manoeuvre,
                              const std::vector<double>& steps_s);

/// One engine with one of its settings and one step size.
struct WorkPrecisionRow {
  std::string engine, settings;
  double step_s, position_error_m, attitude_error_rad, flapper_s_per_cpu_s;
};

/// Writes the first `count` of these flights for engines that no C++ reaches: vehicle_I.toml, and flights.json with the voltages (each
/// held for 1 ms), the start and the end of our 1 us run. Only of a build with peers.
void write_flights(const model::Vehicle& vehicle, std::size_t count, const std::filesystem::path& folder);

/// Errors at the end of free flights about hover against our 1 us run, and seconds of flight per second of one processor; our timing is
/// in float. Peers fly as many flights as fit into a minute, at ever finer steps until their error is below half of `enough_m`.
std::vector<WorkPrecisionRow> work_precision(const model::Vehicle& vehicle, double enough_m, bool peers,
                                             const std::function<void(double done, const std::string& now)>& tell);

}  // namespace flappy::bench
