// The contact law against its closed form, and distances to solids against what defines them.
#include "model/contact.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "vehicles.hpp"

namespace flappy::model {
namespace {

using Point = Vec3<double>;

Point unit(std::mt19937& random) {
  std::normal_distribution<double> normal;
  const Point p{normal(random), normal(random), normal(random)};
  return (1 / std::sqrt(dot(p, p))) * p;
}

/// The nearest of all points of a surface, by brute force.
double nearest(const std::vector<Point>& surface, const Point& p) {
  double least = 1e9;
  for (const Point& s : surface) least = std::min(least, dot(p - s, p - s));
  return std::sqrt(least);
}

/// A distance is right where it is that to the nearest point of the surface, negative inside; its normal where a step along it
/// changes the distance by as much.
void check(const std::function<Gap<double>(const Point&)>& gap, const std::function<bool(const Point&)>& inside,
           const std::vector<Point>& surface, double spacing_m) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> place(-2, 2);
  int within = 0;
  for (int i = 0; i < 400; ++i) {
    const Point p{place(random), place(random), place(random)};
    const Gap<double> g = gap(p);
    const bool in = inside(p);
    within += in;
    EXPECT_EQ(g.distance_m < 0, in);
    // the nearest sample is at most half a cell's diagonal beside the nearest point
    EXPECT_NEAR(std::abs(g.distance_m), nearest(surface, p), spacing_m * spacing_m / std::abs(g.distance_m) + 1e-9);
    EXPECT_NEAR(dot(g.normal, g.normal), 1, 1e-12);
    constexpr double kStep_m = 1e-7;
    EXPECT_NEAR(gap(p + kStep_m * g.normal).distance_m - g.distance_m, kStep_m, 1e-3 * kStep_m);
  }
  EXPECT_GT(within, 5);
}

TEST(Gap, SphereHasDistanceSignAndNormal) {
  std::mt19937 random(3);
  constexpr double kRadius_m = 0.9;
  std::vector<Point> surface;
  for (int i = 0; i < 40000; ++i) surface.push_back(kRadius_m * unit(random));
  check([&](const Point& p) { return gap_to_sphere(p, kRadius_m); },
        [&](const Point& p) { return dot(p, p) < kRadius_m * kRadius_m; }, surface, 0.06);
  EXPECT_EQ(gap_to_sphere(Point{0, 0, 0}, 2.0).distance_m, -2);
  EXPECT_EQ(gap_to_sphere(Point{0, 0, 0}, 2.0).normal.z, 1);
}

TEST(Gap, BoxHasDistanceSignAndNormal) {
  constexpr Point kHalf{0.5, 1.1, 0.8};
  constexpr int kCells = 60;
  std::vector<Point> surface;
  for (int i = 0; i <= kCells; ++i)
    for (int j = 0; j <= kCells; ++j)
      for (const double side : {-1.0, 1.0}) {
        const double a = 2.0 * i / kCells - 1, b = 2.0 * j / kCells - 1;
        surface.push_back({side * kHalf.x, a * kHalf.y, b * kHalf.z});
        surface.push_back({a * kHalf.x, side * kHalf.y, b * kHalf.z});
        surface.push_back({a * kHalf.x, b * kHalf.y, side * kHalf.z});
      }
  check([&](const Point& p) { return gap_to_box(p, kHalf); },
        [&](const Point& p) { return std::abs(p.x) < kHalf.x && std::abs(p.y) < kHalf.y && std::abs(p.z) < kHalf.z; },
        surface, 0.04);
  const Gap<double> corner = gap_to_box(Point{0.8, -1.5, 0.8}, kHalf);
  EXPECT_NEAR(corner.distance_m, 0.5, 1e-15);
  EXPECT_NEAR(corner.normal.x, 0.6, 1e-15);
  EXPECT_NEAR(corner.normal.y, -0.8, 1e-15);
  EXPECT_EQ(gap_to_box(Point{0, 0, 0}, kHalf).distance_m, -0.5);
}

TEST(Gap, CylinderHasDistanceSignAndNormal) {
  constexpr double kRadius_m = 0.7, kHalf_m = 1.2;
  constexpr int kCells = 120;
  std::vector<Point> surface;
  for (int i = 0; i < kCells; ++i)
    for (int j = 0; j <= kCells; ++j) {
      const double angle = 2 * 3.14159265358979 * i / kCells, share = 1.0 * j / kCells;
      const double c = std::cos(angle), s = std::sin(angle);
      surface.push_back({kRadius_m * c, kRadius_m * s, kHalf_m * (2 * share - 1)});
      for (const double end : {-1.0, 1.0})
        surface.push_back({share * kRadius_m * c, share * kRadius_m * s, end * kHalf_m});
    }
  check([&](const Point& p) { return gap_to_cylinder(p, kRadius_m, kHalf_m); },
        [&](const Point& p) { return p.x * p.x + p.y * p.y < kRadius_m * kRadius_m && std::abs(p.z) < kHalf_m; },
        surface, 0.04);
  EXPECT_EQ(gap_to_cylinder(Point{0, 0, 0.1}, kRadius_m, kHalf_m).distance_m, -kRadius_m);
  EXPECT_NEAR(gap_to_cylinder(Point{0, 1.0, 1.6}, kRadius_m, kHalf_m).distance_m, 0.5, 1e-15);
}

TEST(ContactForce, NeverPullsAndStaysWithinItsCone) {
  const ContactConstants<double> q{{0, 0, 0}, 100, 0.75, 0.5, 80, 0.4, 300, 0};
  const Gap<double> gap{-1e-3, {0, 0, 1}};
  constexpr double kStep_s = 250e-6;
  for (const double leaves_m_s : {1.0, 2.0, 50.0}) {
    Pressed<double> pressed = not_pressed<double>();
    EXPECT_TRUE(press(q, gap, false, Point{0.3, 0, leaves_m_s}, kStep_s, pressed));
    if (leaves_m_s < 1 / 0.75) EXPECT_GT(pressed.force_N.z, 0);
    else EXPECT_EQ(pressed.force_N.z, 0);
  }
  Pressed<double> apart = not_pressed<double>();
  EXPECT_FALSE(press(q, Gap<double>{1e-9, {0, 0, 1}}, false, Point{0, 0, -1}, kStep_s, apart));
  EXPECT_EQ(apart.force_N.z, 0);
  // dragged along, it resists with no more than friction times the normal force, along the surface and against the way
  Bristle<double> bristle{{0, 0, 0}, 0};
  for (int i = 0; i < 400; ++i) {
    const Point p{1e-6 * i, 2e-6 * i, -1e-3}, v{1e-6 / kStep_s, 2e-6 / kStep_s, 0};
    Pressed<double> pressed = not_pressed<double>();
    press(q, gap, false, v, kStep_s, pressed);
    const Point force = contact_force(q, pressed, p, v, kStep_s, bristle);
    EXPECT_LE(std::hypot(force.x, force.y), 0.5 * pressed.normal_N * (1 + 1e-12));
    EXPECT_NEAR(force.y, 2 * force.x, 1e-12);
    EXPECT_LE(force.x, 0);
    EXPECT_EQ(force.z, pressed.force_N.z);
    EXPECT_EQ(bristle.state, 1);
    if (i == 399) EXPECT_NEAR(std::hypot(force.x, force.y), 0.5 * pressed.normal_N, 1e-12);
  }
}

TEST(ContactFault, FindsThePointThatIsTooStiffForItsBody) {
  Vehicle v = test::nominal();
  constexpr double kStep_s = 250e-6;
  EXPECT_FALSE(contact_fault(v, kStep_s));
  v.contact = {{"foot", ContactPoint::Body::torso, {0, 0, -0.03}, 400, 0.5, 0.6, 0},
               {"tip", ContactPoint::Body::left_leading_edge, {0, 0.07, 0}, 100, 0.5, 0.3, 0}};
  EXPECT_FALSE(contact_fault(v, kStep_s));
  v.contact[1].stiffness_N_m = 1000;
  const auto fault = contact_fault(v, kStep_s);
  ASSERT_TRUE(fault);
  EXPECT_EQ(fault->path, "contact.tip.stiffness_N_m");
  EXPECT_FALSE(contact_fault(v, kStep_s / 4)) << "omega^2 h^2 falls with h^2";
  // of a point at the centre of mass, h^2 k/m
  v.contact = {{"foot", ContactPoint::Body::torso, v.torso.com_m, v.torso.mass_kg / (kStep_s * kStep_s), 0, 0, 0}};
  EXPECT_TRUE(contact_fault(v, kStep_s, 1 - 1e-9));
  EXPECT_FALSE(contact_fault(v, kStep_s, 1 + 1e-9));
}

}  // namespace
}  // namespace flappy::model
