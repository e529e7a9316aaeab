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
RowContext row_context_of(const std::vector<PredictedFlight>& flights, std::vector<double> noise_sd);

/// One line. `gap` and `noise_floor`: rms of the rows, and what it would be of noise alone, in the channel's unit; of an input, of what is
/// proportional to it.
struct GapLocation {
  std::string stage, test;
  int channel = 0;
  std::string regime;
  double gap = 0, noise_floor = 0, p_value = 1;
  bool discovered = false;
};
const char* channel_unit(int channel);

/// All lines of one stage. `residual` may lack flights that a vehicle did not survive.
std::vector<GapLocation> locate(const RowContext& around, const Residuals& residual, const std::string& stage);

/// Of a stage, discoveries that say where, the largest beside its noise first.
std::vector<GapLocation> largest_discoveries(const std::vector<GapLocation>& places, const std::string& stage,
                                             std::size_t most);

}  // namespace flappy::gap
