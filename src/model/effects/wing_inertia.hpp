// Wings whose centre of mass lies `chord_m` farther from the leading edge than in the file, with another product of
// inertia between span and chord; moments about the centre of mass are unchanged. Exact. Strokes then also turn the
// wing:
//   left: I_yz + product sqrt(I_yy I_zz)     right: the mirror image, with the other sign
// [1] Whitney, Wood, Aeromechanics of passive rotation in flapping flight, J. Fluid Mech. 660, 2010, sec. 2: the
// products of inertia drive passive rotation.
#pragma once

#include "model/effects/effect.hpp"
#include "model/scalar.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct WingInertiaShape {
  static constexpr EffectInfo kInfo{"wing_inertia", Stage::body, 2, "wing_inertia", "Whitney, Wood 2010"};
  static constexpr std::array<EffectParameter, 2> kParameters{
      {{"chord_m", -0.005, 0.005, 0.001, -0.003, 0.003}, {"product", -0.5, 0.5, 0.1, -0.3, 0.3}}};

  template <class V>
  static void vehicle(const double (&q)[2], V& v) {
    shape(q, v.left.wing, 1);
    shape(q, v.right.wing, -1);
  }

 private:
  static void shape(const double (&q)[2], auto& wing, double side) {
    auto& i = wing.inertia_kg_m2;
    wing.com_m.z -= q[0];
    i.yz += side * q[1] * sqrt(i.yy * i.zz);
  }
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
