// The force map of a vehicle: the mean aerodynamic wrench of its wings over whole beats, torso welded, for each input.
// Vehicles times inputs are the lanes of one batch.
//
// Wings start from rest and settle for kSettle_s. Two things make a mean over beats inexact, and both are bounded by the
// choice of the window (tests/identify/force_map_test.cpp measures them):
//   - the driver refreshes its voltage every hold_s, so beats repeat only once a whole number of them is a whole number of
//     holds. At 34 Hz and 1 ms that is 17 beats, 0.5 s, exactly: the paper's average;
//   - elsewhere the window is the number of beats, 10 to 20, that comes nearest to a whole number of holds, rounded to a
//     whole number of steps. The half step left over weighs the wrench of one instant by at most 1/2 step / window:
//     1.7e-4 of its swing about the mean.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "flappy/batch.hpp"

namespace flappy::identify {

inline constexpr int kChannels = 6;
/// Force x, y, z in N, torque x, y, z in N m, in B.
using Wrench = std::array<double, kChannels>;

/// Doubling it changes no map by 0.1 % of itself.
inline constexpr double kSettle_s = 0.3;
inline constexpr double kStep_s = 1e-4;

struct MapOptions {
  model::Triple moment_point_m;  ///< torques are about it, in B from the torso origin
  double settle_s = kSettle_s;
  int threads = 0;  ///< 0: one for each processor
  std::string instruction_set;
};

/// Whole beats, as physics steps.
struct Window {
  int beats, steps;
};
Window whole_beats(const model::Driver& driver);

/// Steps in which wings settle from rest: a whole number of holds, at least `settle_s`.
int settle_steps(const model::Driver& driver, double settle_s);

/// Maps of `vehicles`, one after the other, a wrench for each input. All vehicles have one driver. A lane that leaves the
/// plausible has NaN. Bytes do not depend on threads or instruction set.
template <class T>
std::vector<Wrench> force_map(std::span<const model::Vehicle> vehicles, std::span<const sim::Input> inputs,
                              const MapOptions& options = {});

extern template std::vector<Wrench> force_map<float>(std::span<const model::Vehicle>, std::span<const sim::Input>,
                                                     const MapOptions&);
extern template std::vector<Wrench> force_map<double>(std::span<const model::Vehicle>, std::span<const sim::Input>,
                                                      const MapOptions&);

/// A welded batch with wings from rest, a lane for each vehicle and input, as force_map steps it.
template <class T>
sim::Batch<T> welded_batch(std::span<const model::Vehicle> vehicles, std::span<const sim::Input> inputs,
                           const MapOptions& options);

/// What the air gave between two impulses, as a mean over `seconds`, with torques about `point`.
Wrench mean_wrench(const sim::HeldImpulse& before, const sim::HeldImpulse& after, double seconds,
                   const model::Triple& point);

/// Centre of mass of the vehicle from the torso origin, wings at zero.
model::Triple centre_of_mass(const model::Vehicle& vehicle);

}  // namespace flappy::identify
