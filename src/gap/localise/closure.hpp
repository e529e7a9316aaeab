// Closure: the share of the closable gap that a hypothesis closes,
//   closure = (E_refit - E_effect) / (E_refit - E_floor)
// E: mean over beats and channels of the Huber loss of the residual over the standard deviation of the noise, in held-out flights; refit: with
// fitted parameters and no effect. E_floor: the loss of normal noise alone.
#pragma once

#include <optional>
#include <vector>

#include "gap/localise/where.hpp"

namespace flappy::gap {

inline constexpr double kHuber = 1.345;
double huber_loss(double z);
/// Mean of huber_loss over a standard normal z.
double huber_floor();

/// Losses of one hypothesis: sum and number of losses in each block of consecutive beats of a flight; empty if the simulation of its vehicle
/// diverged.
struct Losses {
  std::vector<double> sum, count;
  std::optional<double> mean() const;
};
Losses losses_of(const RowContext& around, const Residuals& residual);
/// Standard deviation of the difference of two mean losses, from the scatter of the difference over blocks.
double sd_of_difference(const Losses& a, const Losses& b);

/// The closure with its 90 % interval, by resampling of blocks. None if E_refit is less than two of its standard deviations, from the same
/// resamples, above the floor.
std::optional<Closure> closure_of(const Losses& refit, const Losses& effect, double floor);

}  // namespace flappy::gap
