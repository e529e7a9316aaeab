// Controllers: signs, frames, limits and windup channel by channel, with gains of the test's own; what they promise on an
// ideal body; and the shipped ones on the vehicle itself.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "flight/arc.hpp"
#include "flight/fleets.hpp"

namespace flappy::flight::controller_test {
namespace {

using V = model::Vec3<double>;
using Q = model::Quaternion<double>;
using U = model::WingBeat<double>;
constexpr double kPeriod_s = 0.002, kGravity = 9.81;

Q euler(double roll, double pitch, double yaw) {
  const double cr = std::cos(roll / 2), sr = std::sin(roll / 2), cp = std::cos(pitch / 2), sp = std::sin(pitch / 2),
               cy = std::cos(yaw / 2), sy = std::sin(yaw / 2);
  return {cy * cp * cr + sy * sp * sr, cy * cp * sr - sy * sp * cr, cy * sp * cr + sy * cp * sr,
          sy * cp * cr - cy * sp * sr};
}
Estimate<double> level(double yaw = 0) { return {{0, 0, 0}, euler(0, 0, yaw), {0, 0, 0}, {0, 0, 0}}; }
Setpoint<double> here(double yaw = 0) { return {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {std::sin(yaw), std::cos(yaw)}, 0}; }
/// A vector of the heading frame in W.
V ahead(double forward, double left, double yaw) {
  return {forward * std::cos(yaw) - left * std::sin(yaw), forward * std::sin(yaw) + left * std::cos(yaw), 0};
}

PidConstants<double> pid_constants() {
  PidConstants<double> k{};
  k.position_xy_1_s = 2, k.position_z_1_s = 3, k.speed_limit_m_s = 1, k.climb_limit_m_s = 0.5;
  k.forward = {3, 0, 0, 4}, k.left = {2.5, 0, 0, 3}, k.up = {8, 0, 0, 2};
  k.acceleration_limit_m_s2 = 10, k.roll_limit_rad = 0.6, k.pitch_limit_rad = 0.5, k.yaw_error_limit_rad = 0.4;
  k.roll = {4, 0, 0, 1}, k.pitch = {5, 0, 0, 1.5}, k.yaw = {0.2, 0, 0, 0.05};
  k.hover_V = 10, k.lower_V = -4, k.upper_V = 6;
  k.difference_limit_V = 30, k.bias_limit_V = 35, k.split_cycle_limit = 0.15;
  k.velocity_share = k.rate_share = 1;
  k.period_s = kPeriod_s, k.per_period_Hz = 1 / kPeriod_s, k.gravity_m_s2 = kGravity;
  return k;
}

U once(const PidConstants<double>& k, const Estimate<double>& x, const Setpoint<double>& ref) {
  Pid<double> m{};
  m.velocity_m_s = x.velocity_m_s;
  return PidController::update(k, m, x, ref);
}

/// A flight's estimate and set point at a control tick, rotated about z of W.
std::pair<Estimate<double>, Setpoint<double>> wandering(int tick, double angle) {
  const double s = std::sin(angle), c = std::cos(angle), t = tick * kPeriod_s;
  const auto in_W = [&](double x, double y, double z) { return V{c * x - s * y, s * x + c * y, z}; };
  const double yaw = 0.3 * std::sin(5 * t) + angle;
  Estimate<double> x{in_W(0.02 * std::sin(9 * t), 0.01 * std::cos(7 * t), 0.02 * t),
                     euler(0.1 * std::sin(11 * t), 0.08 * std::cos(8 * t), yaw),
                     in_W(0.05 * std::cos(9 * t), -0.03 * std::sin(7 * t), 0.02),
                     {0.3 * std::sin(13 * t), 0.2 * std::cos(17 * t), 0.4 * std::cos(5 * t)}};
  const double heading = 0.2 + angle;
  return {x,
          {in_W(0.01, 0.005, 0), in_W(0.02, 0.01, 0), in_W(0.1, -0.1, 0), {std::sin(heading), std::cos(heading)}, 0.1}};
}

/// For each on the list: a table that another one is written by.
TEST(Controllers, RotateWhatTheyRememberAndTakeBackWhatTheyLearnt) {
  for (int kind = 0; kind < kControllers; ++kind)
    with_controller(kind, [&]<class C>(C) {
      Controller configured = controller(C::kName);
      EXPECT_EQ(configured.kind, kind_of<C>());
      auto& k = configured.constants.of<C>();
      static_cast<LoopConstants<double>&>(k) = {0.2, 0.5, kPeriod_s, 1 / kPeriod_s, kGravity};
      typename C::template Memory<double> there{}, here{};
      C::start(there, wandering(0, 0).first);
      const double angle = 2.1;
      for (int tick = 0; tick < 200; ++tick) {
        const auto [x, ref] = wandering(tick, 0);
        const auto before = there;
        const U u = C::update(k, there, x, ref);
        if (tick == 100) {
          here = there;
          C::rotate(std::sin(angle), std::cos(angle), here);
        }
        if (tick > 100) {
          const auto [rotated_x, rotated_ref] = wandering(tick, angle);
          const U same = C::update(k, here, rotated_x, rotated_ref);
          EXPECT_NEAR(same.amplitude_V, u.amplitude_V, 1e-10) << C::kName << tick;
          EXPECT_NEAR(same.difference_V, u.difference_V, 1e-10) << C::kName << tick;
          EXPECT_NEAR(same.bias_V, u.bias_V, 1e-10) << C::kName << tick;
          EXPECT_NEAR(same.split_cycle, u.split_cycle, 1e-10) << C::kName << tick;
        }
        auto held = there, not_held = there;
        C::unlearn(true, before, held);
        C::unlearn(false, before, not_held);
        const U was = C::trim(k, before), is = C::trim(k, there), taken_back = C::trim(k, held),
                kept = C::trim(k, not_held);
        if (tick > 0) EXPECT_NE(is.amplitude_V, was.amplitude_V);
        EXPECT_EQ(taken_back.amplitude_V, was.amplitude_V);
        EXPECT_EQ(taken_back.bias_V, was.bias_V);
        EXPECT_EQ(kept.amplitude_V, is.amplitude_V);
        EXPECT_EQ(kept.bias_V, is.bias_V);
      }
    });
}

TEST(Pid, SignsAndGainsOfEveryChannel) {
  const PidConstants<double> k = pid_constants();
  const U rest = once(k, level(), here());
  EXPECT_NEAR(rest.amplitude_V, k.hover_V, 1e-12);
  for (const double u : {rest.difference_V, rest.bias_V, rest.split_cycle}) EXPECT_NEAR(u, 0, 1e-12);

  Setpoint<double> ref = here();
  ref.position_m = {0.1, 0, 0};  // to the front: nose down
  EXPECT_NEAR(once(k, level(), ref).bias_V, 5 * std::atan(3 * 2 * 0.1 / kGravity), 1e-12);
  ref.position_m = {0, 0.1, 0};  // to the left: left wing down, less thrust there
  EXPECT_NEAR(once(k, level(), ref).difference_V, -4 * std::atan(2.5 * 2 * 0.1 / kGravity), 1e-12);
  ref.position_m = {0, 0, 0.1};
  EXPECT_NEAR(once(k, level(), ref).amplitude_V, 10 + 8 * 3 * 0.1, 1e-12);
  EXPECT_NEAR(once(k, level(), here(0.1)).split_cycle, 0.2 * 0.1, 1e-12);
  ref = here();
  ref.velocity_m_s = {0.1, -0.2, 0.1}, ref.acceleration_m_s2 = {0.5, 0, 0};  // feed-forward
  EXPECT_NEAR(once(k, level(), ref).bias_V, 5 * std::atan((3 * 0.1 + 0.5) / kGravity), 1e-12);
  EXPECT_NEAR(once(k, level(), ref).amplitude_V, 10 + 8 * 0.1, 1e-12);

  Estimate<double> x = level();
  x.velocity_m_s = {0.1, 0.1, 0.1};
  EXPECT_LT(once(k, x, here()).bias_V, 0);
  EXPECT_GT(once(k, x, here()).difference_V, 0);
  EXPECT_NEAR(once(k, x, here()).amplitude_V, 10 - 8 * 0.1, 1e-12);
  x = level();
  x.attitude = euler(0.1, -0.2, 0);  // it rights itself; leaning, it needs no less thrust
  EXPECT_NEAR(once(k, x, here()).difference_V, -4 * 0.1, 1e-9);
  EXPECT_NEAR(once(k, x, here()).bias_V, 5 * 0.2, 1e-9);
  ref = here();
  ref.position_m.z = 0.1;
  EXPECT_NEAR(once(k, x, ref).amplitude_V, 10 + 8 * 3 * 0.1 / (std::cos(0.1) * std::cos(0.2)), 1e-9);

  PidConstants<double> d = k;
  d.roll.d = d.pitch.d = 0.3, d.yaw.d = 0.02;
  x = level();
  x.body_rate_rad_s = {1, 2, 3};
  EXPECT_NEAR(once(d, x, here()).difference_V, -0.3, 1e-9);
  EXPECT_NEAR(once(d, x, here()).bias_V, -0.6, 1e-9);
  EXPECT_NEAR(once(d, x, here()).split_cycle, -0.06, 1e-9);
  ref = here();
  ref.heading_rate_rad_s = 3;
  EXPECT_NEAR(once(d, x, ref).split_cycle, 0, 1e-9);
}

TEST(Pid, LeansSoThatBothAccelerationsComeOut) {
  // thrust along b gives g b/b_z: the lean that is asked for must point there, however far
  const PidConstants<double> k = pid_constants();
  Setpoint<double> ref = here();
  ref.acceleration_m_s2 = {3, 4, 0};
  const U u = once(k, level(), ref);
  const Q q = euler(u.difference_V / k.roll.p, u.bias_V / k.pitch.p, 0);
  const auto R = rotation_matrix(q);
  EXPECT_NEAR(kGravity * R.row_x.z / R.row_z.z, 3, 1e-9);
  EXPECT_NEAR(kGravity * R.row_y.z / R.row_z.z, 4, 1e-9);
}

template <class Control>
void expect_same_in_every_heading(const Control& control_at) {
  const U straight = control_at(0);
  for (const double yaw : {0.5, M_PI / 2, 3.1, -3.1, -2.0}) {
    const U u = control_at(yaw);
    EXPECT_NEAR(u.amplitude_V, straight.amplitude_V, 1e-9) << yaw;
    EXPECT_NEAR(u.difference_V, straight.difference_V, 1e-9) << yaw;
    EXPECT_NEAR(u.bias_V, straight.bias_V, 1e-9) << yaw;
    EXPECT_NEAR(u.split_cycle, straight.split_cycle, 1e-9) << yaw;
  }
  EXPECT_GT(std::abs(straight.difference_V), 1e-3);
  EXPECT_GT(std::abs(straight.bias_V), 1e-3);
  EXPECT_GT(std::abs(straight.split_cycle), 1e-4);
}

/// Something to do in every channel, turned with the heading; across pi for 3.1.
std::pair<Estimate<double>, Setpoint<double>> busy(double yaw) {
  Estimate<double> x = level();
  x.attitude = euler(0.1, 0.05, yaw);
  x.velocity_m_s = ahead(0.05, -0.03, yaw);
  x.body_rate_rad_s = {0.2, -0.1, 0.3};
  Setpoint<double> ref = here(yaw + 0.12);
  ref.position_m = ahead(0.02, 0.05, yaw);
  ref.position_m.z = 0.03;
  ref.acceleration_m_s2 = ahead(0.1, 0.2, yaw);
  return {x, ref};
}

TEST(Pid, IsTheSameInEveryHeadingAndAcrossPi) {
  PidConstants<double> k = pid_constants();
  for (PidGains<double>* g : {&k.forward, &k.left, &k.up, &k.roll, &k.pitch, &k.yaw})
    g->i = 0.7 * g->p, g->d = 0.01 * g->p;
  expect_same_in_every_heading([&](double yaw) {
    const auto [x, ref] = busy(yaw);
    Pid<double> m{};
    U u{};
    for (int i = 0; i < 100; ++i) u = PidController::update(k, m, x, ref);
    return u;
  });
}

TEST(Pid, TurnsTheShorterWay) {
  const PidConstants<double> k = pid_constants();
  EXPECT_NEAR(once(k, level(M_PI - 0.05), here(-M_PI + 0.05)).split_cycle, 0.2 * 0.1, 1e-9);
  EXPECT_NEAR(once(k, level(-M_PI + 0.05), here(M_PI - 0.05)).split_cycle, -0.2 * 0.1, 1e-9);
  EXPECT_NEAR(once(k, level(0), here(1)).split_cycle, 0.2 * 0.4, 1e-9);  // clipped
  EXPECT_NEAR(once(k, level(0), here(-3)).split_cycle, -0.2 * 0.4, 1e-9);
}

TEST(Pid, StaysWithinItsLimits) {
  PidConstants<double> k = pid_constants();
  k.difference_limit_V = 0.5, k.bias_limit_V = 1, k.split_cycle_limit = 0.01;
  for (const double sign : {1.0, -1.0}) {
    Setpoint<double> ref = here(sign);
    ref.position_m = {100 * sign, 100 * sign, 100 * sign};
    const U u = once(k, level(), ref);
    EXPECT_NEAR(u.difference_V, -sign * 0.5, 1e-12);
    EXPECT_NEAR(u.bias_V, sign * 1, 1e-12);
    EXPECT_NEAR(u.split_cycle, sign * 0.01, 1e-12);
    EXPECT_NEAR(u.amplitude_V, sign > 0 ? 14 : 6, 1e-12);  // climb limit 0.5 m/s x 8 V s/m
    k.climb_limit_m_s = 5;
    EXPECT_NEAR(once(k, level(), ref).amplitude_V, sign > 0 ? 16 : 6, 1e-12);
    k.climb_limit_m_s = 0.5;
  }
  k = pid_constants();  // lean: speed limit 1 m/s x 3 1/s, then the acceleration's limit, then the lean's
  Setpoint<double> ref = here();
  ref.position_m = {100, 0, 0};
  EXPECT_NEAR(once(k, level(), ref).bias_V, 5 * std::atan(3 / kGravity), 1e-12);
  ref.acceleration_m_s2 = {4, 0, 0};
  EXPECT_NEAR(once(k, level(), ref).bias_V, 5 * 0.5, 1e-12);
  k.pitch_limit_rad = 1.5;
  ref.acceleration_m_s2 = {40, 0, 0};
  EXPECT_NEAR(once(k, level(), ref).bias_V, 5 * std::atan(10 / kGravity), 1e-12);
}

TEST(Pid, IntegratesWithinItsLimitsInUnitsOfTheOutput) {
  PidConstants<double> k = pid_constants();
  k.forward.i = 0.5, k.left.i = 0.25, k.up.i = 2, k.roll.i = 1, k.pitch.i = 2, k.yaw.i = 0.1;
  const double yaw = 0.8;
  Estimate<double> x = level(yaw);
  x.attitude = euler(-0.05, 0.04, yaw - 0.1);
  Setpoint<double> ref = here(yaw);
  Pid<double> m{};
  x.velocity_m_s = ahead(-0.2, 0.1, yaw - 0.1);
  x.velocity_m_s.z = -0.1;
  for (int i = 0; i < 500; ++i) PidController::update(k, m, x, ref);  // 1 s of constant errors
  const auto forward = [&] { return m.integral_x * std::cos(yaw - 0.1) + m.integral_y * std::sin(yaw - 0.1); };
  const auto left = [&] { return m.integral_y * std::cos(yaw - 0.1) - m.integral_x * std::sin(yaw - 0.1); };
  EXPECT_NEAR(forward(), 0.5 * 0.2, 1e-9);
  EXPECT_NEAR(left(), -0.25 * 0.1, 1e-9);
  EXPECT_NEAR(m.integral_z, 2 * 0.1, 1e-9);
  EXPECT_NEAR(m.integral_yaw, std::min(0.1 * 0.1, 0.05), 1e-9);
  for (int i = 0; i < 100000; ++i) PidController::update(k, m, x, ref);
  EXPECT_NEAR(forward(), 4, 1e-9);
  EXPECT_NEAR(left(), -3, 1e-9);
  EXPECT_NEAR(m.integral_z, 2, 1e-9);
  EXPECT_NEAR(m.integral_yaw, 0.05, 1e-9);
  EXPECT_NEAR(std::abs(m.integral_roll), 1, 1e-9);
  EXPECT_NEAR(std::abs(m.integral_pitch), 1.5, 1e-9);
}

TEST(Pid, DoesNotWindUp) {
  PidConstants<double> k = pid_constants();
  for (PidGains<double>* g : {&k.forward, &k.left, &k.up, &k.roll, &k.pitch, &k.yaw}) g->i = 2, g->integral_limit = 1e3;
  k.pitch_limit_rad = k.roll_limit_rad = 0.2;  // 2 m/s^2: the lean is at its limit, the acceleration is not
  k.bias_limit_V = k.difference_limit_V = 0.5, k.split_cycle_limit = 0.03, k.upper_V = 2, k.lower_V = -2;
  Setpoint<double> ref = here(0.3);
  ref.position_m = {1, 1, 1};
  Pid<double> m{};
  for (int i = 0; i < 5000; ++i) PidController::update(k, m, level(), ref);
  for (const double integral :
       {m.integral_x, m.integral_y, m.integral_z, m.integral_roll, m.integral_pitch, m.integral_yaw})
    EXPECT_NEAR(integral, 0, 0.02);  // no more than on the first tick
  ref.position_m = {-1, -1, -1};     // held at the one limit by an integral, it comes back at once
  m.integral_x = m.integral_y = 8, m.integral_z = 9;
  ref.position_m = {0, 0, 0};
  Estimate<double> x = level();
  x.velocity_m_s = {0.1, 0.1, 0.1};
  for (int i = 0; i < 500; ++i) PidController::update(k, m, x, ref);
  EXPECT_NEAR(m.integral_x, 8 - 2 * 0.1, 1e-6);
  EXPECT_NEAR(m.integral_y, 8 - 2 * 0.1, 1e-6);
  EXPECT_NEAR(m.integral_z, 9 - 2 * 0.1, 1e-6);
}

TEST(Pid, DampsByTheVelocitysSlope) {
  PidConstants<double> k = pid_constants();
  k.up.d = 0.5, k.forward.d = 0.4;
  Pid<double> m{};
  Estimate<double> x = level();
  PidController::update(k, m, x, here());
  x.velocity_m_s = {0.002, 0, 0.002};  // 1 m/s^2
  const U u = PidController::update(k, m, x, here());
  EXPECT_NEAR(u.amplitude_V, 10 - 8 * 0.002 - 0.5, 1e-9);
  EXPECT_NEAR(u.bias_V, -5 * std::atan((3 * 0.002 + 0.4) / kGravity), 1e-9);
}

/// |H| at 34 Hz is 0, at 0 Hz 1, and else, from the coefficients of PidController::derive() at z = exp(j w),
///   |cos w - cos w0| / sqrt((cos w - cos w0)^2 + (alpha sin w)^2).
TEST(Pid, LeavesTheWingBeatAlone) {
  PidConstants<double> k = pid_constants();
  k.roll = {0, 0, 0.1, 0}, k.pitch = {0, 0, 0.2, 0};
  k.notch_hz = 34, k.notch_quality = 2;
  PidController::derive(k);
  const double w0 = 2 * std::numbers::pi * 34 * kPeriod_s, alpha = std::sin(w0) / 4;
  for (const double hz : {0.0, 5.0, 20.0, 30.0, 34.0, 40.0, 100.0, 200.0}) {
    Pid<double> m{};
    const double w = 2 * std::numbers::pi * hz * kPeriod_s;
    double sum = 0, squares = 0, rolled = 0;
    constexpr int kBefore = 1000, kSeen = 500;  // 2 s, by which the notch has forgotten the start; 1 s, whole periods
    for (int i = 0; i < kBefore + kSeen; ++i) {
      Estimate<double> x = level();
      const double swing = std::cos(w * i);
      x.body_rate_rad_s = {swing, swing, 0};
      const U u = PidController::update(k, m, x, here());
      if (i < kBefore) continue;
      const double out = u.bias_V / 0.2;
      sum += out, squares += out * out;
      rolled = std::max(rolled, std::abs(u.difference_V / 0.1 + swing));
    }
    const double off = std::cos(w) - std::cos(w0);
    const double wanted = hz == 0 ? 1 : std::abs(off) / std::hypot(off, alpha * std::sin(w));
    EXPECT_NEAR(hz == 0 ? -sum / kSeen : std::sqrt(2 * squares / kSeen), wanted, 1e-9) << hz << " Hz";
    EXPECT_NEAR(rolled, 0, 1e-9) << "roll has no notch";
  }
}

TEST(Pid, KeepsItsNotchBelowHalfOfTheControlRate) {
  EXPECT_NO_THROW(controller("pid_robust", {"notch.frequency_hz=199.0"}));
  const io::Config slow =
      io::Config::load(test::source_path("configs/controllers/pid_robust.toml"), {"notch.frequency_hz=50.0"});
  try {
    read_controller(slow.root(), 100);
    FAIL() << "a notch at half of the control rate was accepted";
  } catch (const io::InputError& e) {
    EXPECT_NE(std::string(e.what()).find("accepted: less than half of flight.control_hz"), std::string::npos)
        << e.what();
  }
}

/// The body that the adaptive controller believes in.
struct Body {
  double thrust_N_V = 0.016, offset_V = 2, roll_Nm_V = 1e-3, pitch_Nm_V = 6e-4, yaw_Nm_split = 4e-3;
  double inertia_x = 5e-6, inertia_y = 6e-6, inertia_z = 3e-6, mass_kg = 0.0125;
  V torque_Nm{0, 0, 0}, push_m_s2{0, 0, 0};

  void fly(Estimate<double>& x, const U& u, double time_s) const {
    constexpr double kStep = 1e-4;
    for (int i = 0; i < std::lround(time_s / kStep); ++i) {
      const auto R = rotation_matrix(x.attitude);
      const double thrust = thrust_N_V * (u.amplitude_V - offset_V) / mass_kg;
      const V a = thrust * V{R.row_x.z, R.row_y.z, R.row_z.z} + push_m_s2 + V{0, 0, -kGravity};
      x.position_m = x.position_m + kStep * x.velocity_m_s + (0.5 * kStep * kStep) * a;
      x.velocity_m_s = x.velocity_m_s + kStep * a;
      const V turn{(roll_Nm_V * u.difference_V + torque_Nm.x) / inertia_x,
                   (pitch_Nm_V * u.bias_V + torque_Nm.y) / inertia_y,
                   (yaw_Nm_split * u.split_cycle + torque_Nm.z) / inertia_z};
      x.attitude = rotated(x.attitude, 0.5 * kStep * (x.body_rate_rad_s + 0.5 * kStep * turn));
      x.body_rate_rad_s = x.body_rate_rad_s + kStep * turn;
    }
  }
};

ArcConstants<double> arc_constants() {
  const Body body;
  ArcConstants<double> k{};
  k.horizontal = {6, 7}, k.height = {5, 8}, k.heading = {5, 9};
  k.position_error_limit_m = 0.5, k.velocity_error_limit_m_s = 2, k.yaw_error_limit_rad = 0.5;
  k.mass_kg = {2e-3, 8e-3, 20e-3};
  k.roll_Nm = k.pitch_Nm = {1e-6, -3e-4, 3e-4};
  k.yaw_Nm = {1e-5, -3e-4, 3e-4};
  k.disturbance_m_s2 = {5, -2, 2};
  k.predictor_1_s = 5;
  k.thrust_N_V = body.thrust_N_V, k.thrust_offset_V = body.offset_V;
  k.roll_Nm_V = body.roll_Nm_V, k.pitch_Nm_V = body.pitch_Nm_V, k.yaw_Nm_split = body.yaw_Nm_split;
  k.inertia_x_kg_m2 = body.inertia_x, k.inertia_y_kg_m2 = body.inertia_y, k.inertia_z_kg_m2 = body.inertia_z;
  k.initial_mass_kg = body.mass_kg, k.amplitude_low_V = 4, k.amplitude_high_V = 18;
  k.difference_limit_V = 3, k.bias_limit_V = 3.5, k.split_cycle_limit = 0.15;
  k.velocity_share = k.rate_share = 1;
  k.period_s = kPeriod_s, k.gravity_m_s2 = kGravity;
  return k;
}

U once(const ArcConstants<double>& k, const Estimate<double>& x, const Setpoint<double>& ref) {
  Arc<double> m{};
  m.predicted_x_m_s = x.velocity_m_s.x, m.predicted_y_m_s = x.velocity_m_s.y;
  return ArcController::update(k, m, x, ref);
}

TEST(Arc, SignsOfEveryChannel) {
  const ArcConstants<double> k = arc_constants();
  const Body body;
  const U rest = once(k, level(), here());
  EXPECT_NEAR(rest.amplitude_V, body.mass_kg * kGravity / body.thrust_N_V + body.offset_V, 1e-9);
  for (const double u : {rest.difference_V, rest.bias_V, rest.split_cycle}) EXPECT_NEAR(u, 0, 1e-12);
  Setpoint<double> ref = here();
  ref.position_m = {0.1, 0, 0};
  EXPECT_NEAR(once(k, level(), ref).bias_V, body.inertia_y / kGravity * 7 * 216 * 0.1 / body.pitch_Nm_V,
              1e-9);  // k lambda^3 e
  EXPECT_NEAR(once(k, level(), ref).difference_V, 0, 1e-12);
  ref.position_m = {0, 0.1, 0};
  EXPECT_NEAR(once(k, level(), ref).difference_V, -body.inertia_x / kGravity * 7 * 216 * 0.1 / body.roll_Nm_V, 1e-9);
  ref.position_m = {0, 0, 0.1};
  EXPECT_NEAR(once(k, level(), ref).amplitude_V - rest.amplitude_V, body.mass_kg * 8 * 5 * 0.1 / body.thrust_N_V, 1e-9);
  EXPECT_NEAR(once(k, level(), here(0.1)).split_cycle, body.inertia_z * 9 * 5 * 0.1 / body.yaw_Nm_split, 1e-9);
  Estimate<double> x = level();
  x.body_rate_rad_s = {1, 1, 1};
  EXPECT_LT(once(k, x, here()).difference_V, 0);
  EXPECT_LT(once(k, x, here()).bias_V, 0);
  EXPECT_LT(once(k, x, here()).split_cycle, 0);
  x = level();
  x.attitude = euler(0.1, 0.1, 0);
  EXPECT_LT(once(k, x, here()).difference_V, 0);
  EXPECT_LT(once(k, x, here()).bias_V, 0);
  x = level();
  x.velocity_m_s = {0.1, 0.1, 0.1};
  EXPECT_GT(once(k, x, here()).difference_V, 0);
  EXPECT_LT(once(k, x, here()).bias_V, 0);
  EXPECT_LT(once(k, x, here()).amplitude_V, rest.amplitude_V);
}

TEST(Arc, IsTheSameInEveryHeadingAndTurnsTheShorterWay) {
  const ArcConstants<double> k = arc_constants();
  expect_same_in_every_heading([&](double yaw) {
    const auto [x, ref] = busy(yaw);
    Arc<double> m{};
    m.predicted_x_m_s = x.velocity_m_s.x, m.predicted_y_m_s = x.velocity_m_s.y;
    U u{};
    for (int i = 0; i < 100; ++i) u = ArcController::update(k, m, x, ref);
    return u;
  });
  EXPECT_GT(once(k, level(M_PI - 0.05), here(-M_PI + 0.05)).split_cycle, 0);
  EXPECT_LT(once(k, level(-M_PI + 0.05), here(M_PI - 0.05)).split_cycle, 0);
}

TEST(Arc, AdaptsTowardsWhatItSeesWithinItsBounds) {
  ArcConstants<double> k = arc_constants();
  for (const double sign : {1.0, -1.0}) {
    Estimate<double> x = level();
    x.position_m = {0.02 * sign, 0.02 * sign, -0.02 * sign};  // pushed forward, to the left, and down
    x.attitude = euler(0, 0, 0.02 * sign);
    Arc<double> m{};
    for (int i = 0; i < 50; ++i) ArcController::update(k, m, x, here());
    EXPECT_GT(sign * m.pitch_Nm, 0);
    EXPECT_LT(sign * m.roll_Nm, 0);
    EXPECT_GT(sign * m.yaw_Nm, 0);
    EXPECT_GT(sign * (m.mass_kg - k.initial_mass_kg), 0);
    for (int i = 0; i < 200000; ++i) ArcController::update(k, m, x, here());
    EXPECT_EQ(m.pitch_Nm, sign * 3e-4);
    EXPECT_EQ(m.roll_Nm, -sign * 3e-4);
    EXPECT_EQ(m.yaw_Nm, sign * 3e-4);
    EXPECT_EQ(m.mass_kg, sign > 0 ? 20e-3 : 8e-3);
    Arc<double> d{};
    x = level();
    for (int i = 0; i < 50; ++i)
      x.velocity_m_s = x.velocity_m_s + V{sign * 1e-3, -sign * 1e-3, 0}, ArcController::update(k, d, x, here());
    EXPECT_GT(sign * d.disturbance_x_m_s2, 0);
    EXPECT_LT(sign * d.disturbance_y_m_s2, 0);
    for (int i = 0; i < 20000; ++i)
      x.velocity_m_s = x.velocity_m_s + V{sign * 0.1, -sign * 0.1, 0}, ArcController::update(k, d, x, here());
    EXPECT_EQ(d.disturbance_x_m_s2, sign * 2);
    EXPECT_EQ(d.disturbance_y_m_s2, -sign * 2);
  }
  // an input at its limit: nothing is learnt that would push it on
  k.bias_limit_V = k.difference_limit_V = 1e-3, k.split_cycle_limit = 1e-5, k.amplitude_high_V = 9;
  Estimate<double> x = level();
  x.position_m = {0.3, 0.3, -0.3};
  x.attitude = euler(0, 0, 0.3);
  Arc<double> m{};
  for (int i = 0; i < 1000; ++i) ArcController::update(k, m, x, here());
  for (const double learnt : {m.pitch_Nm, m.roll_Nm, m.yaw_Nm}) EXPECT_EQ(learnt, 0);
  EXPECT_EQ(m.mass_kg, k.initial_mass_kg);
}

// Close to level and knowing its body, the sliding error falls as exp(-k t). Held for a period and sampled, the loop acts
// half a period late, 1 ms of 1/k = 143 ms, and so does each of its lags 1/lambda.
TEST(Arc, SlidingErrorDecaysAsItSays) {
  ArcConstants<double> k = arc_constants();
  k.roll_Nm.gain = k.pitch_Nm.gain = k.yaw_Nm.gain = k.mass_kg.gain = k.disturbance_m_s2.gain = 0;
  const Body body;
  Estimate<double> x = level();
  x.position_m = {1e-3, -2e-3, 3e-3};
  x.attitude = euler(0, 0, 2e-3);
  Arc<double> m{};
  const double l = 6;
  const auto sliding = [&](int axis) {
    const auto R = rotation_matrix(x.attitude);
    const double p[2] = {x.position_m.x, x.position_m.y}, v[2] = {x.velocity_m_s.x, x.velocity_m_s.y},
                 a[2] = {kGravity * R.row_x.z, kGravity * R.row_y.z},
                 j[2] = {kGravity * x.body_rate_rad_s.y, -kGravity * x.body_rate_rad_s.x};
    return j[axis] + 3 * l * a[axis] + 3 * l * l * v[axis] + l * l * l * p[axis];
  };
  const auto height = [&] { return x.velocity_m_s.z + 5 * x.position_m.z; };
  const auto heading = [&] { return x.body_rate_rad_s.z + 5 * 2 * x.attitude.z; };
  const double sx = sliding(0), sy = sliding(1), sz = height(), sh = heading();
  for (int tick = 1; tick <= 150; ++tick) {
    body.fly(x, ArcController::update(k, m, x, here()), kPeriod_s);
    const double t = tick * kPeriod_s;
    if (tick % 25 != 0) continue;
    EXPECT_NEAR(sliding(0) / sx, std::exp(-7 * t), 0.03) << t;
    EXPECT_NEAR(sliding(1) / sy, std::exp(-7 * t), 0.03) << t;
    EXPECT_NEAR(height() / sz, std::exp(-8 * t), 0.03) << t;
    EXPECT_NEAR(heading() / sh, std::exp(-9 * t), 0.03) << t;
  }
  for (int tick = 0; tick < 2000; ++tick) body.fly(x, ArcController::update(k, m, x, here()), kPeriod_s);
  for (const double e : {x.position_m.x, x.position_m.y, x.position_m.z}) EXPECT_NEAR(e, 0, 1e-7);
}

TEST(Arc, LeavesNoErrorUnderConstantTorquePushAndMass) {
  const ArcConstants<double> k = arc_constants();
  Body body;
  body.torque_Nm = {6e-5, -8e-5, 3e-5};
  body.push_m_s2 = {0.5, -0.8, 0};
  body.mass_kg = 0.0138;
  Estimate<double> x = level();
  Arc<double> m{};
  Setpoint<double> ref = here(0.4);
  ref.position_m = {0.1, 0.2, 0.3};
  double farthest = 0;
  for (int tick = 0; tick < 30000; ++tick) {
    body.fly(x, ArcController::update(k, m, x, ref), kPeriod_s);
    farthest = std::max(farthest, std::sqrt(dot(x.position_m - ref.position_m, x.position_m - ref.position_m)));
  }
  EXPECT_LT(farthest, 1.5);
  EXPECT_NEAR(x.position_m.x, 0.1, 1e-5);
  EXPECT_NEAR(x.position_m.y, 0.2, 1e-5);
  EXPECT_NEAR(x.position_m.z, 0.3, 1e-5);
  EXPECT_NEAR(heading_of(rotation_matrix(x.attitude)).sin, std::sin(0.4), 1e-5);
  // and it has learnt what they are; vertical thrust is T b_z with b_z = 1/sqrt(1 + (d/g)^2)
  EXPECT_NEAR(m.roll_Nm, 6e-5, 1e-7);
  EXPECT_NEAR(m.pitch_Nm, -8e-5, 1e-7);
  EXPECT_NEAR(m.yaw_Nm, 3e-5, 1e-7);
  EXPECT_NEAR(m.disturbance_x_m_s2, 0.5, 1e-3);
  EXPECT_NEAR(m.disturbance_y_m_s2, -0.8, 1e-3);
  EXPECT_NEAR(m.mass_kg, 0.0138, 1e-5);
}

/// The shipped controllers on the vehicle: heavier, its centre of mass moved, and pushed by a constant offset of every input.
class Shipped : public testing::TestWithParam<const char*> {};

TEST_P(Shipped, HoldsItsPlaceAgainstConstantOffsets) {
  constexpr std::size_t kCount = 16;
  model::Vehicle vehicle = test::nominal();
  vehicle.torso.mass_kg *= 1.05;
  vehicle.torso.com_m.x += 2e-4;
  Fleet<float> fleet(kCount, vehicle, fleet_options(sensors("paper"), controller(GetParam()), task(staying())));
  for (std::size_t i = 0; i < kCount; ++i) fleet.set_added(i, {0.3, 0.1, 0.15, 0.004});
  for (int period = 0; period < 10000; ++period) fleet.step();
  double mean[3] = {0, 0, 0};
  constexpr int kPeriods = 2500;
  for (int period = 0; period < kPeriods; ++period) {
    fleet.step();
    for (std::size_t i = 0; i < kCount; ++i)
      for (int k = 0; k < 3; ++k) mean[k] += fleet.truth(i).position_m[k] / (kCount * kPeriods);
  }
  EXPECT_EQ(fleet.batch().count_status(sim::kFrozen), 0u);
  for (const double m : mean) EXPECT_NEAR(m, 0, 0.01) << GetParam();  // a body length is 0.1 m
}

INSTANTIATE_TEST_SUITE_P(Controllers, Shipped, testing::Values("pid", "arc"));

}  // namespace
}  // namespace flappy::flight::controller_test
