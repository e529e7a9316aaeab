// Points of contact in the step: impact against the closed form, rest, friction, energy, momentum, touches that motors feel.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "flappy/batch.hpp"
#include "model/contact.hpp"
#include "model/kane.hpp"
#include "vehicles.hpp"

namespace flappy::sim {
namespace {

using model::ContactPoint;
using test::Matrix3d;
using test::Vector3d;

constexpr double kGravity_m_s2 = 9.81;

/// A torso that is a block of 12 g, its wings a speck: what a rigid body does.
model::Vehicle block() {
  model::Vehicle v = test::nominal();
  v.air_density_kg_m3 = 0;
  v.torso.mass_kg = 0.012;
  v.torso.com_m = {};
  v.torso.inertia_kg_m2 = {4e-6, 4e-6, 6e-6, 0, 0, 0};
  for (model::Side* s : {&v.left, &v.right})
    for (model::RigidBody* b : {&s->leading_edge, &s->wing}) *b = {1e-9, {}, {1e-15, 1e-15, 1e-15, 0, 0, 0}};
  return v;
}

/// Points at its corners.
model::Vehicle block_on_corners(double friction, double damping_s_m = 0.5) {
  model::Vehicle v = block();
  for (const double x : {-1.0, 1.0})
    for (const double y : {-1.0, 1.0})
      for (const double z : {-1.0, 1.0})
        v.contact.push_back({"corner_" + std::to_string(v.contact.size()),
                             ContactPoint::Body::torso,
                             {0.03 * x, 0.03 * y, 0.005 * z},
                             150,
                             damping_s_m,
                             friction,
                             0});
  return v;
}

BatchOptions options(double step_s = kDefaultStep_s) {
  BatchOptions o;
  o.step_s = step_s;
  o.threads = 1;
  o.world.ground_z_m = 0;
  return o;
}

/// a u (1 + e) = ln((1 + a u)/(1 - a e u)), by halving.
double restitution(double a_s_m, double u_m_s) {
  double low = 0, high = std::min(1.0, (1 - 1e-15) / (a_s_m * u_m_s));
  for (int i = 0; i < 200; ++i) {
    const double e = (low + high) / 2, x = a_s_m * u_m_s;
    (std::log((1 + x) / (1 - x * e)) > x * (1 + e) ? high : low) = e;
  }
  return low;
}

double rebound(double u_m_s, double offset_m, double step_s, double damping_s_m) {
  model::Vehicle v = block();
  v.contact = {{"ball", ContactPoint::Body::torso, {}, 400, damping_s_m, 0.5, 0}};
  BatchOptions o = options(step_s);
  o.world.gravity_m_s2 = 0;
  Batch<double> b(1, v, o);
  FlapperState s;
  s.position_m[2] = 1e-3 + offset_m;
  s.velocity_m_s[2] = -u_m_s;
  b.reset(0, s);
  b.step(static_cast<int>((0.1 + 2e-3 / u_m_s) / step_s));
  EXPECT_EQ(b.status(0), kTouchedGround);
  return b.state(0).velocity_m_s[2] / u_m_s;
}

TEST(Impact, BouncesAsTheClosedFormSays) {
  constexpr double kDamping_s_m = 0.5;
  for (const double u : {0.05, 0.3, 1.0, 2.0, 4.0}) {
    const double expected = restitution(1.5 * kDamping_s_m, u);
    double worst = 0, worst_of_half = 0;
    for (int i = 0; i < 8; ++i) {
      // where in a step the ball lands
      const double offset_m = u * kDefaultStep_s * i / 8;
      worst = std::max(worst, std::abs(rebound(u, offset_m, kDefaultStep_s, kDamping_s_m) - expected));
      worst_of_half =
          std::max(worst_of_half, std::abs(rebound(u, offset_m, kDefaultStep_s / 2, kDamping_s_m) - expected));
    }
    std::printf("  %.2f m/s: e = %.5f, error %.2g, of half the step %.2g\n", u, expected, worst, worst_of_half);
    // (omega h)^2 = k h^2/m = 0.0021 is the relative error of an explicit spring, and as much again that of where it lands
    EXPECT_LT(worst, 0.004);
    EXPECT_LT(worst_of_half, 0.4 * worst) << "second order";
  }
  EXPECT_NEAR(restitution(0.75, 0.01), 1 - 0.5 * 0.01, 1e-4);
}

TEST(Impact, WithoutDampingLosesNothing) { EXPECT_NEAR(rebound(1, 0, kDefaultStep_s, 0), 1, 0.004); }

/// The nominal robot on four legs.
model::Vehicle legged() {
  model::Vehicle v = test::nominal();
  for (const double x : {-1.0, 1.0})
    for (const double y : {-1.0, 1.0})
      v.contact.push_back({"foot_" + std::to_string(v.contact.size()),
                           ContactPoint::Body::torso,
                           {0.02 * x, 0.02 * y, -0.03},
                           150,
                           0.5,
                           0.6,
                           0});
  return v;
}

template <class T>
double drift_in_rest_m(const World& world, const FlapperState& start) {
  BatchOptions o = options();
  o.world = world;
  Batch<T> b(1, legged(), o);
  b.reset(0, start);
  b.step(8000);  // 2 s to come to rest
  const FlapperState before = b.state(0);
  b.step(40000);
  const FlapperState after = b.state(0);
  EXPECT_TRUE(b.status(0) & kTouching);
  EXPECT_FALSE(b.status(0) & kFrozen);
  double moved = 0;
  for (int i = 0; i < 3; ++i) moved += std::pow(after.position_m[i] - before.position_m[i], 2);
  EXPECT_GT(after.attitude[0] * start.attitude[0] + after.attitude[2] * start.attitude[2], 0.999) << "it stands";
  return std::sqrt(moved);
}

TEST(Rest, DriftsLessThanATenthOfAMillimetreInTenSeconds) {
  World flat;
  flat.ground_z_m = 0;
  FlapperState s;
  s.position_m[0] = 1.3;
  s.position_m[2] = 0.031;
  s.velocity_m_s[0] = 0.05;
  const double single = drift_in_rest_m<float>(flat, s), twice = drift_in_rest_m<double>(flat, s);
  // on a slope of 20 degrees, as steep as friction of 0.36
  World slope;
  constexpr double kTilt_rad = 20 * std::numbers::pi / 180;
  slope.shapes = {box({0, 0, 0}, {2, 2, 0.2}, {0, kTilt_rad, 0})};
  FlapperState t;
  const double height_m = 0.1 + 0.0302;
  t.position_m[0] = height_m * std::sin(kTilt_rad);
  t.position_m[2] = height_m * std::cos(kTilt_rad);
  t.attitude[0] = std::cos(kTilt_rad / 2), t.attitude[2] = std::sin(kTilt_rad / 2);
  const double tilted = drift_in_rest_m<float>(slope, t);
  std::printf("  drift in 10 s: %.2g m in float, %.2g m in double, %.2g m on a slope\n", single, twice, tilted);
  EXPECT_LT(single, 1e-4);
  EXPECT_LT(twice, 1e-4);
  EXPECT_LT(tilted, 1e-4);
}

TEST(Standing, IsOnItsFeetWhereItHasThem) {
  Batch<float> b(1, legged(), options());
  FlapperState s;
  s.position_m[2] = 0.03;
  b.reset(0, s, Start::standing);
  EXPECT_EQ(b.support(0), Start::flying) << "no support but its feet";
  b.step(2000);
  EXPECT_NEAR(b.state(0).position_m[2], 0.03, 5e-4);
  EXPECT_EQ(b.status(0), kTouchedGround | kTouching);
  b.set_input(0, {14, 0, 0, 0});
  b.step(1200);
  EXPECT_GT(b.state(0).position_m[2], 0.035) << "it takes off";
  EXPECT_EQ(b.status(0), kTouchedGround);
}

/// How a block goes down a plane of this slope: speed gained and way gone in half a second, `settled_s` after it was put there.
struct Slide {
  double gained_m_s, way_m;
};
Slide slide(double slope_rad, double friction, double settled_s) {
  BatchOptions o = options();
  o.world.ground_z_m = -1e3;
  o.world.shapes = {box({0, 0, 0}, {20, 20, 0.2}, {0, slope_rad, 0})};
  const double height_m = 0.1 + 0.005;
  Batch<double> b(1, block_on_corners(friction, 3), o);
  FlapperState s;
  s.position_m[0] = height_m * std::sin(slope_rad);
  s.position_m[2] = height_m * std::cos(slope_rad);
  s.attitude[0] = std::cos(slope_rad / 2), s.attitude[2] = std::sin(slope_rad / 2);
  b.reset(0, s);
  const auto down = [&](const double(&v)[3]) { return v[0] * std::cos(slope_rad) - v[2] * std::sin(slope_rad); };
  b.step(static_cast<int>(std::lround(settled_s / kDefaultStep_s)));
  const FlapperState from = b.state(0);
  b.step(2000);
  const FlapperState to = b.state(0);
  return {down(to.velocity_m_s) - down(from.velocity_m_s), down(to.position_m) - down(from.position_m)};
}

TEST(Friction, HoldsBelowItsAngleAndGivesWayAbove) {
  constexpr double kFriction = 0.5;
  const double angle_rad = std::atan(kFriction);
  EXPECT_LT(std::abs(slide(angle_rad - 0.01, kFriction, 4).way_m), 1e-6);
  for (const double beyond_rad : {0.01, 0.05, 0.2}) {
    const double slope_rad = angle_rad + beyond_rad;
    const double pull_m_s2 = kGravity_m_s2 * (std::sin(slope_rad) - kFriction * std::cos(slope_rad));
    const double gained_m_s = slide(slope_rad, kFriction, 0.5).gained_m_s;
    std::printf("  %.3f rad: %.5f m/s^2, expected %.5f m/s^2\n", slope_rad, 2 * gained_m_s, pull_m_s2);
    EXPECT_NEAR(2 * gained_m_s, pull_m_s2, 1e-3 * pull_m_s2 + 1e-3);
  }
}

/// Of a rigid block: kinetic and potential energy.
double energy_J(const FlapperState& s) {
  const double* v = s.velocity_m_s;
  const double* w = s.body_rate_rad_s;
  return 0.5 * 0.012 * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]) +
         0.5 * (4e-6 * (w[0] * w[0] + w[1] * w[1]) + 6e-6 * w[2] * w[2]) + 0.012 * kGravity_m_s2 * s.position_m[2];
}

TEST(Energy, NeverGrowsByContact) {
  for (const double damping_s_m : {0.0, 0.5}) {
    constexpr std::size_t kBlocks = 64;
    BatchOptions o = options();
    o.world.walls = {{0.3, 0, -1, 0}, {-0.3, 0, 1, 0}};
    o.world.shapes = {sphere({0, 0, 0}, 0.1), cylinder({0.1, 0.1, 0}, {0.1, 0.2, 0.3}, 0.03)};
    Batch<double> b(kBlocks, block_on_corners(0.4, damping_s_m), o);
    std::vector<double> most(kBlocks), first(kBlocks);
    for (std::size_t i = 0; i < kBlocks; ++i) {
      const double k = static_cast<double>(i);
      FlapperState s;
      s.position_m[0] = 0.25 * std::sin(k), s.position_m[1] = 0.25 * std::sin(7 * k), s.position_m[2] = 0.4;
      s.velocity_m_s[0] = std::sin(3 * k), s.velocity_m_s[2] = std::sin(5 * k) - 1;
      for (int a = 0; a < 3; ++a) s.body_rate_rad_s[a] = 20 * std::sin((a + 11) * k);
      b.reset(i, s);
      most[i] = first[i] = energy_J(s);
    }
    double worst = 0;
    std::size_t bounces = 0;
    for (int step = 0; step < 12000; ++step) {
      b.step(1);
      for (std::size_t i = 0; i < kBlocks; ++i) {
        if (b.status(i) & kTouching) continue;  // then springs hold some of it
        const double e = energy_J(b.state(i));
        worst = std::max(worst, (e - most[i]) / first[i]);
        bounces += e < most[i] - 1e-7;
        most[i] = std::min(most[i], e);
      }
    }
    EXPECT_EQ(b.count_status(kFrozen), 0u);
    EXPECT_GE(b.count_status(kTouchedGround), kBlocks - 2) << "one may come to rest elsewhere";
    EXPECT_GT(bounces, 2 * kBlocks);
    std::printf("  damping %.1f s/m: energy grew by at most %.2g of itself, %zu losses\n", damping_s_m, worst, bounces);
    // an explicit spring hands back what it took but for (omega h)^2 of it, k w h^2 = 0.005 at a corner, and damping takes more
    EXPECT_LT(worst, damping_s_m > 0 ? 1e-3 : 5e-3);
  }
}

/// Energy and momentum of the five bodies by Kane's formulation, springs left out.
struct Mechanics {
  double energy_J;
  Vector3d momentum, spin_about_W;
};
Mechanics mechanics(const model::Vehicle& v, const FlapperState& s) {
  const Eigen::Quaterniond attitude(s.attitude[0], s.attitude[1], s.attitude[2], s.attitude[3]);
  const Matrix3d R = attitude.normalized().toRotationMatrix();
  const auto [k, m, u] = test::kane_unloaded(v, s, R);
  return {0.5 * u.dot(m.mass * u), R * m.momentum,
          R * m.angular_momentum_origin + Vector3d(s.position_m).cross(R * m.momentum)};
}

/// A wing that strikes a wall without damping or friction gives all energy back, what the wall does not push stays: momentum along
/// it and spin about its normal.
TEST(WingStrike, TurnsHingesAndBodyAsItsForceDoes) {
  for (const auto on : {ContactPoint::Body::left_leading_edge, ContactPoint::Body::right_leading_edge,
                        ContactPoint::Body::left_wing, ContactPoint::Body::right_wing}) {
    model::Vehicle v = test::identified();
    v.air_density_kg_m3 = 0;
    for (model::Side* s : {&v.left, &v.right}) {
      s->motor.torque_constant_Nm_A = s->motor.friction_Nm = s->motor.damping_Nm_s = 0;
      s->stroke = s->rotation = {-1.75, 1.75, 0, 0};
      s->spring = {};
    }
    const bool left = on == ContactPoint::Body::left_leading_edge || on == ContactPoint::Body::left_wing;
    v.contact = {{"tip", on, {0.002, left ? 0.07 : -0.07, -0.01}, 20, 0, 0, 0}};
    BatchOptions o = options(2e-5);
    v.driver.hold_s = 1e-3;
    o.world.ground_z_m = -1e3;
    o.world.gravity_m_s2 = 0;
    o.world.walls = {{-0.04, 0, 1, 0}};  // behind, where strokes above 0 take the wings
    Batch<double> b(1, v, o);
    FlapperState s;
    s.velocity_m_s[1] = 0.3;
    s.body_rate_rad_s[0] = 1, s.body_rate_rad_s[1] = -2;
    for (int i = 0; i < 2; ++i) s.stroke_rate_rad_s[i] = 60, s.rotation_rate_rad_s[i] = 8;
    b.reset(0, s);
    const Mechanics before = mechanics(v, s);
    bool touched = false, left_again = false;
    for (int step = 0; step < 3000 && !left_again; ++step) {
      b.step(1);
      touched |= (b.status(0) & kTouching) != 0;
      left_again = touched && (b.status(0) & kTouching) == 0;
    }
    ASSERT_TRUE(left_again);
    const Mechanics after = mechanics(v, b.state(0));
    const double pushed = (after.momentum - before.momentum).x();
    EXPECT_GT(pushed, 1e-5);
    // second order in omega h = 0.05 at the tip, whose mass is about 30 mg
    EXPECT_NEAR(after.energy_J, before.energy_J, 2e-3 * before.energy_J);
    EXPECT_NEAR(after.momentum.y(), before.momentum.y(), 1e-9);
    EXPECT_NEAR(after.momentum.z(), before.momentum.z(), 1e-9);
    EXPECT_NEAR(after.spin_about_W.x(), before.spin_about_W.x(), 2e-3 * std::abs(pushed) * 0.07);
  }
}

/// A wing that turns into a wall while all else is held bounces as a ball does, from the speed of its point.
TEST(WingStrike, FeelsTheSpeedOfItsPoint) {
  for (const bool strokes : {false, true}) {
    model::Vehicle v = test::nominal();
    v.air_density_kg_m3 = 0;
    for (model::Side* s : {&v.left, &v.right}) {
      s->motor.torque_constant_Nm_A = s->motor.friction_Nm = s->motor.damping_Nm_s = 0;
      s->spring = {};
      s->stroke = {strokes ? -1.7 : 0, strokes ? 1.7 : 0, 0, 0};
      s->rotation = {strokes ? 0 : -1.7, strokes ? 0 : 1.7, 0, 0};
    }
    constexpr double kArm_m = 0.05, kSpeed_m_s = 1.2;
    // strokes above 0 take the span backward, rotations above 0 what is below the hinge
    v.contact = {strokes
                     ? model::ContactPoint{"tip", ContactPoint::Body::left_leading_edge, {0, kArm_m, 0}, 5, 0.5, 0, 0}
                     : model::ContactPoint{"tip", ContactPoint::Body::left_wing, {0, 0.01, -kArm_m}, 5, 0.5, 0, 0}};
    BatchOptions o = options(2e-5);
    o.world.ground_z_m = -1e3;
    o.world.gravity_m_s2 = 0;
    o.world.walls = {{-0.003, 0, 1, 0}};
    Batch<double> b(1, v, o);
    FlapperState s;
    const double rate = kSpeed_m_s / kArm_m;
    (strokes ? s.stroke_rate_rad_s : s.rotation_rate_rad_s)[0] = rate;
    b.reset(0, s, Start::welded);
    b.step(2000);
    EXPECT_EQ(b.status(0), kTouchedWall);
    const FlapperState e = b.state(0);
    const double left = -(strokes ? e.stroke_rate_rad_s : e.rotation_rate_rad_s)[0] / rate;
    // the wall is met askew by 0.06 rad and pressed in by a millimetre or two of 50
    EXPECT_NEAR(left, restitution(0.75, kSpeed_m_s), 0.02);
  }
}

/// A body whose centre of mass is aside spins off and keeps its energy.
TEST(Impact, TurnsABodyAboutItsCentreOfMass) {
  model::Vehicle v = block();
  v.torso.com_m = {0.02, 0, 0};
  v.contact = {{"point", ContactPoint::Body::torso, {0, 0, 0}, 100, 0, 0, 0}};
  BatchOptions o = options(2e-5);
  o.world.gravity_m_s2 = 0;
  Batch<double> b(1, v, o);
  FlapperState s;
  s.position_m[2] = 1e-3;
  s.velocity_m_s[2] = -1;
  b.reset(0, s);
  b.step(2000);
  EXPECT_EQ(b.status(0), kTouchedGround);
  // an impulse J at 0.02 m from C: J (1/m + r^2/I) = 2 u
  const double J = 2 / (1 / 0.012 + 0.02 * 0.02 / 4e-6);
  const FlapperState e = b.state(0);
  EXPECT_NEAR(e.body_rate_rad_s[1], 0.02 * J / 4e-6, 0.01 * 0.02 * J / 4e-6);
}

TEST(WingStrike, ShowsInTheMotorsCurrent) {
  model::Vehicle v = test::nominal();
  v.contact = {{"left_tip", ContactPoint::Body::left_leading_edge, {0, 0.07, 0}, 100, 0.5, 0.3, 0},
               {"right_tip", ContactPoint::Body::right_leading_edge, {0, -0.07, 0}, 100, 0.5, 0.3, 0}};
  BatchOptions o = options();
  o.world.ground_z_m = -1e3;
  // behind the left wing alone
  o.world.shapes = {box({-0.06, 0.08, 0.02}, {0.04, 0.06, 0.2}, {0, 0, 0})};
  Batch<float> b(1, v, o);
  b.reset(0, {}, Start::welded);
  const auto current_A = [&](int side) {
    const model::Motor& m = v.left.motor;
    const double emf_V = m.gear_ratio * m.torque_constant_Nm_A * b.state(0).stroke_rate_rad_s[side];
    return (9 - emf_V) / m.resistance_ohm;
  };
  double differ_A = 0, before_A = 0;
  for (int step = 0; step < 60; ++step) {
    b.set_voltages(0, 9, 9);
    b.step(1);
    const double differs = std::abs(current_A(0) - current_A(1));
    (b.status(0) & kTouchedShape ? differ_A : before_A) =
        std::max(differs, b.status(0) & kTouchedShape ? differ_A : before_A);
  }
  EXPECT_TRUE(b.status(0) & kTouchedShape);
  EXPECT_LT(before_A, 1e-4);
  EXPECT_GT(differ_A, 0.05) << "of 0.7 A at a standstill";
}

TEST(Grasp, HoldsWhatIsTouchedSlowlyUntilAReset) {
  model::Vehicle v = block();
  v.contact = {{"foot", ContactPoint::Body::torso, {0, 0, 0.01}, 150, 0.5, 0.5, 0.3}};
  BatchOptions o = options();
  o.world.ground_z_m = -1e3;
  o.world.shapes = {cylinder({0, -1, 1}, {0, 1, 1}, 0.005)};  // a perch to hang from
  Batch<float> b(2, v, o);
  FlapperState slow, fast;
  slow.position_m[2] = fast.position_m[2] = 0.98;
  slow.velocity_m_s[2] = 0.4;  // 0.25 m/s where it meets the perch, 5 mm higher
  fast.velocity_m_s[2] = 0.7;
  b.reset(0, slow);
  b.reset(1, fast);
  b.step(8000);
  EXPECT_NEAR(b.state(0).position_m[2], 0.985, 1e-3);
  EXPECT_TRUE(b.status(0) & kTouching);
  EXPECT_LT(b.state(1).position_m[2], 0.5);
  b.reset(0, fast);
  b.step(4000);
  EXPECT_LT(b.state(0).position_m[2], 0.9) << "a reset lets go";
}

TEST(Batch, RefusesPointsThatAreNotItsOwn) {
  Batch<float> b(2, legged(), options());
  EXPECT_THROW(b.set_vehicle(0, test::nominal()), std::invalid_argument);
  model::Vehicle other = legged();
  other.contact[0].name = "hand";
  EXPECT_THROW(b.set_vehicle(0, other), std::invalid_argument);
  other = legged();
  other.contact[0].stiffness_N_m = 1e5;
  EXPECT_THROW(b.set_vehicle(0, other), std::invalid_argument);
  other.contact[0].stiffness_N_m = 200;
  EXPECT_NO_THROW(b.set_vehicle(0, other));
}

TEST(Shapes, AreEventsForWhoHasNoPoints) {
  BatchOptions o = options();
  o.world.ground_z_m = -1e3;
  o.world.shapes = {sphere({0, 0, 0.5}, 0.1)};
  Batch<float> b(2, test::nominal(), o);
  FlapperState near;
  near.position_m[2] = 0.35;  // around_m is 0.084
  b.reset(0, near);
  b.step(1);
  EXPECT_EQ(b.status(0), kTouchedShape);
  EXPECT_EQ(b.status(1), 0u);
}

}  // namespace
}  // namespace flappy::sim
