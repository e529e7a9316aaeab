// What an exported header promises and asks for, as text: its opening comment, and a number by which headers of the same
// promise know each other.
#pragma once

#include "deploy/run_info.hpp"
#include "flight/fly_config.hpp"

namespace flappy::deploy {

inline constexpr int kHeaderFormat = 1;

/// Control periods and the policy's own, in whole microseconds. io::InputError where they are none.
struct Periods {
  long control_us, policy_us, driver_us;
};
Periods periods_of(const flight::FlyConfig& config);

/// The lines of a C comment, without its marks: where it comes from, periods, frames, every observation and action.
std::string contract_text(const flight::FlyConfig& config, const RunInfo& run);

/// CRC-32 of format, task, periods and of names, units and frames in their order: equal where two headers fit together.
std::uint32_t contract_crc32(const flight::FlyConfig& config);

/// `#define PREFIX_...`: format, contract, task, hashes, periods, wing-beat frequency.
std::string contract_macros(const std::string& prefix, const flight::FlyConfig& config, const RunInfo& run);

}  // namespace flappy::deploy
