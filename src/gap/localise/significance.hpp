// Tests of whether residuals could be noise alone, for where.hpp. Noise is correlated over beats, so only sums over
// blocks of beats count as independent, except those of neighbouring blocks.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

namespace flappy::gap {

/// Block number of each beat, all flights in a row. `beats`: [flight] number of beats; `length`: beats in a block.
/// Numbers are consecutive in time; those of different flights are more than kWhitenessLags apart, so none are
/// neighbours.
std::vector<int> blocks_of(const std::vector<std::size_t>& beats, int length);

struct FittedSlope {
  double slope = 0, p_value = 1;
};
/// Least squares of y = slope x, and a t test of slope 0. Variance: sums of x (y - slope x) over blocks, plus the full
/// covariance of neighbours where positive (Hansen and Hodrick 1980; Newey and West 1987: half); correlation far beyond
/// a block makes it too small. Effective blocks: 1 / sum of squared shares of x^2 (Carter, Schnepel, Steigerwald 2017);
/// none below five, or if x is 0. With x = 1 in some beats, else 0, tests the mean of y there. `x`, `y`, `block`:
/// [beat].
std::optional<FittedSlope> slope_test(const std::vector<double>& x, const std::vector<double>& y,
                                      const std::vector<int>& block);

struct Whiteness {
  double rms = 0;  ///< root mean square of the block means
  double p_value = 1;
};
/// Number of lags in the test of whiteness. Choice.
inline constexpr int kWhitenessLags = 6;
/// Test of Ljung and Box 1978 on block means, over kWhitenessLags lags; none with too few blocks. `y`, `block`: [beat].
std::optional<Whiteness> whiteness_test(const std::vector<double>& y, const std::vector<int>& block);

struct Bands {
  std::vector<double> power;      ///< [band]; all bands add up to the sum of squares about the mean
  std::vector<std::size_t> bins;  ///< [band] number of frequencies
};
/// Adds the periodogram of one flight to the bands, which end at `ends_Hz`, rising. `y`: [beat], 0 in beats without a
/// row.
void add_bands(const std::vector<double>& y, double beats_Hz, const std::vector<double>& ends_Hz, Bands& to);

/// [test] Whether it is a discovery, if at most a share `rate` of all discoveries may be false (Benjamini and Hochberg
/// 1995).
std::vector<char> discoveries(const std::vector<double>& p_values, double rate);

}  // namespace flappy::gap
