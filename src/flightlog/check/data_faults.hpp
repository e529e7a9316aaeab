// Faults of the data that forbid a diagnosis, because no vehicle and no effect explains them. They are found before any fit.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "flightlog/check/check.hpp"
#include "flightlog/check/data_fault.hpp"

namespace flappy::flightlog {

/// Shortest time that command, motion capture and IMU must have in common (command and motion capture alone where
/// inputs are declared). Ten beats let the wings settle, and fifty tell mean, harmonics and noise apart. In less than
/// kMinTime_s the accelerometer does not show gravity clearly enough.
inline constexpr double kMinBeats = 60, kMinTime_s = 2;

/// The faults of a log, empty where it can be diagnosed. Missing samples come first, then flights that are too short,
/// then all others, one for each file. `report`: check_flight() of the log; `folder`: the place that DataFault::file
/// names. Sensor effects within their priors are no fault, with one exception: a vibration rectification of several
/// times its typical magnitude, which changes the mean force like a wrong attitude.
std::vector<DataFault> data_faults(const FlightLog& log, const CheckReport& report,
                                   const std::filesystem::path& folder);
inline std::vector<DataFault> data_faults(const FlightLog& log, const std::filesystem::path& folder) {
  return data_faults(log, check_flight(log), folder);
}

/// The faults of several flights of one robot, whose declared inputs are also compared with one another.
std::vector<DataFault> data_faults(const std::vector<FlightLog>& logs, const std::vector<std::string>& folders);

}  // namespace flappy::flightlog
