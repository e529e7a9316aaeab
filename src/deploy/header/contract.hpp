// What an exported header promises and asks for, as text: its opening comment, and a number by which headers of the same
// promise know each other.
#pragma once

#include "policy/run_info.hpp"
#include "rollout/fly_config.hpp"

namespace flappy::deploy {

inline constexpr int kHeaderFormat = 1;

/// Control periods and the policy's own, in whole microseconds. io::InputError where they are none.
struct Periods {
  long control_us, policy_us, driver_us;
};
Periods periods_of(const rollout::FlyConfig& config);

/// The lines of a C comment, without its marks: where it comes from, periods, frames, every observation and action.
std::string contract_text(const rollout::FlyConfig& config, const policy::RunInfo& run);

/// CRC-32 of format, task, periods and of names, units and frames in their order: equal where two headers fit together.
std::uint32_t contract_crc32(const rollout::FlyConfig& config);

/// `#define PREFIX_...`: format, contract, task, hashes, periods, wing-beat frequency.
std::string contract_macros(const std::string& prefix, const rollout::FlyConfig& config, const policy::RunInfo& run);

}  // namespace flappy::deploy
