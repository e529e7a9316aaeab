// The force map: the mean aerodynamic wrench over whole beats, torso welded, for each input. One batch simulates all, a
// lane for each vehicle and input.
//
// Wings start from rest and settle for kSettle_s. The mean is exact only over a whole number of beats and of the
// driver's holds, because the driver refreshes its voltage every hold_s (errors: tests/identify/force_map_test.cpp). At
// 34 Hz and 1 ms, 17 beats are exactly 500 holds, 0.5 s: the paper's average. Other drivers use the 10 to 20 beats
// nearest to a whole number of holds, rounded to whole steps, which changes the mean by at most 1/2 step / window:
// 1.7e-4 of the wrench's swing.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "flappy/batch.hpp"

namespace flappy::identify {

inline constexpr int kChannels = 6;
/// Force x, y, z in N, torque x, y, z in N m, in B.
using Wrench = std::array<double, kChannels>;

/// Settling time. Twice this time changes every map by less than 0.1 %.
inline constexpr double kSettle_s = 0.3;
inline constexpr double kStep_s = 1e-4;

struct MapOptions {
  model::Triple moment_point_m;  ///< reference point of the torques, in B from the torso origin
  double settle_s = kSettle_s;
  int threads = 0;  ///< 0: one for each processor
  std::string instruction_set;
};

struct Window {
  int beats, steps;
};
Window whole_beats(const model::Driver& driver);

/// Number of steps for the wings to settle from rest: a whole number of holds, at least `settle_s`.
int settle_steps(const model::Driver& driver, double settle_s);

/// Force maps, [vehicle][input]; all vehicles need the same driver. NaN where a simulation leaves the plausible range.
/// Bit-identical for all numbers of threads and instruction sets.
template <class T>
std::vector<Wrench> force_map(std::span<const model::Vehicle> vehicles, std::span<const sim::Input> inputs,
                              const MapOptions& options = {});

extern template std::vector<Wrench> force_map<float>(std::span<const model::Vehicle>, std::span<const sim::Input>,
                                                     const MapOptions&);
extern template std::vector<Wrench> force_map<double>(std::span<const model::Vehicle>, std::span<const sim::Input>,
                                                      const MapOptions&);

/// The batch that force_map() steps: torso welded, wings at rest, lanes [vehicle][input].
template <class T>
sim::Batch<T> welded_batch(std::span<const model::Vehicle> vehicles, std::span<const sim::Input> inputs,
                           const MapOptions& options);

/// Mean aerodynamic wrench between two readings of the impulse that are `seconds` apart, torques about `point`.
Wrench mean_wrench(const sim::HeldImpulse& before, const sim::HeldImpulse& after, double seconds,
                   const model::Triple& point);

/// Centre of mass of the vehicle from the torso origin, wings at zero.
model::Triple centre_of_mass(const model::Vehicle& vehicle);

}  // namespace flappy::identify
