// Vehicles with four angles a wing, as they fly: balances of momentum, energy and work, with their order; gaits as they are prescribed; lanes alike.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "flappy/batch.hpp"
#include "model/jointed_kane.hpp"
#include "sim/storage.hpp"
#include "jointed_vehicles.hpp"

namespace flappy::sim {
namespace {

using model::Jointed, model::Vehicle;
using test::Matrix3d, test::Random, test::Vector3d;

BatchOptions options(double step_s) {
  BatchOptions o;
  o.step_s = step_s;
  o.threads = 1;
  o.world.ground_z_m = -1000;
  return o;
}

/// What a vehicle is and has at an instant, in W, from the figures of its file.
struct Totals {
  double mass = 0, kinetic_J = 0, spring_J = 0;
  Vector3d com = Vector3d::Zero(), momentum = Vector3d::Zero(), angular = Vector3d::Zero();  // about the origin of W
};

Totals totals(const Vehicle& v, const FlapperState& s, const WingJoints& q) {
  const auto vec = [](const model::Triple& t) { return Vector3d(t.x, t.y, t.z); };
  Totals t;
  const Matrix3d R = Eigen::Quaterniond(s.attitude[0], s.attitude[1], s.attitude[2], s.attitude[3]).toRotationMatrix();
  const Vector3d at(s.position_m[0], s.position_m[1], s.position_m[2]);
  const Vector3d moves(s.velocity_m_s[0], s.velocity_m_s[1], s.velocity_m_s[2]);
  const Vector3d turns = R * Vector3d(s.body_rate_rad_s[0], s.body_rate_rad_s[1], s.body_rate_rad_s[2]);
  const auto add = [&](const model::RigidBody& b, const Matrix3d& axes, const Vector3d& w, const Vector3d& point,
                       const Vector3d& speed) {
    const model::InertiaTensor& i = b.inertia_kg_m2;
    Matrix3d I;
    I << i.xx, i.xy, i.xz, i.xy, i.yy, i.yz, i.xz, i.yz, i.zz;
    I = axes * I * axes.transpose();
    const Vector3d r = axes * vec(b.com_m), u = speed + w.cross(r), c = point + r;
    t.mass += b.mass_kg;
    t.com += b.mass_kg * c;
    t.momentum += b.mass_kg * u;
    t.angular += c.cross(b.mass_kg * u) + I * w;
    t.kinetic_J += 0.5 * (b.mass_kg * u.squaredNorm() + w.dot(I * w));
  };
  add(v.torso, R, turns, at, moves);
  for (int side = 0; side < 2; ++side) {
    const model::Side& own = side == 0 ? v.left : v.right;
    const Jointed::Wing& wing = side == 0 ? v.jointed->left : v.jointed->right;
    const double sign = side == 0 ? 1 : -1;
    const Vector3d axes[4] = {-Vector3d::UnitY(), sign * Vector3d::UnitZ(), sign * Vector3d::UnitX(),
                              Vector3d::UnitY()};
    const Vector3d arm = R * vec(own.shoulder_m);
    Matrix3d frame = R;
    Vector3d w = turns;
    for (int j = 0; j < 4; ++j) {
      if (j == 3) add(own.leading_edge, frame, w, at + arm, moves + turns.cross(arm));
      w += q.rate_rad_s[side][j] * (frame * axes[j]);
      frame = frame * Eigen::AngleAxisd(q.angle_rad[side][j], axes[j]).toRotationMatrix();
      const Jointed::Angle& a = wing.angles[static_cast<std::size_t>(j)];
      if (a.mode == Jointed::Mode::free)
        t.spring_J += 0.5 * a.stiffness_Nm_rad * std::pow(q.angle_rad[side][j] - a.rest_rad, 2);
    }
    add(own.wing, frame, w, at + arm, moves + turns.cross(arm));
  }
  t.com /= t.mass;
  return t;
}

FlapperState tumbling() {
  FlapperState s;
  s.attitude[0] = 0.9, s.attitude[1] = 0.3, s.attitude[2] = -0.1, s.attitude[3] = std::sqrt(1 - 0.91);
  s.velocity_m_s[0] = 1, s.velocity_m_s[1] = -0.5, s.velocity_m_s[2] = 0.3;
  s.body_rate_rad_s[0] = 2, s.body_rate_rad_s[1] = -3, s.body_rate_rad_s[2] = 1;
  s.stroke_rad[0] = 0.2, s.rotation_rad[1] = -0.3;
  return s;
}

struct Balance {
  double momentum, angular, energy, position;  // relative errors after a flight in vacuum
};

Balance balance(const Vehicle& v, double step_s) {
  const double seconds = 0.05;
  BatchOptions o = options(step_s);
  Batch<double> batch(1, v, o);
  batch.reset(0, tumbling());
  batch.step(1);  // the state before the first step does not know the driven angles yet
  const Totals before = totals(v, batch.state(0), batch.joints(0));
  const double work_before = batch.joints(0).work_J;
  const int steps = static_cast<int>(std::lround(seconds / step_s));
  batch.step(steps);
  const Totals after = totals(v, batch.state(0), batch.joints(0));
  const double g = o.world.gravity_m_s2, t = steps * step_s;
  const Vector3d weight(0, 0, -g * before.mass);
  const Vector3d fallen = before.com + t * before.momentum / before.mass + 0.5 * t * t * weight / before.mass;
  // angular momentum about the origin of W changes by the integral of com x weight, a cubic in time
  const Vector3d turned = before.angular + t * before.com.cross(weight) +
                          0.5 * t * t * (before.momentum / before.mass).cross(weight);
  const double work = batch.joints(0).work_J - work_before;
  const double fall = g * before.mass * (after.com.z() - before.com.z());
  const double energy = (after.kinetic_J + after.spring_J + fall) - (before.kinetic_J + before.spring_J) - work;
  return {(after.momentum - before.momentum - t * weight).norm() / before.momentum.norm(),
          (after.angular - turned).norm() / turned.norm(), std::abs(energy) / before.kinetic_J,
          (after.com - fallen).norm() / 0.05};
}

/// Without dampers, in vacuum.
Vehicle in_vacuum(Random& random) {
  Vehicle v = test::random_jointed(random);
  v.air_density_kg_m3 = 0;
  test::put_plain_planform(v);
  for (Jointed::Wing* w : {&v.jointed->left, &v.jointed->right})
    for (Jointed::Angle& a : w->angles) a.damping_Nm_s = 0;
  return v;
}

TEST(JointedStep, BalancesMomentumAndEnergyToSecondOrder) {
  Random random(3);
  for (int trial = 0; trial < 12; ++trial) {
    const Vehicle v = in_vacuum(random);
    const Balance coarse = balance(v, 2e-5), fine = balance(v, 1e-5), finest = balance(v, 5e-6);
    const auto order = [&](double Balance::* part, const char* what) {
      EXPECT_LT(finest.*part, 2e-4) << what << trial;
      // between 3 and 5 each time, unless it is rounding already
      if (finest.*part > 1e-10) {
        EXPECT_GT(coarse.*part / (fine.*part), 2.5) << what << trial << ' ' << coarse.*part << ' ' << fine.*part;
        EXPECT_GT(fine.*part / (finest.*part), 3) << what << trial << ' ' << fine.*part << ' ' << finest.*part;
      }
    };
    order(&Balance::momentum, "momentum ");
    order(&Balance::angular, "angular momentum ");
    order(&Balance::energy, "energy ");
    order(&Balance::position, "position ");
  }
}

}  // namespace
}  // namespace flappy::sim
