#include "flightlog/log_world.hpp"

#include <algorithm>

#include "model/linear_algebra.hpp"

namespace flappy::flightlog {

sim::World world_of(const FlightHeader& h) {
  sim::World world{h.gravity_m_s2, h.ambient.ground_z_m, h.ambient.ceiling_z_m, {}, {}};
  for (const LogWall& w : h.ambient.walls) world.walls.push_back({w.x_m, w.y_m, w.normal_x, w.normal_y});
  for (const auto& s : h.ambient.spheres) world.shapes.push_back(sim::sphere({s[0], s[1], s[2]}, s[3]));
  for (const auto& b : h.ambient.boxes) {
    world.shapes.push_back(sim::box({b[0], b[1], b[2]}, {b[3], b[4], b[5]}, {0, 0, 0}));
    std::copy_n(b.begin() + 6, 4, world.shapes.back().attitude);
  }
  for (const auto& c : h.ambient.cylinders)
    world.shapes.push_back(sim::cylinder({c[0], c[1], c[2]}, {c[3], c[4], c[5]}, c[6]));
  return world;
}

void add_solid(const sim::Shape& s, LogAmbient& ambient) {
  const double *c = s.centre_m, *q = s.attitude, *half = s.half_m;
  switch (s.kind) {
    case sim::Shape::Kind::sphere:
      ambient.spheres.push_back({c[0], c[1], c[2], half[0]});
      break;
    case sim::Shape::Kind::box:
      ambient.boxes.push_back({c[0], c[1], c[2], 2 * half[0], 2 * half[1], 2 * half[2], q[0], q[1], q[2], q[3]});
      break;
    case sim::Shape::Kind::cylinder:
      const auto R = model::rotation_matrix(model::Quaternion<double>{q[0], q[1], q[2], q[3]});
      const double x = half[2] * R.row_x.z, y = half[2] * R.row_y.z, z = half[2] * R.row_z.z;
      ambient.cylinders.push_back({c[0] - x, c[1] - y, c[2] - z, c[0] + x, c[1] + y, c[2] + z, half[0]});
      break;
  }
}

}  // namespace flappy::flightlog
