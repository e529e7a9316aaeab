// The trained actor as one header in C99 that tests itself.
#pragma once

#include "deploy/contract.hpp"
#include "deploy/quantise.hpp"

namespace flappy::deploy {

/// Text of flappy_policy.h: the same bytes for the same arguments. `vectors`: rows of its self-test.
std::string policy_header(const flight::FlyConfig& config, const RunInfo& run, const PolicyNetwork& network,
                          const PolicyVectors& vectors);
std::string policy_header(const flight::FlyConfig& config, const RunInfo& run, const QuantisedNetwork& network,
                          const PolicyVectors& vectors);

}  // namespace flappy::deploy
