// Where the residuals are more than noise: by channel, by what the vehicle did, by frequency.
//
// A table has one line for each test of one channel; rms of its rows over the noise's, and how probable noise alone is:
//   channel     all beats
//   regime      a third of the beats: low, middle and high ones of height, speed, ...
//   phase       mean or one harmonic of the beats: where in the stroke
//   frequency   a band of the beats' means, against the highest band and the spectrum of noise that remembers one beat
//   input       what is proportional to an input
//   whiteness   whether blocks of beats remember the blocks before; not of motion capture, whose rows are differences
// The first three and inputs test mean rows in blocks of beats (gap/significance.hpp), the most telling coefficient of a channel standing for
// all (Bonferroni). Among all tests of a stage false discoveries are held to kFalseDiscoveries.
#pragma once

#include <string>
#include <vector>

#include "gap/evidence/evidence.hpp"
#include "gap/result/diagnosis.hpp"

namespace flappy::gap {

inline constexpr double kFalseDiscoveries = 0.05;

constexpr std::size_t group_of(int channel, int coefficient) {
  return static_cast<std::size_t>(channel) * kCoefficients + static_cast<std::size_t>(coefficient);
}

/// What beats are sorted by, [flight][beat].
struct Quantity {
  std::string name, unit;
  std::vector<std::vector<double>> values;
};

/// What rows of flights lie in.
struct RowContext {
  std::vector<std::size_t> beats;          ///< of each flight
  std::vector<double> beats_Hz;            ///< of each flight
  std::vector<std::vector<char>> covered;  ///< [flight][beat][channel]
  std::vector<Quantity> regimes, inputs;
  std::vector<char> rows;        ///< [group]: whether there are any
  std::vector<double> noise_sd;  ///< [group]
  bool has_rows(int channel, int coefficient) const { return rows[group_of(channel, coefficient)] != 0; }
  bool covers(std::size_t flight, std::size_t beat, int channel) const {
    return covered[flight][beat * kChannels + static_cast<std::size_t>(channel)] != 0;
  }
};
RowContext row_context_of(const Flights& flights, std::vector<double> noise_sd);

/// All rows of the table of a stage. `residual`: [flight], empty where the vehicle came apart. Of an input, `gap` and `noise_floor` are of what
/// is proportional to it.
std::vector<ResidualLocation> locate(const RowContext& around, const Residuals& residual, Stage stage);

}  // namespace flappy::gap
