// Everything that may be wrong with the blind robot: nothing at magnitude 0, something at magnitude 1, and of the magnitude it should be.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "full.hpp"
#include "lab/blind/a/a_effects.hpp"
#include "lab/blind/a/robot_sensors.hpp"
#include "refusal.hpp"
#include "vehicles.hpp"

namespace flappy::blind::effects_test {
namespace {

/// What a short flight near ground, ceiling and wall leaves: motion, currents, battery, and what the sensors saw.
std::vector<double> trace(const Magnitudes& magnitudes, double duration_s = 0.25) {
  const Room room{.ceiling_z_m = 0.25, .wall = {0, 0.2, 0, -1}};
  const std::uint64_t seed = 3;
  const SensorSet set = sensors_of(seed, false, false);
  Robot robot(test::identified(), room, magnitudes, seed);
  RobotImu imu(set, magnitudes, seed, 0, kRobotStep_s);
  RobotMocap mocap(set, magnitudes, seed, 0);
  Torso start;
  start.position_m = {0.05, 0, 0.15};
  start.velocity_m_s = {0.3, 0.2, -0.3};
  start.rate_rad_s = {0, 0, 3};
  robot.place_torso(start);
  std::vector<double> all;
  const auto add = [&](const Vector3d& v, double scale) {
    for (int k = 0; k < 3; ++k) all.push_back(v(k) / scale);
  };
  double volts[2] = {0, 0};
  for (int n = 0; n < std::lround(duration_s / kRobotStep_s); ++n) {
    const double t = n * kRobotStep_s;
    if (n % 50 == 0) volts[0] = 12 * std::cos(2 * kPi * 34 * t), volts[1] = 10 * std::cos(2 * kPi * 34 * t);
    if (n % 250 == 0) {
      if (const auto s = mocap.look(robot.torso(), t)) {
        add(s->position_m, 1e-3);
        add(s->attitude.vec(), 1e-2);
        all.push_back(s->arrival_s / 1e-3);
      }
    }
    robot.step(volts[0], volts[1]);
    if (const auto s = imu.after_step(robot, t + kRobotStep_s)) add(s->gyro_rad_s, 0.1), add(s->accel_m_s2, 0.1);
  }
  const Torso& torso = robot.torso();
  add(torso.position_m, 1e-3);
  add(torso.velocity_m_s, 1e-2);
  add(torso.rate_rad_s, 0.1);
  all.push_back(robot.battery_V() / 0.1);
  for (const std::size_t k : {0u, 1u}) all.push_back(robot.current_A(k) / 0.01);
  return all;
}

double distance(const std::vector<double>& a, const std::vector<double>& b) {
  EXPECT_EQ(a.size(), b.size());
  double sum = 0;
  for (std::size_t k = 0; k < a.size(); ++k) sum += (a[k] - b[k]) * (a[k] - b[k]);
  return std::sqrt(sum / static_cast<double>(a.size()));
}

TEST(BlindEffects, VanishAtMagnitudeZeroAndActAtMagnitudeOne) {
  const std::vector<double> none = trace({});
  for (const std::string& name : effect_names()) {
    const double typical = distance(trace(Magnitudes({{name, 1}})), none);
    EXPECT_GT(typical, 0.01) << name;
    if (!test::full()) continue;
    const double small = distance(trace(Magnitudes({{name, 0.05}})), none);
    EXPECT_GT(small, 0) << name;
    // It grows with its magnitude; but a gear with the narrowest gap has flanks, which one without has not.
    EXPECT_GT(typical, (name == "gear_backlash" ? 1 : 5) * small) << name;
    if (name != "gear_backlash") EXPECT_LT(distance(trace(Magnitudes({{name, 1e-6}})), none), 0.05 * typical) << name;
  }
}

TEST(BlindEffects, OfTheSensorsLeaveTheMotionAlone) {
  const auto motion = [](const Magnitudes& magnitudes) {
    std::vector<double> all = trace(magnitudes, 0.05);
    return std::vector<double>(all.end() - 12, all.end());
  };
  const auto none = motion({});
  for (const char* name : {"gyro_bias", "accelerometer_misalignment", "vibration_rectification", "mocap_tilt",
                           "marker_offset", "mocap_delay", "outside_mocap_lens"})
    EXPECT_EQ(motion(Magnitudes({{name, 1}})), none) << name;
}

struct Stand {
  double thrust_N, heat_K, current_A;
  Vector3d moment_Nm;
};
/// At 10 V with the torso held at a height.
Stand stand(const std::vector<BlindEffect>& effects, double z_m = 1, double amplitude_V = 10) {
  Robot robot(test::nominal(), {}, Magnitudes(effects), 3);
  robot.hold_torso(true);
  Torso torso;
  torso.position_m.z() = z_m;
  robot.place_torso(torso);
  Stand s{};
  s.moment_Nm.setZero();
  double volts = 0, steps = 0;
  for (int n = 0; n < 75000; ++n) {
    if (n % 50 == 0) volts = amplitude_V * std::cos(2 * kPi * 34 * n * kRobotStep_s);
    robot.step(volts, volts);
    if (n < 50000) continue;
    ++steps;
    s.thrust_N += robot.air().force_N.z();
    s.moment_Nm += robot.air().moment_Nm;
    s.current_A += robot.current_A(0) * robot.current_A(0);
  }
  s.thrust_N /= steps, s.moment_Nm /= steps, s.current_A = std::sqrt(s.current_A / steps);
  s.heat_K = robot.state().side[0].winding_K;
  return s;
}

// Magnitudes of the catalogue, within a factor of about two: what is typical is not known better.
TEST(BlindEffects, AreOfTypicalSize) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  const double thrust = stand({}).thrust_N;
  const auto change = [&](const char* name, double z_m = 1) { return stand({{name, 1}}, z_m).thrust_N / thrust - 1; };
  EXPECT_NEAR(change("ground_effect", 0.08), 0.06, 0.03);
  EXPECT_NEAR(change("ground_effect", 1), 0, 0.002);
  EXPECT_NEAR(change("ceiling_effect", 1.91), 0.05, 0.03);
  EXPECT_NEAR(change("ceiling_effect", 1), 0, 0.001);
  EXPECT_NEAR(change("driver_dead_zone"), -0.08, 0.03);
  EXPECT_NEAR(change("battery_sag"), -0.04, 0.02);
  EXPECT_NEAR(change("coulomb_friction"), -0.03, 0.015);
  EXPECT_NEAR(change("wing_flexibility"), 0.07, 0.04);
  EXPECT_GT(std::abs(change("added_mass")), 1e-3);
  EXPECT_GT(std::abs(change("rotational_lift")), 3e-3);
  const Stand warm = stand({{"winding_heating", 1}});
  EXPECT_NEAR(warm.heat_K, 1.4 * 1.5 / 0.3, 2);  // 1.4 W for 1.5 s into 0.3 J/K, less what leaves
  EXPECT_GT(std::abs(stand({{"wing_damage", 1}}).moment_Nm.x()), 1e-4);
  // 80 degrees of stroke are needed for the wings to meet
  EXPECT_NEAR(stand({{"clap_and_fling", 1}}, 1, 9).thrust_N / stand({}, 1, 9).thrust_N, 1, 2e-3);
  EXPECT_GT(stand({{"clap_and_fling", 1}}, 1, 16).thrust_N / stand({}, 1, 16).thrust_N, 1.02);
}

TEST(BlindEffects, RefuseWhatTheyDoNotKnow) {
  const auto refusal = [](const char* id, double magnitude) {
    return test::refusal([&] { Magnitudes({{id, magnitude}}); });
  };
  EXPECT_EQ(refusal("ground_efect", 1),
            "--effect ground_efect: no such effect; accepted: what `flappy-blind effects` lists; did you mean "
            "\"ground_effect\"?");
  EXPECT_EQ(test::refusal([] {
              Magnitudes({{"wind", 1}, {"wind", 2}});
            }),
            "--effect wind: given twice; accepted: each effect once");
  EXPECT_EQ(refusal("wind", -1), "--effect wind: magnitude -1 is out of range; accepted: 0 to 4, 1 is typical");
}

TEST(BlindEffects, HaveNamesOfTheirOwn) {
  const auto& names = effect_names();
  EXPECT_EQ(std::set<std::string>(names.begin(), names.end()).size(), 40u);
}

/// The benchmark takes those before the first outside_... for the catalogue.
TEST(BlindEffects, HaveThoseOutsideTheCatalogueLast) {
  EXPECT_TRUE(
      std::ranges::is_partitioned(effect_names(), [](const auto& name) { return !name.starts_with("outside_"); }));
}

}  // namespace
}  // namespace flappy::blind::effects_test
