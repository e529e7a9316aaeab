// Faults of the data that forbid a diagnosis: what no vehicle and no effect explains, found before anything is fitted.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "flightlog/check/check.hpp"
#include "flightlog/check/data_fault.hpp"

namespace flappy::flightlog {

/// A flight must have this many beats seen by voltages, motion capture and IMU alike (by inputs and motion capture, where inputs
/// are declared): ten in which the wings settle, and
/// fifty of which mean, harmonics and noise are told apart. Nor does gravity show in less than the time.
inline constexpr double kLeastBeats = 60, kLeastTime_s = 2;

/// At most one for each file, the one that explains the others; none where the log can be diagnosed. `report`: of the
/// log; `folder` stands for the place in `file`. Effects of sensors within their priors are none, but for
/// a vibration rectification of several times its typical size: the mean force is bent as by another attitude.
std::vector<DataFault> data_faults(const FlightLog& log, const CheckReport& report,
                                   const std::filesystem::path& folder);
inline std::vector<DataFault> data_faults(const FlightLog& log, const std::filesystem::path& folder) {
  return data_faults(log, check_flight(log), folder);
}

/// Of several flights of one robot, compared with one another as well.
std::vector<DataFault> data_faults(const std::vector<FlightLog>& logs, const std::vector<std::string>& folders);

}  // namespace flappy::flightlog
