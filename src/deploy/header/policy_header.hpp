// Exports the trained actor as one header in C99 that tests itself.
#pragma once

#include "deploy/header/contract.hpp"
#include "deploy/header/quantise.hpp"

namespace flappy::deploy {

/// The text of flappy_policy.h, the same to the byte for the same arguments. `vectors`: for its self-test.
std::string policy_header(const rollout::FlyConfig& config, const policy::RunInfo& run,
                          const policy::PolicyNetwork& network, const policy::PolicyVectors& vectors);
std::string policy_header(const rollout::FlyConfig& config, const policy::RunInfo& run, const QuantisedNetwork& network,
                          const policy::PolicyVectors& vectors);

}  // namespace flappy::deploy
