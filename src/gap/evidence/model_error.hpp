// What every model of a flapping wing gets wrong, before anything is known of a vehicle: how much two good models of one differ.
// Found between this simulator and the blind robot on 18 development robots without any effect, after the fit of
// parameters: the variances that make their residuals most probable (expectation-maximisation), a quarter larger in sd.
// Figures are of each kind of function, channel and harmonic, pooled over both phases and all robots.
#pragma once

#include <string>

#include "gap/replay/carry.hpp"

namespace flappy::gap {

/// Kinds of functions of the regime (gap/evidence.hpp).
enum class Function {
  constant,
  input,
  rate,
  product,
  place,
  velocity_x,
  velocity_y,
  velocity_z,
  square_x,
  square_y,
  square_z
};

/// Sd of the coefficient of such a function in every model, as a share of the channel's signal.
double mistaken_share(int channel, int harmonic, Function function);

/// Every real vehicle has a little of every effect, or of something that looks like it: sd of the coordinates of its sizes
/// (gap/hypothesis.hpp), with which the residuals of 23 further development robots without any are most probable. Only more
/// than that is an effect.
double background_sd(const std::string& effect);

/// How much more or less than usual models may be mistaken about a vehicle, and how often that is so.
struct Mistaken {
  double factor, probability;
};
inline constexpr Mistaken kMistaken[] = {{0.7, 0.25}, {1, 0.35}, {1.4, 0.25}, {2, 0.1}, {4, 0.05}};

/// How well an entry's equation describes the effect of its name: sd of every coefficient as a share of its own.
inline constexpr double kFormError = 0.3;

}  // namespace flappy::gap
