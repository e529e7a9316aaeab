// The contract of an exported header, as text and as a checksum that tells whether a policy fits a firmware.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "policy/policy_network.hpp"
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

/// CRC-32 of the numbers in the headers, by which a log can name what flies.
struct ExportedCrc {
  std::uint32_t policy = 0;
  std::optional<std::uint32_t> controller;  ///< none: no controller is exported
};

/// CRC-32 of the numbers in the text of an exported header.
std::uint32_t crc_of_header(const std::string& text);

/// contract.json: what goes into the policy and comes out of it, for programs (docs/reference/export.md). `vectors`: those
/// of the header's self-test.
std::string contract_json(const rollout::FlyConfig& config, const policy::RunInfo& run,
                          const policy::PolicyNetwork& network, const policy::PolicyVectors& vectors,
                          const ExportedCrc& crc);

/// README.md of an exported folder: how the headers are wired into a program.
std::string wiring_text(const rollout::FlyConfig& config, const policy::RunInfo& run, bool with_controller);

/// Lines "#define <prefix>NAME value"; the prefix is used as it is, for example "FLAPPY_POLICY_". Names: FORMAT,
/// CONTRACT (contract_crc32()), TASK, CONFIG_SHA256, COMMIT, DIRTY, CONTROL_US, PERIOD_US (of the policy), FLAPPING_HZ,
/// HOLDS_TRIM. Throws as periods_of() does.
std::string contract_macros(const std::string& prefix, const rollout::FlyConfig& config, const policy::RunInfo& run);

}  // namespace flappy::deploy
