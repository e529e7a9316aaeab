// The share of the closable gap that a hypothesis closes,
//   closure = (E_refit - E_effect) / (E_refit - E_floor)
// E: mean over beats and channels of the Huber loss of residual / noise standard deviation in held-out flights; refit:
// fitted parameters without effect; E_floor: normal noise alone.
#pragma once

#include <optional>
#include <vector>

#include "gap/localise/where.hpp"

namespace flappy::gap {

/// Where the Huber loss becomes linear, in standard deviations of the noise. Derived: 95 % efficient with normal noise.
inline constexpr double kHuber = 1.345;
double huber_loss(double z);
/// Mean of huber_loss over a standard normal z.
double huber_floor();

/// Losses of one hypothesis: sum and number in each block of consecutive beats; empty if the simulation diverged.
struct Losses {
  std::vector<double> sum, count;
  std::optional<double> mean() const;
};
Losses losses_of(const RowContext& around, const Residuals& residual);
/// Standard deviation of the difference of two mean losses, from its scatter over blocks.
double sd_of_difference(const Losses& a, const Losses& b);

/// The closure with its 90 % interval by resampled blocks. None if E_refit is less than two of its sd above the floor.
std::optional<Closure> closure_of(const Losses& refit, const Losses& effect, double floor);

}  // namespace flappy::gap
