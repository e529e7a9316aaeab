// What surrounds the flappers, the same for a whole batch, and what can become of them in it.
#pragma once

#include <cstdint>
#include <vector>

namespace flappy::sim {

/// A vertical wall through (x, y); its normal points into the free space and has length 1.
struct Wall {
  double x_m = 0, y_m = 0, normal_x = 1, normal_y = 0;
};

/// A solid that stands in the room, in a frame of its own.
struct Shape {
  enum class Kind { sphere, box, cylinder } kind = Kind::sphere;
  double centre_m[3] = {0, 0, 0};     ///< in W
  double attitude[4] = {1, 0, 0, 0};  ///< w, x, y, z, from its frame to W
  /// Radius of a sphere; half the edges of a box; radius, radius and half the length of a cylinder, whose axis is its z.
  double half_m[3] = {0, 0, 0};
};

/// All figures in W; the box is turned by a rotation vector, rad, the cylinder's axis goes from the one point to the other.
Shape sphere(const double (&centre_m)[3], double radius_m);
Shape box(const double (&centre_m)[3], const double (&edges_m)[3], const double (&rotation_rad)[3]);
Shape cylinder(const double (&from_m)[3], const double (&to_m)[3], double radius_m);

/// The defaults stand for "none": far away.
struct World {
  double gravity_m_s2 = 9.81;
  double ground_z_m = -1e3;
  double ceiling_z_m = 1e3;
  std::vector<Wall> walls;
  std::vector<Shape> shapes;
};

/// Why a flapper is no ordinary one; bits of Batch::status().
enum Status : std::uint32_t {
  kFrozen = 1,         ///< left the finite or the plausible: keeps its last plausible state until it is reset
  kTouchedGround = 2,  ///< in flight, since its last reset
  kTouchedCeiling = 4,
  kTouchedWall = 8,
  kTouchedShape = 16,
  kTouching = 32,  ///< now, with a point of contact
};

}  // namespace flappy::sim
