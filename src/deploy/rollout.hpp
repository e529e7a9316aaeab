// A trained actor as what is exported, and what it sees and does in flight.
#pragma once

#include "deploy/policy_network.hpp"
#include "flight/fly_config.hpp"

namespace flappy::deploy {

/// The actor of `config` and the action range of its task, in single precision.
PolicyNetwork network_of(const flight::FlyConfig& config);

/// The network as the simulator's lanes evaluate it, to the bit. `observation`: float[n][inputs].
std::vector<float> evaluate(const PolicyNetwork& network, const std::vector<float>& observation);

/// Vehicles that no training and no evaluation has flown: of the random streams' last quarter.
inline constexpr std::uint32_t kRolloutFlappers = std::uint32_t{3} << 30;

/// Observations and actions of `flights` randomised vehicles, flown by the actor in single precision until hand-back or end,
/// in the order of flights; those from `first` on.
PolicyVectors roll_out(const flight::FlyConfig& config, std::size_t first, std::size_t flights);

/// At most `count` rows, evenly chosen.
PolicyVectors some_of(const PolicyVectors& all, std::size_t count);
/// More rows of the same widths.
void append(PolicyVectors& to, const PolicyVectors& more);

/// Observations at and beyond the ends of their ranges, where inputs are clipped and outputs saturate.
PolicyVectors corners(const PolicyNetwork& network, const std::vector<flight::Signal>& observation);

}  // namespace flappy::deploy
