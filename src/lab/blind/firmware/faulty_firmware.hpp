// Robots that fly exported C, by a firmware that may make a mistake with it. Written apart from what finds mistakes
// (deploy/flown), and shares nothing with it but the exported headers.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "lab/blind/family.hpp"

namespace flappy::blind {

/// Names of mistakes, "none" first.
const std::vector<std::string>& firmware_mistakes();

/// Latencies by which the firmware stamps samples.
struct FirmwareSensors {
  double imu_latency_s = 0, mocap_latency_s = 0;
};

/// Compiles the headers of `exported` with a firmware. `begin_s`: since start(), when the policy shall act. "int8" and
/// "contracted" fly other code than the exported; "another_export" is for the caller: another folder without a mistake.
/// io::InputError for an unknown mistake, or where there is no compiler or header.
std::unique_ptr<OnBoard> make_firmware(const std::filesystem::path& exported, const std::string& mistake,
                                       const FirmwareSensors& sensors, double begin_s);

/// A firmware that sets 0 V.
std::unique_ptr<OnBoard> silent_firmware();

}  // namespace flappy::blind
