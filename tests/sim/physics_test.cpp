// What must hold of five hinged bodies, whatever the vehicle: conservation, closed solutions, symmetry,
// stops, convergence. Energy, momentum and inertia come from Kane's formulation (model/kane.hpp), not from
// the code under test.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <complex>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "flappy/batch.hpp"
#include "model/kane.hpp"
#include "vehicles.hpp"

namespace flappy::sim::physics_test {
namespace {

using std::numbers::pi;
using test::Matrix3d;
using test::Vector3d;

constexpr double kStep = 1e-4, kFine = 2.5e-5;
constexpr double kGravity = 9.81;
constexpr double kEps = std::numeric_limits<double>::epsilon();
constexpr model::Joint kLocked{0, 0, 0, 0};
constexpr model::Joint kFree{-1.75, 1.75, 0, 0};

BatchOptions options(double step_s, double gravity_m_s2) {
  BatchOptions o;
  o.step_s = step_s;
  o.threads = 1;
  o.world.gravity_m_s2 = gravity_m_s2;
  return o;
}

int steps_in(double seconds, double step_s) { return static_cast<int>(std::lround(seconds / step_s)); }

std::array<model::Side*, 2> sides(model::Vehicle& v) { return {&v.left, &v.right}; }
const model::Side& side(const model::Vehicle& v, std::size_t i) { return i == 0 ? v.left : v.right; }

/// The identified vehicle, whose sides differ: inertia, springs, rotors that spin and these joints; no air, motor or friction.
model::Vehicle conservative(const model::Joint& stroke, const model::Joint& rotation) {
  model::Vehicle v = test::identified();
  v.air_density_kg_m3 = 0;
  for (model::Side* s : sides(v)) {
    s->motor.torque_constant_Nm_A = s->motor.friction_Nm = s->motor.damping_Nm_s = 0;
    s->stroke = stroke;
    s->rotation = rotation;
  }
  v.left.motor.rotor_spin_sense = 1;
  v.right.motor.rotor_spin_sense = -0.5;
  return v;
}

model::Vehicle without_springs(model::Vehicle v) {
  for (model::Side* s : sides(v)) s->spring = {0, 0, 0};
  return v;
}

/// A stroke with its rotation at zero. The vehicles here have one spring stiffness for both directions.
struct Oscillator {
  double inertia, stiffness, rest, friction, torque_per_V, damping;
  explicit Oscillator(const model::Side& s) {
    const auto about_z = [](const model::RigidBody& b) {
      return b.inertia_kg_m2.zz + b.mass_kg * (b.com_m.x * b.com_m.x + b.com_m.y * b.com_m.y);
    };
    const model::Motor& m = s.motor;
    const double N = m.gear_ratio, eta = m.efficiency, K = m.torque_constant_Nm_A, R = m.resistance_ohm;
    inertia = about_z(s.leading_edge) + about_z(s.wing) + eta * N * N * m.rotor_inertia_kg_m2;
    stiffness = s.spring.stiffness_positive_Nm_rad;
    rest = s.spring.rest_angle_rad;
    friction = eta * N * m.friction_Nm + s.stroke.friction_Nm;
    torque_per_V = N * eta * K / R;
    damping = eta * N * N * (K * K / R + m.damping_Nm_s) + s.stroke.damping_Nm_s;
  }
};

/// A wing that hangs from its rotation hinge.
struct Pendulum {
  double arm, hanging, weight_Nm, inertia, rate;
  explicit Pendulum(const model::RigidBody& wing)
      : arm(std::hypot(wing.com_m.x, wing.com_m.z)),
        hanging(std::atan2(wing.com_m.x, -wing.com_m.z)),
        weight_Nm(wing.mass_kg * kGravity * arm),
        inertia(wing.inertia_kg_m2.yy + wing.mass_kg * arm * arm),
        rate(std::sqrt(weight_Nm / inertia)) {}
};

struct Mechanics {
  double mass, energy;           // kinetic, less that of C, and of the springs
  Vector3d com, momentum, spin;  // in W; spin about C
  Matrix3d inertia;              // about C, in B
};

Mechanics mechanics(const model::Vehicle& v, const FlapperState& s) {
  const Eigen::Quaterniond attitude(s.attitude[0], s.attitude[1], s.attitude[2], s.attitude[3]);
  const Matrix3d R = attitude.normalized().toRotationMatrix();
  const auto [k, m, u] = test::kane_unloaded(v, s, R);
  double energy = 0.5 * (u.dot(m.mass * u) - m.momentum.squaredNorm() / m.total_mass);
  for (std::size_t i = 0; i < 2; ++i) {
    const Oscillator o(side(v, i));
    energy += 0.5 * o.stiffness * std::pow(s.stroke_rad[i] - o.rest, 2);
  }
  const Matrix3d at_C = m.total_mass * (m.com.squaredNorm() * Matrix3d::Identity() - m.com * m.com.transpose());
  return {m.total_mass,
          energy,
          Vector3d(s.position_m) + R * m.com,
          R * m.momentum,
          R * (m.angular_momentum_origin - m.com.cross(m.momentum)),
          m.mass.block<3, 3>(3, 3) - at_C};
}

double fastest_rate(const FlapperState& s) {
  double rate = Vector3d(s.body_rate_rad_s).norm();
  for (int i = 0; i < 2; ++i)
    rate = std::max({rate, std::abs(s.stroke_rate_rad_s[i]), std::abs(s.rotation_rate_rad_s[i])});
  return rate;
}

/// Expects an error below its bound, and states both on the screen and in the report.
void expect_below(const std::string& what, double error, double bound) {
  char text[64];
  std::snprintf(text, sizeof text, "%.3g (bound %.3g)", error, bound);
  std::printf("  %s: %s\n", what.c_str(), text);
  ::testing::Test::RecordProperty(what, text);
  EXPECT_LT(error, bound) << what;
}

/// Expects an error to fall with the step at least in proportion, but for a tenth, and no faster than with its square.
void expect_order(const std::string& what, double coarse, double fine) {
  EXPECT_GT(coarse / fine, 0.9 * kStep / kFine) << what;
  EXPECT_LT(coarse / fine, 1.1 * std::pow(kStep / kFine, 2)) << what;
}

// ---- closed solutions

TEST(Physics, FallsFreely) {
  const double seconds = 0.3;
  const int steps = steps_in(seconds, kStep);
  model::Vehicle beating = test::identified();
  beating.air_density_kg_m3 = 0;
  const model::Vehicle vehicles[] = {conservative(kLocked, kLocked), without_springs(conservative(kFree, kFree)),
                                     beating};
  for (int wings = 0; wings < 3; ++wings) {
    SCOPED_TRACE(wings);  // locked, at rest, beating
    const model::Vehicle& v = vehicles[wings];
    Batch<double> b(1, v, options(kStep, kGravity));
    FlapperState s;
    s.attitude[0] = 0.8, s.attitude[2] = 0.6;
    s.velocity_m_s[0] = 0.3, s.velocity_m_s[1] = -0.2, s.velocity_m_s[2] = 1;
    if (wings == 1) s.stroke_rad[0] = 0.5, s.rotation_rad[1] = -0.4;
    b.reset(0, s);
    if (wings == 2) b.set_input(0, {10, 1, 0, 0});
    b.step(steps);
    const FlapperState r = b.state(0);
    const Mechanics before = mechanics(v, s), after = mechanics(v, r);
    // each step rounds once a velocity below 3 m/s and a place below 1 m; a body that turns has an attitude
    // of length 1 + (h w / 2)^4, 1e-12, which scales the few mm and mm/ms between origin and C
    const double tolerance = steps * kEps * 3 + (wings == 2 ? 1e-12 : 0);
    const double fall = kGravity * seconds * seconds / 2;
    EXPECT_NEAR(after.com.x(), before.com.x() + 0.3 * seconds, tolerance);
    EXPECT_NEAR(after.com.y(), before.com.y() - 0.2 * seconds, tolerance);
    EXPECT_NEAR(after.com.z(), before.com.z() + 1 * seconds - fall, tolerance);
    EXPECT_NEAR(after.momentum.x(), before.momentum.x(), after.mass * tolerance);
    EXPECT_NEAR(after.momentum.y(), before.momentum.y(), after.mass * tolerance);
    if (wings == 2) {
      EXPECT_GT(Vector3d(r.body_rate_rad_s).norm(), 0.1) << "wings that do not move the body show nothing";
      continue;
    }
    for (int i = 0; i < 4; ++i) EXPECT_NEAR(r.attitude[i], s.attitude[i], 2 * kEps);
    for (int i = 0; i < 2; ++i) {
      EXPECT_EQ(r.stroke_rad[i], s.stroke_rad[i]);
      EXPECT_EQ(r.rotation_rad[i], s.rotation_rad[i]);
    }
  }
}

TEST(Physics, HangingWingSwingsLikeAPendulum) {
  const model::Vehicle v = conservative(kLocked, kFree);
  Batch<double> b(1, v, options(kStep, kGravity));
  FlapperState s;
  s.rotation_rad[0] = 1.2, s.rotation_rad[1] = 0.3;
  b.reset(0, s, Start::welded);
  constexpr int kPeriods = 4;
  std::array<std::vector<double>, 2> crossings;  // downward, s
  FlapperState before = s;
  for (int n = 1; n <= steps_in(1.4, kStep); ++n) {
    b.step(1);
    const FlapperState now = b.state(0);
    for (std::size_t i = 0; i < 2; ++i) {
      ASSERT_EQ(now.stroke_rad[i], 0);
      const Pendulum wing(side(v, i).wing);
      const double p = before.rotation_rad[i] - wing.hanging, q = now.rotation_rad[i] - wing.hanging;
      if (p > 0 && q <= 0) crossings[i].push_back((n - 1 + p / (p - q)) * kStep);
    }
    before = now;
  }
  for (std::size_t i = 0; i < 2; ++i) {
    const Pendulum wing(side(v, i).wing);
    const double amplitude = s.rotation_rad[i] - wing.hanging;
    const double period = 4 / wing.rate * std::comp_ellint_1(std::sin(amplitude / 2));
    ASSERT_GT(crossings[i].size(), kPeriods);
    // leapfrog: frequency off by (h rate)^2/24, amplitude by (h rate)^2/8, crossing by the third order
    const double allowed = std::pow(kStep * wing.rate, 2) * period;
    EXPECT_NEAR((crossings[i][kPeriods] - crossings[i][0]) / kPeriods, period, allowed) << i;
  }
}

TEST(Physics, StrokeAnswersTheDriverLikeADampedOscillator) {
  constexpr std::size_t kSettle = 10000, kWindow = 4000;  // transients decay at 40/s
  // resonance at 35.5; whole beats in the window
  for (const double hertz : {10.0, 25.0, 35.0, 37.5, 50.0, 100.0}) {
    SCOPED_TRACE(hertz);
    model::Vehicle v = test::identified();
    v.air_density_kg_m3 = 0;
    v.driver.hold_s = kStep;
    v.driver.flapping_Hz = hertz;
    for (model::Side* s : sides(v)) {
      s->motor.friction_Nm = s->stroke.friction_Nm = 0;
      s->rotation = kLocked;
    }
    const Input input{2, 0.5, 0.7, 0};
    Batch<double> b(1, v, options(kStep, kGravity));
    b.reset(0, {}, Start::welded);
    b.set_input(0, input);
    b.step(kSettle);
    std::array<std::vector<double>, 2> stroke;
    for (std::size_t n = 0; n < kWindow; ++n, b.step(1))
      for (std::size_t i = 0; i < 2; ++i) stroke[i].push_back(b.state(0).stroke_rad[i]);

    const double w = 2 * pi * hertz;
    const auto turn = [&](std::size_t n) { return std::polar(1.0, w * kStep * static_cast<double>(kSettle + n)); };
    for (std::size_t i = 0; i < 2; ++i) {
      const Oscillator o(side(v, i));
      const std::complex<double> Z(o.stiffness - o.inertia * w * w, o.damping * w);
      const double amplitude_V = input.amplitude_V + (i == 0 ? 1 : -1) * input.difference_V;
      // a voltage that is held for a step is half a step late
      const std::complex<double> expected = o.torque_per_V * amplitude_V / Z * std::polar(1.0, -w * kStep / 2);
      std::complex<double> measured = 0;
      double mean = 0;
      for (std::size_t n = 0; n < kWindow; ++n) {
        measured += 2.0 / kWindow * stroke[i][n] * std::conj(turn(n));
        mean += stroke[i][n] / kWindow;
      }
      // leapfrog: psi'' off by (w h)^2/12, psi' by (w h)^2/6; driver: held, of (w h)^2/24 less, and half a 2^-32 of a beat in
      // each update
      const double scheme =
          std::pow(w * kStep, 2) * ((o.inertia * w * w / 12 + o.damping * w / 6) / std::abs(Z) + 1.0 / 24);
      const double phase = 2 * pi * 0x1p-33 * (kSettle + kWindow);
      EXPECT_LT(std::abs(measured / expected - 1.0), scheme + phase) << "side " << i;
      const double allowed = phase * std::abs(expected);
      EXPECT_NEAR(mean, o.rest + o.torque_per_V * input.bias_V / o.stiffness, allowed) << "side " << i;
      for (std::size_t n = 0; n < kWindow; ++n)  // no other harmonic
        ASSERT_NEAR(stroke[i][n], mean + std::real(measured * turn(n)), allowed);
    }
  }
}

// ---- dry friction

TEST(CoulombFriction, TakesTwoBandsFromEachSwingAndThenSticks) {
  model::Vehicle v = conservative(kFree, kLocked);
  for (model::Side* s : sides(v)) s->motor.friction_Nm = 2e-5, s->stroke.friction_Nm = 1e-5;
  const std::array<Oscillator, 2> o{Oscillator(v.left), Oscillator(v.right)};
  Batch<double> b(1, v, options(kStep, kGravity));
  FlapperState before;
  before.stroke_rad[0] = 0.54, before.stroke_rad[1] = -0.4;
  b.reset(0, before, Start::welded);
  std::array<std::vector<double>, 2> turns;
  for (std::size_t i = 0; i < 2; ++i) turns[i] = {before.stroke_rad[i] - o[i].rest};
  constexpr double kRest = 1e-12;  // rad/s
  for (int n = 0; n < steps_in(0.4, kStep); ++n) {
    b.step(1);
    const FlapperState now = b.state(0);
    for (std::size_t i = 0; i < 2; ++i) {
      const double was = before.stroke_rate_rad_s[i], is = now.stroke_rate_rad_s[i];
      if (std::abs(was) > kRest && (was * is < 0 || std::abs(is) < kRest))
        turns[i].push_back(before.stroke_rad[i] - o[i].rest);
    }
    before = now;
  }
  b.step(1000);
  const FlapperState later = b.state(0);
  for (std::size_t i = 0; i < 2; ++i) {
    const double band = o[i].friction / o[i].stiffness;
    // each turn A is seen within half a step, A (w h)^2/8, of a leapfrog half a step off; friction turns late
    const double wh2 = o[i].stiffness / o[i].inertia * kStep * kStep;
    for (std::size_t j = 1; j < turns[i].size(); ++j) {
      const double last = turns[i][j - 1];
      EXPECT_NEAR(turns[i][j] + last, std::copysign(2 * band, last), (std::abs(last) / 2 + 4 * band) * wh2);
    }
    EXPECT_EQ(turns[i].size() - 1, std::lround(std::abs(turns[i][0]) / (2 * band)));
    EXPECT_LE(std::abs(before.stroke_rad[i] - o[i].rest), band);
    EXPECT_EQ(later.stroke_rad[i], before.stroke_rad[i]) << "at rest it stays where it is, to the last bit";
    const double rounding = kEps * o[i].friction * kStep / o[i].inertia;  // of the torques that cancel
    EXPECT_LE(std::abs(later.stroke_rate_rad_s[i]), rounding);
  }
}

TEST(CoulombFriction, OfTheRotationTakesItsWorkFromEachSwing) {
  model::Vehicle v = conservative(kLocked, kFree);
  const double friction = v.left.rotation.friction_Nm = 1e-7;
  const Pendulum wing(v.left.wing);
  Batch<double> b(1, v, options(kStep, kGravity));
  FlapperState before;
  before.rotation_rad[0] = 0.5;
  b.reset(0, before, Start::welded);
  double last = 0.5 - wing.hanging;
  int turns = 0;
  for (int n = 0; n < steps_in(1.2, kStep); ++n) {
    b.step(1);
    const FlapperState now = b.state(0);
    if (before.rotation_rate_rad_s[0] * now.rotation_rate_rad_s[0] < 0) {
      const double turn = before.rotation_rad[0] - wing.hanging;
      const double work = friction * (std::abs(last) + std::abs(turn));
      // as above: each turn is off by A (w h)^2/4, friction by a step
      const double wh2 = std::pow(wing.rate * kStep, 2);
      const double allowed = (wing.weight_Nm * last * last + 4 * work) * wh2;
      EXPECT_NEAR(wing.weight_Nm * (std::cos(turn) - std::cos(last)), work, allowed);
      last = turn;
      ++turns;
    }
    before = now;
  }
  EXPECT_GE(turns, 9);
}

TEST(CoulombFriction, HoldsARestingWingUpToItsTorque) {
  model::Vehicle v = test::identified();
  v.air_density_kg_m3 = 0;
  const Oscillator o(v.left);
  for (const double part : {-0.999, 0.999, 1.001}) {
    Batch<double> b(1, v, options(kStep, kGravity));
    FlapperState s;
    s.stroke_rad[0] = o.rest;
    b.reset(0, s, Start::welded);
    b.set_input(0, {0, 0, part * o.friction / o.torque_per_V, 0});
    b.step(500);
    if (std::abs(part) < 1) {
      EXPECT_EQ(b.state(0).stroke_rad[0], o.rest);
      EXPECT_EQ(b.state(0).stroke_rate_rad_s[0], 0);
    } else {
      EXPECT_GT(b.state(0).stroke_rad[0], o.rest);
    }
  }
}

// ---- conservation

/// Largest departure from the start, and what the step accounts for.
struct Drift {
  double momentum = 0, spin = 0, energy = 0;
  double momentum_bound = 0, spin_bound = 0, energy_bound = 0;
};

Drift drift(const model::Vehicle& v, const FlapperState& start, double seconds, double step_s) {
  Batch<double> b(1, v, options(step_s, 0));
  b.reset(0, start);
  const Mechanics first = mechanics(v, start);
  Drift d;
  double fastest = 0, body = 0, widest = 0;
  for (int n = 0; n < steps_in(seconds, step_s); ++n) {
    b.step(1);
    const FlapperState s = b.state(0);
    const Mechanics now = mechanics(v, s);
    d.momentum = std::max(d.momentum, (now.momentum - first.momentum).norm());
    d.spin = std::max(d.spin, (now.spin - first.spin).norm());
    d.energy = std::max(d.energy, std::abs(now.energy - first.energy));
    fastest = std::max(fastest, fastest_rate(s));
    body = std::max(body, Vector3d(s.body_rate_rad_s).norm());
    for (int i = 0; i < 2; ++i) widest = std::max({widest, std::abs(s.stroke_rad[i]), std::abs(s.rotation_rad[i])});
  }
  EXPECT_LT(widest, kFree.upper_rad) << "a stop would take energy";
  // the attitude's length, (h w / 2)^4 off, and rounding scale the momenta of wings at 5 m/s
  d.momentum_bound = (std::pow(step_s * body / 2, 4) + 16 * kEps) * first.mass * 5;
  // a step keeps constant inertial torques that have the size of the energy and turn at the fastest rate
  d.spin_bound = step_s * fastest * first.energy * seconds;
  d.energy_bound = d.spin_bound * fastest;
  return d;
}

/// Askew in everything. `scale`: rates of the hinges, rad/s.
FlapperState spinning(const Vector3d& body_rate, double scale) {
  FlapperState s;
  s.attitude[0] = 0.8, s.attitude[2] = 0.6;
  s.velocity_m_s[0] = 1, s.velocity_m_s[2] = -0.5;
  Eigen::Map<Vector3d>(s.body_rate_rad_s) = body_rate;
  s.stroke_rad[0] = -0.3, s.stroke_rad[1] = 0.2;
  s.rotation_rad[0] = 0.2, s.rotation_rad[1] = -0.1;
  s.stroke_rate_rad_s[0] = scale, s.stroke_rate_rad_s[1] = 0.8 * scale;
  s.rotation_rate_rad_s[0] = -scale, s.rotation_rate_rad_s[1] = 0.5 * scale;
  return s;
}

void expect_conservation(const std::string& name, const model::Vehicle& v, const FlapperState& start, double seconds) {
  const Drift coarse = drift(v, start, seconds, kStep), fine = drift(v, start, seconds, kFine);
  expect_below(name + "_momentum_kg_m_s", coarse.momentum, coarse.momentum_bound);
  expect_below(name + "_momentum_fine_kg_m_s", fine.momentum, fine.momentum_bound);
  expect_below(name + "_angular_momentum_Nm_s", coarse.spin, coarse.spin_bound);
  expect_below(name + "_energy_J", coarse.energy, coarse.energy_bound);
  expect_order(name + "_angular_momentum", coarse.spin, fine.spin);
  expect_order(name + "_energy", coarse.energy, fine.energy);
}

TEST(ForceFree, FreeWingsConserve) {
  const model::Vehicle v = without_springs(conservative(kFree, kFree));
  expect_conservation("free", v, spinning({2, -3, 4}, 1), 0.3);
  expect_conservation("free_fast", v, spinning({6, -9, 12}, 60), 0.015);  // up to the first stop
}

TEST(ForceFree, WingsOnSpringsConserve) {
  model::Vehicle v = conservative(kFree, kFree);
  // wings balanced about their hinge and stable, or the strokes throw them at the stops
  for (model::Side* s : sides(v)) {
    s->wing.com_m.x = s->wing.com_m.z = s->wing.inertia_kg_m2.yz = 0;
    std::swap(s->wing.inertia_kg_m2.xx, s->wing.inertia_kg_m2.zz);
  }
  FlapperState s = spinning({2, -3, 4}, 2);
  s.stroke_rate_rad_s[0] = 200, s.stroke_rate_rad_s[1] = 150;
  expect_conservation("springs", v, s, 0.3);
}

TEST(ForceFree, RigidVehicleTumblesAsEulerSays) {
  const model::Vehicle v = conservative(kLocked, kLocked);
  const double seconds = 0.5;
  FlapperState start;
  start.attitude[0] = 0.8, start.attitude[2] = 0.6;
  const Vector3d w0 = Eigen::Map<Vector3d>(start.body_rate_rad_s) = Vector3d(12, -20, 15);

  // Euler's equations by Runge and Kutta's fourth order: (20 us x 28 rad/s)^4 = 1e-13
  const Matrix3d inertia = mechanics(v, start).inertia, inverse = inertia.inverse();
  using Turning = Eigen::Matrix<double, 7, 1>;  // quaternion x, y, z, w as Eigen stores it, body rate
  const auto slope = [&](const Turning& x) {
    const Vector3d w = x.tail<3>();
    Turning d;
    d << 0.5 * (Eigen::Quaterniond(x.data()) * Eigen::Quaterniond(0, w.x(), w.y(), w.z())).coeffs(),
        inverse * -w.cross(inertia * w);
    return d;
  };
  Turning x;
  x << 0, 0.6, 0, 0.8, w0;
  const double h = 2e-5;
  for (int n = 0; n < steps_in(seconds, h); ++n) {
    const Turning a = slope(x), b = slope(x + h / 2 * a), c = slope(x + h / 2 * b), d = slope(x + h * c);
    x += h / 6 * (a + 2 * b + 2 * c + d);
  }

  double angle[2], rate[2];
  for (const int fine : {0, 1}) {
    const double step_s = fine ? kFine : kStep;
    Batch<double> b(1, v, options(step_s, 0));
    b.reset(0, start);
    b.step(steps_in(seconds, step_s));
    const FlapperState s = b.state(0);
    const Eigen::Quaterniond q(s.attitude[0], s.attitude[1], s.attitude[2], s.attitude[3]);
    angle[fine] = q.normalized().angularDistance(Eigen::Quaterniond(x.data()).normalized());
    rate[fine] = (Vector3d(s.body_rate_rad_s) - x.tail<3>()).norm();
    for (int i = 0; i < 2; ++i) EXPECT_EQ(std::abs(s.stroke_rate_rad_s[i]) + std::abs(s.rotation_rate_rad_s[i]), 0);
  }
  // each step keeps constant what turns at the body's rate
  const double bound = kStep * w0.squaredNorm() * seconds;
  expect_below("tumbling_attitude_rad", angle[0], bound);
  expect_below("tumbling_body_rate_rad_s", rate[0], bound * w0.norm());
  expect_order("attitude", angle[0], angle[1]);
  expect_order("body rate", rate[0], rate[1]);
}

// ---- symmetry

void mirror(model::RigidBody& b) { b.com_m.y *= -1, b.inertia_kg_m2.xy *= -1, b.inertia_kg_m2.yz *= -1; }

model::Vehicle mirrored(model::Vehicle v) {
  std::swap(v.left, v.right);
  mirror(v.torso);
  for (model::Side* s : sides(v)) {
    mirror(s->leading_edge);
    mirror(s->wing);
    s->shoulder_m.y *= -1;
  }
  return v;
}

FlapperState mirrored(FlapperState s) {
  s.position_m[1] *= -1, s.velocity_m_s[1] *= -1;
  s.attitude[1] *= -1, s.attitude[3] *= -1;
  s.body_rate_rad_s[0] *= -1, s.body_rate_rad_s[2] *= -1;
  for (auto* p : {s.stroke_rad, s.rotation_rad, s.stroke_rate_rad_s, s.rotation_rate_rad_s}) std::swap(p[0], p[1]);
  return s;
}

Input mirrored(Input u) { return {u.amplitude_V, -u.difference_V, u.bias_V, -u.split_cycle}; }

double largest_difference(const FlapperState& a, const FlapperState& b) {
  double d = 0;
  const auto compare = [&](const auto& x, const auto& y) {
    for (std::size_t i = 0; i < std::size(x); ++i) d = std::max(d, std::abs(x[i] - y[i]));
  };
  compare(a.position_m, b.position_m), compare(a.attitude, b.attitude);
  compare(a.velocity_m_s, b.velocity_m_s), compare(a.body_rate_rad_s, b.body_rate_rad_s);
  compare(a.stroke_rad, b.stroke_rad), compare(a.stroke_rate_rad_s, b.stroke_rate_rad_s);
  compare(a.rotation_rad, b.rotation_rad), compare(a.rotation_rate_rad_s, b.rotation_rate_rad_s);
  return d;
}

TEST(Mirror, MirroredVehicleMovesMirrored) {
  model::Vehicle symmetric = test::nominal();
  symmetric.torso.com_m.y = symmetric.torso.inertia_kg_m2.xy = symmetric.torso.inertia_kg_m2.yz = 0;
  symmetric.right = mirrored(symmetric).right;
  FlapperState askew = spinning({2, -1, 3}, 20);
  askew.position_m[1] = 0.1;
  askew.velocity_m_s[1] = -0.2;
  askew.attitude[1] = 0.36, askew.attitude[2] = 0, askew.attitude[3] = 0.48;
  const struct {
    const char* name;
    model::Vehicle vehicle;
    FlapperState start;
    Input input;
  } cases[] = {{"identified", test::identified(), askew, {10, 1, 0.5, 0.08}},
               {"nominal", test::nominal(), askew, {10, 1, 0.5, 0.08}},
               {"own_mirror", symmetric, {}, {10, 0, 0.5, 0}}};
  for (const auto& c : cases) {
    constexpr int kSteps = 2000;
    constexpr double kNudge = 1e-9;
    Batch<double> b(3, c.vehicle, options(kStep, kGravity));
    b.set_vehicle(1, mirrored(c.vehicle));
    FlapperState nudged = c.start;
    nudged.stroke_rad[0] += kNudge;
    b.reset(0, c.start), b.set_input(0, c.input);
    b.reset(1, mirrored(c.start)), b.set_input(1, mirrored(c.input));
    b.reset(2, nudged), b.set_input(2, c.input);
    double difference = 0, growth = 0;
    for (int n = 0; n < kSteps; ++n) {
      b.step(1);
      difference = std::max(difference, largest_difference(b.state(0), mirrored(b.state(1))));
      growth = std::max(growth, largest_difference(b.state(0), b.state(2)) / kNudge);
    }
    // every step rounds, and what it rounds away grows no more than the nudge did
    expect_below(std::string(c.name) + "_to_its_mirror", difference, kSteps * kEps * growth);
    EXPECT_LT(growth, 1e5) << "chaos would hide a difference";
  }
}

// ---- scale

/// The vehicle in other units: lengths and times times `a`, masses times a^3. Speeds, densities, angles and voltages
/// keep their numbers.
model::Vehicle scaled(model::Vehicle v, double a) {
  const std::pair<const char*, int> powers[] = {{"flapping_Hz", -1},
                                                {"hold_s", 1},
                                                {"mass_kg", 3},
                                                {"inertia_kg_m2", 5},
                                                {"com_m", 1},
                                                {"shoulder_m", 1},
                                                {"below_m", 1},
                                                {"above_m", 1},
                                                {"around_m", 1},
                                                {"wing_length_m", 1},
                                                {"mean_chord_m", 1},
                                                {"damping_Nm_s", 4},
                                                {"friction_Nm", 3},
                                                {"stiffness_positive_Nm_rad", 3},
                                                {"stiffness_negative_Nm_rad", 3},
                                                {"resistance_ohm", -2},
                                                {"torque_constant_Nm_A", 1},
                                                {"compliance_rad_Nm", -3},
                                                {"twist_rad_N", -2},
                                                {"drag_area_m2", 2},
                                                {"centre_z_m", 1}};
  for (const model::Parameter& p : model::parameters(v))
    for (const auto& [name, power] : powers)
      if (("." + p.path + ".").find("." + std::string(name) + ".") != std::string::npos ||
          p.path.ends_with("." + std::string(name)) || p.path.ends_with("rotor_" + std::string(name)))
        *p.value *= std::pow(a, power);
  return v;
}

FlapperState scaled(FlapperState s, double a) {
  for (double& x : s.position_m) x *= a;
  for (auto* rates : {s.stroke_rate_rad_s, s.rotation_rate_rad_s})
    for (int i = 0; i < 2; ++i) rates[i] /= a;
  for (double& w : s.body_rate_rad_s) w /= a;
  return s;
}

const FlapperState kTumbling = [] {
  FlapperState s;
  s.velocity_m_s[0] = 0.3, s.velocity_m_s[1] = -0.2;
  s.body_rate_rad_s[0] = 2, s.body_rate_rad_s[1] = -1, s.body_rate_rad_s[2] = 3;
  return s;
}();

/// The flight of a scaled vehicle in the units of the vehicle itself, step by step.
template <class T>
std::vector<FlapperState> scaled_flight(const model::Vehicle& v, double a, int steps,
                                        const FlapperState& start = kTumbling,
                                        const Input& input = {10, 1, 0.5, 0.08}) {
  Batch<T> b(1, scaled(v, a), options(kStep * a, kGravity / a));
  b.reset(0, scaled(start, a));
  b.set_input(0, input);
  std::vector<FlapperState> flight;
  for (int n = 0; n < steps; ++n) b.step(1), flight.push_back(scaled(b.state(0), 1 / a));
  return flight;
}

/// The shipped vehicles, and one with effects that bring inertias, springs and air of their own.
std::vector<model::Vehicle> vehicles_to_scale() {
  model::Vehicle v = test::identified();
  v.effects["added_mass"] = {{"factor", 1}};
  v.effects["gear_backlash"] = {{"gap_rad", 0.02}};
  v.effects["stop_compliance"] = {{"compliance_rad_Nm", 50}, {"damping_ratio", 0.5}};
  v.effects["wing_flexibility"] = {{"twist_rad_N", 0.5}};
  v.effects["rotational_lift"] = {{"factor", 1}};
  v.effects["wake_capture"] = {{"gain", 0.1}, {"decay", 0.15}};
  v.effects["clap_and_fling"] = {{"gain", 0.5}, {"contact_rad", 1.3}};
  v.effects["body_drag"] = {{"drag_area_m2", 0.0015}, {"centre_z_m", 0.01}};
  return {test::nominal(), test::identified(), v};
}

// A change of units by powers of two rounds nothing, unless a number leaves the normal range of single precision.
TEST(Scale, OfUnitsChangesNoBitOfAFlight) {
  for (const model::Vehicle& v : vehicles_to_scale()) {
    const std::vector<FlapperState> flight = scaled_flight<float>(v, 1, 2000);
    for (const double a : {8.0, 0x1p-3, 0x1p-4, 0x1p-6}) {  // from a hummingbird of 6 kg to one of 0.05 mg
      const std::vector<FlapperState> other = scaled_flight<float>(v, a, 2000);
      std::size_t n = 0;
      while (n < flight.size() && largest_difference(flight[n], other[n]) == 0) ++n;
      EXPECT_EQ(n, flight.size()) << v.name << " at " << a << " differs from this step on";
    }
  }
}

TEST(Scale, OfAVehicleOf5MilligrammesIsFlownInFloatAsInDouble) {
  const double a = std::cbrt(5e-6 / mechanics(test::nominal(), {}).mass);  // no power of two
  for (const model::Vehicle& v : vehicles_to_scale()) {
    const auto flight = [&]<class T>(T) { return scaled_flight<T>(v, a, 300, {}, {9, 0.3, 0.2, 0.02}); };  // a beat
    const std::vector<FlapperState> single = flight(1.0F), twice = flight(1.0);
    double error[2] = {0, 0}, largest[2] = {0, 0};
    for (std::size_t n = 19; n < single.size(); n += 20)
      for (std::size_t i = 0; i < 2; ++i) {
        const auto compare = [&](std::size_t k, double x, double y) {
          error[k] = std::max(error[k], std::abs(x - y)), largest[k] = std::max(largest[k], std::abs(y));
        };
        compare(0, single[n].rotation_rate_rad_s[i], twice[n].rotation_rate_rad_s[i]);
        compare(0, single[n].stroke_rate_rad_s[i], twice[n].stroke_rate_rad_s[i]);
        compare(1, single[n].body_rate_rad_s[i], twice[n].body_rate_rad_s[i]);
      }
    // 300 roundings of 6e-8, which add up like noise, 1e-6, and grow a little
    expect_below(v.name + "_5_mg_hinges", error[0] / largest[0], 1e-5);
    expect_below(v.name + "_5_mg_body", error[1] / largest[1], 1e-5);
  }
}

// ---- stops

/// Follows one hinge from step to step.
struct Watch {
  int contacts = 0, offences = 0;
  void look(const model::Joint& joint, double angle_before, double angle, double rate) {
    const bool lower = angle_before == joint.lower_rad, upper = angle_before == joint.upper_rad;
    contacts += lower || upper;
    offences += angle < joint.lower_rad || angle > joint.upper_rad;
    offences += (lower && rate < 0) || (upper && rate > 0);  // on its stop it rests or leaves
  }
};

TEST(Stops, HoldDrivenWings) {
  const model::Vehicle v = test::identified();
  for (const Start start : {Start::flying, Start::welded}) {
    Batch<double> b(1, v, options(kStep, kGravity));
    b.reset(0, {}, start);
    b.set_input(0, {18, 2, 1, 0.1});
    Watch stroke, rotation;
    FlapperState before = b.state(0);
    for (int n = 0; n < 3000; ++n) {
      b.step(1);
      const FlapperState now = b.state(0);
      for (std::size_t i = 0; i < 2; ++i) {
        stroke.look(side(v, i).stroke, before.stroke_rad[i], now.stroke_rad[i], now.stroke_rate_rad_s[i]);
        rotation.look(side(v, i).rotation, before.rotation_rad[i], now.rotation_rad[i], now.rotation_rate_rad_s[i]);
      }
      before = now;
    }
    EXPECT_EQ(stroke.offences + rotation.offences, 0);
    EXPECT_GT(stroke.contacts, 10);
    EXPECT_GT(rotation.contacts, 1000);
    EXPECT_EQ(b.status(0), 0u);
  }
}

TEST(Stops, DoNotThrowBack) {
  const double limit = 0.8, rate = 130;
  const model::Joint stopped{-limit, limit, 0, 0};
  for (const bool stroke : {true, false})
    for (const int sense : {+1, -1}) {
      const model::Vehicle v = without_springs(conservative(stroke ? stopped : kLocked, stroke ? kLocked : stopped));
      Batch<double> b(1, v, options(kStep, 0));
      const auto angle = [&] { return (stroke ? b.state(0).stroke_rad : b.state(0).rotation_rad)[1]; };
      const auto speed = [&] { return (stroke ? b.state(0).stroke_rate_rad_s : b.state(0).rotation_rate_rad_s)[1]; };
      FlapperState s;
      (stroke ? s.stroke_rate_rad_s : s.rotation_rate_rad_s)[1] = sense * rate;
      b.reset(0, s, Start::welded);
      const int flight = static_cast<int>(limit / (rate * kStep));  // whole steps before the one that lands
      b.step(flight);
      EXPECT_NEAR(angle(), sense * rate * flight * kStep, flight * kEps);
      b.step(1);
      for (int n = 0; n < 50; ++n) {
        EXPECT_EQ(angle(), sense * limit);
        b.step(1);
        EXPECT_NEAR(speed(), 0, 2 * kEps * rate);
      }
    }
}

/// Throws the wings of force-free vehicles at their stops and holds every step against conservation.
void throw_at_stops(const std::string& name, double right_stroke_rate, int least_landings_right) {
  std::mt19937_64 engine{11};
  const auto random = [&](double scale) { return scale * (2 * static_cast<double>(engine() >> 11) * 0x1p-53 - 1); };
  const model::Vehicle v = without_springs(conservative({-0.8, 0.8, 0, 0}, {-0.7, 0.7, 0, 0}));
  int landings[2] = {0, 0};
  double worst_energy = -1, worst_spin = 0;  // over their bounds
  for (int trial = 0; trial < 100; ++trial) {
    Batch<double> b(1, v, options(kFine, 0));
    FlapperState before;
    for (double& rate : before.body_rate_rad_s) rate = random(10);
    for (int i = 0; i < 2; ++i) {
      before.stroke_rad[i] = random(0.2), before.rotation_rad[i] = random(0.6);
      before.stroke_rate_rad_s[i] = random(i == 0 ? 100 : right_stroke_rate);
      before.rotation_rate_rad_s[i] = random(200);
    }
    b.reset(0, before);
    Mechanics last = mechanics(v, before);
    double jumped = 0;
    for (int n = 0; n < steps_in(0.025, kFine); ++n) {
      b.step(1);
      const FlapperState now = b.state(0);
      const Mechanics m = mechanics(v, now);
      double jump = 0;
      for (int i = 0; i < 2; ++i) {
        landings[i] += std::abs(now.stroke_rad[i]) == 0.8 && std::abs(before.stroke_rad[i]) < 0.8;
        jump = std::max({jump, std::abs(now.stroke_rate_rad_s[i] - before.stroke_rate_rad_s[i]),
                         std::abs(now.rotation_rate_rad_s[i] - before.rotation_rate_rad_s[i])});
      }
      // angular momentum: the step holds inertial torques of up to 4 energies (inertia turns by twice the angle), and an impact
      // puts others in their place. Energy: a step's own error (see drift); and rates of mid-step are off by half of the jumps of
      // this step and the last, which the torques, of second degree, feel twice
      const double rate = std::max(fastest_rate(before), fastest_rate(now)), turn = kFine * rate;
      const double energy_bound = last.energy * turn * (turn + 4 * (jump + jumped) / rate);
      worst_energy = std::max(worst_energy, (m.energy - last.energy) / energy_bound);
      worst_spin = std::max(worst_spin, (m.spin - last.spin).norm() / (8 * last.energy * kFine));
      before = now;
      last = m;
      jumped = jump;
    }
  }
  expect_below(name + "_energy_gained_over_bound", worst_energy, 1);
  expect_below(name + "_angular_momentum_lost_over_bound", worst_spin, 1);
  EXPECT_GT(landings[0], 50);
  EXPECT_GE(landings[1], least_landings_right);
}

TEST(Stops, TakeEnergyAndLeaveMomentum) { throw_at_stops("impact", 5, 0); }

// Fails: a stroke thrown at its stop by the landing of the other is stopped without the body feeling it.
TEST(Stops, TakeEnergyAndLeaveMomentumOfBothStrokes) { throw_at_stops("impacts", 100, 50); }

// ---- order

/// Error at half the step, as a part of that at the whole.
double part_left(const std::function<double(double)>& error, double step_s) {
  return error(step_s / 2) / error(step_s);
}

// Broadside on (theta = 0, so alpha = pi/2), the air's moment on a stroke is k psi'^2, and 1/psi' grows by k t/I. With rates of the
// step's start it would be first order, and half of the error would be left.
TEST(Order, OfAWingThatTheAirSlowsDownIsSecond) {
  model::Vehicle v = without_springs(conservative(kFree, kLocked));
  v.air_density_kg_m3 = 1.18;
  constexpr double kRate_rad_s = 200, kTime_s = 0.016;
  const auto rate_after = [&](double seconds, double step_s) {
    Batch<double> b(1, v, options(step_s, 0));
    FlapperState s;
    s.stroke_rad[0] = -1.7;
    s.stroke_rate_rad_s[0] = kRate_rad_s;
    b.reset(0, s, Start::welded);
    b.step(steps_in(seconds, step_s));
    return b.state(0).stroke_rate_rad_s[0];
  };
  const double per_s = (1 / rate_after(1e-3, 1e-6) - 1 / kRate_rad_s) / 1e-3;
  EXPECT_GT(per_s * kRate_rad_s * kTime_s, 0.5) << "the air does too little";
  const double exact = 1 / (1 / kRate_rad_s + per_s * kTime_s);
  EXPECT_NEAR(rate_after(kTime_s, 1e-6), exact, 1e-5 * exact) << "of this form is the solution";
  const auto error = [&](double step_s) { return std::abs(rate_after(kTime_s, step_s) - exact); };
  EXPECT_NEAR(part_left(error, 500e-6), 0.25, 0.06);
  EXPECT_LT(error(250e-6), 0.002 * exact);
}

// A stroke swings against its stop, which takes its rate, and the spring pulls it off again: from the landing at t' on it is
//   psi = rest + (stop - rest) cos(w (t - t'))
// Starts are spread over what a step turns, as the error depends on where in the step it lands.
TEST(Order, OfAStrokeThatItsSpringPullsOffItsStopIsSecond) {
  constexpr double kRest_rad = 0.2, kTime_s = 0.016;
  model::Vehicle v = conservative(kFree, kLocked);
  for (model::Side* side : sides(v)) side->spring.rest_angle_rad = kRest_rad;
  const Oscillator o(v.left);
  const double w = std::sqrt(o.stiffness / o.inertia), stop = kFree.upper_rad;
  constexpr int kStarts = 64;
  const auto error = [&](double step_s) {
    double sum = 0;
    Batch<double> b(kStarts, v, options(step_s, 0));
    for (int i = 0; i < kStarts; ++i) {
      FlapperState s;
      s.stroke_rad[0] = -1.4 - 0.2 * i / kStarts;
      b.reset(static_cast<std::size_t>(i), s, Start::welded);
    }
    b.step(steps_in(kTime_s, step_s));
    for (int i = 0; i < kStarts; ++i) {
      const double swing = 1.4 + 0.2 * i / kStarts + kRest_rad;
      const double landed_s = std::acos((kRest_rad - stop) / swing) / w;
      EXPECT_GT(kTime_s, landed_s);
      const double rate = -(stop - kRest_rad) * w * std::sin(w * (kTime_s - landed_s));
      sum += std::pow(b.state(static_cast<std::size_t>(i)).stroke_rate_rad_s[0] - rate, 2);
    }
    return std::sqrt(sum / kStarts) / (w * stop);
  };
  EXPECT_NEAR(part_left(error, 500e-6), 0.25, 0.06);
  EXPECT_LT(error(250e-6), std::pow(250e-6 * w, 2));
}

// ---- precision

TEST(Precision, FloatFliesAsDouble) {
  const double seconds = 0.3;
  const int steps = steps_in(seconds, kStep);
  for (const model::Vehicle& v : {test::nominal(), test::identified()}) {
    Batch<float> single(1, v, options(kStep, kGravity));
    Batch<double> twice(1, v, options(kStep, kGravity));
    single.set_input(0, {10, 0, 0, 0});
    twice.set_input(0, {10, 0, 0, 0});
    double error = 0, speed = 0, rate = 0;
    for (int n = 0; n < steps; n += 20) {
      single.step(20);
      twice.step(20);
      const FlapperState s = twice.state(0);
      error = std::max(error, (Vector3d(single.state(0).position_m) - Vector3d(s.position_m)).norm());
      speed = std::max(speed, Vector3d(s.velocity_m_s).norm());
      rate = std::max(rate, Vector3d(s.body_rate_rad_s).norm());
    }
    // each step rounds the velocity, which then acts for T/2 on average, and the body rate, which tilts a
    // thrust of about the weight: g rate T^3/6
    const double rounding = steps * static_cast<double>(std::numeric_limits<float>::epsilon()) / 2;
    const double bound = rounding * (speed * seconds / 2 + kGravity * rate * std::pow(seconds, 3) / 6);
    EXPECT_GT(error, 0);
    expect_below(v.name + "_float_mm", 1e3 * error, 1e3 * bound);
    EXPECT_LT(error, 1e-4) << "small: below the noise of motion capture";
  }
}

Vector3d com_after_flight(const model::Vehicle& v, double step_s) {
  Batch<double> b(1, v, options(step_s, kGravity));
  b.set_input(0, {10, 0, 0, 0});
  b.step(steps_in(0.3, step_s));
  return mechanics(v, b.state(0)).com;
}

TEST(Precision, StepOf100MicrosecondsHasConverged) {
  for (const model::Vehicle& v : {test::nominal(), test::identified()})
    expect_below(v.name + "_step_mm", 1e3 * (com_after_flight(v, kStep) - com_after_flight(v, 5e-6)).norm(), 3);

  const model::Vehicle v = test::nominal();
  Batch<double> b(1, v, options(kStep, kGravity));
  b.reset(0, {}, Start::welded);
  b.set_input(0, {10, 0, 0, 0});
  b.step(steps_in(1, kStep));
  const double before = b.held_impulse(0).force_N_s[2], seconds = 17 / v.driver.flapping_Hz;
  b.step(steps_in(seconds, kStep));
  const double thrust = (b.held_impulse(0).force_N_s[2] - before) / seconds;
  expect_below("thrust_per_cent", 100 * std::abs(thrust / 0.1258 - 1), 0.5);  // 0.1258 N: converged
}

}  // namespace
}  // namespace flappy::sim::physics_test
