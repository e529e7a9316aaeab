// Settled flappers: each vehicle is released in the air and hovers until its controller has learnt the trim.
#pragma once

#include <functional>

#include "flight/fleet.hpp"

namespace flappy::rollout {

inline constexpr double kHover_s = 3;  // long enough for a controller to learn its trim

/// Snapshots of `count` vehicles after `seconds` of hover, each at another phase of the beat. The task and shapes of
/// `options` are not used. A snapshot depends only on its vehicle, the options and its flapper's number.
template <class T>
std::vector<flight::Snapshot<T>> settle(const flight::FleetOptions& options, std::size_t count, double seconds,
                                        const std::function<model::Vehicle(std::uint32_t flapper)>& vehicle);

extern template std::vector<flight::Snapshot<float>> settle(const flight::FleetOptions&, std::size_t, double,
                                                            const std::function<model::Vehicle(std::uint32_t)>&);
extern template std::vector<flight::Snapshot<double>> settle(const flight::FleetOptions&, std::size_t, double,
                                                             const std::function<model::Vehicle(std::uint32_t)>&);

}  // namespace flappy::rollout
