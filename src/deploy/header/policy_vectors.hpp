// The network of a trained actor for export, and vectors of what it sees and does in flight.
#pragma once

#include "policy/policy.hpp"
#include "policy/policy_network.hpp"
#include "rollout/fly_config.hpp"

namespace flappy::deploy {

/// The actor of `config` with the action range of its task, in single precision.
policy::PolicyNetwork network_of(const rollout::FlyConfig& config);

/// Evaluates the network exactly as the simulator does, to the bit. `observation`: float[n][inputs].
std::vector<float> evaluate(const policy::PolicyNetwork& network, const std::vector<float>& observation);

/// First flapper for roll_out(). The last quarter of the random streams is flown neither in training nor in evaluation.
inline constexpr std::uint32_t kRolloutFlappers = std::uint32_t{3} << 30;

/// Flies `count` randomised vehicles by the actor, from number `first` on, in single precision, until hand-back or end,
/// and returns their observations and actions.
policy::PolicyVectors roll_out(const rollout::FlyConfig& given, std::size_t first, std::size_t count);

/// Flights of the same vehicles under the actor and under a policy, until one of the two hands back or ends.
struct BesideActor {
  std::size_t ended_alike = 0;  ///< in the same control period, for the same reason
  double largest_distance_m = 0;
};
/// Flies the first `count` vehicles of roll_out() twice.
BesideActor fly_beside(const rollout::FlyConfig& given, const policy::Policy& policy, std::size_t count);

/// At most `count` rows, evenly spaced.
policy::PolicyVectors some_of(const policy::PolicyVectors& all, std::size_t count);
void append(policy::PolicyVectors& to, const policy::PolicyVectors& more);

/// The network with 16 times the sums of its last layer, whose outputs saturate where those of a calm policy do not.
policy::PolicyNetwork louder(policy::PolicyNetwork network);

/// Flown observations at 1 to 1000 times their distance from the middle of the normalisation, so that one output after
/// the other saturates.
policy::PolicyVectors saturating(const policy::PolicyNetwork& network, const policy::PolicyVectors& flown);

/// Observations at and beyond the limits of their ranges, where inputs are clipped and outputs saturate.
policy::PolicyVectors corners(const policy::PolicyNetwork& network, const std::vector<flight::Signal>& observation);

}  // namespace flappy::deploy
