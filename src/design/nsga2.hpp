// A generation of NSGA-II (Deb et al., IEEE T-EC 6, 2002), with pagmo's sorting, crowding distance and operators.
// Points are of the unit cube, objectives are minimised. pagmo's own generation (2.18) divides the crowding distance by
// the range of each objective in a front: where an objective does not vary, designs inside the front get 0/0, which
// ranks above its ends. Here such an objective is left out; where all vary, the bits are those of pagmo::nsga2.
#pragma once

#include <cstddef>
#include <vector>

namespace flappy::design {

using Points = std::vector<std::vector<double>>;

/// As many children as there are parents, a multiple of four.
Points children_of(const Points& parents, const Points& objectives, unsigned seed);

/// Which `count` points live on: whole fronts, and of the last one those that are least crowded.
std::vector<std::size_t> best_of(const Points& objectives, std::size_t count);

}  // namespace flappy::design
