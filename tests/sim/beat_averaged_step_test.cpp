// Robots that are known by the beat, as they fly: against an integration that knows nothing of the kernel, and against closed forms.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <stdexcept>

#include "flappy/batch.hpp"
#include "flappy/vehicle_file.hpp"
#include "sim/storage.hpp"
#include "vehicles.hpp"

namespace flappy::sim::mean_step_test {
namespace {

using Eigen::Matrix3d, Eigen::Quaterniond, Eigen::Vector3d;
using model::BeatAveraged, model::Vehicle;

Vehicle flapper() { return model::read_any_vehicle(test::source_path("configs/vehicles/flapper_nimble.toml")); }

BatchOptions options(double step_s) {
  BatchOptions o;
  o.step_s = step_s;
  o.threads = 1;
  o.world.ground_z_m = -100;
  return o;
}

/// A body without symmetry under thrust of two lagging sides, a force that is off the origin, drag and damping.
Vehicle crooked() {
  Vehicle v = flapper();
  v.torso.mass_kg = 0.1;
  v.torso.com_m = {0.004, -0.003, 0.006};
  v.torso.inertia_kg_m2 = {5e-4, 3e-4, 4e-4, 3e-5, -2e-5, 4e-5};
  BeatAveraged& b = *v.beat_averaged;
  b.inputs = {{"left", 0, 1, 0.1, {1, 0.5, 0, 0}}, {"right", 0, 1, 0.1, {1, -0.5, 0, 0}}};
  b.actuators = {{"left_Hz", "left", BeatAveraged::Role::flapping, 25, 1, 0.05},
                 {"right_Hz", "right", BeatAveraged::Role::flapping, 25, 1, 0.08}};
  b.coefficients = {{"k", 0.03, 0}, {"d", 0.004, 0}, {"r", 2e-5, 0}};
  b.wrenches = {{"sides", {0.01, 0.02, 0.03}, {"", "", "k * (left_Hz + right_Hz)", "", "", ""}},
                {"air",
                 {0, 0, 0},
                 {"-d * (left_Hz + right_Hz) * v_x", "-2 * d * speed * v_y", "",
                  "0.01 * k * (left_Hz - right_Hz) - r * 30 * w_x", "-r * 30 * w_y", "-r * 30 * w_z^2 * w_z"}}};
  return v;
}

struct Motion {
  Vector3d position, velocity, rate;  // of the origin, in W; rate in B
  Quaterniond attitude = Quaterniond::Identity();
  double left_Hz = 0, right_Hz = 0;
};

/// The same robot by Newton and Euler about the torso's origin:
///   m (a + w' x c + w x (w x c)) = F        m c x a + J w' + w x J w = M        J: about the origin
/// in fourth-order steps (Runge, Kutta).
Motion integrated(Motion x, double left, double right, double seconds, int steps) {
  const Vector3d c(0.004, -0.003, 0.006);
  const double m = 0.1;
  Matrix3d I;
  I << 5e-4, 3e-5, 4e-5, 3e-5, 3e-4, -2e-5, 4e-5, -2e-5, 4e-4;
  const Matrix3d J = I + m * (c.squaredNorm() * Matrix3d::Identity() - c * c.transpose());
  const auto skew = [](const Vector3d& v) {
    Matrix3d s;
    s << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
    return s;
  };
  const auto rates = [&](const Motion& s) {
    const Matrix3d R = s.attitude.toRotationMatrix();
    const Vector3d v = R.transpose() * s.velocity, w = s.rate;
    const double sum = s.left_Hz + s.right_Hz;
    const Vector3d thrust(0, 0, 0.03 * sum), air(-0.004 * sum * v.x(), -0.008 * v.norm() * v.y(), 0);
    const Vector3d force = thrust + air + m * 9.81 * (R.transpose() * Vector3d(0, 0, -1));
    Vector3d moment =
        Vector3d(0.01, 0.02, 0.03).cross(thrust) +
        Vector3d(3e-4 * (s.left_Hz - s.right_Hz) - 6e-4 * w.x(), -6e-4 * w.y(), -6e-4 * std::pow(w.z(), 3));
    moment += c.cross(m * 9.81 * (R.transpose() * Vector3d(0, 0, -1)));
    Eigen::Matrix<double, 6, 6> A;
    A << m * Matrix3d::Identity(), -m * skew(c), m * skew(c), J;
    Eigen::Matrix<double, 6, 1> b;
    b << force - m * w.cross(w.cross(c)), moment - w.cross(J * w);
    const Eigen::Matrix<double, 6, 1> a = A.partialPivLu().solve(b);
    Motion d;
    d.position = s.velocity;
    d.velocity = R * a.head<3>();
    d.rate = a.tail<3>();
    d.attitude = s.attitude * Quaterniond(0, w.x() / 2, w.y() / 2, w.z() / 2);
    d.left_Hz = (25 * left + 1 - s.left_Hz) / 0.05;
    d.right_Hz = (25 * right + 1 - s.right_Hz) / 0.08;
    return d;
  };
  const auto plus = [](Motion s, double h, const Motion& d) {
    s.position += h * d.position, s.velocity += h * d.velocity, s.rate += h * d.rate;
    s.attitude.coeffs() += h * d.attitude.coeffs();
    s.left_Hz += h * d.left_Hz, s.right_Hz += h * d.right_Hz;
    return s;
  };
  const double h = seconds / steps;
  for (int i = 0; i < steps; ++i) {
    const Motion a = rates(x), b = rates(plus(x, h / 2, a)), e = rates(plus(x, h / 2, b)), f = rates(plus(x, h, e));
    x = plus(plus(plus(plus(x, h / 6, a), h / 3, b), h / 3, e), h / 6, f);
    x.attitude.normalize();
  }
  return x;
}

/// How far a flight of 0.4 s ends from the integrated one: position, m, and rate, rad/s.
std::pair<double, double> distance(double step_s) {
  Batch<double> batch(1, crooked(), options(step_s));
  FlapperState s;
  s.attitude[0] = 0.9, s.attitude[1] = 0.3, s.attitude[2] = -0.1, s.attitude[3] = std::sqrt(1 - 0.91);
  s.velocity_m_s[0] = 1, s.velocity_m_s[1] = -0.5, s.velocity_m_s[2] = 0.3;
  s.body_rate_rad_s[0] = 2, s.body_rate_rad_s[1] = -3, s.body_rate_rad_s[2] = 1;
  batch.reset(0, s);
  batch.set_input(0, {0.4, 0.2, 0, 0});  // 0.6 and 0.4, as if they had been there for long
  const auto fly = [&](double seconds) { batch.step(static_cast<int>(std::lround(seconds / step_s))); };
  fly(0.2);
  batch.set_input(0, {0.2, -0.1, 0, 0});
  fly(0.2);
  Motion x;
  x.position = Vector3d::Zero(), x.velocity = Vector3d(1, -0.5, 0.3), x.rate = Vector3d(2, -3, 1);
  x.attitude = Quaterniond(0.9, 0.3, -0.1, std::sqrt(1 - 0.91));
  x.left_Hz = 25 * 0.6 + 1, x.right_Hz = 25 * 0.4 + 1;
  x = integrated(x, 0.6, 0.4, 0.2, 4000);
  x = integrated(x, 0.1 + 0.2 - 0.05, 0.1 + 0.2 + 0.05, 0.2, 4000);
  const FlapperState e = batch.state(0);
  return {(Vector3d(e.position_m) - x.position).norm(), (Vector3d(e.body_rate_rad_s) - x.rate).norm()};
}

// The scheme is of second order, so that half the step leaves a quarter of the error.
TEST(BeatAveragedStep, ConvergesToNewtonAndEuler) {
  const auto [coarse_m, coarse_rad_s] = distance(1e-3);
  const auto [fine_m, fine_rad_s] = distance(5e-4);
  EXPECT_LT(coarse_m, 2e-4);
  EXPECT_NEAR(coarse_m / fine_m, 4, 0.4);
  EXPECT_NEAR(coarse_rad_s / fine_rad_s, 4, 0.4);
}

// Nothing acts: R I w and the speed stay. A step of h leaves (w h)^2 of it, 0.01 for 100 steps in a turn.
TEST(BeatAveragedStep, KeepsMomentum) {
  Vehicle v = crooked();
  v.beat_averaged->wrenches = {{"none", {}, {"0", "", "", "", "", ""}}};
  BatchOptions o = options(5e-4);
  o.world.gravity_m_s2 = 0;
  Batch<double> batch(1, v, o);
  FlapperState s;
  s.body_rate_rad_s[0] = 10, s.body_rate_rad_s[1] = -7, s.body_rate_rad_s[2] = 4;
  s.velocity_m_s[0] = 1;
  batch.reset(0, s);
  Matrix3d I;
  I << 5e-4, 3e-5, 4e-5, 3e-5, 3e-4, -2e-5, 4e-5, -2e-5, 4e-4;
  const Vector3d before = I * Vector3d(10, -7, 4), c(0.004, -0.003, 0.006);
  const Vector3d drifts = Vector3d(1, 0, 0) + Vector3d(10, -7, 4).cross(c);  // of the centre of mass
  batch.step(2000);
  const FlapperState e = batch.state(0);
  const Matrix3d R =
      Quaterniond(e.attitude[0], e.attitude[1], e.attitude[2], e.attitude[3]).normalized().toRotationMatrix();
  EXPECT_LT((R * I * Vector3d(e.body_rate_rad_s) - before).norm(), 3e-4 * before.norm());
  EXPECT_GT((Vector3d(e.body_rate_rad_s) - Vector3d(10, -7, 4)).norm(), 1);  // it tumbles
  EXPECT_LT((Vector3d(e.position_m) + R * c - (c + drifts)).norm(), 1e-9);
}

/// Level flight of a Flapper whose actuators do nothing, in 1 s.
FlapperState after_a_second(Vehicle v, double gravity_m_s2, double speed_m_s, const std::string& lift_N = "") {
  v.beat_averaged->wrenches = {{"none", {}, {"0", "", lift_N, "", "", ""}}};
  BatchOptions o = options(1e-3);
  o.world.gravity_m_s2 = gravity_m_s2;
  Batch<double> batch(1, v, o);
  FlapperState s;
  s.velocity_m_s[0] = speed_m_s;
  batch.reset(0, s);
  batch.set_input(0, {0.588, 0, 0, 0});  // 14.7 Hz
  batch.step(1000);
  return batch.state(0);
}

// v' = -b v from 2 m/s, with a wind of 0.5: v = 0.5 + 1.5 exp(-b t); v' = -c v^2 against drag: v = v0 / (1 + c v0 t).
TEST(BeatAveragedStep, EffectsActByTheirMeans) {
  Vehicle v = flapper();
  v.effects["flapping_counter_force"] = {{"x_per_s", 3}, {"y_per_s", 0}, {"z_per_s", 0}};
  v.effects["wind"] = {{"x_m_s", 0.5}, {"y_m_s", 0}, {"z_m_s", 0}};
  EXPECT_NEAR(after_a_second(v, 0, 2).velocity_m_s[0], 0.5 + 1.5 * std::exp(-3.0), 1e-5);
  v.effects.clear();
  v.effects["body_drag"] = {{"drag_area_m2", 0.01}, {"centre_z_m", 0}};
  const double c = 0.5 * v.air_density_kg_m3 * 0.01 / v.torso.mass_kg;
  EXPECT_NEAR(after_a_second(v, 0, 2).velocity_m_s[0], 2 / (1 + c * 2), 1e-5);
  v.effects.clear();
  EXPECT_NEAR(after_a_second(v, 9.81, 0).position_m[2], -9.81 / 2, 1e-9);
}

// A robot that hovers and is pushed takes a weight along, which hung at rest. It is compared with two masses and a stiff spring, which stretches by some um,
// integrated in fourth-order steps; the kernel's steps of 1 ms are of first order for the weight.
TEST(BeatAveragedStep, ASlungLoadSwings) {
  for (const double speed_m_s : {0.2, 1.5}) {
    SCOPED_TRACE(speed_m_s);
    Vehicle v = flapper();
    v.torso.com_m = {};
    const double mass = 0.03, length = 0.3, gravity = 9.81, damping = 2 * 0.05 * std::sqrt(gravity / length);
    const double robot = v.torso.mass_kg, lift_N = 1.1 * (robot + mass) * gravity;
    v.effects["slung_load"] = {
        {"mass_kg", mass}, {"length_m", length}, {"moment_x_kg_m", 0}, {"moment_y_kg_m", 0}, {"z_m", 0}};
    using Eight = Eigen::Matrix<double, 8, 1>;  // places and velocities along x and z of robot and weight
    constexpr double kStiff_N_m = 1e5;
    const auto rate = [&](const Eight& y) {
      const Eigen::Vector2d d = y.segment<2>(2) - y.head<2>();
      const Eigen::Vector2d pull = kStiff_N_m * (d.norm() - length) * d.normalized();
      Eight r;
      r << y.tail<4>(), pull / robot + Eigen::Vector2d(0, lift_N / robot - gravity),
          -pull / mass - damping * y.tail<2>() - Eigen::Vector2d(0, gravity);
      return r;
    };
    Eight y;
    // stretched by the tension of the begin, or robot and weight would tremble
    const double pull_N = mass * (speed_m_s * speed_m_s / length + lift_N / robot) / (1 + mass / robot);
    y << 0, 0, 0, -length - pull_N / kStiff_N_m, speed_m_s, 0, 0, 0;
    constexpr double kStep_s = 2e-5;
    double steepest = 0;
    for (int i = 0; i < 50'000; ++i) {
      const Eight a = rate(y), b = rate(y + kStep_s / 2 * a), c = rate(y + kStep_s / 2 * b), d = rate(y + kStep_s * c);
      y += kStep_s / 6 * (a + 2 * b + 2 * c + d);
      steepest = std::max(steepest, std::abs(y[2] - y[0]) / length);
    }
    EXPECT_EQ(steepest > 0.6, speed_m_s > 1) << steepest;
    const FlapperState s = after_a_second(v, gravity, speed_m_s, std::to_string(lift_N));
    // in the first step the weight still pulls by its rest, with g in place of 1.1 g
    const double late_m_s = 0.1 * gravity * mass / robot * 1e-3;
    EXPECT_NEAR(s.velocity_m_s[0], y[4], 2e-3 * speed_m_s);
    EXPECT_NEAR(s.position_m[0], y[0], 1e-3 * speed_m_s);
    EXPECT_NEAR(s.velocity_m_s[2], y[5], late_m_s + 1e-3 * speed_m_s);
  }
}

// Robots of one batch share their expressions: one with a torn wing sinks, the other hovers.
TEST(BeatAveragedStep, ALostActuatorIsARobotsOwn) {
  Vehicle v = flapper(), torn = v;
  // in the order of names: dihedral, left_Hz, right_Hz, yaw_throw
  torn.effects["actuator_loss"] = {{"loss_1", 0}, {"loss_2", 0.1}, {"loss_3", 0.1}};
  Batch<double> batch(2, v, options(1e-3));
  batch.set_vehicle(1, torn);
  for (int i = 0; i < 2; ++i) {
    batch.reset(i, {}, Start::flying);
    batch.set_input(i, {0.588, 0, 0, 0});
  }
  batch.step(100);
  EXPECT_NEAR(batch.state(1).velocity_m_s[2] - batch.state(0).velocity_m_s[2],
              -0.1 * 0.0344 * 25 * 0.588 * 2 / v.torso.mass_kg * 0.1, 1e-6);
}

/// When an input that begins after 50 ms has shown: the thrust from its change of speed, step by step.
std::vector<double> thrust_of(const Vehicle& v) {
  BatchOptions o = options(1e-3);
  o.world.gravity_m_s2 = 0;
  Batch<double> batch(1, v, o);
  batch.reset(0, {}, Start::flying);
  std::vector<double> thrust;
  for (int i = 0; i < 300; ++i) {
    const double before = batch.state(0).velocity_m_s[2];
    batch.set_input(0, {i < 50 ? 0.0 : 0.5, 0, 0, 0});
    batch.step(1);
    thrust.push_back((batch.state(0).velocity_m_s[2] - before) / 1e-3 * v.torso.mass_kg);
  }
  return thrust;
}

TEST(BeatAveragedStep, InputsAreLateAndLag) {
  Vehicle v = flapper();
  const double whole = 0.0344 * 25 * 0.5 * 2;
  const std::vector<double> prompt = thrust_of(v);
  EXPECT_NEAR(prompt[49], 0, 1e-9);
  EXPECT_NEAR(prompt[50], whole, 1e-6);
  v.effects["command_delay"] = {{"delay_s", 0.0305}};
  const std::vector<double> late = thrust_of(v);
  EXPECT_NEAR(late[79], 0, 1e-9);
  EXPECT_NEAR(late[80], whole / 2, 1e-6);  // between two steps, a share of each
  EXPECT_NEAR(late[81], whole, 1e-6);
  v.effects.clear();
  v.effects["driver_bandwidth"] = {{"lag_s", 0.05}};
  const std::vector<double> slow = thrust_of(v);
  for (const int i : {50, 80, 150})  // half-way in its step
    EXPECT_NEAR(slow[static_cast<std::size_t>(i)], whole * (1 - std::exp(-(i - 50 + 0.5) * 1e-3 / 0.05)), 1e-6) << i;
}

// What a late robot remembers is its own past, not a place in the batch's: put into a batch that has flown for another time, it flies on alike.
TEST(BeatAveragedStep, SnapshotsRememberInputsByTheirAge) {
  Vehicle v = flapper();
  v.effects["command_delay"] = {{"delay_s", 0.0305}};
  Batch<double> from(1, v, options(1e-3)), to(1, v, options(1e-3));
  const auto fly = [](Batch<double>& batch, int first, int last) {
    for (int i = first; i < last; ++i) {
      batch.set_input(0, {0.5 + 0.01 * (i % 17), 0.001 * (i % 5), 0, 0});
      batch.step(1);
    }
  };
  fly(from, 0, 640);  // more than are remembered
  fly(to, 0, 37);
  const auto [rows, memory] = storage_of(from).get_beat_averaged(0);
  storage_of(to).put_beat_averaged(0, rows, memory);
  storage_of(to).blocks[0] = storage_of(from).blocks[0];
  fly(from, 640, 700);
  fly(to, 640, 700);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(to.state(0).position_m[i], from.state(0).position_m[i]) << i;
    EXPECT_EQ(to.state(0).body_rate_rad_s[i], from.state(0).body_rate_rad_s[i]) << i;
  }
}

TEST(BeatAveragedStep, ControllersOutputsAreMixedWithinRange) {
  // left = 0.1 + 1 A + 0.5 D, at most 1
  Vehicle v = crooked();
  v.torso.com_m = {};
  v.beat_averaged->wrenches = {{"left", {}, {"", "left_Hz", "", "", "", ""}},
                               {"right", {}, {"", "", "right_Hz", "", "", ""}}};
  for (BeatAveraged::Actuator& a : v.beat_averaged->actuators) a.lag_s = a.offset = 0;
  BatchOptions o = options(1e-3);
  o.world.gravity_m_s2 = 0;
  const auto driven = [&](const Input& input) {
    Batch<double> batch(1, v, o);
    batch.reset(0, {});
    batch.set_input(0, input);
    batch.step(1);
    const FlapperState s = batch.state(0);
    return std::pair{s.velocity_m_s[1] * 100 / 25, s.velocity_m_s[2] * 100 / 25};  // m / (h gain)
  };
  EXPECT_NEAR(driven({}).first, 0.1, 1e-9);
  EXPECT_NEAR(driven({0.3, 0.2, 9, 9}).first, 0.5, 1e-9);
  EXPECT_NEAR(driven({0.3, 0.2, 9, 9}).second, 0.3, 1e-9);
  EXPECT_NEAR(driven({0.8, 0.9, 0, 0}).first, 1, 1e-9);
  EXPECT_NEAR(driven({-0.8, 0, 0, 0}).second, 0, 1e-9);
}

TEST(BeatAveragedStep, StandsUntilItIsCarried) {
  BatchOptions o = options(1e-3);
  o.world.ground_z_m = 0;
  Vehicle v = flapper();
  v.extent.below_m = 0.1;
  Batch<double> batch(1, v, o);
  FlapperState s;
  s.position_m[2] = 0.1;
  batch.reset(0, s, Start::standing);
  batch.set_input(0, {0.58, 0, 0, 0});  // 0.5874 carries it
  batch.step(2000);
  EXPECT_EQ(batch.support(0), Start::standing);
  EXPECT_DOUBLE_EQ(batch.state(0).position_m[2], 0.1);
  batch.set_input(0, {0.6, 0, 0, 0});
  batch.step(2000);
  EXPECT_EQ(batch.support(0), Start::flying);
  EXPECT_GT(batch.state(0).position_m[2], 0.12);
  batch.set_input(0, {0.3, 0, 0, 0});
  batch.step(2000);
  EXPECT_TRUE(batch.status(0) & kTouchedGround);
}

TEST(BeatAveragedStep, RobotsOfABatchShareExpressions) {
  Batch<float> batch(3, flapper(), options(1e-3));
  Vehicle v = flapper();
  v.beat_averaged->coefficients[0].value *= 1.1;
  batch.set_vehicle(1, v);
  v.beat_averaged->wrenches[1].terms[0] = "forward_N";
  EXPECT_THROW(batch.set_vehicle(1, v), std::invalid_argument);
  EXPECT_THROW(batch.set_vehicle(1, test::nominal()), std::invalid_argument);
  EXPECT_THROW(Batch<float>(1, test::nominal(), options(1e-3)).set_vehicle(0, flapper()), std::invalid_argument);
  v = flapper();
  v.beat_averaged->inputs.resize(5, {"more", 0, 1});
  EXPECT_THROW(Batch<float>(1, v, options(1e-3)), std::invalid_argument);
  // a robot's bytes are its own
  Batch<float> alone(1, flapper(), options(1e-3));
  const Input input{0.6, 0.01, 0.02, 0.03};
  for (std::size_t i = 0; i < 3; ++i) batch.set_input(i, input);
  alone.set_input(0, input);
  batch.step(200), alone.step(200);
  EXPECT_EQ(batch.hash(2, 3), alone.hash(0, 1));
  EXPECT_NE(batch.hash(1, 2), alone.hash(0, 1));
}

}  // namespace
}  // namespace flappy::sim::mean_step_test
