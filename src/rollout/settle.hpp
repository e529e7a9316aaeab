// Settled flappers: each vehicle is released in the air and hovers until its controller has learnt its trim.
#pragma once

#include <functional>

#include "flight/fleet.hpp"

namespace flappy::rollout {

inline constexpr double kHover_s = 3;  // long enough for a controller to learn its trim

/// Snapshots of `count` vehicles after `seconds` of hover, each at a phase of the wing beat of its own. `options`: sensors,
/// controller and world of the flights to come; its task is not used. Bytes depend on the vehicles, the options and the
/// number of each flapper alone.
template <class T>
std::vector<flight::Snapshot<T>> settle(const flight::FleetOptions& options, std::size_t count, double seconds,
                                        const std::function<model::Vehicle(std::uint32_t flapper)>& vehicle);

extern template std::vector<flight::Snapshot<float>> settle(const flight::FleetOptions&, std::size_t, double,
                                                            const std::function<model::Vehicle(std::uint32_t)>&);
extern template std::vector<flight::Snapshot<double>> settle(const flight::FleetOptions&, std::size_t, double,
                                                             const std::function<model::Vehicle(std::uint32_t)>&);

}  // namespace flappy::rollout
