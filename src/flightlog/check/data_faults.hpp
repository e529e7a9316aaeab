// Faults of the data that forbid a diagnosis, because no vehicle and no effect explains them. Found before any fit.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "flightlog/check/check.hpp"
#include "flightlog/check/data_fault.hpp"

namespace flappy::flightlog {

/// Shortest time common to command, mocap and (with voltages) IMU. Ten beats let the wings settle, fifty tell mean,
/// harmonics and noise apart. Under kMinTime_s the accelerometer does not show gravity clearly.
inline constexpr double kMinBeats = 60, kMinTime_s = 2;

/// The faults of a log, empty where it can be diagnosed: missing samples first, then too short flights, then the rest,
/// one for each file. `report`: check_flight() of the log; `folder`: named by DataFault::file. Sensor effects within
/// their priors are no fault, except a vibration rectification of several times its typical magnitude, which changes
/// the mean force like a wrong attitude.
std::vector<DataFault> data_faults(const FlightLog& log, const CheckReport& report,
                                   const std::filesystem::path& folder);
inline std::vector<DataFault> data_faults(const FlightLog& log, const std::filesystem::path& folder) {
  return data_faults(log, check_flight(log), folder);
}

/// The faults of several flights of one robot, whose declared inputs are also compared with one another.
std::vector<DataFault> data_faults(const std::vector<FlightLog>& logs, const std::vector<std::string>& folders);

/// Reads a log. Throws io::InputError with the first fault, if any.
FlightLog read_faultless_log(const std::filesystem::path& folder);

}  // namespace flappy::flightlog
