// How far the gap shrinks. E: mean over beats and channels of the Huber loss of residual over sd of noise, in flights held out.
//   closure = (E_refit - E_effect) / (E_refit - E_floor)
// E_floor: of normal noise alone.
#pragma once

#include <optional>
#include <vector>

#include "gap/localise/where.hpp"

namespace flappy::gap {

inline constexpr double kHuber = 1.345;
double huber_loss(double z);
/// Its mean over a standard normal z.
double huber_floor();

/// Losses of one hypothesis, summed over blocks of beats of one flight; empty where its vehicle came apart.
struct Losses {
  std::vector<double> sum, count;
  std::optional<double> mean() const;
};
Losses losses_of(const RowContext& around, const Residuals& residual);
/// Sd of the difference of two means, from its scatter over blocks.
double sd_of_difference(const Losses& a, const Losses& b);

/// Nothing where E_refit is not two of its standard deviations, by the same draws, above the floor.
std::optional<Closure> closure_of(const Losses& refit, const Losses& effect, double floor);

}  // namespace flappy::gap
