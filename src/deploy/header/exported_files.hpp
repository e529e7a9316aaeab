// The files of an exported policy that are text: headers, contract.json and README.md.
#pragma once

#include <map>
#include <string>

#include "deploy/header/policy_vectors.hpp"
#include "policy/run_info.hpp"

namespace flappy::deploy {

/// [name] text of flappy_policy.h, contract.json, README.md and, unless no_controller() says why not,
/// flappy_controller.h. `tests`: observations of the policy's self-test. io::InputError as from controller_header().
std::map<std::string, std::string> exported_files(const rollout::FlyConfig& config, const policy::RunInfo& run,
                                                  const policy::PolicyNetwork& network, policy::PolicyVectors tests);
/// The same for the configuration's actor, tested on corners() alone, without a flight.
std::map<std::string, std::string> exported_files(const rollout::FlyConfig& config, const policy::RunInfo& run);

}  // namespace flappy::deploy
