// The share of the closable gap that a hypothesis closes,
//   closure = (E_refit - E_effect) / (E_refit - E_floor)
// E: mean over beats and channels of the Huber loss of residual / noise standard deviation in test flights held out.
// refit: fitted parameters without effects; effect: a hypothesis with effects; floor: normal noise alone.
#pragma once

#include <optional>
#include <vector>

#include "gap/localise/where.hpp"

namespace flappy::gap {

/// Where the Huber loss becomes linear, in standard deviations of the noise. Derived: 95 % efficient with normal noise.
inline constexpr double kHuber = 1.345;
/// z^2 / 2 up to kHuber, then linear.
double huber_loss(double z);
/// Mean of huber_loss over a standard normal z.
double huber_floor();

/// Losses of one hypothesis over all test flights.
struct Losses {
  std::vector<double> sum, count;  ///< [block of consecutive beats] sum and number; empty if a simulation diverged
  std::vector<char> clamped;       ///< [block] whether the robot was clamped
  /// Mean loss over the runs on a bench (true), over the flights (false), or over all. None: there are no losses.
  std::optional<double> mean(std::optional<bool> on_bench = {}) const;
};
/// The losses of a residual; empty if that of any flight is empty. `around`: of the test flights.
Losses losses_of(const RowContext& around, const TestResiduals& residual);
/// Standard deviation of the difference of two mean losses of the same flights, from the scatter of the difference over
/// blocks; 0 if one of the losses is empty.
double sd_of_difference(const Losses& a, const Losses& b);

/// The closure with its 90 % interval by resampled blocks. None if one of the losses is empty, or if E_refit is less
/// than two of its standard deviations above the floor. `floor`: huber_floor().
std::optional<Closure> closure_of(const Losses& refit, const Losses& effect, double floor);

}  // namespace flappy::gap
