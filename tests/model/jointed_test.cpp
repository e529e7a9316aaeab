// Vehicles with four angles a wing: their equations of motion against Kane's method written independently, with Eigen and for any chain of bodies, and
// against what their inverse dynamics gives; their gait and its filter against differences; their air against closed forms.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <fstream>
#include <numbers>
#include <random>

#include "io/files.hpp"
#include "jointed_vehicles.hpp"
#include "model/derive_jointed.hpp"
#include "model/jointed_kane.hpp"
#include "refusal.hpp"

namespace flappy::jointed_test {
namespace {

using model::Jointed, model::Moving, model::Vec3, model::Vehicle;
using test::Random, test::Vector3d;

Vec3<double> to_vec(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }

struct Case {
  Vehicle vehicle;
  test::JointedState state;
  model::JointedParameters<double> parameters;
  model::Sides<Moving<double>[model::kJoints]> q;
  model::Sides<model::JointedPose<double>> pose;
  model::Sides<model::JointedLoad<double>> load{};
  model::FreeJoints free[2];
  int size = model::kBodyUnknowns;
};

Case random_case(Random& random, bool carries_air) {
  Case c;
  c.vehicle = test::random_jointed(random);
  c.parameters = model::derive_jointed(c.vehicle);
  c.state = test::random_state(random, c.vehicle);
  if (carries_air) {
    c.parameters.left.added = {3e-4, 2e-9, 4e-8, -3e-7, 2e-9, -2e-6};
    c.parameters.right.added = {4e-4, 3e-9, 5e-8, -4e-7, -2e-9, 3e-6};
  }
  for (std::size_t side = 0; side < 2; ++side) {
    auto& q = side == 0 ? c.q.left : c.q.right;
    auto& free = c.free[side];
    auto& load = side == 0 ? c.load.left : c.load.right;
    const Jointed::Wing& w = side == 0 ? c.vehicle.jointed->left : c.vehicle.jointed->right;
    for (std::size_t j = 0; j < 4; ++j) {
      const test::JointedState::Joint& x = c.state.joints[side][j];
      const bool is_free = w.angles[j].mode == Jointed::Mode::free;
      q[j] = {x.angle, x.rate, is_free ? 0 : x.acceleration};
      if (is_free) free.unknown[j] = c.size++;
      load.pulls[j] = {is_free ? x.torque : 0, 0};
    }
  }
  const Vec3<double> w = to_vec(c.state.body_rate);
  c.pose = {model::place_side<+1>(c.parameters.left, c.q.left, w),
            model::place_side<-1>(c.parameters.right, c.q.right, w)};
  for (std::size_t side = 0; side < 2; ++side) {  // what the air does, and how fast the shoulder is in it
    const auto& g = side == 0 ? c.pose.left : c.pose.right;
    auto& load = side == 0 ? c.load.left : c.load.right;
    load.force_N = g.to_E(to_vec(c.state.force[side]));
    load.moment_Nm = g.to_E(to_vec(c.state.moment[side]));
    const model::Triple& s = (side == 0 ? c.vehicle.left : c.vehicle.right).shoulder_m;
    load.air_speed_m_s = g.to_E(to_vec(c.state.velocity_B) + cross(w, Vec3<double>{s.x, s.y, s.z}));
  }
  return c;
}

model::JointedMotion<double> solved(const Case& c, bool carries_air, bool held = false) {
  return model::accelerate(c.parameters, c.pose, c.q, c.load, to_vec(c.state.body_rate), to_vec(c.state.gravity_B),
                           c.free, c.size, carries_air, held);
}

// Both are exact; their linear systems are solved to about 1e-16 times condition numbers of 1e6.
constexpr double kTolerance = 1e-8;

TEST(Jointed, AcceleratesAsKaneSays) {
  Random random;
  for (int trial = 0; trial < 300; ++trial) {
    for (const bool carries_air : {false, true}) {
      Case c = random_case(random, carries_air);
      const auto m = solved(c, carries_air);
      std::array<Eigen::Matrix3d, 2> added;
      for (std::size_t side = 0; side < 2; ++side) {
        const auto& k = (side == 0 ? c.parameters.left : c.parameters.right).added;
        added[side] << k.xx, k.xy, k.xz, k.xy, k.yy, k.yz, k.xz, k.yz, k.zz;
      }
      const test::JointedAnswer kane = test::jointed_kane(c.vehicle, c.state, added);
      const Vector3d ours(m.acceleration_m_s2.x, m.acceleration_m_s2.y, m.acceleration_m_s2.z),
          turn(m.angular_acceleration_rad_s2.x, m.angular_acceleration_rad_s2.y, m.angular_acceleration_rad_s2.z);
      EXPECT_LT((ours - kane.acceleration).norm(), kTolerance * kane.acceleration.norm());
      EXPECT_LT((turn - kane.angular_acceleration).norm(), kTolerance * kane.angular_acceleration.norm());
      double joint = 0, torque = 0;
      for (std::size_t side = 0; side < 2; ++side)
        for (std::size_t j = 0; j < 4; ++j) {
          joint = std::max(joint, std::abs(kane.joint[side][j]));
          torque = std::max(torque, std::abs(kane.torque[side][j]));
        }
      for (std::size_t side = 0; side < 2; ++side)
        for (std::size_t j = 0; j < 4; ++j) {
          EXPECT_NEAR((side == 0 ? m.joint_rad_s2.left : m.joint_rad_s2.right)[j], kane.joint[side][j],
                      kTolerance * joint);
          EXPECT_NEAR((side == 0 ? m.torque_Nm.left : m.torque_Nm.right)[j], kane.torque[side][j], kTolerance * torque);
        }
    }
  }
}

TEST(Jointed, HeldTorsoLeavesTheFreeAnglesOfKane) {
  Random random;
  for (int trial = 0; trial < 100; ++trial) {
    Case c = random_case(random, false);
    const auto m = solved(c, false, true);
    const test::JointedAnswer kane =
        test::jointed_kane(c.vehicle, c.state, {Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero()}, true);
    EXPECT_EQ(m.acceleration_m_s2.x, 0);
    EXPECT_EQ(m.angular_acceleration_rad_s2.z, 0);
    for (std::size_t side = 0; side < 2; ++side)
      for (std::size_t j = 0; j < 4; ++j)
        EXPECT_NEAR((side == 0 ? m.joint_rad_s2.left : m.joint_rad_s2.right)[j], kane.joint[side][j],
                    kTolerance * (1e5 + std::abs(kane.joint[side][j])));
  }
}

// ---- the file

std::string driven_text() { return io::read_text(test::source_path("configs/vehicles/hummingbird_driven.toml")); }

/// What is said of the shipped file with `from` in it replaced.
std::string refused(const std::string& from, const std::string& to, std::string text = driven_text()) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), to);
  const std::string file = testing::TempDir() + "jointed.toml";
  std::ofstream(file) << text;
  const std::string said = test::refusal([&] { model::read_any_vehicle(file); });
  const std::size_t key = said.find(": ");
  return key == std::string::npos ? said : said.substr(key + 2);
}

TEST(JointedFile, ReadsBackTheSame) {
  for (const Vehicle& v : {test::driven_hummingbird(), test::insect(true, 5)}) {
    const std::string file = testing::TempDir() + "jointed_text.toml";
    std::ofstream(file) << model::vehicle_text(v);
    EXPECT_EQ(model::vehicle_text(model::read_any_vehicle(file)), model::vehicle_text(v));
  }
}

TEST(JointedFile, MirrorsTheLeftSide) {
  const Vehicle v = test::driven_hummingbird();
  EXPECT_EQ(v.right.shoulder_m.y, -v.left.shoulder_m.y);
  EXPECT_EQ(v.right.leading_edge.inertia_kg_m2.yz, -v.left.leading_edge.inertia_kg_m2.yz);
  EXPECT_EQ(v.right.leading_edge.inertia_kg_m2.xz, v.left.leading_edge.inertia_kg_m2.xz);
  EXPECT_EQ(v.jointed->right.angles[1].cos_rad, v.jointed->left.angles[1].cos_rad);
}

TEST(JointedFile, RefusesWhatNoWingDoes) {
  EXPECT_EQ(refused("cos_rad = [0.11]", "cos_rad = [63.0]"),
            "left.stroke.cos_rad: 63.0 rad is more than a turn; are these degrees?; accepted: amplitudes in rad");
  EXPECT_EQ(refused("cos_rad = [0.11]", "cos_rad = [0.15]"),
            "left.stroke: reaches 2.294 rad with all inputs at their ends; accepted: at most 1.75 rad either way");
  EXPECT_EQ(refused("cos_rad = [0.11]", ""),
            "left.stroke: is driven without a harmonic; accepted: cos_rad, sin_rad, or mode = \"fixed\"");
  EXPECT_EQ(refused("timing_opposed = 4.0", "timing_opposed = 6.0"),
            "input: all timing together stops the phase; accepted: at most 0.8 of all inputs at their ends");
  EXPECT_EQ(
      refused("lag_s = 0.004 ", "scale.stroke_plane = 0.1\nlag_s = 0.004 "),
      "input.amplitude.scale.stroke_plane: changes an angle that it cannot move; accepted: an angle that is driven");
  EXPECT_EQ(refused("lag_s = 0.004 ", "offset_rad.stroke_plane = 0.1\nlag_s = 0.004 "), "accepted");
  EXPECT_EQ(refused("mode = \"fixed\"", "mode = \"fixed\"\ncos_rad = [0.1]").substr(0, 37),
            "left.stroke_plane.cos_rad: unknown ke");
  // of a free angle
  const auto refused_free = [](const std::string& from, const std::string& to) {
    return refused(from, to, io::read_text(test::source_path("configs/vehicles/kubeetle_like.toml")));
  };
  EXPECT_EQ(refused_free("stop_stiffness_Nm_rad = 0.05\nstop_damping_Nm_s = 2e-5\n", ""),
            "left.rotation.lower_rad: is a stop that nothing holds; accepted: left.rotation.stop_stiffness_Nm_rad "
            "above 0, or no stop");
  EXPECT_EQ(refused_free("mode = \"free\"", "mode = \"free\"\nmean_rad = 0.1").substr(0, 33),
            "left.rotation.mean_rad: unknown k");
  EXPECT_EQ(refused_free("lag_s = ", "offset_rad.rotation = 0.1\nlag_s = ")
                    .find("changes an angle that it cannot "
                          "move; accepted: an angle that is "
                          "driven or fixed") != std::string::npos,
            true);
  EXPECT_EQ(refused("lag_s = 0.004 ", "lag_s = 0.0 "),
            "input.amplitude.lag_s: 0 is out of range; accepted: a number from 1e-05 to 1");
  EXPECT_EQ(refused("mode = \"fixed\"", "mode = \"loose\"").substr(0, 56),
            "left.stroke_plane.mode: \"loose\" is not known; accepted: ");
  EXPECT_EQ(refused("symmetric = true", "symmetric = false").substr(0, 22), "right: is missing; acc");
  EXPECT_EQ(refused("[left.planform]", "[effects.battery_sag]\n[left.planform]"),
            "effects.battery_sag: acts on wings and motors of another kind of vehicle; accepted: effects of sensors");
  EXPECT_EQ(refused("[left.planform]", "[left.aerodynamics]\nstrips_m = [[0.01, 0.01, 0.02, 0.0]]\n[left.planform]"),
            "left.planform: has no use where strips are given; accepted: [planform] or [aerodynamics]");
  EXPECT_EQ(test::refusal([] {
              model::read_vehicle(test::source_path("configs/vehicles/hummingbird_driven.toml"));
            }).find("model: wings whose angles are driven have no motors; accepted:") != std::string::npos,
            true);
}

// ---- air

// A wing that translates at constant speed across uniform strips: their sum in closed form.
TEST(StripAerodynamics, SumsToTheClosedForm) {
  Jointed::Wing w;
  const double span = 0.05, chord = 0.02, rho = 1.2, edge = 0.008;
  for (int i = 0; i < 10; ++i) w.strips.push_back({(i + 0.5) * span / 10, span / 10, chord, edge});
  w.rotational_lift = 1, w.normal_sin = {3}, w.tangential_cos = {0.4};
  const Vec3<double> v{-2, 0, 1.5}, turn{0, 30, 0};
  model::WingLoad<double> load = model::no_load<double>();
  for (const auto& strip : model::derive_strips(w, rho, -1))
    model::add_strip(strip, model::derive_series(w), true, v, turn, load);
  const double normal = -2 + 30 * (edge - chord / 4), U = std::hypot(normal, 1.5), area = span * chord;
  const double N = 0.5 * rho * area * U * U * 3 * (-normal / U), T = 0.5 * rho * area * U * U * 0.4 * (1.5 / U);
  const double R = rho * chord * area * std::numbers::pi / 2 * 1.5 * 30;
  EXPECT_NEAR(load.force_N.x, N + R, 1e-12);
  EXPECT_NEAR(load.force_N.z, -T, 1e-12);
  EXPECT_NEAR(load.moment_Nm.z, span / 2 * (N + R), 1e-12);
  EXPECT_NEAR(load.moment_Nm.x, span / 2 * T, 1e-12);
  const double c = 1.5 / U, behind = 0.46 - 0.332 * c - 0.037 * (4 * c * c * c - 3 * c) -
                                     0.013 * (16 * std::pow(c, 5) - 20 * c * c * c + 5 * c);
  EXPECT_NEAR(load.moment_Nm.y, N * (edge - chord * behind) + R * (edge - chord / 2), 1e-9);
}

// The series of the published C_N, in sines, are its polynomial.
TEST(StripAerodynamics, TakesSeriesForPolynomials) {
  Jointed::Wing published, sines;
  sines.normal_sin = {3.45 + 0.15, 0, 0.15};  // sin a (0.6 cos^2 a + 3.45)
  const auto a = model::derive_series(published), b = model::derive_series(sines);
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(a.normal[i], b.normal[i], 1e-15);
  Jointed::Wing all;
  all.normal_sin = {0.1, 0.2, 0.3, 0.4}, all.tangential_cos = {0.5, 0.6, 0.7, 0.8};
  const auto s = model::derive_series(all);
  const double x = 0.7, c = std::cos(x);
  double normal = 0, tangential = 0, P = 0, Q = 0;
  for (int k = 1; k <= 4; ++k) normal += 0.1 * k * std::sin(k * x), tangential += (0.4 + 0.1 * k) * std::cos(k * x);
  for (int i = 3; i >= 0; --i) P = P * c + s.normal[i];
  for (int i = 4; i >= 0; --i) Q = Q * c + s.tangential[i];
  EXPECT_NEAR(std::sin(x) * P, normal, 1e-14);
  EXPECT_NEAR(Q, tangential, 1e-14);
}

}  // namespace
}  // namespace flappy::jointed_test
