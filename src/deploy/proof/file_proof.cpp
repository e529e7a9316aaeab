#include "deploy/proof/file_proof.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace flappy::deploy {
namespace {

/// Integers that are ordered as floats are, and one apart where floats are neighbours.
std::int64_t ordered(float x) {
  const auto bits = std::bit_cast<std::int32_t>(x);
  return bits < 0 ? std::int64_t{INT32_MIN} - bits : bits;
}

}  // namespace

double ulp_between(float a, float b) {
  if (std::isnan(a) || std::isnan(b)) return std::numeric_limits<double>::infinity();
  return static_cast<double>(std::abs(ordered(a) - ordered(b)));
}

Agreement compare(const std::string& file, const std::string& runtime, const policy::Policy& policy,
                  const std::vector<float>& half, const policy::PolicyVectors& vectors) {
  Agreement row{file, runtime};
  std::vector<float> action(vectors.action.size());
  policy.act(vectors.rows(), vectors.observation.data(), action.data());
  std::vector<double> ulp;
  for (std::size_t i = 0; i < action.size(); ++i) {
    ulp.push_back(ulp_between(action[i], vectors.action[i]));
    const float reach = half[i % half.size()];
    const auto of_range = static_cast<double>(std::nextafter(reach, INFINITY) - reach);
    if (reach > 0)
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
  return row;
}

void ask_far_out(Agreement& row, const policy::Policy& policy, const policy::PolicyNetwork& network,
                 const policy::PolicyVectors& vectors) {
  std::vector<float> action(vectors.action.size());
  policy.act(vectors.rows(), vectors.observation.data(), action.data());
  for (std::size_t i = 0; i < action.size(); ++i) {
    const std::size_t k = i % static_cast<std::size_t>(network.outputs());
    if (k >= network.half.size()) continue;  // the memory may be at the end of its range
    const float low = network.middle[k] - network.half[k], high = network.middle[k] + network.half[k];
    row.saturated += vectors.action[i] <= low || vectors.action[i] >= high;
    row.beyond_range += !(action[i] >= low && action[i] <= high);
  }
}

}  // namespace flappy::deploy
