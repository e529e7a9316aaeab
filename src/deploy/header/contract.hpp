// The contract of an exported header, as text and as a checksum that tells whether a policy fits a firmware.
#pragma once

#include <cstdint>
#include <string>

#include "policy/run_info.hpp"
#include "rollout/fly_config.hpp"

namespace flappy::deploy {

inline constexpr int kHeaderFormat = 1;

/// Periods in microseconds of the feedback controller, of the policy, and of the motor driver, which holds its voltage
/// for one. Throws io::InputError if one is not a whole number.
struct Periods {
  long control_us, policy_us, driver_us;
};
Periods periods_of(const rollout::FlyConfig& config);

/// The text of the comment at the top of the header, without comment marks: origin, periods, frames, every observation
/// and action.
std::string contract_text(const rollout::FlyConfig& config, const policy::RunInfo& run);

/// CRC-32 of format, task, control and policy period, whether the controller's trim is held, then name, unit and frame
/// of each observation and action in order. A policy may replace another one if both have the same CRC-32.
std::uint32_t contract_crc32(const rollout::FlyConfig& config);

/// Lines "#define <prefix>NAME value"; the prefix is used as it is, for example "FLAPPY_POLICY_". Names: FORMAT,
/// CONTRACT (contract_crc32()), TASK, CONFIG_SHA256, COMMIT, DIRTY, CONTROL_US, PERIOD_US (of the policy), FLAPPING_HZ,
/// HOLDS_TRIM. Throws as periods_of() does.
std::string contract_macros(const std::string& prefix, const rollout::FlyConfig& config, const policy::RunInfo& run);

}  // namespace flappy::deploy
