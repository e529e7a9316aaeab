// Laws of a wing, against sums over a fine grid and against the published wing, whose file states what they predict.
#include "design/wing.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "vehicles.hpp"

namespace flappy::design {
namespace {

constexpr WingShape kShape{0.065, 0.02, 1.4, 0.9};

TEST(WingShape, ChordHasItsMeanAndItsEnds) {
  EXPECT_DOUBLE_EQ(chord_at(kShape, 0), kShape.root_chord);
  EXPECT_DOUBLE_EQ(chord_at(kShape, 1), kShape.tip_chord);
  double mean = 0;
  for (int i = 0; i < 10000; ++i) mean += chord_at(kShape, (i + 0.5) / 10000) / 10000;
  EXPECT_NEAR(mean, 1, 1e-8);
}

TEST(WingShape, LeastChordIsFoundWithinTheSpan) {
  for (const WingShape& s : {kShape, WingShape{1, 1, 1.8, 1.6}, WingShape{1, 1, 0.3, 0.9}, WingShape{1, 1, 2, 0.5}}) {
    double least = 1e9;
    for (int i = 0; i <= 10000; ++i) least = std::min(least, chord_at(s, i / 10000.0));
    EXPECT_NEAR(least_chord(s), least, 1e-6);
  }
}

/// The file states moments of an outline that is none of ours: the simulator's, from a drawing.
TEST(WingShape, PredictsThePublishedMomentsToHalfAPerCent) {
  const model::Planform& p = test::nominal().left.planform;
  const model::Planform predicted = planform_of(shape_of(p), 5);
  const auto close = [](double a, double b) { EXPECT_NEAR(a / b, 1, 5e-3); };
  close(predicted.r33, p.r33);  // those that shape_of() did not take
  close(predicted.z_cp2, p.z_cp2);
  close(predicted.z_cp1, p.z_cp1);
  close(predicted.z_cp0, p.z_cp0);
  close(predicted.z_rd, p.z_rd);
  close(predicted.r22 * predicted.mean_chord_m, p.r22 * p.mean_chord_m);
  close(predicted.r11 * predicted.mean_chord_m, p.r11 * p.mean_chord_m);
}

TEST(Panel, MomentsAreThoseOfItsPoints) {
  const Panel panel{0.006, 0.002, 0.05};
  Mass sum;
  constexpr int kAlong = 2000, kDown = 200;
  const double step = (kShape.length_m - panel.hub_m) / kAlong;
  for (int i = 0; i < kAlong; ++i) {
    const double y = panel.hub_m + (i + 0.5) * step;
    for (const double width : {chord_at(kShape, y / kShape.length_m) * kShape.mean_chord_m, panel.sleeve_m})
      for (int k = 0; k < kDown; ++k)
        sum.add(point_mass(panel.kg_m2 * step * width / kDown, {0, -y, -(k + 0.5) * width / kDown}));
  }
  const Mass law = panel_of(kShape, panel, -1);
  EXPECT_NEAR(law.mass_kg / sum.mass_kg, 1, 1e-6);
  EXPECT_NEAR(law.first_kg_m.y / sum.first_kg_m.y, 1, 1e-5);
  EXPECT_NEAR(law.first_kg_m.z / sum.first_kg_m.z, 1, 1e-5);
  EXPECT_NEAR(law.second_kg_m2.yy / sum.second_kg_m2.yy, 1, 1e-5);
  EXPECT_NEAR(law.second_kg_m2.zz / sum.second_kg_m2.zz, 1, 1e-4);  // of the middles of 200 pieces
  EXPECT_NEAR(law.second_kg_m2.yz / sum.second_kg_m2.yz, 1, 1e-5);
}

/// Only the areal density is taken from the published wing: centre of mass and inertia about the hinges are predicted.
TEST(Panel, PredictsThePublishedWingWithinTenPerCent) {
  const model::Side& side = test::nominal().left;
  Panel panel{0.005, 0.002, 1};
  panel.kg_m2 = side.wing.mass_kg / panel_of(shape_of(side.planform), panel, 1).mass_kg;
  const Mass law = panel_of(shape_of(side.planform), panel, 1), published = mass_of(side.wing);
  const auto close = [](double a, double b) { EXPECT_NEAR(a / b, 1, 0.1) << a << " " << b; };
  close(law.first_kg_m.y, published.first_kg_m.y);
  close(law.first_kg_m.z, published.first_kg_m.z);
  close(law.second_kg_m2.yy, published.second_kg_m2.yy);  // about the stroke's axis
  close(law.second_kg_m2.zz, published.second_kg_m2.zz);  // about the rotation's
}

/// The published leading edge is a hub with a rod: what is far from the shoulder is the rod, which predicts nearly all.
TEST(Rod, PredictsThePublishedLeadingEdgeWithinTenPerCent) {
  const model::Side& side = test::nominal().left;
  const Mass rod = rod_of(side.planform.wing_length_m, 0.8e-3, 1500, 1);
  const double share = rod.second_kg_m2.yy / mass_of(side.leading_edge).second_kg_m2.yy;
  EXPECT_GT(share, 0.9);
  EXPECT_LT(share, 1);
}

TEST(Rod, BendsAsMuchInSharesOfItsLength) {
  // F R^3/(8 E I)/R for the same F and E
  const auto bent = [](double length, double diameter) { return length * length / std::pow(diameter, 4); };
  EXPECT_NEAR(bent(0.09, stiff_diameter_m(0.09, 0.07, 0.8e-3)), bent(0.07, 0.8e-3), 1e-6 * bent(0.07, 0.8e-3));
}

TEST(Mass, ReadsBackAsTheBody) {
  const model::RigidBody& b = test::nominal().torso;
  const model::RigidBody same = body_of(mass_of(b));
  EXPECT_DOUBLE_EQ(same.mass_kg, b.mass_kg);
  EXPECT_NEAR(same.com_m.z, b.com_m.z, 1e-15);
  for (double model::InertiaTensor::*i :
       {&model::InertiaTensor::xx, &model::InertiaTensor::yy, &model::InertiaTensor::zz, &model::InertiaTensor::xy,
        &model::InertiaTensor::yz, &model::InertiaTensor::xz})
    EXPECT_NEAR(same.inertia_kg_m2.*i, b.inertia_kg_m2.*i, 1e-20);
}

}  // namespace
}  // namespace flappy::design
