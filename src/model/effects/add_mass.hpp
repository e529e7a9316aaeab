// A weight at a point of a rigid body. With m the weight, M the body's mass, and d from the body's centre of mass to the
// weight: M' = M + m, c' = c + m / M' d, I' = I + m M / M' (d . d 1 - d d^T), about the new centre of mass.
// [1] Goldstein, Classical Mechanics, ch. 5: the parallel axis theorem.
#pragma once

namespace flappy::model {
inline namespace FLAPPY_ISA {

/// `at`: position of the weight, m, in the frame of the body's centre of mass.
template <class Body>
void add_mass(double mass_kg, const double (&at)[3], Body& body) {
  const double all = body.mass_kg + mass_kg, reduced = body.mass_kg * mass_kg / all, share = mass_kg / all;
  const double d[3] = {at[0] - body.com_m.x, at[1] - body.com_m.y, at[2] - body.com_m.z};
  auto& i = body.inertia_kg_m2;
  i.xx += reduced * (d[1] * d[1] + d[2] * d[2]);
  i.yy += reduced * (d[0] * d[0] + d[2] * d[2]);
  i.zz += reduced * (d[0] * d[0] + d[1] * d[1]);
  i.xy -= reduced * d[0] * d[1];
  i.yz -= reduced * d[1] * d[2];
  i.xz -= reduced * d[0] * d[2];
  body.com_m = {body.com_m.x + share * d[0], body.com_m.y + share * d[1], body.com_m.z + share * d[2]};
  body.mass_kg = all;
}

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
