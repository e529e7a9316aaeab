#include "deploy/proof/file_proof.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include "deploy/header/policy_vectors.hpp"
#include "rollout/rollout.hpp"

namespace flappy::deploy {
namespace {

/// Integers that are ordered as floats are, and one apart where floats are neighbours.
std::int64_t ordered(float x) {
  const auto bits = std::bit_cast<std::int32_t>(x);
  return bits < 0 ? std::int64_t{INT32_MIN} - bits : bits;
}

void compare_flights(Agreement& to, const rollout::FlyConfig& given, const policy::Policy& policy) {
  rollout::FlyConfig config = given;
  config.fleet.first_flapper = kRolloutFlappers;
  config.excitation = {};
  rollout::Rollout<float> of_actor(config, to.flights);
  config.actor.reset();
  rollout::Rollout<float> of_file(config, to.flights, &policy);
  std::vector<bool> over(to.flights, false);
  while (!of_actor.over()) {
    of_actor.step();
    of_file.step();
    for (std::size_t i = 0; i < to.flights; ++i) {
      if (over[i]) continue;
      const auto& one = of_actor.fleet();
      const auto& other = of_file.fleet();
      const auto state = [i](const flight::Fleet<float>& fleet) {
        return std::pair(fleet.ended(i), fleet.handed_back(i));
      };
      const flight::Motion a = one.truth(i), b = other.truth(i);
      to.largest_distance_m = std::max(to.largest_distance_m,
                                       std::hypot(a.position_m[0] - b.position_m[0], a.position_m[1] - b.position_m[1],
                                                  a.position_m[2] - b.position_m[2]));
      over[i] = state(one) != std::pair(std::uint32_t{0}, false) || state(other) != std::pair(std::uint32_t{0}, false);
      if (over[i] && state(one) == state(other)) ++to.ended_alike;
    }
  }
  to.ended_alike += static_cast<std::size_t>(std::ranges::count(over, false));
}

}  // namespace

double ulp_between(float a, float b) {
  if (std::isnan(a) || std::isnan(b)) return std::numeric_limits<double>::infinity();
  return static_cast<double>(std::abs(ordered(a) - ordered(b)));
}

Agreement compare(const std::string& file, const std::string& runtime, const policy::Policy& policy,
                  const rollout::FlyConfig& config, const policy::PolicyNetwork& network,
                  const policy::PolicyVectors& vectors, std::size_t flights) {
  Agreement row{file, runtime};
  std::vector<float> action(vectors.action.size());
  policy.act(vectors.rows(), vectors.observation.data(), action.data());
  std::vector<double> ulp;
  for (std::size_t i = 0; i < action.size(); ++i) {
    ulp.push_back(ulp_between(action[i], vectors.action[i]));
    const float half = network.half[i % network.half.size()];
    const auto of_range = static_cast<double>(std::nextafter(half, INFINITY) - half);
    if (half > 0)
      row.largest_ulp_of_range =
          std::max(row.largest_ulp_of_range,
                   std::abs(static_cast<double>(action[i]) - static_cast<double>(vectors.action[i])) / of_range);
  }
  std::ranges::sort(ulp);
  row.outputs = ulp.size();
  row.differing = static_cast<std::size_t>(std::ranges::count_if(ulp, [](double x) { return x > 0; }));
  row.median_ulp = ulp[ulp.size() / 2];
  row.percentile_99_ulp = ulp[ulp.size() * 99 / 100];
  row.largest_ulp = ulp.back();
  row.flights = flights;
  compare_flights(row, config, policy);
  return row;
}

}  // namespace flappy::deploy
