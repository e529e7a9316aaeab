// Surroundings of the flappers, the same for a whole batch, and the status bits that they cause.
#pragma once

#include <cstdint>
#include <vector>

namespace flappy::sim {

/// A vertical wall through (x, y); its normal points into the free space and has length 1.
struct Wall {
  double x_m = 0, y_m = 0, normal_x = 1, normal_y = 0;
};

/// A solid obstacle, in its own frame.
struct Shape {
  enum class Kind { sphere, box, cylinder } kind = Kind::sphere;
  double centre_m[3] = {0, 0, 0};     ///< w, x, y, z, from its frame to W
  double attitude[4] = {1, 0, 0, 0};  ///< w, x, y, z, from its frame to W
  /// Radius of a sphere; half the edges of a box; radius, radius and half the length of a cylinder about its z axis.
  double half_m[3] = {0, 0, 0};
};

/// All arguments in W. The box is turned by a rotation vector, rad; the axis of the cylinder runs from the one point to
/// the other.
Shape sphere(const double (&centre_m)[3], double radius_m);
Shape box(const double (&centre_m)[3], const double (&edges_m)[3], const double (&rotation_rad)[3]);
Shape cylinder(const double (&from_m)[3], const double (&to_m)[3], double radius_m);

/// The defaults mean "none": surfaces far away.
struct World {
  double gravity_m_s2 = 9.81;
  double ground_z_m = -1e3;
  double ceiling_z_m = 1e3;
  std::vector<Wall> walls;
  std::vector<Shape> shapes;
  /// Whether the ground is somewhere else than at its default, which nothing reaches.
  bool has_ground() const { return ground_z_m > World{}.ground_z_m; }
};

/// Bits of Batch::status().
enum Status : std::uint32_t {
  kFrozen = 1,         ///< non-finite or implausible: keeps its last plausible state until it is reset
  kTouchedGround = 2,  ///< in flight, since the last reset
  kTouchedCeiling = 4,
  kTouchedWall = 8,
  kTouchedShape = 16,
  kTouching = 32,  ///< a point of contact touches a surface now
};

}  // namespace flappy::sim
