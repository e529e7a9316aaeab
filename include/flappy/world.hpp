// What surrounds the flappers, the same for a whole batch, and what can become of them in it.
#pragma once

#include <cstdint>
#include <vector>

namespace flappy::sim {

/// A vertical wall through (x, y); its normal points into the free space and has length 1.
struct Wall {
  double x_m = 0, y_m = 0, normal_x = 1, normal_y = 0;
};

/// The defaults stand for "none": far away.
struct World {
  double gravity_m_s2 = 9.81;
  double ground_z_m = -1e3;
  double ceiling_z_m = 1e3;
  std::vector<Wall> walls;
};

/// Why a flapper is no ordinary one; bits of Batch::status().
enum Status : std::uint32_t {
  kFrozen = 1,         ///< left the finite or the plausible: keeps its last plausible state until it is reset
  kTouchedGround = 2,  ///< in flight, since its last reset
  kTouchedCeiling = 4,
  kTouchedWall = 8,
};

}  // namespace flappy::sim
