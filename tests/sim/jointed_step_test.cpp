// Vehicles with four angles a wing, as they fly: balances of momentum, energy and work, with their order; gaits as they are prescribed; lanes alike.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "flappy/batch.hpp"
#include "jointed_vehicles.hpp"
#include "model/derive.hpp"
#include "model/jointed_kane.hpp"
#include "model/wing_angles.hpp"
#include "sim/storage.hpp"

namespace flappy::sim::jointed_step_test {
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
  batch.step(1);                     // the state before the first step does not know the driven angles yet
  batch.set_input(0, {1, 0, 0, 0});  // so that everything is on its way meanwhile
  const Totals before = totals(v, batch.state(0), batch.joints(0));
  const double work_before = batch.joints(0).work_J;
  const int steps = static_cast<int>(std::lround(seconds / step_s));
  batch.step(steps);
  const Totals after = totals(v, batch.state(0), batch.joints(0));
  const double g = o.world.gravity_m_s2, t = steps * step_s;
  const Vector3d weight(0, 0, -g * before.mass);
  const Vector3d fallen = before.com + t * before.momentum / before.mass + 0.5 * t * t * weight / before.mass;
  // angular momentum about the origin of W changes by the integral of com x weight, a cubic in time
  const Vector3d turned =
      before.angular + t * before.com.cross(weight) + 0.5 * t * t * (before.momentum / before.mass).cross(weight);
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
  v.jointed->inputs.emplace_back();
  Jointed::Input& u = v.jointed->inputs[0];
  u.low = -1, u.high = 1, u.mix = {1, 0, 0, 0}, u.lag_s = 0.01;
  u.frequency = 0.2, u.timing = 0.2, u.timing_opposed = 0.2;
  u.scale = {0.1, 0.2, 0.3, 0.1}, u.scale_opposed = {0, 0.1, 0, 0};
  u.offset_rad = {0.1, 0, 0.05, 0}, u.offset_opposed_rad = {0.02, 0.1, 0, 0.05};
  return v;
}

TEST(JointedStep, BalancesMomentumAndEnergyToSecondOrder) {
  Random random(3);
  for (int trial = 0; trial < 12; ++trial) {
    const Vehicle v = in_vacuum(random);
    const Balance coarse = balance(v, 2e-5), fine = balance(v, 1e-5), finest = balance(v, 5e-6);
    const auto order = [&](double Balance::*part, const char* what) {
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

/// A gait on every angle that all inputs act on, in still air.
Vehicle busy_gait() {
  Vehicle v = test::driven_hummingbird();
  Jointed& j = *v.jointed;
  for (Jointed::Wing* w : {&j.left, &j.right}) {
    w->angles[0].mode = Jointed::Mode::driven, w->angles[0].cos_rad = {0.1, 0.02}, w->angles[0].sin_rad = {0, 0.03};
    w->angles[2].mode = Jointed::Mode::driven, w->angles[2].cos_rad = {0, 0.1}, w->angles[2].sin_rad = {0.05, 0};
  }
  j.inputs.resize(1);
  Jointed::Input& u = j.inputs[0];
  u.low = -1, u.high = 1, u.neutral = 0, u.lag_s = 0.01, u.mix = {1, 0, 0, 0};
  u.frequency = 0.2, u.timing = 0.2, u.timing_opposed = 0.3;
  u.scale = {0.1, 0.2, 0.3, 0.1}, u.scale_opposed = {0, 0.1, 0, 0};
  u.offset_rad = {0.1, 0, 0.05, 0}, u.offset_opposed_rad = {0.02, 0.1, 0, 0.05};
  return v;
}

// Angle, rate and acceleration belong together, whatever inputs do meanwhile: differences of the angles over steps, of order h^2.
TEST(JointedStep, DrivesAnglesWhoseRatesAreTheirDerivatives) {
  const double h = 1e-5;
  Batch<double> batch(1, busy_gait(), options(h));
  batch.reset(0, {}, Start::welded);
  batch.step(1);
  batch.set_input(0, {1, 0, 0, 0});
  batch.step(200);
  batch.set_input(0, {-0.5, 0, 0, 0});
  batch.step(300);  // the filter is amid its way
  std::vector<WingJoints> q;
  for (int i = 0; i < 3; ++i) q.push_back(batch.joints(0)), batch.step(1);
  for (int side = 0; side < 2; ++side)
    for (int k = 0; k < 4; ++k) {
      const double difference = (q[2].angle_rad[side][k] - q[0].angle_rad[side][k]) / (2 * h);
      // h^2/6 of a third derivative of (2 pi 40 Hz 3)^3 x 0.3 rad
      EXPECT_NEAR(q[1].rate_rad_s[side][k], difference, 1e-2) << side << k;
      EXPECT_GT(std::abs(difference), 1e-2) << side << k;
    }
}

// The filter, the clock and the harmonics in closed form: an input that was there for long.
TEST(JointedStep, FollowsTheGaitOfItsFile) {
  const double h = 1e-5;
  const Vehicle v = busy_gait();
  const Jointed& j = *v.jointed;
  Batch<double> batch(1, v, options(h));
  batch.reset(0, {}, Start::welded);
  const double u = 0.4;
  batch.set_input(0, {u, 0, 0, 0});
  const int steps = 1234;
  batch.step(steps);
  const WingJoints q = batch.joints(0);
  const double t = j.frequency_Hz * (1 + 0.2 * u) * steps * h, turn = 2 * std::numbers::pi;
  for (int side = 0; side < 2; ++side) {
    const double s = side == 0 ? 1 : -1, d = u * (0.2 + s * 0.3);
    const double p = t + d * (1 - std::cos(turn * t)) / turn;
    const Jointed::Wing& w = side == 0 ? j.left : j.right;
    for (std::size_t k = 0; k < 4; ++k) {
      double g = 0;
      for (std::size_t i = 0; i < w.angles[k].cos_rad.size(); ++i) {
        const double x = turn * p * static_cast<double>(i + 1);
        g += w.angles[k].cos_rad[i] * std::cos(x) + w.angles[k].sin_rad[i] * std::sin(x);
      }
      const Jointed::Input& i = j.inputs[0];
      const double scale = 1 + u * (i.scale[k] + s * i.scale_opposed[k]);
      const double offset = w.angles[k].mean_rad + u * (i.offset_rad[k] + s * i.offset_opposed_rad[k]);
      // within half a step the end follows by a series of second order
      EXPECT_NEAR(q.angle_rad[side][k], offset + scale * g, 1e-7) << side << k;
    }
  }
}

// In air: trajectories of steps h, h/2, h/4 come together by a factor of four, with strips, rotational lift, added mass and free rotation.
TEST(JointedStep, FliesInAirToSecondOrder) {
  for (const bool free : {false, true}) {
    const Vehicle v = test::insect(free);
    std::vector<Vector3d> ends;
    for (const double h : {4e-5, 2e-5, 1e-5, 5e-6}) {
      Batch<double> batch(1, v, options(h));
      FlapperState s;
      s.velocity_m_s[0] = 0.3, s.body_rate_rad_s[1] = 2;
      batch.reset(0, s);
      batch.set_input(0, {0.2, 0.1, 0, 0});
      batch.step(static_cast<int>(std::lround(0.03 / h)));
      const FlapperState end = batch.state(0);
      ends.emplace_back(end.position_m[0], end.position_m[1], end.position_m[2]);
    }
    const double first = (ends[0] - ends[1]).norm(), second = (ends[1] - ends[2]).norm(),
                 third = (ends[2] - ends[3]).norm();
    EXPECT_GT(first / second, 2.7) << free << ' ' << first << ' ' << second;
    EXPECT_GT(second / third, 3.2) << free << ' ' << second << ' ' << third;
    EXPECT_LT(third, 2e-6) << free;
  }
}

// A hinge of stiffness k and inertia J swings with sqrt(k/J); stops hold it.
TEST(JointedStep, SwingsOnItsHingeAndStaysWithinItsStops) {
  Vehicle v = test::driven_hummingbird();
  v.air_density_kg_m3 = 0;
  for (Jointed::Wing* w : {&v.jointed->left, &v.jointed->right}) {
    w->angles[1].mode = Jointed::Mode::fixed;
    w->angles[1].cos_rad.clear(), w->angles[1].sin_rad.clear();
    w->angles[3] = {};
    w->angles[3].mode = Jointed::Mode::free;
    w->angles[3].stiffness_Nm_rad = 1e-4;
  }
  BatchOptions o = options(1e-5);
  o.world.gravity_m_s2 = 0;
  Batch<double> batch(1, v, o);
  FlapperState s;
  s.rotation_rad[0] = s.rotation_rad[1] = 0.3;
  batch.reset(0, s, Start::welded);
  const model::RigidBody& wing = v.left.wing;
  const double J = wing.inertia_kg_m2.yy + wing.mass_kg * (wing.com_m.x * wing.com_m.x + wing.com_m.z * wing.com_m.z);
  const double period = 2 * std::numbers::pi * std::sqrt(J / 1e-4);
  batch.step(static_cast<int>(std::lround(10 * period / 1e-5)));
  // after ten periods: the frequency's own error (w h)^2/12 of ten turns, squared, and the nearest step
  EXPECT_NEAR(batch.state(0).rotation_rad[0], 0.3, 2e-4);

  for (Jointed::Wing* w : {&v.jointed->left, &v.jointed->right}) {
    Jointed::Angle& a = w->angles[3];
    a.lower_rad = -0.1, a.upper_rad = 0.1, a.stop_stiffness_Nm_rad = 0.5, a.stop_damping_Nm_s = 1e-5;
  }
  Batch<double> stopped(1, v, o);
  s.rotation_rad[0] = s.rotation_rad[1] = 0;
  s.rotation_rate_rad_s[0] = s.rotation_rate_rad_s[1] = 30;
  stopped.reset(0, s, Start::welded);
  double largest = 0;
  for (int i = 0; i < 20000; ++i)
    stopped.step(1), largest = std::max(largest, std::abs(stopped.state(0).rotation_rad[0]));
  EXPECT_GT(largest, 0.1);
  EXPECT_LT(largest, 0.1 + 30 * std::sqrt(J / 0.5));  // all of its energy in the stop
}

// The power of all muscles is the rate of the energy: held wings in air lose to it what they gain.
TEST(JointedStep, CountsPositivePowerOfEachWing) {
  Batch<double> batch(1, test::driven_hummingbird(), options(1e-5));
  batch.reset(0, {}, Start::welded);
  batch.set_input(0, {9.8, 0, 0, 0});
  double positive = 0, all = 0;
  batch.step(1);
  const double from = batch.energy_J(0), from_all = batch.joints(0).work_J;
  for (int i = 0; i < 5000; ++i) {
    batch.step(1);
    const WingJoints q = batch.joints(0);
    for (int side = 0; side < 2; ++side) {
      double power = 0;
      for (int k = 0; k < 4; ++k) power += q.torque_Nm[side][k] * q.rate_rad_s[side][k];
      positive += 1e-5 * std::max(power, 0.0);
      all += 1e-5 * power;
    }
  }
  // torques are of the middle of a step, rates of its end: half a step's change of the rate, of 30 steps in a quarter beat
  EXPECT_NEAR(batch.energy_J(0) - from, positive, 2e-2 * positive);
  EXPECT_NEAR(batch.joints(0).work_J - from_all, all, 2e-2 * positive);
  EXPECT_GT(positive, all);
}

TEST(JointedStep, IsTheSameInEveryLaneAndOnEveryInstructionSet) {
  const Vehicle v = test::insect(true);
  std::vector<std::uint64_t> hashes;
  for (const std::string& set : instruction_sets()) {
    BatchOptions o = options(1e-4);
    o.instruction_set = set;
    Batch<float> batch(21, v, o);
    for (std::size_t i = 0; i < 21; ++i) batch.reset(i, {}), batch.set_input(i, {0.2, 0.1, 0.05, 0.01});
    batch.step(500);
    for (std::size_t i = 1; i < 21; ++i) EXPECT_EQ(batch.hash(i, i + 1), batch.hash(0, 1));
    hashes.push_back(batch.hash(0, 1));
  }
  for (const std::uint64_t h : hashes) EXPECT_EQ(h, hashes[0]);
}

TEST(JointedStep, StandsUntilItsWingsCarryItAndFreezesWhatComesApart) {
  BatchOptions o = options(250e-6);
  o.world.ground_z_m = 0;
  Batch<double> batch(2, test::driven_hummingbird(), o);
  batch.reset(0, {}, Start::standing);
  batch.set_input(0, {2, 0, 0, 0});
  batch.step(2000);
  EXPECT_EQ(batch.support(0), Start::standing);
  EXPECT_EQ(batch.state(0).position_m[2], 0);
  EXPECT_GT(batch.held_impulse(0).force_N_s[2], 0);
  batch.set_input(0, {13, 0, 0, 0});
  batch.step(1200);
  EXPECT_EQ(batch.support(0), Start::flying);
  EXPECT_GT(batch.state(0).position_m[2], 0);

  FlapperState fast;
  fast.velocity_m_s[0] = 1000, fast.position_m[2] = 1;
  batch.reset(1, fast);
  batch.step(1);
  const std::uint64_t hash = batch.hash(1, 2);
  EXPECT_TRUE(batch.status(1) & kFrozen);
  batch.step(10);
  EXPECT_EQ(batch.hash(1, 2), hash);
}

// The single point feels what the blade element says of a driven wing (wing_angles.hpp), whose Phi has another sign on the right.
TEST(JointedStep, FeelsTheAirOfADrivenWing) {
  const double h = 1e-5;
  Vehicle v = busy_gait();
  for (model::Side* s : {&v.left, &v.right})
    s->planform.rotational_damping_coefficient = 0;  // is of the real rate here
  Batch<double> batch(1, v, options(h));
  batch.reset(0, {}, Start::welded);
  batch.set_input(0, {0.5, 0, 0, 0});
  batch.step(700);
  const HeldImpulse before = batch.held_impulse(0);
  batch.step(1);
  const HeldImpulse after = batch.held_impulse(0);
  const WingJoints q = batch.joints(0);
  batch.step(1);
  const WingJoints next = batch.joints(0);
  Vector3d force(0, 0, 0), moment(0, 0, 0);
  const auto p = model::derive(v, h);
  const auto add = [&]<int side>() {
    double angle[4], rate[4];
    for (int k = 0; k < 4; ++k) {
      const double sign = k == 0 && side < 0 ? -1 : 1;
      const int s = side > 0 ? 0 : 1;
      const double acceleration = (next.rate_rad_s[s][k] - q.rate_rad_s[s][k]) / h;
      angle[k] = sign * (q.angle_rad[s][k] - h / 2 * q.rate_rad_s[s][k]);  // of the middle of the step before
      rate[k] = sign * (q.rate_rad_s[s][k] - h / 2 * acceleration);
    }
    const auto air = model::air_on_driven_wing<side>(
        side > 0 ? p.left : p.right, model::WingAngles<double>{angle[0], angle[1], angle[2], angle[3]},
        model::WingAngles<double>{rate[0], rate[1], rate[2], rate[3]}, {0, 0, 0}, {0, 0, 0});
    const model::Triple& at = (side > 0 ? v.left : v.right).shoulder_m;
    const Vector3d f(air.force_N.x, air.force_N.y, air.force_N.z);
    force += f;
    moment += Vector3d(air.moment_Nm.x, air.moment_Nm.y, air.moment_Nm.z) + Vector3d(at.x, at.y, at.z).cross(f);
  };
  add.operator()<+1>();
  add.operator()<-1>();
  for (int k = 0; k < 3; ++k) {  // rates of the middle are those of two ends, of order h^2
    EXPECT_NEAR((after.force_N_s[k] - before.force_N_s[k]) / h, force[k], 1e-3 * force.norm()) << k;
    EXPECT_NEAR((after.moment_Nm_s[k] - before.moment_Nm_s[k]) / h, moment[k], 1e-3 * moment.norm()) << k;
  }
}

// Put into a batch that has flown for another time, a snapshot flies on alike.
TEST(JointedStep, FliesOnFromASnapshot) {
  const Vehicle v = test::insect(true);
  Batch<float> from(1, v, options(1e-4)), to(3, v, options(1e-4));
  const auto fly = [](Batch<float>& batch, std::size_t i, int steps) {
    for (int k = 0; k < steps; ++k) batch.set_input(i, {0.01 * (k % 17), 0.001 * (k % 5), 0, 0}), batch.step(1);
  };
  fly(from, 0, 240);
  fly(to, 2, 37);
  const auto [rows, memory] = storage_of(from).get_jointed(0);
  storage_of(to).put_jointed(2, rows, memory);
  Block<float>&a = storage_of(from).blocks[0], &b = storage_of(to).blocks[0];
  for (std::size_t r = 0; r < kStateRows; ++r) b.state[r][2] = a.state[r][0];
  fly(from, 0, 100);
  fly(to, 2, 100);
  EXPECT_EQ(to.hash(2, 3), from.hash(0, 1));
}

TEST(JointedStep, RefusesOthersInItsBatch) {
  Batch<double> batch(1, test::driven_hummingbird(), options(1e-4));
  EXPECT_THROW(batch.set_vehicle(0, test::nominal()), std::invalid_argument);
  EXPECT_THROW(batch.set_vehicle(0, test::insect(true)), std::invalid_argument);
  EXPECT_NO_THROW(batch.set_vehicle(0, test::driven_hummingbird()));
  Batch<double> robots(1, test::nominal(), options(1e-4));
  EXPECT_THROW(robots.joints(0), std::logic_error);
}

}  // namespace
}  // namespace flappy::sim::jointed_step_test
