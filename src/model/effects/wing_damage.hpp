// A wing has lost a share of its area at the tip, by a straight cut at r_1, valid up to 0.3; this reduces its mass and
// the moments of its planform. With a linear chord, c = C (r00 + 12 (r11 - r00 / 2) (r - 1/2)), within 0.3 % of the
// shipped wings' moments, every moment loses its integral from r_1 to 1, by Gauss's rule with three points, exact for
// these powers. The lost membrane has the wing's mean mass per area, centred at mid-chord; the remaining edge is as
// stiff as before.
// [1] Muijres et al., Flies compensate for unilateral wing damage through modular adjustments of wing and body
// kinematics, Interface Focus 7, 20160103, 2017: force and moment scale with second and third moment of the area that
// is left.
#pragma once

#include "model/effects/effect.hpp"
#include "model/scalar.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct WingDamage {
  static constexpr EffectInfo kInfo{"wing_damage", Stage::body, 2, "asymmetry", "Muijres et al. 2017"};
  static constexpr std::array<EffectParameter, 2> kParameters{
      {{"left_area", 0, 0.3, 0.05, 0, 0.15}, {"right_area", 0, 0.3, 0, 0, 0.15}}};

  template <class V>
  static void vehicle(const double (&q)[2], V& v) {
    cut(q[0], v.left, 1);
    cut(q[1], v.right, -1);
  }

 private:
  static void cut(double share, auto& s, double side) {
    if (!(share > 0)) return;
    auto& w = s.planform;
    const double slope = 12 * (w.r11 - w.r00 / 2),
                 tip = w.r00 + slope / 2;  // chord and its slope at the tip, per mean chord
    const double lost = share * w.r00;
    const double depth = 2 * lost / (tip + sqrt(tip * tip - 2 * slope * lost));  // 1 - r_1: tip d - slope d^2/2 = lost
    auto& wing = s.wing;
    auto& i = wing.inertia_kg_m2;
    auto& com = wing.com_m;
    const double m = wing.mass_kg, per_area = m / w.r00, root = w.r00 - slope / 2;
    const double half = (i.xx + i.yy + i.zz) / 2, xx = half - i.xx;
    double y = m * com.y, z = m * com.z;
    double yy = half - i.yy + m * com.y * com.y, zz = half - i.zz + m * com.z * com.z, yz = -i.yz + m * com.y * com.z;
    for (int k = -1; k <= 1; ++k) {
      const double r = 1 - depth / 2 * (1 - k * 0.77459666924148338);  // sqrt(3/5)
      const double weight = depth / 18 * (k == 0 ? 8 : 5), c = root + slope * r, area = weight * c, area2 = area * c;
      w.r00 -= area;
      w.r11 -= area * r;
      w.r22 -= area * r * r;
      w.r33 -= area * r * r * r;
      w.z_cp0 -= area2;
      w.z_cp1 -= area2 * r;
      w.z_cp2 -= area2 * r * r;
      w.z_rd -= area2 * c * c;
      const double dm = per_area * area, at_y = side * w.wing_length_m * r, chord = w.mean_chord_m * c;
      wing.mass_kg -= dm;
      y -= dm * at_y;
      z += dm * chord / 2;
      yy -= dm * at_y * at_y;
      zz -= dm * chord * chord / 3;
      yz += dm * at_y * chord / 2;
    }
    com = {m * com.x / wing.mass_kg, y / wing.mass_kg, z / wing.mass_kg};
    yy -= y * com.y;
    zz -= z * com.z;
    i.xx = yy + zz;
    i.yy = xx + zz;
    i.zz = xx + yy;
    i.yz = -(yz - y * com.z);
  }
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
