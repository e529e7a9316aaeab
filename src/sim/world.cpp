#include "flappy/world.hpp"

#include <algorithm>
#include <cmath>

#include "model/linear_algebra.hpp"
#include "model/math.hpp"

namespace flappy::sim {
namespace {

/// Puts three axes of length 1 in W, the columns, into a shape.
void put_axes(const double (&x)[3], const double (&y)[3], const double (&z)[3], Shape& shape) {
  for (int i = 0; i < 3; ++i) {
    shape.rotation[3 * i] = x[i];
    shape.rotation[3 * i + 1] = y[i];
    shape.rotation[3 * i + 2] = z[i];
  }
}

}  // namespace

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
  const double by = half.sin / angle;
  const auto m = model::rotation_matrix(model::Quaternion<double>{half.cos, by * a[0], by * a[1], by * a[2]});
  const double rows[9] = {m.row_x.x, m.row_x.y, m.row_x.z, m.row_y.x, m.row_y.y,
                          m.row_y.z, m.row_z.x, m.row_z.y, m.row_z.z};
  std::copy_n(rows, 9, s.rotation);
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
  // any direction across will do: that farthest from the axis among those of W, made normal to it
  const int least =
      static_cast<int>(std::min_element(z, z + 3, [](double a, double b) { return std::abs(a) < std::abs(b); }) - z);
  double x[3], norm2 = 0;
  for (int i = 0; i < 3; ++i) {
    x[i] = (i == least ? 1 : 0) - z[least] * z[i];
    norm2 += x[i] * x[i];
  }
  for (double& c : x) c /= std::sqrt(norm2);
  const double y[3] = {z[1] * x[2] - z[2] * x[1], z[2] * x[0] - z[0] * x[2], z[0] * x[1] - z[1] * x[0]};
  put_axes(x, y, z, s);
  return s;
}

}  // namespace flappy::sim
