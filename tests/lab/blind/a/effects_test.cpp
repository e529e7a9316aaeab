// Everything that may be wrong with the blind robot: nothing at magnitude 0, something at magnitude 1, and of the magnitude it should be.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "full.hpp"
#include "lab/blind/a/a_effects.hpp"
#include "lab/blind/a/a_laws.hpp"
#include "lab/blind/a/family_a.hpp"
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
  s.heat_K = robot.state().side[0].heat.winding_K;
  return s;
}

// Magnitudes of the catalogue, within a factor of about two: what is typical is not known better.
TEST(BlindEffects, AreOfTypicalSize) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  const double thrust = stand({}).thrust_N;
  const auto change = [&](const char* name, double z_m = 1) { return stand({{name, 1}}, z_m).thrust_N / thrust - 1; };
  EXPECT_NEAR(change("ground_effect", 0.08), 0.05, 0.02);
  EXPECT_NEAR(change("ground_effect", 1), 0, 0.001);
  EXPECT_NEAR(change("ceiling_effect", 1.91), 0.05, 0.03);
  EXPECT_NEAR(change("ceiling_effect", 1), 0, 0.002);
  EXPECT_NEAR(change("driver_dead_zone"), -0.08, 0.03);
  EXPECT_NEAR(change("battery_sag"), -0.04, 0.02);
  EXPECT_NEAR(change("coulomb_friction"), -0.03, 0.015);
  EXPECT_NEAR(change("wing_flexibility"), 0.07, 0.04);
  EXPECT_GT(std::abs(change("added_mass")), 1e-3);
  EXPECT_GT(std::abs(change("rotational_lift")), 3e-3);
  const Stand warm = stand({{"winding_heating", 1}});
  EXPECT_NEAR(warm.heat_K, 1.3 * 1.5 / 0.263, 2);  // 1.3 W for 1.5 s into 0.263 J/K, less what leaves
  EXPECT_GT(std::abs(stand({{"wing_damage", 1}}).moment_Nm.x()), 1e-4);
  // more than 80 degrees of stroke are needed for the wings to meet
  EXPECT_NEAR(stand({{"clap_and_fling", 1}}, 1, 9).thrust_N / stand({}, 1, 9).thrust_N, 1, 2e-3);
  EXPECT_GT(stand({{"clap_and_fling", 1}}, 1, 16).thrust_N / stand({}, 1, 16).thrust_N, 1.02);
}

const std::unique_ptr<Family>& family() {
  static const std::unique_ptr<Family> f = make_family_a();
  return f;
}
double law(const char* effect, std::vector<double> at, std::size_t k = 0) { return family()->law(effect, at)[k]; }

// A source's image far away is a point's; on the ground the disc sees half the flow.
TEST(BlindLaws, GroundIsThatOfAnImage) {
  EXPECT_NEAR(law("ground_effect", {0.8}) / (laws::square(laws::kDisc_m / 0.8) / 16), 1, 0.02);
  EXPECT_NEAR(laws::ground(0), 1, 1e-12);
}

// Momentum of jet and suction on the ceiling: jet^2 - 2 v jet - v^2 R^2 / (8 D^2) = 0, at v = 1.
TEST(BlindLaws, CeilingBalancesMomentum) {
  for (const double d : {0.02, 0.07, 0.3}) {
    const double jet = 2 * std::pow(1 + law("ceiling_effect", {d}), 1 / laws::kCeilingExponent);
    EXPECT_NEAR(jet * jet - 2 * jet - laws::square(laws::kDisc_m / d) / 8, 0, 1e-9);
  }
}

// Pressure of the flow of sink and image on the wall, by numbers, over the weight 2 rho pi R^2 v^2: rho = v = 1.
TEST(BlindLaws, WallPullsByItsPressure) {
  constexpr double d = 0.13, step = 1e-4;
  const double area = kPi * laws::square(laws::kDisc_m), flow = area;
  double force = 0;
  for (double r = step / 2; r < 8; r += step) {
    const double speed = 2 * flow / (4 * kPi) * r / std::pow(r * r + d * d, 1.5);
    force += 0.5 * speed * speed * 2 * kPi * r * step;
  }
  EXPECT_NEAR(law("wall_effect", {d}) / (force / (2 * area)), 1, 1e-3);
  EXPECT_GT(law("wall_effect", {0.1}, 1), law("wall_effect", {0.2}, 1));
}

TEST(BlindLaws, OpeningPlatesAreLighthills) {
  EXPECT_NEAR(laws::opening_plates(kPi / 3), 0.69, 0.005);
  EXPECT_NEAR(laws::opening_plates(1e-3) * 4e-3, 1, 0.02);
  EXPECT_LT(law("clap_and_fling", {1}), 0.1);
  EXPECT_LT(laws::clap_and_fling(0.9, 0.84), 2e-3) << "wings that do not meet";
}

// The free length l of the leaf has the tip force E I / (r l) and the tip's angle (L - l / 2) / r; L = E I = 1.
TEST(BlindLaws, LeafWrapsOnItsSupport) {
  const double r = 1 / (2 * laws::kLeaf_rad);
  const auto force = [&](double l) { return 1 / (r * l); };
  for (const double l : {1.0, 0.8, 0.5, 0.3}) {
    const double angle = (1 - l / 2) / r, stiffness = 2;  // of the whole length: angle = F / 2
    EXPECT_NEAR(stiffness * angle + laws::leaf_added(stiffness, angle), force(l), 1e-9) << l;
  }
  EXPECT_EQ(laws::leaf_added(1, 0.8), 0);
}

// Kramer's force for slow rotation; for fast rotation the speed of the flow alone limits it.
TEST(BlindLaws, RotationalLiftSaturates) {
  const double slow = law("rotational_lift", {0, 200, 1e-3}), twice = law("rotational_lift", {0, 200, 2e-3});
  EXPECT_NEAR(twice / slow, 2, 1e-6);
  EXPECT_NEAR(law("rotational_lift", {0, 50, 4e4}) / law("rotational_lift", {0, 50, 2e4}), 1, 1e-3);
  EXPECT_NEAR(law("rotational_lift", {0, 200, -50}), -law("rotational_lift", {0, 200, 50}), 1e-15);
}

// A plate that only rotates about its leading edge: rho pi/4 c^2 (c/2)^2 + rho pi/128 c^4 per span, and the inertia of all
// strips; a stroke at 0 rotation turns masses at r.
TEST(BlindLaws, AddedMassIsThatOfPlates) {
  const model::Vehicle v = test::nominal();
  const Strips s = cut_into_strips(v.left.planform);
  double rotation = 0, stroke = 0, mass = 0, inertia = 0;
  for (std::size_t i = 0; i < kStrips; ++i) {
    const double x = s.r_m[i] / 0.07, c2 = s.chord_m[i] * s.chord_m[i], ellipse = std::sqrt(4 * x * (1 - x));
    const double m = v.air_density_kg_m3 * kPi / 4 * c2 * s.width_m * ellipse;
    rotation += m * c2 * (0.25 + 1.0 / 32);
    stroke += m * s.r_m[i] * s.r_m[i];
    mass += m, inertia += m * c2 / 32;
  }
  EXPECT_NEAR(law("added_mass", {0, 0, 0, 0, 1e4}, 1), -1e4 * rotation, 1e-6 * 1e4 * rotation);
  EXPECT_NEAR(law("added_mass", {0, 0, 0, 1e4, 0}), -1e4 * stroke, 1e-6 * 1e4 * stroke);
  const auto& numbers = family()->effects()[static_cast<std::size_t>(Effect::added_mass)].numbers;
  EXPECT_NEAR(numbers[0] / mass, 1, 1e-3);
  EXPECT_NEAR(numbers[1] / inertia, 1, 1e-3);
}

// Loses no energy of its own: what the air gets, d/dt of 1/2 m (n.v)^2, the wing gives.
TEST(BlindLaws, AddedMassKeepsEnergy) {
  const std::vector<double> at = {0.6, 120, -80, 2e4, -1.5e4};
  const double given = law("added_mass", at) * at[1] + law("added_mass", at, 1) * at[2];
  const model::Vehicle v = test::nominal();
  const Strips s = cut_into_strips(v.left.planform);
  const auto energy = [&](double t) {
    const double rotation = at[0] + t * (at[2] + t / 2 * at[4]), psi = at[1] + t * at[3], theta = at[2] + t * at[4];
    double sum = 0;
    for (std::size_t i = 0; i < kStrips; ++i) {
      const auto added = laws::added_mass(v.air_density_kg_m3, s.chord_m[i], s.width_m, s.r_m[i] / 0.07);
      const double across = psi * s.r_m[i] * std::cos(rotation) + theta * s.chord_m[i] / 2;
      sum += 0.5 * (added.mass_kg * across * across + added.inertia_kg_m2 * theta * theta);
    }
    return sum;
  };
  constexpr double step = 1e-7;
  EXPECT_NEAR(given, -(energy(step) - energy(-step)) / (2 * step), 1e-3 * std::abs(given));
}

// What resists only takes energy.
TEST(BlindLaws, DissipateWhereTheyResist) {
  Random random(5, Purpose::directions);
  for (int n = 0; n < 200; ++n) {
    const Vector3d v = random.normals();
    EXPECT_LT(laws::body_drag(v, 1.18).dot(v), 0);
    const double rate = 200 * random.normal();
    EXPECT_GE(laws::motor_friction(rate) * rate, 0);
    EXPECT_LE(rotation_drag(0.02, 5 * random.normal(), rate) * rate, 0);
    EXPECT_LE(laws::dead_time(rate / 200) * rate, 0);
  }
  // a rotor that meets a flank at 10 rad/s leaves it more slowly; rubber likewise
  double pressed = 0, rate = 10;
  do {
    rate -= 1e-7 * laws::gear_contact(0, pressed, rate).torque_Nm / 6e-8;
    pressed += 1e-7 * rate;
  } while (pressed > 0);
  EXPECT_LT(-rate, 9.5);
  EXPECT_GT(-rate, 3);
  EXPECT_GT(law("stop_compliance", {0.02, 50}), law("stop_compliance", {0.02, -50}));
}

// All heat is in the masses or has left, and at last the winding is P (R1 + R2 + R3) above the air.
TEST(BlindLaws, HeatIsKept) {
  laws::Heat h;
  double left_J = 0;
  constexpr double kStep_s = 0.01, kPower_W = 1.2;
  for (int n = 0; n < 200000; ++n) {
    left_J += kStep_s * h.housing_K / laws::kToAir_K_W;
    laws::heat_step(h, kStep_s * kPower_W, kStep_s);
    if (n == 3000)
      EXPECT_NEAR(
          left_J + laws::kWinding_J_K * h.winding_K + laws::kMagnet_J_K * h.magnet_K + laws::kHousing_J_K * h.housing_K,
          3001 * kStep_s * kPower_W, 0.02);
  }
  EXPECT_NEAR(h.winding_K, kPower_W * (laws::kToMagnet_K_W + laws::kToHousing_K_W + laws::kToAir_K_W), 0.1);
}

TEST(BlindLaws, BatterySagsAsItsCircuitSays) {
  constexpr double t = 8, i = 0.7;
  const double rc =
      i * (laws::kFast_ohm * (1 - std::exp(-t / laws::kFast_s)) + laws::kSlow_ohm * (1 - std::exp(-t / laws::kSlow_s)));
  const double x = i * t / laws::kCapacity_C;  // cubic less the exponential, which is not felt so far up
  const double open = 5 * (0.2156 * x - 0.1178 * (1 - (1 - x) * (1 - x)) + 0.3201 * (1 - std::pow(1 - x, 3)));
  EXPECT_NEAR(law("battery_sag", {t, i}), i * laws::kSeries_ohm + rc + open, 2e-3);
}

// The filter's gusts have unit variance, and the spectrum's integral is 1.
TEST(BlindLaws, GustsHaveTheirVariance) {
  Random random(3, Purpose::gusts);
  laws::Gust g;
  double sum = 0;
  constexpr int kSteps = 400000;
  for (int n = 0; n < kSteps; ++n) {
    const Vector3d gust = laws::gust_step(g, random.normals(), 1e-3);
    sum += gust.squaredNorm() / 3;
  }
  EXPECT_NEAR(sum / kSteps, 1, 0.12);  // 700 correlation times, three axes: 4 %
  double integral = 0;
  for (double f = 0.025; f < 20; f += 0.05) integral += 0.05 * law("wind", {0.6, f}, 1);
  EXPECT_NEAR(integral, 1, 0.02);
  EXPECT_NEAR(law("wind", {0.6, 1}), 1, 1e-12);
}

// A sheet of constant chord under r^2: twist (x - x^4 / 4) 4 / 3.
TEST(BlindLaws, TwistIsThatOfASheet) {
  Strips s = cut_into_strips(test::nominal().left.planform);
  s.chord_m.fill(0.02);
  const auto shape = laws::twist_shape(s);
  for (std::size_t i = 0; i < kStrips; ++i) {
    const double x = (static_cast<double>(i) + 0.5) / kStrips;
    EXPECT_NEAR(shape[i], (x - x * x * x * x / 4) * 4 / 3, 5e-3) << i;
  }
}

// A wing that never turns back meets no wake; after a reversal it meets some per cent of its largest force.
TEST(BlindLaws, WakeIsMetAfterReversal) {
  laws::Wake wake;
  for (int n = 0; n < 5000; ++n) laws::wake_step(wake, 200, 2e-5);
  EXPECT_LT(std::abs(laws::wake_met(wake, 200)), 0.01);
  EXPECT_GT(law("wake_capture", {2e-3, 250}), 0.03);
  EXPECT_LT(std::abs(law("wake_capture", {8e-3, 250})), 1e-3);
}

// Of all effects that the table names, those that are more than geometry have a law; its numbers are positive.
TEST(BlindLaws, AreWrittenDown) {
  for (const FamilyEffect& e : family()->effects()) {
    EXPECT_FALSE(e.law.empty() || e.source.empty() || e.numbers.empty()) << e.id;
    for (const double x : e.numbers) EXPECT_GT(x, 0) << e.id;
    const std::vector<double> at(5, 0.5);
    const bool geometry =
        e.id == "com_offset" || e.id == "inertia_products" || e.id == "wing_inertia" || e.id.starts_with("outside_");
    EXPECT_EQ(family()->law(e.id, at).empty(), geometry) << e.id;
  }
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
