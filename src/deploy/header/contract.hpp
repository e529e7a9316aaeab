// The contract of an exported header, as text and as a checksum by which headers recognise each other.
#pragma once

#include "policy/run_info.hpp"
#include "rollout/fly_config.hpp"

namespace flappy::deploy {

inline constexpr int kHeaderFormat = 1;

/// The periods of controller, policy, driver in microseconds. io::InputError where one is not a whole number.
struct Periods {
  long control_us, policy_us, driver_us;
};
Periods periods_of(const rollout::FlyConfig& config);

/// The header's opening comment without marks: origin, periods, frames, every observation and action.
std::string contract_text(const rollout::FlyConfig& config, const policy::RunInfo& run);

/// CRC-32 of format, task, periods, names, units and frames in order: equal where two headers fit together.
std::uint32_t contract_crc32(const rollout::FlyConfig& config);

/// The macros PREFIX_...: format, contract, task, hashes, periods, wing-beat frequency.
std::string contract_macros(const std::string& prefix, const rollout::FlyConfig& config, const policy::RunInfo& run);

}  // namespace flappy::deploy
