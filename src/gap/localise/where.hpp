// Locates residuals that exceed the noise, for the table of the report. The table has a row for each test of a channel.
// The row has the rms of residual and noise, and the p value of the hypothesis that the residual is noise alone. The
// tests:
//   channel     all beats
//   regime      a third of the beats: those with low, middle or high height, speed, ...
//   phase       the mean or one harmonic of the beat: where in the stroke
//   frequency   a frequency band of the beat means, compared with what the highest band and the spectrum of
//               autoregressive noise predict there
//   input       the part that is proportional to an input
//   whiteness   correlation between blocks of beats; not for path and rotate, whose rows are differences over beats
// The tests of channel, regime, phase and input use sums over blocks (significance.hpp). Their p value is the smallest
// one of the channel's coefficients times the number of these (Bonferroni). The false discovery rate is held to
// kFalseDiscoveries among the tests of one residual (Fitted).
#pragma once

#include <string>
#include <vector>

#include "gap/evidence/evidence.hpp"
#include "gap/result/diagnosis.hpp"

namespace flappy::gap {

/// False discovery rate among all tests of a stage. Choice.
inline constexpr double kFalseDiscoveries = 0.05;

/// Index of a coefficient of a channel among the rows of a beat.
constexpr std::size_t group_of(int channel, int coefficient) {
  return static_cast<std::size_t>(channel) * kCoefficients + static_cast<std::size_t>(coefficient);
}

/// A RegimeQuantity (gap/replay/predicted_flight.hpp) in all flights.
struct Quantity {
  std::string name, unit;
  std::vector<std::vector<double>> values;  ///< [flight][beat]
};

/// Properties of the flights whose residuals are tested: in a diagnosis, the test flights. [flight] is an index of
/// these.
struct RowContext {
  std::vector<std::size_t> beats;          ///< [flight] number of beats
  std::vector<double> beats_Hz;            ///< [flight]
  std::vector<char> clamped;               ///< [flight] whether the robot was clamped
  std::vector<std::vector<char>> covered;  ///< [flight][beat x kChannels + channel]
  std::vector<Quantity> regimes, inputs;   ///< those that all flights have
  std::vector<char> rows;                  ///< [row of a beat] whether a flight has it
  std::vector<double> noise_sd;            ///< [group] standard deviation of a row's noise (gap/evidence/evidence.hpp)
  bool has_rows(int channel, int coefficient) const { return rows[group_of(channel, coefficient)] != 0; }
  double noise_sd_of(bool on_bench, int channel, int coefficient) const {
    return noise_sd[(on_bench ? kRowsPerBeat : 0) + group_of(channel, coefficient)];
  }
  bool covers(std::size_t flight, std::size_t beat, int channel) const {
    return covered[flight][beat * kChannels + static_cast<std::size_t>(channel)] != 0;
  }
};
RowContext row_context_of(const FlightList& flights, std::vector<double> noise_sd);

/// All rows of the table for one residual. `residual`: [flight of `around`], empty where the simulation diverged.
/// `fitted`: what had been fitted, which the rows state. In the test of an input, `gap` and `noise_floor` are the rms
/// of the parts of residual and noise that are proportional to the input; in the test of whiteness, the rms of their
/// block means.
std::vector<ResidualLocation> locate(const RowContext& around, const TestResiduals& residual, Fitted fitted);

}  // namespace flappy::gap
