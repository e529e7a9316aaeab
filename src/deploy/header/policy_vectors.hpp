// A trained actor as what is exported, and what it sees and does in flight.
#pragma once

#include "policy/policy_network.hpp"
#include "rollout/fly_config.hpp"

namespace flappy::deploy {

/// The actor of `config` and the action range of its task, in single precision.
policy::PolicyNetwork network_of(const rollout::FlyConfig& config);

/// The network as the simulator's lanes evaluate it, to the bit. `observation`: float[n][inputs].
std::vector<float> evaluate(const policy::PolicyNetwork& network, const std::vector<float>& observation);

/// Vehicles that no training and no evaluation has flown: of the random streams' last quarter.
inline constexpr std::uint32_t kRolloutFlappers = std::uint32_t{3} << 30;

/// Observations and actions of `count` randomised vehicles, flown by the actor in single precision until hand-back or end,
/// in the order of flights; those from `first` on.
policy::PolicyVectors roll_out(const rollout::FlyConfig& given, std::size_t first, std::size_t count);

/// At most `count` rows, evenly chosen.
policy::PolicyVectors some_of(const policy::PolicyVectors& all, std::size_t count);
/// More rows of the same widths.
void append(policy::PolicyVectors& to, const policy::PolicyVectors& more);

/// Observations at and beyond the ends of their ranges, where inputs are clipped and outputs saturate.
policy::PolicyVectors corners(const policy::PolicyNetwork& network, const std::vector<flight::Signal>& observation);

}  // namespace flappy::deploy
