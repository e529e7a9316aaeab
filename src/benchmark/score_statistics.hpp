// How sure a few dozen cases make one of a figure.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

namespace flappy::benchmark {

/// A figure with its 95 % interval; nothing where no case speaks of it.
struct ScoreValue {
  std::optional<double> value;
  double low = 0, high = 0;
  std::size_t count = 0;  ///< of cases
};

/// `successes` of `count`, with Wilson's interval (Wilson, J. Am. Stat. Assoc. 22, 1927).
ScoreValue proportion(std::size_t successes, std::size_t count);

/// A statistic of `count` cases, with the percentile interval of 2,000 resamples of cases (Efron 1981), the same ones every
/// time. `statistic` gets the cases' indices; nothing where it has no value.
ScoreValue resampled(std::size_t count,
                     const std::function<std::optional<double>(const std::vector<std::size_t>&)>& statistic);

/// A probability that was stated, and whether what it was stated of was so.
struct Claim {
  double probability = 0;
  bool right = false;
};

/// Expected calibration error: claims in the order of their probability are cut into 10 bins of equal count (fewer where
/// there are fewer claims); mean over claims of |mean probability - share of right ones| of their bin. 0 without claims.
double calibration_error(std::vector<Claim> claims);

/// What of the error of a perfectly calibrated predictor with the same probabilities lies below with 95 %: 2,000 draws.
double calibrated_error_95(std::vector<Claim> claims);

}  // namespace flappy::benchmark
