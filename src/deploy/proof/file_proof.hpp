// How policy.pt and policy.onnx act next to the float actor. Their runtimes add in another order, so last bits differ.
#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "policy/policy.hpp"
#include "policy/policy_network.hpp"

namespace flappy::deploy {

struct Agreement {
  std::string file, runtime;
  /// Outputs of the same observations. A difference in units in the last place (ulp) of the actor's output; in those of
  /// half the output's range, which do not grow where an output crosses 0.
  std::size_t outputs = 0, differing = 0;
  double median_ulp = 0, percentile_99_ulp = 0, largest_ulp = 0, largest_ulp_of_range = 0;
  /// Of saturating(): outputs that the network has at an end of their range, and those of the file beyond it.
  std::size_t saturated = 0, beyond_range = 0;
  std::size_t flights = 0, ended_alike = 0;  ///< as fly_beside() (policy_vectors.hpp) finds them
  double largest_distance_m = 0;
};

/// Compares outputs alone. `half`: of each output's range (output_half()); `vectors`: with the actor's actions.
Agreement compare(const std::string& file, const std::string& runtime, const policy::Policy& policy,
                  const std::vector<float>& half, const policy::PolicyVectors& vectors);

/// Fills in `saturated` and `beyond_range` of a row.
void ask_far_out(Agreement& row, const policy::Policy& policy, const policy::PolicyNetwork& network,
                 const policy::PolicyVectors& vectors);

/// Number of floats from `a` to `b`; infinite where one is NaN.
double ulp_between(float a, float b);

/// A text table for a terminal of 100 columns.
std::string table_of(const std::vector<Agreement>& rows);
nlohmann::ordered_json json_of(const std::vector<Agreement>& rows);

}  // namespace flappy::deploy
