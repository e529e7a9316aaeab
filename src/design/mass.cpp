#include "design/mass.hpp"

namespace flappy::design {

Mass& Mass::add(const Mass& o, double f) {
  mass_kg += f * o.mass_kg;
  first_kg_m = first_kg_m + f * o.first_kg_m;
  const auto &a = second_kg_m2, &b = o.second_kg_m2;
  second_kg_m2 = {a.xx + f * b.xx, a.yy + f * b.yy, a.zz + f * b.zz, a.xy + f * b.xy, a.yz + f * b.yz, a.xz + f * b.xz};
  return *this;
}

Mass mass_of(const model::RigidBody& b) { return {b.mass_kg, model::first_moment(b), model::second_moment(b)}; }

Mass point_mass(double m, const model::Triple& r) {
  return {m,
          {m * r.x, m * r.y, m * r.z},
          {m * r.x * r.x, m * r.y * r.y, m * r.z * r.z, m * r.x * r.y, m * r.y * r.z, m * r.x * r.z}};
}

model::RigidBody body_of(const Mass& mass) {
  const double m = mass.mass_kg;
  const auto& P = mass.second_kg_m2;
  const model::Triple c{mass.first_kg_m.x / m, mass.first_kg_m.y / m, mass.first_kg_m.z / m};
  const double xx = P.xx - m * c.x * c.x, yy = P.yy - m * c.y * c.y, zz = P.zz - m * c.z * c.z;
  return {m, c, {yy + zz, xx + zz, xx + yy, m * c.x * c.y - P.xy, m * c.y * c.z - P.yz, m * c.x * c.z - P.xz}};
}

}  // namespace flappy::design
