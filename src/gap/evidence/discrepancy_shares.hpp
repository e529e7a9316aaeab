// Prior standard deviations of the coefficients of a regime basis, divided by the signal of their channel: shares. The
// model discrepancy has one table of shares, the session variation another.
#pragma once

#include <array>
#include <string>

#include "gap/replay/predicted_flight.hpp"
#include "io/config.hpp"

namespace flappy::gap {

/// [channel, those of a bench after those of the air][harmonic][kind of function].
using Shares =
    std::array<std::array<std::array<double, static_cast<std::size_t>(BasisFunction::count)>, kHarmonics + 1>,
               kSettingChannels>;

inline double share_of(const Shares& shares, int channel, int harmonic, BasisFunction function) {
  return shares[static_cast<std::size_t>(channel)][static_cast<std::size_t>(harmonic)]
               [static_cast<std::size_t>(function)];
}

/// Reads the tables [share.CHANNEL] of a file, or [share.all] for channels without one; of runs on a bench
/// [bench_share.CHANNEL], or what holds in the air. io::InputError with file and line.
Shares read_shares(const io::Table& root);
/// The text that read_shares reads.
std::string shares_text(const Shares& shares);
/// Comment in files after the entry `other` of [background_sd]. Learning does not change that entry.
inline constexpr const char* kOthers = "  # Of effects that are not listed. Choice.";

}  // namespace flappy::gap
