// Tests of whether residuals could be noise alone, for where.hpp. Noise is correlated over beats. The tests therefore
// take sums over blocks of beats as independent, except those of neighbouring blocks.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

namespace flappy::gap {

/// [beat] Number of the beat's block, one flight after another. `beats`: [flight] number of beats; `length`: beats in a
/// block. Numbers are consecutive in time. Those of different flights differ by more than kWhitenessLags, so blocks of
/// different flights are never neighbours.
std::vector<int> blocks_of(const std::vector<std::size_t>& beats, int length);

struct FittedSlope {
  double slope = 0, p_value = 1;
};
/// Least squares of y = slope x, and a t test of whether the slope is 0. The variance of the slope comes from the sums
/// of x (y - slope x) over blocks, plus the full covariance of neighbouring blocks if that is positive (Hansen and
/// Hodrick 1980; Newey and West 1987 take half). It is too small if the correlation reaches far beyond a block. The
/// number of effective blocks is 1 / sum of the squared shares that blocks have in x^2 (Carter, Schnepel, Steigerwald
/// 2017); none if it is below five, or if x is 0. If x is 1 in some beats and else 0, this tests the mean of y in these
/// beats. `x`, `y`, `block`: [beat].
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

/// [test] Whether its p value is a discovery. Of all discoveries, at most the share `rate` is expected to be false
/// (Benjamini and Hochberg 1995).
std::vector<char> discoveries(const std::vector<double>& p_values, double rate);

}  // namespace flappy::gap
