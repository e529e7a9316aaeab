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

/// Expected calibration error over 10 bins of equal mass (fewer where there are fewer claims), its bias removed. With d the difference
/// in a bin of mean probability and share of right ones, and s^2 = share (1 - share) / claims the variance of that share, the mean
/// of |d| over claims is too large by what |N(d, s)| exceeds |d| in expectation; that is taken away (Kumar, Liang, Ma, NeurIPS 2019,
/// whose estimate of the squared error takes s^2 away; here of the absolute one, by the folded normal; where nothing is off, 0.47 s is left of 0.80 s). At least 0; 0 without claims.
/// Claims of one probability count as their mean, so that no order of theirs matters.
double calibration_error(const std::vector<Claim>& claims);

/// The same with the interval of 2,000 resamples, moved so that their mean is the figure: resampled shares err once more.
ScoreValue calibration_score(const std::vector<Claim>& claims);

}  // namespace flappy::benchmark
