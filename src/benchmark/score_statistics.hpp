// Scores with confidence intervals from a limited number of cases.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

namespace flappy::benchmark {

/// A score with its 95 % interval; without a value if no case counts for it.
struct ScoreValue {
  std::optional<double> value;
  double low = 0, high = 0;
  std::size_t count = 0;  ///< number of cases
};

/// Share of `successes` in `count`, with Wilson's interval (Wilson, J. Am. Stat. Assoc. 22, 1927).
ScoreValue proportion(std::size_t successes, std::size_t count);

/// A statistic of `count` cases, with the percentile interval of 2,000 resamples of cases (Efron 1981), which are the same in every run.
/// `statistic` gets the indices of the cases, and returns none if it has no value for them.
ScoreValue resampled(std::size_t count,
                     const std::function<std::optional<double>(const std::vector<std::size_t>&)>& statistic);

/// A stated probability, and whether the statement was right.
struct Claim {
  double probability = 0;
  bool right = false;
};

/// Expected calibration error over 10 bins of equal mass (fewer bins if there are fewer claims), with its bias removed. In a bin, let d be the mean
/// probability less the share of right claims, and s^2 = share (1 - share) / claims the variance of that share. The mean of |d| is too large by the
/// expected excess of |N(d, s)| over |d|, which is subtracted. Kumar, Liang, Ma (NeurIPS 2019) subtract s^2 from the squared error; here the folded
/// normal does the same for the absolute error. Where claims are calibrated, 0.47 s of 0.80 s is left. At least 0; 0 without claims.
/// Claims of equal probability count as their mean, so that their order does not matter.
double calibration_error(const std::vector<Claim>& claims);

/// calibration_error with the interval of 2,000 resamples, shifted so that their mean is the score: resampled shares have the sampling error twice.
ScoreValue calibration_score(const std::vector<Claim>& claims);

}  // namespace flappy::benchmark
