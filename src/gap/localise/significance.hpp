// Whether what beats show could be noise alone. Noise remembers the beats before; so nothing here takes beats for independent:
// sums over blocks of beats are, up to their next neighbours.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

namespace flappy::gap {

/// The block of each beat of flights that stand one behind the other: neighbours in time have consecutive numbers, and
/// flights are far apart.
std::vector<int> blocks_of(const std::vector<std::size_t>& beats, int length);

struct FittedSlope {
  double slope = 0, p_value = 1;
};
/// Least squares of y = slope x, tested against 0. The slope's variance is that of sums of x (y - slope x) over blocks, and
/// of neighbouring blocks, in full, where they agree (Hansen and Hodrick 1980; Newey and West 1987 give them half); memory far
/// beyond a block makes it too small. Blocks count by how much of x they hold (1 / sum of their squared shares: Carter, Schnepel, Steigerwald 2017); nothing with fewer than five. With x = 1 in some beats and 0 in others this tests their mean.
std::optional<FittedSlope> slope_test(const std::vector<double>& x, const std::vector<double>& y,
                                      const std::vector<int>& block);

struct Whiteness {
  double rms = 0;  ///< of the blocks' means
  double p_value = 1;
};
/// Ljung and Box 1978 on the means of blocks, over kWhitenessLags of them; nothing with fewer than 20.
inline constexpr int kWhitenessLags = 6;
std::optional<Whiteness> whiteness_test(const std::vector<double>& y, const std::vector<int>& block);

/// Squares by frequency, in bands of a periodogram.
struct Bands {
  std::vector<double> power;  ///< without the mean, they add up to the sum of squares
  std::vector<std::size_t> bins;
};
/// Adds those of one flight's beats, 0 where there are none, in bands that end at `ends_Hz`.
void add_bands(const std::vector<double>& y, double beats_Hz, const std::vector<double>& ends_Hz, Bands& to);

/// Which of the tests are discoveries when a share of at most `rate` of these may be false (Benjamini and Hochberg 1995).
std::vector<char> discoveries(const std::vector<double>& p_values, double rate);

}  // namespace flappy::gap
