#include "flappy/world.hpp"

#include <algorithm>
#include <cmath>

#include "model/math.hpp"

namespace flappy::sim {
Shape sphere(const double (&centre_m)[3], double radius_m) {
  Shape s;
  std::copy_n(centre_m, 3, s.centre_m);
  s.half_m[0] = radius_m;
  return s;
}

Shape box(const double (&centre_m)[3], const double (&edges_m)[3], const double (&rotation_rad)[3]) {
  Shape s;
  s.kind = Shape::Kind::box;
  std::copy_n(centre_m, 3, s.centre_m);
  for (int i = 0; i < 3; ++i) s.half_m[i] = edges_m[i] / 2;
  const double(&a)[3] = rotation_rad;
  const double angle = std::sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
  if (!(angle > 0)) return s;
  const auto half = model::sin_cos_wide(angle / 2);
  s.attitude[0] = half.cos;
  for (int i = 0; i < 3; ++i) s.attitude[i + 1] = half.sin * a[i] / angle;
  return s;
}

Shape cylinder(const double (&from_m)[3], const double (&to_m)[3], double radius_m) {
  Shape s;
  s.kind = Shape::Kind::cylinder;
  double z[3], length2 = 0;
  for (int i = 0; i < 3; ++i) {
    z[i] = to_m[i] - from_m[i];
    length2 += z[i] * z[i];
    s.centre_m[i] = (from_m[i] + to_m[i]) / 2;
  }
  const double length = std::sqrt(length2);
  s.half_m[0] = s.half_m[1] = radius_m;
  s.half_m[2] = length / 2;
  if (!(length > 0)) return s;
  for (double& c : z) c /= length;
  // the shortest turn that takes z of W to the axis a: (1 + z.a, z x a); half a turn about x if the axis points down
  const double norm = std::sqrt(2 * (1 + z[2]));
  const bool down = !(norm > 1e-6);
  s.attitude[0] = down ? 0 : norm / 2;
  s.attitude[1] = down ? 1 : -z[1] / norm;
  s.attitude[2] = down ? 0 : z[0] / norm;
  return s;
}

}  // namespace flappy::sim
