// Robots of family C: the engine's model is the vehicle's file, the physics holds where it must, and effects, declarations and
// arguments do what they say.
#include "lab/blind/c/family_c.hpp"

#include <gtest/gtest.h>

#include <map>
#include <numeric>

#include "io/parallel.hpp"
#include "lab/blind/c/c_bench.hpp"
#include "lab/blind/c/c_contrast.hpp"
#include "lab/blind/c/c_escape.hpp"
#include "lab/blind/c/c_flight.hpp"
#include "lab/blind/c/c_law.hpp"
#include "lab/blind/c/c_laws.hpp"
#include "lab/blind/c/c_session.hpp"
#include "lab/blind/c/mjcf.hpp"

namespace flappy::blind::c {
namespace {

const std::filesystem::path kVehicle =
    std::filesystem::path(FLAPPY_SOURCE_DIR) / "configs/vehicles/hummingbird_nominal.toml";
// Long enough for all effects, short enough for all of them in a test.
constexpr Length kShort = {0.1, 0.1};

Assignment plain() {
  Assignment a;
  a.vehicle_file = kVehicle;
  a.seed = 5;
  a.power = a.wings = true;
  return a;
}

Assignment with(const std::string& effect, double magnitude) {
  Assignment a = plain();
  a.effects = {{effect, magnitude}};
  return a;
}

flightlog::FlightLog short_log(const Assignment& a, std::size_t flight = 0) {
  return fly_one(a, flight, false, kShort).flight.log;
}

const RobotParameters& nominal() {
  static const RobotParameters parameters = read_parameters(kVehicle);
  return parameters;
}

/// Motors and springs as those of a robot without effects.
struct Bench {
  explicit Bench(const RobotParameters& f, double every_s = Mechanism::kStep_s, const Build& build = {})
      : parameters(f),
        mechanism(parameters, build, every_s),
        drive(parameters, Magnitudes({}), 1, 0),
        step_s(every_s) {}

  /// Calls `each` after every step.
  template <class Each>
  void run(const Inputs& inputs, double until_s, bool held, const Each& each) {
    const long steps = std::lround(until_s / step_s), tick = std::lround(1e-3 / step_s);
    for (long i = 0; i < steps; ++i) {
      const double now_s = static_cast<double>(i) * step_s;
      if (i % tick == 0)
        drive.command(now_s, beat_voltages(inputs, beat_phase(now_s, parameters.flapping_Hz), parameters));
      const auto torques = drive.torques(now_s, step_s, {mechanism.drive_angle(0), mechanism.drive_angle(1)},
                                         {mechanism.drive_rate(0), mechanism.drive_rate(1)});
      const Motion still;
      mechanism.step(torques,
                     {-parameters.sides[0].spring.positive_Nm_rad * mechanism.stroke(0),
                      -parameters.sides[1].spring.positive_Nm_rad * mechanism.stroke(1)},
                     {}, held ? &still : nullptr);
      each(now_s);
      if (held) mechanism.move_torso(still);
    }
  }
  /// Over the robot's weight, with the torso held, over ten beats after ten.
  double thrust(const Inputs& inputs) {
    double sum = 0, count = 0;
    run(inputs, 20 / parameters.flapping_Hz, true, [&](double now_s) {
      if (now_s < 10 / parameters.flapping_Hz) return;
      sum += mechanism.motion().acceleration_W.z();
      ++count;
    });
    return 1 + sum / count / Mechanism::kGravity_m_s2;
  }

  RobotParameters parameters;
  Mechanism mechanism;
  Drive drive;
  double step_s;
};

struct Momentum {
  Eigen::Vector3d linear = Eigen::Vector3d::Zero(), place = Eigen::Vector3d::Zero();
  double of_wings = 0;
};

Momentum momentum(const Mechanism& mechanism) {
  Momentum sum;
  const mjModel& m = mechanism.model();
  for (int body = 1; body < m.nbody; ++body) {
    mjtNum velocity[6];
    mj_objectVelocity(&m, const_cast<mjData*>(&mechanism.data()), mjOBJ_BODY, body, velocity,
                      0);  // of the centre of mass
    const Eigen::Vector3d p = m.body_mass[body] * Eigen::Vector3d(velocity[3], velocity[4], velocity[5]);
    sum.linear += p;
    if (body > 1) sum.of_wings = std::max(sum.of_wings, p.norm());
    sum.place += m.body_mass[body] * Eigen::Vector3d(mechanism.data().xipos + 3 * body);
  }
  return sum;
}

TEST(FamilyC, ModelHasTheFilesMassesAndInertias) {
  const Mechanism mechanism(nominal(), {});
  const mjModel& m = mechanism.model();
  double mass = 0;
  for (int body = 1; body < m.nbody; ++body) mass += m.body_mass[body];
  EXPECT_NEAR(mass, 12.448e-3, 1e-6);
  const std::vector<std::pair<std::string, RigidBody>> bodies = {{"torso", nominal().torso},
                                                                 {"left_edge", nominal().sides[0].leading_edge},
                                                                 {"right_edge", nominal().sides[1].leading_edge},
                                                                 {"left_wing", nominal().sides[0].wing},
                                                                 {"right_wing", nominal().sides[1].wing}};
  for (const auto& [name, body] : bodies) {
    const int id = mj_name2id(&m, mjOBJ_BODY, name.c_str());
    ASSERT_GE(id, 0) << name;
    EXPECT_NEAR(m.body_mass[id], body.mass_kg, 1e-12) << name;
    const mjtNum* q = m.body_iquat + 4 * id;
    const Eigen::Matrix3d R = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix();
    const Eigen::Matrix3d inertia = R * Eigen::Vector3d(m.body_inertia + 3 * id).asDiagonal() * R.transpose();
    EXPECT_LT((inertia - body.inertia_kg_m2).norm(), 1e-6 * body.inertia_kg_m2.norm()) << name;
    EXPECT_LT((Eigen::Vector3d(m.body_ipos + 3 * id) - body.com_m).norm(), 1e-12) << name;
  }
}

TEST(FamilyC, EllipsoidsHaveThePlanformsMoments) {
  const Planform& p = nominal().sides[0].planform;
  double r0 = 0, r1 = 0, r2 = 0, r3 = 0;
  for (const Strip& s : strips_of(p)) {
    r0 += s.area;
    r1 += s.area * s.radius;
    r2 += s.area * s.radius * s.radius;
    r3 += s.area * s.radius * s.radius * s.radius;
  }
  EXPECT_NEAR(r0, p.r00, 1e-12);
  EXPECT_NEAR(r1, p.r11, 1e-12);
  EXPECT_NEAR(r2, p.r22, 1e-12);
  EXPECT_NEAR(r3, p.r33, 1e-12);
}

TEST(FamilyC, FallsFreelyWithoutAir) {
  Mechanism mechanism(nominal(), {});
  mechanism.model().opt.density = mechanism.model().opt.viscosity = 0;
  const double before = momentum(mechanism).place.z();
  for (long i = 0; i < std::lround(0.1 / Mechanism::kStep_s); ++i) mechanism.step({0, 0}, {0, 0}, {});
  const double fallen = (before - momentum(mechanism).place.z()) / nominal().mass_kg();
  EXPECT_NEAR(fallen, 0.5 * 9.81 * 0.1 * 0.1, 1e-4);
}

TEST(FamilyC, KeepsMomentumWithoutAirAndWeight) {
  const auto lost = [](double step_s, const Build& build) {
    Bench bench(nominal(), step_s, build);
    mjOption& option = bench.mechanism.model().opt;
    option.density = option.viscosity = option.gravity[2] = 0;
    double wings = 0, all = 0;
    bench.run({10, 0, 0, 0}, 0.04, false, [&](double) {
      const Momentum now = momentum(bench.mechanism);
      wings = std::max(wings, now.of_wings);
      all = std::max(all, now.linear.norm());
    });
    EXPECT_GT(wings, 1e-4);  // kg m/s
    return all / wings;
  };
  // with every effect on the bodies, whose forces are between them
  std::array<Build, 4> builds;
  builds[1].backlash_rad = kBacklash_rad;
  builds[2].stop_softness = 1;
  builds[3].damage = kDamage;
  for (const Build& build : builds) {
    const double coarse = lost(Mechanism::kStep_s, build), fine = lost(Mechanism::kStep_s / 5, build);
    EXPECT_LT(fine, 0.02) << &build - builds.data();
    EXPECT_LT(fine, 0.25 * coarse) << &build - builds.data();
  }
}

TEST(FamilyC, TenVoltsCarryTheWeightInSteps) {
  const double thrust = Bench(nominal()).thrust({10, 0, 0, 0});
  EXPECT_NEAR(thrust, 1.0, 0.03);
  EXPECT_NEAR(Bench(nominal(), Mechanism::kStep_s / 2).thrust({10, 0, 0, 0}), thrust, 0.005);
}

TEST(FamilyC, SymmetricRobotFliesSymmetrically) {
  RobotParameters f = nominal();
  const auto mirrored = [](RigidBody body) {
    body.com_m.y() *= -1;
    for (const auto& [i, j] : {std::pair{0, 1}, std::pair{1, 2}})
      body.inertia_kg_m2(i, j) = body.inertia_kg_m2(j, i) = -body.inertia_kg_m2(i, j);
    return body;
  };
  f.torso.com_m.y() = 0;
  for (const auto& [i, j] : {std::pair{0, 1}, std::pair{1, 2}})
    f.torso.inertia_kg_m2(i, j) = f.torso.inertia_kg_m2(j, i) = 0;
  f.sides[1].leading_edge = mirrored(f.sides[0].leading_edge);
  f.sides[1].wing = mirrored(f.sides[0].wing);
  Bench bench(f);
  double aside = 0, along = 0, strokes = 0;
  bench.run({10, 0, 0.2, 0}, 0.15, false, [&](double) {
    const Motion now = bench.mechanism.motion();
    aside = std::max({aside, std::abs(now.velocity_W.y()), std::abs(now.rate_B.x()), std::abs(now.rate_B.z())});
    along = std::max(along, std::abs(now.rate_B.y()));
    strokes = std::max(strokes, std::abs(bench.mechanism.stroke(0) - bench.mechanism.stroke(1)));
  });
  EXPECT_GT(along, 0.5);
  EXPECT_LT(aside, 1e-5);
  EXPECT_LT(strokes, 1e-6);
}

TEST(FamilyC, InputsTurnTheRobotAsPublished) {
  const auto turned = [](const Inputs& inputs) {
    Bench bench(nominal());
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    bench.run(inputs, 8 / 34.0, true, [&](double) { sum += bench.mechanism.motion().turning_B; });
    return sum;
  };
  const Eigen::Vector3d none = turned({10, 0, 0, 0});
  EXPECT_GT((turned({10, 1, 0, 0}) - none).x(), 0);
  EXPECT_GT((turned({10, 0, 1, 0}) - none).y(), 0);
  EXPECT_GT((turned({10, 0, 0, 0.1}) - none).z(), 0);
}

TEST(FamilyC, Hovers) {
  Assignment a = plain();
  a.hover = true;
  a.own_parameters = true;
  const FamilyFlight flight = fly_one(a, 0, false, {1.5, 2}).flight;
  EXPECT_FALSE(flight.crashed) << flight.how;
  EXPECT_EQ(flight.log.command.t_s.size(), 2000U);
  const flightlog::FlightLog again = flightlog::parse_flight_log(flightlog::flight_log_files(flight.log), "log");
  EXPECT_EQ(again.command, flight.log.command);
  EXPECT_GT(flight.log.mocap.t_s.size(), 250U);
  EXPECT_EQ(flight.log.header.ambient.walls.size(), 1U);
}

TEST(FamilyC, EffectsOfNoSizeLeaveTheSameBytesAndOthersNot) {
  const std::vector<FamilyEffect>& effects = effect_table();
  ASSERT_EQ(effects.size(), static_cast<std::size_t>(Effect::kCount));
  Assignment none = plain();
  for (const FamilyEffect& effect : effects) none.effects.emplace_back(effect.id, 0.0);
  const std::array<flightlog::FlightLog, 3> without = {short_log(plain()), short_log(plain(), 1),
                                                       short_log(plain(), 2)};
  EXPECT_EQ(short_log(none), without[0]);
  const ProposedFlight low = {0.1,
                              [](double) {
                                return std::array<double, 4>{0, 0, 0.05, 0};
                              },
                              [](double) { return std::array<double, 4>{}; }};  // the ground effect ends soon
  Assignment near = plain();
  near.proposed = &low;
  const flightlog::FlightLog near_ground = short_log(near);
  std::vector<int> same(effects.size());
  io::parallel_for(effects.size(), 2, [&](std::size_t i) {
    const std::size_t flight = effects[i].id == "ceiling_effect" ? 1 : effects[i].id == "wall_effect" ? 2 : 0;
    Assignment a = with(effects[i].id, 1);
    if (effects[i].id == "ground_effect") a.proposed = &low;
    same[i] = short_log(a, flight) == (a.proposed ? near_ground : without[flight]);
  });
  for (std::size_t i = 0; i < effects.size(); ++i) {
    EXPECT_FALSE(same[i]) << effects[i].id;
    EXPECT_FALSE(effects[i].typical.empty() || effects[i].channels.empty() || effects[i].regimes.empty())
        << effects[i].id;
  }
}

TEST(FamilyC, DriveLosesWhatItsEffectsTake) {
  const auto driven = [](const std::string& effect, double until_s) {
    const Magnitudes magnitudes(effect.empty() ? std::vector<std::pair<std::string, double>>{}
                                               : std::vector<std::pair<std::string, double>>{{effect, 1}});
    Drive drive(nominal(), magnitudes, 3, 0);
    drive.command(0, {5, -5});
    for (double t = 0; t < until_s; t += 1e-4) drive.torques(t, 1e-4, {0, 0}, {0, 0});
    return std::pair{drive.currents()[0], drive.battery_V()};
  };
  const double current = driven("", 0.01).first;
  EXPECT_NEAR(current, 5 / 12.4, 1e-12);
  const double lossy =
      driven("driver_dead_zone", 0.01).first;  // the bridge's drop at 5 V of 18.5 V, and at its current
  EXPECT_NEAR(12.4 * lossy + laws::bridge_loss_V(5, lossy, Drive::kBattery_V), 5, 1e-9);
  EXPECT_LT(driven("driver_bandwidth", 5e-4).first, 0.7 * current);
  EXPECT_NEAR(driven("driver_bandwidth", 0.03).first, current, 1e-9);
  EXPECT_EQ(driven("command_delay", laws::kDoor_s - 2e-4).first, 0);
  EXPECT_NEAR(driven("command_delay", laws::kDoor_s + laws::kTask_s + 2e-4).first, current, 1e-12);
  EXPECT_LT(driven("winding_heating", 3).first, 0.98 * current);
  EXPECT_LT(driven("battery_sag", 0.1).second, Drive::kBattery_V);
  EXPECT_NE(driven("outside_converter_hunting", 0.01).second, Drive::kBattery_V);
}

TEST(FamilyC, AirActsWhereItsEffectsAre) {
  struct Acted {
    Wrench wrench;
    double factor;
  };
  const auto acted = [](const std::string& effect, const Eigen::Vector3d& at) {
    Mechanism mechanism(nominal(), {});
    Air air(nominal(), Magnitudes({{effect, 1}}), 3, 0);
    mechanism.place(at, Eigen::Quaterniond::Identity());
    mj_kinematics(&mechanism.model(), const_cast<mjData*>(&mechanism.data()));
    const Wrench wrench = air.act(mechanism, 1e-4);
    const int strip = mj_name2id(&mechanism.model(), mjOBJ_GEOM, "left_strip_1");
    return Acted{wrench, mechanism.model().geom_fluid[mjNFLUID * strip]};
  };
  const double plane_m = nominal().sides[0].shoulder_m.z();
  EXPECT_NEAR(acted("ground_effect", {0, 0, 0.05 - plane_m}).factor, 1 + laws::ground_share(0.05), 1e-12);
  EXPECT_LT(acted("ground_effect", {0, 0, 0.12}).factor, 0.98);
  EXPECT_NEAR(acted("ground_effect", {0, 0, 1}).factor, 1, 1e-5);
  EXPECT_NEAR(acted("ceiling_effect", {0, 0, 2 - 0.05 - plane_m}).factor, 1 + laws::ceiling_share(0.05), 1e-12);
  EXPECT_LT(acted("wall_effect", {0, 0.9, 1}).factor, 0.97);
  EXPECT_GT(acted("wall_effect", {0, 0.9, 1}).wrench.force_W.y(), 2e-3);
  EXPECT_LT(acted("wall_effect", {0, 0, 1}).wrench.force_W.y(), 1e-4);
  EXPECT_NEAR(acted("tether", {0, 0, 1.01}).wrench.force_W.z(), -laws::kWires_kg_m * 9.81, 1e-6);
  EXPECT_NEAR(acted("tether", {0, 0, 0.01}).wrench.force_W.z(), 0, 1e-9);
}

TEST(FamilyC, SensorsErrAsTheirEffectsSay) {
  const flightlog::FlightLog log = short_log(plain()), late = short_log(with("mocap_delay", 1));
  EXPECT_EQ(late.command, log.command);
  EXPECT_EQ(late.imu, log.imu);
  EXPECT_EQ(late.header, log.header);
  // samples from before t = 0 arrive later: those that are in both logs are the same poses
  const std::size_t more = static_cast<std::size_t>(
      std::find(late.mocap.x_m.begin(), late.mocap.x_m.end(), log.mocap.x_m[0]) - late.mocap.x_m.begin());
  ASSERT_LT(more, late.mocap.x_m.size());
  const double late_s = late.mocap.t_s[more] - log.mocap.t_s[0];
  EXPECT_GE(late_s, laws::kBuffer0_s - 1e-12);
  EXPECT_LE(late_s, laws::kBuffer0_s + laws::kBufferFrame_s + 1e-12);
  const flightlog::FlightLog bent = short_log(with("mocap_tilt", 1)), offset = short_log(with("marker_offset", 1));
  const auto place = [](const flightlog::FlightLog& of) {
    return Eigen::Vector3d(of.mocap.x_m[3], of.mocap.y_m[3], of.mocap.z_m[3]);
  };
  const Eigen::Vector3d true_W = place(log);
  EXPECT_LT((place(bent) - true_W - laws::bent_by(true_W, sensor_faults(Magnitudes({}), plain().seed).bend, 1)).norm(),
            1e-6);
  EXPECT_GT((place(bent) - true_W).norm(), 1e-4);
  const double shifted_m = (place(offset) - true_W).norm();
  EXPECT_GT(shifted_m, 0.5e-3);
  EXPECT_LT(shifted_m, 3e-3);
  EXPECT_EQ(short_log(with("gyro_bias", 1)).imu.accel_x_m_s2, log.imu.accel_x_m_s2);
  EXPECT_EQ(short_log(with("vibration_rectification", 1)).imu.gyro_x_rad_s, log.imu.gyro_x_rad_s);
}

TEST(FamilyC, SwapsTheWingsWithTheirFaults) {
  const auto wing = [](const Robot& robot, const char* side) {
    const mjModel& m = robot.mechanism().model();
    const int id = mj_name2id(&m, mjOBJ_BODY, (side + std::string("_wing")).c_str());
    return std::array<double, 2>{m.body_mass[id], m.body_ipos[3 * id + 1]};
  };
  Assignment a = with("wing_damage", 2);
  for (const bool own : {false, true}) {
    a.own_parameters = own;
    a.changes = {};
    const Robot before(a, 0);
    a.changes.swapped_wings = true;
    const Robot after(a, 0);
    const auto left = wing(before, "left"), right = wing(before, "right"), swapped = wing(after, "left");
    EXPECT_NE(left[0], right[0]) << "one is damaged";
    EXPECT_NEAR(swapped[0], right[0], 1e-15);
    EXPECT_NEAR(swapped[1], -right[1], 1e-15);
    EXPECT_NEAR(wing(after, "right")[0], left[0], 1e-15);
    const auto &was = before.parameters().sides, &is = after.parameters().sides;
    EXPECT_EQ(is[0].leading_edge.inertia_kg_m2(0, 1), -was[1].leading_edge.inertia_kg_m2(0, 1));
    EXPECT_EQ(is[0].leading_edge.inertia_kg_m2(1, 1), was[1].leading_edge.inertia_kg_m2(1, 1));
    EXPECT_EQ(is[1].fluid, was[0].fluid);
    EXPECT_EQ(is[0].rotation.lower_rad, was[1].rotation.lower_rad);
    EXPECT_EQ(is[0].motor.resistance_ohm, was[0].motor.resistance_ohm) << "motors stay";
  }
}

TEST(FamilyC, CarriesAWeightAndLosesWhatIsTakenAway) {
  Assignment a = with("tether", 1);
  const RigidBody before = Robot(a, 0).parameters().torso;
  a.changes.added_mass_kg = 0.5e-3;
  a.changes.added_at_m = {0.02, 0, -0.01};
  a.changes.without = {"tether"};
  const Robot robot(a, 0);
  const RigidBody& after = robot.parameters().torso;
  EXPECT_NEAR(after.mass_kg, before.mass_kg + 0.5e-3, 1e-15);
  EXPECT_NEAR(after.mass_kg * after.com_m.x(), before.mass_kg * before.com_m.x() + 0.5e-3 * 0.02, 1e-15);
  EXPECT_EQ(robot.magnitudes()[Effect::kTether], 0);
  EXPECT_EQ(short_log(a).header.changes, a.changes);
}

TEST(FamilyC, ContrastIsWhatTheEffectDoes) {
  const Length length = {0.12, 0.2};
  const auto mean = [&](const std::string& effect, double magnitude) {
    const Contrast contrast = contrast_of(plain(), 0, effect, magnitude, length);
    EXPECT_EQ(contrast.beat_s.size(), 6U);
    Eigen::Matrix<double, 6, 1> sum = Eigen::Matrix<double, 6, 1>::Zero();
    for (const auto& beat : contrast.change)
      for (int channel = 0; channel < 6; ++channel) sum[channel] += beat[static_cast<std::size_t>(channel) * 5] / 6;
    return sum;
  };
  const auto com = mean("com_offset", 1);  // 0.83 mm under the weight: about 26 rad/s^2
  EXPECT_NEAR(std::hypot(com[3], com[4]), 26, 8);
  EXPECT_NEAR(mean("com_offset", 2).segment<2>(3).norm() / com.segment<2>(3).norm(), 2, 0.15);
  EXPECT_EQ(mean("com_offset", 0).norm(), 0);
  EXPECT_EQ(mean("gyro_bias", 1).norm(), 0);
  EXPECT_LT(mean("driver_dead_zone", 1)[2], -0.2);
  const auto damage = mean("wing_damage", 1);
  EXPECT_NEAR(std::abs(damage[3]), 20, 7);
  EXPECT_LT(damage[2], 0);
}

TEST(FamilyC, WingsFollowATorsoThatIsHeld) {
  Mechanism mechanism(nominal(), {});
  Motion spinning;
  spinning.turning_B.z() = 1000;
  mechanism.step({0, 0}, {0, 0}, {}, &spinning);
  // without its rotor's inertia a wing would stay where it was: the left one's stroke goes back as fast, the right one's forth
  EXPECT_LT(mechanism.stroke_rate(0), -500 * Mechanism::kStep_s);
  EXPECT_GT(mechanism.stroke_rate(0), -3000 * Mechanism::kStep_s);
  EXPECT_NEAR(mechanism.stroke_rate(1), -mechanism.stroke_rate(0), 1e-3);
}

TEST(FamilyC, PilotRemembersWhereItWasCarried) {
  Pilot pilot(nominal(), plain(), 0);
  Motion still;
  still.position_W = {0.1, 0, 1};
  still.velocity_W = {0.2, 0, 0};
  for (int i = 0; i < 60; ++i) pilot.look(still, 1e-3);
  pilot.carry(still.position_W, M_PI / 2, {0, 0.5, 0});
  still.position_W = {0.1, 0.5, 1};
  still.velocity_W = {0, 0.2, 0};
  still.q_WB = Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ());
  still.R_WB = still.q_WB.toRotationMatrix();
  pilot.look(still, 1e-3);
  EXPECT_LT((pilot.view().position_W - still.position_W).norm(), 0.01);
  EXPECT_LT((pilot.view().velocity_W - still.velocity_W).norm(), 1e-9);
  EXPECT_NEAR(heading_of(pilot.view().R_WB), M_PI / 2, 0.02);
}

TEST(FamilyC, EscapeKeepsItsRules) {
  EscapeAssignment rules;
  rules.observation = {"goal_rotation", "position_error", "velocity", "body_rate",
                       "beat_phase",    "time",           "trim",     "previous_action"};
  std::vector<double> first;
  std::size_t calls = 0;
  rules.policy = [&](const std::vector<double>& observation) {
    if (calls == 0) first = observation;
    ++calls;
    return std::array<double, 4>{};
  };
  rules.start_m = {-0.02, 0, 0};
  rules.hand_back = {0.01, 0.1, 1, 0.1, 0.1};
  rules.hand_back_at_s = 0.1;
  rules.capture = {0.1, 1, 15, 0.7, 0.8};
  rules.capture_by_s = 0.35;
  rules.keep = {0.1, 0, 0, 0.8, 0.8};
  rules.keep_from_s = 0.3;
  rules.keep_until_s = 0.5;
  const FamilyEscape escape = escape_of(plain(), 0, rules, 1);
  EXPECT_TRUE(escape.success);
  ASSERT_EQ(first.size(), 9U + 3 + 3 + 3 + 2 + 1 + 4 + 4) << "numbers as a task has them (flight/task.cpp)";
  for (const std::size_t diagonal : {0, 4, 8}) EXPECT_NEAR(first[diagonal], 1, 0.05) << "upright, heading for the goal";
  EXPECT_NEAR(first[9], -0.02, 0.01) << "behind the goal";
  EXPECT_LE(calls, 10U);
  EXPECT_LT(escape.captured_s, 0.02);
  EXPECT_EQ(escape.log.header.ambient.ground_z_m, -1);
  rules.capture.distance_m = 1e-6;  // it stays near, but never captures
  EXPECT_FALSE(escape_of(plain(), 0, rules, 1).success);
  rules.capture.distance_m = 0.1;
  rules.heading_rad = M_PI;
  rules.start_m = {0.05, 0, 0};
  const FamilyEscape turned = escape_of(plain(), 1, rules, 0.2);
  EXPECT_NEAR(std::abs(turned.log.mocap.qz[0]), 1, 0.02);
  EXPECT_NEAR(turned.log.mocap.x_m[0], 0.05, 5e-3);
  EXPECT_NEAR(turned.log.mocap.z_m[0], 0, 0.02);
  rules.policy = [](const std::vector<double>&) { return std::array<double, 4>{-5, 3, 0, 0}; };
  rules.hand_back_at_s = 0.3;
  rules.capture = {0.001, 0.01, 15, 0.7, 0.8};
  EXPECT_FALSE(escape_of(plain(), 0, rules, 0.5).success);
}

TEST(FamilyC, ConventionsChangeDeclarationsWithinTheirBounds) {
  double latencies = 0, places = 0;
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    Assignment a = plain();
    a.seed = seed;
    const Robot robot(a, 0);
    const SensorParameters exact = sensor_parameters(a, robot);
    a.conventions = true;
    const SensorParameters loose = sensor_parameters(a, robot);
    const flightlog::FlightHeader &e = exact.declared, &l = loose.declared;
    EXPECT_EQ(e.imu.latency_s, exact.imu.latency_s);
    EXPECT_EQ(e.imu.position_m[1], exact.imu.position_m.y());
    EXPECT_EQ(e.mocap.latency_s, exact.mocap.latency_s);
    EXPECT_EQ(exact.fast_imu + exact.fast_mocap, 0);
    EXPECT_EQ(exact.imu.sampling, Sampling::kInstant);
    EXPECT_EQ(loose.imu.latency_s, exact.imu.latency_s);
    EXPECT_EQ(loose.imu.gyro_noise, exact.imu.gyro_noise);
    const double half_s = loose.imu.sampling == Sampling::kInstant ? 0 : 0.5 / e.imu.rate_hz;
    EXPECT_LE(std::abs(l.imu.latency_s - (exact.imu.latency_s + half_s)), 0.5e-3 + 1e-12);
    EXPECT_LE(std::abs(l.mocap.latency_s - e.mocap.latency_s), 0.5e-3);
    EXPECT_LE((Eigen::Vector3d(l.imu.position_m.data()) - exact.imu.position_m).norm(), 2e-3 + 1e-12);
    EXPECT_LE(Eigen::AngleAxisd(Eigen::Matrix3d(exact.imu.gyro_axes.inverse() * loose.imu.gyro_axes)).angle(),
              M_PI / 180 + 1e-9);
    EXPECT_NEAR(l.imu.rate_hz / e.imu.rate_hz, 1, 0.01);
    EXPECT_NEAR(l.mocap.rate_hz / e.mocap.rate_hz, 1, 0.02);
    for (const double ratio :
         {l.imu.gyro_noise_rad_s / e.imu.gyro_noise_rad_s, l.mocap.position_noise_m / e.mocap.position_noise_m}) {
      EXPECT_GE(ratio, 0.7);
      EXPECT_LE(ratio, 1.5);
    }
    EXPECT_LE(loose.fast_imu + loose.fast_mocap, 50e-6);
    EXPECT_EQ(l.ambient, e.ambient);
    latencies += l.mocap.latency_s != e.mocap.latency_s;
    places += l.imu.position_m != e.imu.position_m;
  }
  EXPECT_EQ(latencies, 12);
  EXPECT_EQ(places, 12);
  Assignment a = plain();
  const flightlog::FlightLog exact = short_log(a);
  a.conventions = true;
  EXPECT_EQ(short_log(a).command, exact.command);
}

TEST(FamilyC, DeclaredNoiseIsThatOfTheSamples) {
  // a robot at rest: what varies from pose to pose is noise
  Assignment a = plain();
  const Robot robot(a, 0);
  const SensorParameters parameters = sensor_parameters(a, robot);
  Sensors sensors(a, 0, robot, parameters);
  for (int i = 0; i < 120000; ++i) sensors.after_step(robot, robot.step_s() * i);
  flightlog::FlightLog log;
  sensors.finish(log, 1e9);
  double position = 0, attitude = 0;
  for (std::size_t i = 0; i < log.mocap.t_s.size(); ++i) {
    position +=
        log.mocap.x_m[i] * log.mocap.x_m[i] + log.mocap.y_m[i] * log.mocap.y_m[i] + log.mocap.z_m[i] * log.mocap.z_m[i];
    attitude +=
        4 * (log.mocap.qx[i] * log.mocap.qx[i] + log.mocap.qy[i] * log.mocap.qy[i] + log.mocap.qz[i] * log.mocap.qz[i]);
  }
  const double count = 3 * static_cast<double>(log.mocap.t_s.size());
  EXPECT_NEAR(std::sqrt(position / count) / parameters.declared.mocap.position_noise_m, 1, 0.1);
  EXPECT_NEAR(std::sqrt(attitude / count) / parameters.declared.mocap.attitude_noise_rad, 1, 0.1);
}

TEST(FamilyC, FiguresAreDrawnApartAndPhysical) {
  Eigen::Vector3d spread = Eigen::Vector3d::Zero();
  constexpr int count = 200;
  for (std::uint64_t seed = 0; seed < count; ++seed) {
    const RobotParameters drawn = drawn_parameters(nominal(), seed);
    for (const Side& side : drawn.sides) {
      EXPECT_TRUE(is_physical(side.wing.inertia_kg_m2) && is_physical(side.leading_edge.inertia_kg_m2));
      EXPECT_GT(side.rotation.upper_rad, 0.6);
    }
    EXPECT_NE(drawn.sides[0].motor.resistance_ohm, drawn.sides[1].motor.resistance_ohm);
    spread += Eigen::Vector3d(drawn.torso.mass_kg / nominal().torso.mass_kg - 1,
                              drawn.sides[0].motor.resistance_ohm / 12.4 - 1,
                              drawn.torso.com_m.x() - nominal().torso.com_m.x())
                  .cwiseAbs2();
  }
  spread = (spread / count).cwiseSqrt();
  EXPECT_NEAR(spread[0], 0.03, 0.005);
  EXPECT_NEAR(spread[1], 0.07, 0.01);
  EXPECT_NEAR(spread[2], 0.3e-3, 0.05e-3);
}

/// A robot whose every random stream acts.
Assignment busy(std::size_t session) {
  Assignment a = plain();
  a.effects = {{"wind", 1}, {"gyro_bias", 1}, {"outside_driver_jitter", 1}};
  a.own_parameters = a.conventions = true;
  a.session = session;
  return a;
}

/// Sum of voltages, positions, IMU, power and wings.
std::array<double, 5> sums(const flightlog::FlightLog& log) {
  const auto sum = [](std::initializer_list<const flightlog::Column*> columns) {
    double all = 0;
    for (const flightlog::Column* column : columns) all = std::accumulate(column->begin(), column->end(), all);
    return all;
  };
  const flightlog::ImuStream& i = log.imu;
  return {sum({&log.command.left_voltage_V, &log.command.right_voltage_V}),
          sum({&log.mocap.x_m, &log.mocap.y_m, &log.mocap.z_m}),
          sum({&i.gyro_x_rad_s, &i.gyro_y_rad_s, &i.gyro_z_rad_s, &i.accel_x_m_s2, &i.accel_y_m_s2, &i.accel_z_m_s2}),
          sum({&log.power->battery_V, &log.power->left_current_A, &log.power->right_current_A}),
          sum({&log.wings->left_stroke_rad, &log.wings->right_rotation_rad})};
}

TEST(FamilyC, SessionZeroFliesAsRecorded) {
  // The robot's flights are data of benchmarks. Last bits differ between processors, and may change a few of a converter's digits.
  const std::array<std::array<double, 5>, 3> before = {{{20.3207691, 13.5350394, 478.88548, 1849.99982, 9.33609989},
                                                        {1.17638089, 11.5872780, 535.827841, 1849.35728, 9.72943676},
                                                        {-7.34173911, 9.67152714, 529.782425, 1849.4885, 8.92014535}}};
  const std::array<double, 5> near = {1e-5, 1e-6, 0.02, 2e-3, 1e-6};
  for (std::size_t flight = 0; flight < 3; ++flight) {
    const std::array<double, 5> now = sums(short_log(busy(0), flight));
    for (std::size_t i = 0; i < 5; ++i) EXPECT_NEAR(now[i], before[flight][i], near[i]) << flight << " " << i;
  }
  // the robot to the last bit
  const Robot robot(busy(0), 0);
  const RobotParameters drawn = drawn_parameters(nominal(), busy(0).seed);
  EXPECT_EQ(mjcf_text(robot.parameters(), {}, 1e-4), mjcf_text(drawn, {}, 1e-4));
  EXPECT_EQ(session_change(busy(0)).air, 1);
  EXPECT_EQ(stream_of(busy(0), 2), 2U);
  EXPECT_NE(stream_of(busy(1), 2), 2U);
}

TEST(FamilyC, SessionsDifferInAllRowsButDeclareTheSame) {
  for (std::size_t flight = 0; flight < 3; ++flight) {
    const flightlog::FlightLog first = short_log(busy(0), flight), second = short_log(busy(1), flight);
    EXPECT_EQ(second, short_log(busy(1), flight));
    EXPECT_EQ(second.header, first.header);
    const auto zeroth = sums(first), one = sums(second), two = sums(short_log(busy(2), flight));
    for (std::size_t i = 0; i < 5; ++i)
      EXPECT_TRUE(zeroth[i] != one[i] && one[i] != two[i] && two[i] != zeroth[i]) << i;
  }
}

TEST(FamilyC, FlightsOfEverySessionKeepTheirKind) {
  for (std::size_t session = 0; session < 6; ++session) {
    Assignment a = plain();
    a.session = session;
    std::array<double, 3> clearance = {1, 1, 1};
    for (std::size_t flight = 0; flight < 3; ++flight) {
      const Programme programme(a, flight, nominal());
      EXPECT_EQ(programme.start_W() == Programme(plain(), flight, nominal()).start_W(), session == 0);
      for (double t = 0; t < 10; t += 0.01) {
        const Eigen::Vector3d at = programme.target(t).position_W;
        clearance[flight] = std::min(clearance[flight], std::array{at.z(), 2 - at.z(), 1 - at.y()}[flight]);
      }
    }
    for (const double closest : clearance) EXPECT_LT(closest, 0.22) << session;
  }
}

TEST(FamilyC, SessionChangesAreBoundedAndAsWideAsStated) {
  struct Spread {
    double bound, sd, rms = 0, largest = 0, smallest = 1;
  };
  // in the order of `values`
  std::vector<Spread> spreads = {
      {0.0191, 0.0080},  {0.007, 0.0040},    {0.0256, 0.0094}, {0.12, 0.04},    {0.15, 0.044},      {0.0062, 0.0035},
      {3e-5, 1.73e-5},   {4.6e-4, 2.66e-4},  {3.1e-4, 1.8e-4}, {3e-4, 1.73e-4}, {0.00227, 0.00176}, {4.2e-3, 3.25e-3},
      {2.5e-4, 1.94e-4}, {0.00175, 0.00135}, {1e-4, 0.58e-4},  {3e-4, 1.73e-4}, {0.035, 0.0202}};
  constexpr int count = 200;
  for (std::uint64_t seed = 0; seed < count; ++seed) {
    Assignment a = plain();
    a.seed = seed;
    a.session = 1 + seed % 3;
    const SessionChange day = session_change(a);
    const std::vector<double> values = {day.air - 1,
                                        day.supply - 1,
                                        day.winding[seed % 2] - 1,
                                        day.friction[seed % 2] - 1,
                                        day.damping[seed % 2] - 1,
                                        day.rest_rad[seed % 2],
                                        day.tape_kg,
                                        day.battery_m.x(),
                                        day.battery_m.y(),
                                        day.battery_m.z(),
                                        day.imu_turn_rad.norm(),
                                        day.gyro_bias_rad_s.norm(),
                                        day.markers_m.norm(),
                                        day.markers_turn_rad.norm(),
                                        day.imu_late_s,
                                        day.mocap_late_s,
                                        day.gains[seed % kPilotGains] - 1};
    ASSERT_EQ(values.size(), spreads.size());
    for (std::size_t i = 0; i < values.size(); ++i) {
      spreads[i].rms += values[i] * values[i] / count;
      spreads[i].largest = std::max(spreads[i].largest, std::abs(values[i]));
      spreads[i].smallest = std::min(spreads[i].smallest, std::abs(values[i]));
    }
    EXPECT_NE(day.winding[0], day.winding[1]);
    EXPECT_NE(day.rest_rad[0], day.rest_rad[1]);
  }
  for (std::size_t i = 0; i < spreads.size(); ++i) {
    EXPECT_LE(spreads[i].largest, spreads[i].bound) << i;
    EXPECT_GT(spreads[i].smallest, 0) << i;
    EXPECT_NEAR(std::sqrt(spreads[i].rms) / spreads[i].sd, 1, 0.15) << i;
  }
}

TEST(FamilyC, SessionsChangeTheRobotAndItsSensorsAsDrawn) {
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    Assignment a = plain(), b = plain();
    a.own_parameters = a.conventions = b.own_parameters = b.conventions = true;
    a.seed = b.seed = seed;
    b.session = 2;
    const SessionChange day = session_change(b);
    const Robot first(a, 0), second(b, 0);
    const RobotParameters &f = first.parameters(), &g = second.parameters();
    EXPECT_NEAR(second.mechanism().model().opt.density, f.density_kg_m3 * day.air, 1e-12);
    EXPECT_NEAR(second.drive().battery_V(), Drive::kBattery_V * day.supply, 1e-12);
    for (std::size_t side = 0; side < 2; ++side) {
      const Side &s = f.sides[side], &t = g.sides[side];
      EXPECT_NEAR(t.motor.resistance_ohm / s.motor.resistance_ohm, day.winding[side], 1e-12);
      EXPECT_NEAR(t.motor.friction_Nm / s.motor.friction_Nm, day.friction[side], 1e-12);
      EXPECT_NEAR(t.stroke.friction_Nm / s.stroke.friction_Nm, day.friction[side], 1e-12);
      EXPECT_NEAR(t.motor.damping_Nm_s / s.motor.damping_Nm_s, day.damping[side], 1e-12);
      EXPECT_NEAR(t.stroke.damping_Nm_s / s.stroke.damping_Nm_s, day.damping[side], 1e-12);
      EXPECT_NEAR(t.spring.rest_rad - s.spring.rest_rad, day.rest_rad[side], 1e-12);
    }
    // 0.3 of the torso moves with the battery; effects of magnitude 0.2 are larger
    EXPECT_NEAR(g.torso.mass_kg - f.torso.mass_kg, day.tape_kg, 1e-12);
    const Eigen::Vector3d moved = g.torso.com_m - f.torso.com_m;
    EXPECT_LT((moved - 0.3 * day.battery_m).norm(), 0.05e-3);
    EXPECT_LT(moved.head<2>().norm() * f.torso.mass_kg / f.mass_kg(), 0.2e-3);
    const Eigen::Matrix3d inertia = g.torso.inertia_kg_m2 - f.torso.inertia_kg_m2;
    EXPECT_GT(std::abs(inertia(0, 2)), 0);
    EXPECT_LT(std::max(std::abs(inertia(0, 1)), std::abs(inertia(0, 2))), 0.01 * f.torso.inertia_kg_m2(0, 0));
    EXPECT_TRUE(is_physical(g.torso.inertia_kg_m2));

    const SensorParameters s = sensor_parameters(a, first), t = sensor_parameters(b, second);
    EXPECT_EQ(t.declared, s.declared);
    EXPECT_EQ(t.mocap.model_m, s.mocap.markers_m);
    for (std::size_t i = 0; i < 4; ++i)
      EXPECT_LT((t.mocap.markers_m[i] - s.mocap.markers_m[i] - day.markers_m -
                 day.markers_turn_rad.cross(s.mocap.markers_m[i]))
                    .norm(),
                1e-7);
    const auto turn = [](const Eigen::Matrix3d& from, const Eigen::Matrix3d& to) {
      const Eigen::AngleAxisd by(Eigen::Matrix3d(from.inverse() * to));
      return Eigen::Vector3d(by.angle() * by.axis());
    };
    EXPECT_LT((turn(s.imu.gyro_axes, t.imu.gyro_axes) - day.imu_turn_rad).norm(), 1e-9);
    EXPECT_LT((turn(s.imu.accel_axes, t.imu.accel_axes) - day.imu_turn_rad).norm(), 1e-9);
    EXPECT_LT((t.imu.gyro_bias - s.imu.gyro_bias - day.gyro_bias_rad_s).norm(), 1e-12);
    EXPECT_NEAR(t.imu.latency_s - s.imu.latency_s, day.imu_late_s, 1e-12);
    EXPECT_NEAR(t.mocap.latency_s - s.mocap.latency_s, day.mocap_late_s, 1e-12);

    // an effect keeps its direction
    a.effects = b.effects = {{"com_offset", 1}};
    const Eigen::Vector3d off = Robot(a, 0).parameters().torso.com_m - f.torso.com_m,
                          still = Robot(b, 0).parameters().torso.com_m - g.torso.com_m;
    EXPECT_LT((off - still).norm(), 0.01 * off.norm());
  }
}

TEST(FamilyC, SessionsHaveNoiseOfTheirOwnAndGluedMarkersShiftThePose) {
  // one robot at rest, with the same sensors in both sessions
  const Robot robot(with("gyro_bias", 1), 0);
  SensorParameters parameters = sensor_parameters(plain(), robot);
  const auto log = [&](std::size_t session) {
    Assignment a = plain();
    a.session = session;
    Sensors sensors(a, 0, robot, parameters);
    for (int i = 0; i < 1000; ++i) sensors.after_step(robot, robot.step_s() * i);
    flightlog::FlightLog seen;
    sensors.finish(seen, 1);
    return seen;
  };
  const flightlog::FlightLog first = log(0), second = log(1);
  EXPECT_EQ(log(1), second);
  EXPECT_NE(second.imu.accel_x_m_s2, first.imu.accel_x_m_s2);
  EXPECT_NE(second.mocap.x_m, first.mocap.x_m);
  EXPECT_NE(second.power->battery_V, first.power->battery_V);
  EXPECT_NE(second.wings->left_stroke_rad, first.wings->left_stroke_rad);
  parameters.imu.gyro_noise = parameters.mocap.marker_noise_m = 0;
  EXPECT_NE(log(1).imu.gyro_x_rad_s, log(0).imu.gyro_x_rad_s) << "the walk of the gyro's bias";
  EXPECT_NEAR(log(1).mocap.x_m[0], 0, 1e-9);
  for (Eigen::Vector3d& marker : parameters.mocap.markers_m) marker.x() += 1e-3;
  EXPECT_NEAR(log(1).mocap.x_m[0], 1e-3, 1e-9);
}

TEST(FamilyC, CalmFlightsAreSlowSmoothAndSafe) {
  Assignment a = plain();
  a.calm = true;
  Assignment hover = plain();
  hover.hover = true;
  EXPECT_EQ(short_log(a, 0), short_log(hover, 0));
  for (a.seed = 0; a.seed < 60; ++a.seed)
    for (std::size_t flight = 1; flight < 3; ++flight) {
      const Programme programme(a, flight, nominal());
      double way_m = 0, turned_rad = 0;
      Target last = programme.target(0);
      for (int i = 1; i <= 2000; ++i) {
        const double t = 0.005 * i;
        const Target now = programme.target(t);
        EXPECT_LE(now.velocity_W.norm(), 0.2 + 1e-9);
        EXPECT_LT((now.position_W - last.position_W).norm(), 0.0011);
        EXPECT_LT((now.velocity_W - last.velocity_W).norm(), 0.005 * 0.3);
        EXPECT_LE(std::abs(now.heading_rad - last.heading_rad), 0.005 * 0.3 + 1e-9);
        EXPECT_TRUE(std::abs(now.position_W.x()) <= 0.6 && std::abs(now.position_W.y() + 0.05) <= 0.45 &&
                    std::abs(now.position_W.z() - 1) <= 0.5);
        const Inputs more = programme.excitation(t);
        EXPECT_EQ(std::abs(more.amplitude_V) + std::abs(more.difference_V) + std::abs(more.bias_V) +
                      std::abs(more.split_cycle),
                  0);
        way_m += (now.position_W - last.position_W).norm();
        turned_rad += std::abs(now.heading_rad - last.heading_rad);
        last = now;
      }
      EXPECT_GT(way_m, 0.3);
      EXPECT_GT(turned_rad, 0);
    }
  a.own_parameters = true;
  io::parallel_for(4, 2, [&](std::size_t i) {
    Assignment one = a;
    one.seed = i;
    one.session = i % 2;
    const Flown flown = fly_one(one, 1 + i / 2, true, {0.7, 2.3});
    EXPECT_FALSE(flown.flight.crashed) << flown.flight.how;
    const std::size_t beat = 588, start = 14000;  // steps; t = 0
    for (std::size_t step = start; step + beat < flown.path.size(); step += beat)
      EXPECT_LT((flown.path[step + beat].position_W - flown.path[step].position_W).norm() * 34, 0.25);
  });
}

TEST(FamilyC, SameBytesOnAnyNumberOfThreads) {
  const auto flown = [](int threads) {
    std::vector<flightlog::FlightLog> logs(4);
    io::parallel_for(logs.size(), threads, [&](std::size_t i) {
      Assignment a = with(i % 2 == 0 ? "wind" : "gear_backlash", 1);
      a.own_parameters = a.conventions = true;
      a.seed = i / 2;
      logs[i] = short_log(a, i % 3);
    });
    return logs;
  };
  const auto one = flown(1);
  EXPECT_EQ(one, flown(2));
  EXPECT_NE(one[0].mocap.x_m, one[2].mocap.x_m);
}

/// What the wings of a clamped robot have, about the torso's origin, in B.
struct Borne {
  Eigen::Matrix<double, 6, 1> momentum = Eigen::Matrix<double, 6, 1>::Zero();
  Eigen::Matrix<double, 6, 1> weight = Eigen::Matrix<double, 6, 1>::Zero();  ///< with the torso's
  double potential_J = 0;
};

Borne borne(const Mechanism& mechanism) {
  Borne sum;
  const mjModel& m = mechanism.model();
  const mjData& d = mechanism.data();
  const Eigen::Vector3d origin(d.qpos), down(0, 0, -Mechanism::kGravity_m_s2);
  for (int body = 1; body < m.nbody; ++body) {
    mjtNum v[6];
    mj_objectVelocity(&m, const_cast<mjData*>(&d), mjOBJ_BODY, body, v, 0);
    const double mass = m.body_mass[body];
    const Eigen::Vector3d at = Eigen::Vector3d(d.xipos + 3 * body) - origin, p = mass * Eigen::Vector3d(v + 3);
    const Eigen::Matrix3d R = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(d.ximat + 9 * body);
    const Eigen::Vector3d spin =
        R * Eigen::Vector3d(m.body_inertia + 3 * body).asDiagonal() * R.transpose() * Eigen::Vector3d(v);
    sum.momentum.head<3>() += p;
    sum.momentum.tail<3>() += at.cross(p) + spin;
    sum.weight.head<3>() += mass * down;
    sum.weight.tail<3>() += at.cross(mass * down);
    sum.potential_J += mass * Mechanism::kGravity_m_s2 * at.z();
  }
  return sum;
}

TEST(FamilyC, ClampedRobotPressesOnItsStandByAirWeightAndMomentum) {
  using Six = Eigen::Matrix<double, 6, 1>;
  struct Errors {
    double impulse = 0, mean = 0;
  };
  const auto errors = [](double step_s) {
    Bench bench(drawn_parameters(nominal(), 4), step_s);
    bench.mechanism.clamp();
    const double beat_s = 1 / nominal().flapping_Hz;
    Six first = Six::Zero(), owed = Six::Zero(), swing = Six::Zero(), off = Six::Zero(), mean = Six::Zero();
    long beat = -1;
    double count = 0;
    bench.run({10, 0.5, 0.7, 0.05}, 20 * beat_s, false, [&](double now_s) {
      const mjData& d = bench.mechanism.data();
      const Borne now = borne(bench.mechanism);  // at the start of this step, as its forces are
      if (static_cast<long>(now_s / beat_s) != beat) {
        beat = static_cast<long>(now_s / beat_s);
        first = now.momentum;
        owed.setZero();
      }
      const Six change = now.momentum - first;
      swing = swing.cwiseMax(change.cwiseAbs());
      off = off.cwiseMax((owed - change).cwiseAbs());
      Six pressed;
      pressed << bench.mechanism.support().force_W, bench.mechanism.support().torque_W;
      const Six acts = Eigen::Map<const Six>(d.qfrc_passive) + now.weight;
      owed += step_s * (acts - pressed);
      if (beat < 10) return;
      mean += pressed - acts;
      ++count;
    });
    EXPECT_EQ(Eigen::Vector3d(bench.mechanism.data().qpos).norm(), 0) << "it gave way";
    Errors of;
    of.impulse = std::max(off.head<3>().maxCoeff() / swing.head<3>().maxCoeff(),
                          off.tail<3>().maxCoeff() / swing.tail<3>().maxCoeff());
    of.mean = mean.head<3>().norm() / count / (nominal().mass_kg() * Mechanism::kGravity_m_s2);
    return of;
  };
  // over a beat and, for the mean, over ten; the integrator is of first order in the step
  const Errors coarse = errors(Mechanism::kStep_s), fine = errors(Mechanism::kStep_s / 4);
  EXPECT_LT(coarse.impulse, 0.05);
  EXPECT_LT(fine.impulse, 0.4 * coarse.impulse);
  EXPECT_LT(coarse.mean, 0.01);
}

TEST(FamilyC, ClampedRobotDoesNoWorkOnItsStand) {
  const auto lost = [](double step_s) {
    Bench bench(nominal(), step_s);
    bench.mechanism.clamp();
    const int nv = static_cast<int>(bench.mechanism.model().nv);
    Eigen::VectorXd before = Eigen::VectorXd::Zero(nv), carried(nv);
    double work = 0, turned_over = 0, least = 0, most = 0, rest_J = 0;
    bool begun = false;
    bench.run({10, 0, 0, 0}, 10 / nominal().flapping_Hz, false, [&](double) {
      const mjData& d = bench.mechanism.data();
      mj_mulM(&bench.mechanism.model(), const_cast<mjData*>(&d), carried.data(), before.data());
      const double potential_J = borne(bench.mechanism).potential_J;
      if (!begun) rest_J = potential_J;
      begun = true;
      const double balance = 0.5 * before.dot(carried) + potential_J - rest_J - work;
      least = std::min(least, balance);
      most = std::max(most, balance);
      Eigen::VectorXd after = Eigen::Map<const Eigen::VectorXd>(d.qvel, nv);
      after.head<6>().setZero();
      const Eigen::VectorXd force = Eigen::Map<const Eigen::VectorXd>(d.qfrc_applied, nv) +
                                    Eigen::Map<const Eigen::VectorXd>(d.qfrc_passive, nv) +
                                    Eigen::Map<const Eigen::VectorXd>(d.qfrc_constraint, nv);
      const double done = step_s * 0.5 * force.tail(nv - 6).dot((before + after).tail(nv - 6));
      work += done;
      turned_over += std::abs(done);
      before = after;
    });
    EXPECT_GT(turned_over, 1e-3);  // J
    return (most - least) / turned_over;
  };
  const double coarse = lost(Mechanism::kStep_s), fine = lost(Mechanism::kStep_s / 4);
  EXPECT_LT(coarse, 0.05);
  EXPECT_LT(fine, 0.5 * coarse);
}

/// A rig that only its spring and its cross-talk move.
RigParameters silent(RigParameters f) {
  f.force_noise_N = f.moment_noise_Nm = f.drift_N_s = f.walk_N_root_s = 0;
  f.force_digit_N = f.moment_digit_Nm = 1e-12;
  return f;
}

std::array<const flightlog::Column*, 6> columns_of(const flightlog::ForcesStream& forces) {
  return {&forces.force_x_N,   &forces.force_y_N,   &forces.force_z_N,
          &forces.moment_x_Nm, &forces.moment_y_Nm, &forces.moment_z_Nm};
}

/// Half a second of `rest`, in which the sensor is zeroed, then `acts`.
flightlog::ForcesStream loaded(const Robot& robot, const RigParameters& f, const Wrench& rest, const Wrench& acts,
                               double until_s) {
  Rig rig(plain(), 0, robot, f);
  const long before = std::lround(0.5 / robot.step_s()), after = std::lround(until_s / robot.step_s());
  for (long i = 1 - before; i <= after; ++i) rig.load(i <= 0 ? rest : acts, static_cast<double>(i) * robot.step_s());
  flightlog::FlightLog log;
  rig.finish(log, 1e9);
  return *log.forces;
}

TEST(FamilyC, SensorReadsNothingAtRestAndDrifts) {
  const Robot robot(plain(), 0);
  const RigParameters f = rig_parameters(plain(), robot);
  Wrench weight;
  weight.force_W.z() = -0.12;
  weight.torque_W.x() = 1e-4;
  const flightlog::ForcesStream quiet = loaded(robot, silent(f), weight, weight, 0.5);
  for (const flightlog::Column* column : columns_of(quiet))
    for (const double value : *column) EXPECT_NEAR(value, 0, 3e-12);
  // noise of the mean of a second and of that of the zero, 6 sd, and a second's drift
  const flightlog::ForcesStream real = loaded(robot, f, weight, weight, 1);
  const double samples = 0.5 * f.declared.rate_hz;
  for (std::size_t i = 0; i < 6; ++i) {
    const flightlog::Column& column = *columns_of(real)[i];
    const double mean = std::accumulate(column.begin(), column.end(), 0.0) / static_cast<double>(column.size());
    const double noise = i < 3 ? f.declared.force_noise_N : f.declared.moment_noise_Nm;
    double square = 0;
    for (const double value : column) square += (value - mean) * (value - mean);
    EXPECT_LT(std::abs(mean), 6 * noise * std::sqrt(1.5 / samples) + (i < 3 ? 5e-3 : 5e-5) / 60) << i;
    EXPECT_NEAR(std::sqrt(square / static_cast<double>(column.size())) / noise, 1, 0.1) << i;
  }
  RigParameters drifting = silent(f);
  drifting.drift_N_s = f.drift_N_s;
  const double after = std::abs(loaded(robot, drifting, weight, weight, 2).force_x_N.back()) / 2;  // N/s
  EXPECT_GE(after * 60, 0.5e-3);
  EXPECT_LE(after * 60, 6e-3);
}

TEST(FamilyC, SensorSwingsAtTheResonanceThatIsDrawn) {
  const Robot robot(plain(), 0);
  for (std::uint64_t seed = 0; seed < 8; ++seed) {
    Assignment a = plain();
    a.seed = seed;
    RigParameters f = silent(rig_parameters(a, robot));
    EXPECT_GE(f.declared.resonance_hz, 250);
    EXPECT_LE(f.declared.resonance_hz, 700);
    EXPECT_EQ(f.declared.resonance_hz, *std::ranges::min_element(f.natural_hz));
    f.crosstalk.setIdentity();
    f.position_m.setZero();
    f.steps = 1;
    Wrench acts;
    acts.force_W.setConstant(0.1);
    acts.torque_W.setConstant(1e-3);
    const flightlog::ForcesStream swings = loaded(robot, f, {}, acts, 0.1);
    for (std::size_t i = 0; i < 6; ++i) {
      const flightlog::Column& column = *columns_of(swings)[i];
      const double still = i < 3 ? 0.1 : 1e-3;
      const double highest = *std::ranges::max_element(column) / still - 1;
      EXPECT_NEAR(std::log(1 / highest), M_PI * f.damping[i] / std::sqrt(1 - f.damping[i] * f.damping[i]), 0.03)
          << "the overshoot of a step";
      std::vector<double> crossings;
      for (std::size_t k = 1; k < column.size(); ++k)
        if (column[k - 1] < still && column[k] >= still)
          crossings.push_back(static_cast<double>(k) - (column[k] - still) / (column[k] - column[k - 1]));
      ASSERT_GT(crossings.size(), 10U);
      const double hz =
          static_cast<double>(crossings.size() - 1) / (crossings.back() - crossings.front()) / robot.step_s();
      EXPECT_NEAR(hz / f.natural_hz[i], 1, 5e-3) << i;
    }
  }
}

TEST(FamilyC, SensorStandsWhereItIsAndItsAxesTalkToEachOther) {
  const Robot robot(plain(), 0);
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    Assignment a = plain();
    a.seed = seed;
    a.conventions = true;
    RigParameters f = silent(rig_parameters(a, robot));
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j) {
        const auto range = [&](int k) { return k < 3 ? f.force_range_N : f.moment_range_Nm; };
        const double share = std::abs(f.crosstalk(i, j)) * range(j) / range(i);
        EXPECT_GE(share, i == j ? 1 : 1e-3);
        EXPECT_LE(share, i == j ? 1 : 1e-2);
      }
    f.damping.fill(0.9);  // it comes to rest at once
    Wrench acts;
    acts.force_W = {0.01, -0.03, 0.1};
    acts.torque_W = {2e-4, 1e-3, -5e-4};
    const flightlog::ForcesStream forces = loaded(robot, f, {}, acts, 0.2);
    Eigen::Matrix<double, 6, 1> read, truly;
    for (std::size_t i = 0; i < 6; ++i) read[static_cast<int>(i)] = columns_of(forces)[i]->back();
    truly = f.crosstalk.inverse() * read;
    const Eigen::Vector3d force = f.R_BS * truly.head<3>();
    const Eigen::Vector3d moment = f.R_BS * truly.tail<3>() + f.position_m.cross(force);
    EXPECT_LT((force - acts.force_W).norm(), 1e-9);
    EXPECT_LT((moment - acts.torque_W).norm(), 1e-10);
    EXPECT_GT((read - truly).head<3>().norm(), 1e-5);
    // as declared, the axes are off by their tilt and the cross-talk
    const auto& q = f.declared.attitude;
    const Eigen::Vector3d declared =
        Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix() * Eigen::Vector3d(read.head<3>());
    EXPECT_LT((declared - acts.force_W).norm(), 0.1 * acts.force_W.norm());
  }
}

TEST(FamilyC, BenchIsDeclaredExactlyOrWithinHabits) {
  std::array<int, 3> kinds{};
  for (std::uint64_t seed = 0; seed < 24; ++seed) {
    Assignment a = plain();
    a.seed = seed;
    const Robot robot(a, 0);
    const RigParameters e = rig_parameters(a, robot);
    EXPECT_EQ(e.declared.latency_s, e.latency_s);
    EXPECT_EQ(Eigen::Vector3d(e.declared.position_m.data()), e.position_m);
    EXPECT_EQ(e.declared.attitude, (std::array<double, 4>{1, 0, 0, 0}));
    EXPECT_EQ(e.R_BS, Eigen::Matrix3d::Identity());
    EXPECT_NEAR(e.declared.rate_hz * static_cast<double>(e.steps) * robot.step_s(), 1, 1e-12);
    EXPECT_EQ(e.declared_film.noise_rad, 0.5 * kDegree);
    EXPECT_EQ(std::abs(e.fast_sensor) + std::abs(e.fast_film) + std::abs(e.film.late_s), 0);
    EXPECT_FALSE(e.mean);
    a.conventions = true;
    const RigParameters l = rig_parameters(a, robot);
    EXPECT_EQ(l.natural_hz, e.natural_hz);
    EXPECT_EQ(l.position_m, e.position_m);
    const double half_s = l.mean ? 0.5 / e.declared.rate_hz : 0;
    EXPECT_LE(std::abs(l.declared.latency_s - l.latency_s - half_s), 0.5e-3 + 1e-12);
    EXPECT_GE(l.declared.latency_s, 0);
    const double off_m = (Eigen::Vector3d(l.declared.position_m.data()) - l.position_m).norm();
    EXPECT_GT(off_m, 0.09e-3);
    EXPECT_LE(off_m, 0.5e-3 + 1e-12);
    const auto& q = l.declared.attitude;
    const Eigen::Matrix3d said = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix();
    EXPECT_LT((said.cwiseAbs2() - said.cwiseAbs()).norm(), 1e-12) << "right angles";
    const double tilt = Eigen::AngleAxisd(Eigen::Matrix3d(l.R_BS * said.transpose())).angle();
    EXPECT_GT(tilt, 0.04 * kDegree);
    EXPECT_LE(tilt, 0.3 * kDegree + 1e-9);
    EXPECT_LE(std::abs(l.film.late_s), 0.5e-3);
    EXPECT_LE(l.fast_sensor + l.fast_film, 50e-6);
    for (const double ratio :
         {l.declared.force_noise_N / e.declared.force_noise_N, l.declared_film.noise_rad / e.declared_film.noise_rad}) {
      EXPECT_GE(ratio, 0.7);
      EXPECT_LE(ratio, 1.5);
    }
    kinds[0] += said(2, 2) < 0;
    kinds[1] += std::abs(said(0, 0)) < 0.5;
    kinds[2] += l.declared.resonance_hz == 0;
    a.session = 1;  // clamped again, declared as before
    const RigParameters s = rig_parameters(a, robot);
    EXPECT_EQ(s.declared, l.declared);
    EXPECT_GT((s.position_m - l.position_m).norm(), 0);
    EXPECT_LE((s.position_m - l.position_m).norm(), 0.1e-3 + 1e-12);
    const double clamped = Eigen::AngleAxisd(Eigen::Matrix3d(s.R_BS * l.R_BS.transpose())).angle();
    EXPECT_GT(clamped, 0);
    EXPECT_LE(clamped, 0.1 * kDegree + 1e-9);
  }
  for (const int kind : kinds) EXPECT_TRUE(kind > 2 && kind < 22) << kind;
}

TEST(FamilyC, FilmHidesAFifthOfItsFramesInStretches) {
  const Robot robot(plain(), 0);  // at rest: what varies is noise
  Rig rig(plain(), 0, robot, rig_parameters(plain(), robot));
  const long steps = std::lround(20 / robot.step_s());
  for (long i = 1; i <= steps; ++i) rig.after_step(robot, static_cast<double>(i) * robot.step_s(), true);
  flightlog::FlightLog log;
  rig.finish(log, 1e9);
  ASSERT_TRUE(log.wings && log.header.wings);
  EXPECT_NEAR(log.header.wings->rate_hz, 2000, 1e-9);
  const double frames = 20 * 2000, seen = static_cast<double>(log.wings->t_s.size());
  EXPECT_NEAR(seen / frames, 0.8, 0.02);
  double stretches = 0, square = 0;
  for (std::size_t i = 1; i < log.wings->t_s.size(); ++i)
    stretches += log.wings->t_s[i] - log.wings->t_s[i - 1] > 0.75e-3;
  EXPECT_NEAR((frames - seen) / stretches, 8, 1.5) << "frames of a stretch";
  for (const double angle : log.wings->right_rotation_rad) square += angle * angle;
  EXPECT_NEAR(std::sqrt(square / seen) / (0.5 * kDegree), 1, 0.03);
}

TEST(FamilyC, BenchRunsHold37PointsAndAreFilmedInTen) {
  std::size_t points = 0, filmed = 0, films = 0;
  for (std::size_t run = 0; run < 3; ++run) {
    const BenchProgramme programme(plain(), run, nominal());
    Assignment later = plain();
    later.session = 1;
    const BenchProgramme again(later, run, nominal());
    points += programme.points().size();
    EXPECT_NEAR(programme.lasts_s(), 27, 2);
    const auto of_this = std::ranges::count_if(programme.points(), [](const BenchPoint& p) { return p.filmed; });
    filmed += static_cast<std::size_t>(of_this);
    films += of_this > 0;
    EXPECT_EQ(programme.inputs(-1e-3).amplitude_V, 0);
    EXPECT_LT(programme.inputs(1).amplitude_V, programme.inputs(3).amplitude_V) << "up to hover";
    for (std::size_t i = 0; i < programme.points().size(); ++i) {
      const double begins_s = 2.0 * static_cast<double>(i);
      EXPECT_EQ(programme.inputs(begins_s + 0.5).bias_V, programme.inputs(begins_s + 1.999).bias_V);
      EXPECT_EQ(programme.filmed(begins_s + 1), programme.points()[i].filmed);
      const double once = programme.inputs(begins_s + 1).amplitude_V, then = again.inputs(begins_s + 1).amplitude_V;
      EXPECT_NE(once, then);
      EXPECT_NEAR(once / then, 1, 0.07);
    }
    for (double t = 0; t < programme.lasts_s(); t += 1e-3) {
      const Inputs now = programme.inputs(t);
      EXPECT_LE(now.amplitude_V, 0.8 * nominal().amplitude_limit_V);
      EXPECT_LE(std::abs(now.difference_V), 0.65 * nominal().difference_limit_V);
      EXPECT_LE(std::abs(now.bias_V), 0.65 * nominal().bias_limit_V);
      EXPECT_LE(std::abs(now.split_cycle), 0.65 * nominal().split_cycle_limit);
    }
  }
  EXPECT_EQ(points, 37U);
  EXPECT_EQ(filmed, 10U);
  EXPECT_EQ(films, 2U);
}

TEST(FamilyC, BenchKeepsWingsOffTheStopsOfTheirStroke) {
  const std::vector<Inputs> extremes = {{13.4, 0, 0, 0},   {12.4, 1.1, 0, 0}, {10.3, 1.55, 0, 0},
                                        {11.3, 0, 1.1, 0}, {10.3, 0, 1.6, 0}, {10.3, 0, 0, 0.093}};
  constexpr std::size_t robots = 8;
  std::array<double, robots * 6> widest{};  // over where the stop is
  io::parallel_for(widest.size(), 2, [&](std::size_t i) {
    Bench bench(drawn_parameters(nominal(), i % robots));
    bench.mechanism.clamp();
    bench.run(extremes[i / robots], 6 / nominal().flapping_Hz, false, [&](double) {
      for (std::size_t side = 0; side < 2; ++side) {
        const Hinge& stroke = bench.parameters.sides[side].stroke;
        const double angle = bench.mechanism.stroke(side);
        widest[i] = std::max(widest[i], angle / (angle > 0 ? stroke.upper_rad : stroke.lower_rad));
      }
    });
  });
  for (std::size_t i = 0; i < widest.size(); ++i) {
    EXPECT_LT(widest[i], 0.99) << "robot " << i % robots << ", inputs " << i / robots;
    EXPECT_GT(widest[i], 0.4) << "robot " << i % robots << ", inputs " << i / robots;
  }
}

TEST(FamilyC, BenchLogsOnlyWhatAClampedRobotHas) {
  Assignment a = plain();
  a.bench = a.own_parameters = true;
  const flightlog::FlightLog log = run_on_bench(a, 0, 0.8).log;
  EXPECT_EQ(flightlog::parse_flight_log(flightlog::flight_log_files(log), "log"), log);
  EXPECT_EQ(log.header.mocap, flightlog::MocapHeader{});
  EXPECT_EQ(log.header.imu, flightlog::ImuHeader{});
  EXPECT_TRUE(log.mocap.t_s.empty() && log.imu.t_s.empty() && !log.wings && log.power && log.forces);
  EXPECT_EQ(log.header.ambient.ground_z_m, -1);
  EXPECT_EQ(log.header.ambient.ceiling_z_m, 1);
  EXPECT_EQ(log.command.t_s.size(), 800U);
  double up = 0;
  for (const double force : log.forces->force_z_N) up += force / static_cast<double>(log.forces->t_s.size());
  EXPECT_GT(up, 0.01) << "it pulls the sensor up";
  const auto family = make_family_c();
  EXPECT_TRUE(family->has_bench());
  EXPECT_THROW(family->fly(a, 3), io::InputError);
}

TEST(FamilyC, BenchHasTheSameBytesOnAnyNumberOfThreads) {
  const auto run = [](int threads) {
    std::vector<flightlog::FlightLog> logs(3);
    io::parallel_for(logs.size(), threads, [&](std::size_t i) {
      Assignment a = with(i == 2 ? "gear_backlash" : "wind", 1);
      a.bench = a.own_parameters = a.conventions = true;
      a.seed = 3 + i / 2;
      a.session = i % 2;
      logs[i] = run_on_bench(a, 0, 4.2).log;
    });
    return logs;
  };
  const auto one = run(1);
  EXPECT_EQ(one, run(2));
  EXPECT_TRUE(one[0].wings && one[0].wings->t_s.size() > 200);
  EXPECT_NE(one[0].forces->force_z_N, one[1].forces->force_z_N) << "another session";
  EXPECT_EQ(one[0].header.rig, one[1].header.rig);
}

TEST(FamilyC, EveryEffectHasALawASourceAndNumbers) {
  const std::map<std::string, std::vector<double>> at = {{"ground_effect", {0.1}},
                                                         {"ceiling_effect", {0.1}},
                                                         {"wall_effect", {0.12}},
                                                         {"body_drag", {1, 0.5, -0.5}},
                                                         {"added_mass", {0.5, 200, 100, 1e4, 1e4}},
                                                         {"rotational_lift", {0.5, 200, 100}},
                                                         {"wake_capture", {0.003, 250}},
                                                         {"clap_and_fling", {0.3}},
                                                         {"wing_flexibility", {0.8, 1}},
                                                         {"wing_damage", {0.95}},
                                                         {"wind", {0.5, 1}},
                                                         {"spring_hardening", {1}},
                                                         {"gear_backlash", {0.02, 5}},
                                                         {"coulomb_friction", {100}},
                                                         {"winding_heating", {5, 1}},
                                                         {"battery_sag", {5, 0.3}},
                                                         {"driver_dead_zone", {5, 0.2}},
                                                         {"driver_bandwidth", {1e-3}},
                                                         {"command_delay", {3}},
                                                         {"stop_compliance", {0.1, 20}},
                                                         {"gyro_bias", {5}},
                                                         {"accelerometer_misalignment", {1, 2, 3}},
                                                         {"vibration_rectification", {20, 100}},
                                                         {"mocap_tilt", {0.2, 0.2, 1}},
                                                         {"marker_offset", {0.2, 0.1, 1}},
                                                         {"mocap_delay", {1}},
                                                         {"tether", {0.3, 0.2, 1}}};
  const auto family = make_family_c();
  for (const FamilyEffect& effect : family->effects()) {
    EXPECT_FALSE(effect.law.empty() || effect.source.empty()) << effect.id;
    EXPECT_TRUE(effect.numbers.size() >= 2 && effect.numbers.size() <= 5) << effect.id;
    for (const double number : effect.numbers) EXPECT_GT(number, 0) << effect.id;
    const auto arguments = at.find(effect.id);
    if (arguments == at.end()) {
      EXPECT_TRUE(family->law(effect.id, {}).empty()) << effect.id;
      continue;
    }
    const std::vector<double> once = family->law(effect.id, arguments->second);
    EXPECT_GT(std::ranges::count_if(once, [](double value) { return value != 0; }), 0) << effect.id;
    for (const double value : once) EXPECT_TRUE(std::isfinite(value)) << effect.id;
    EXPECT_EQ(family->law(effect.id, arguments->second), once) << effect.id;
  }
}

TEST(FamilyC, LawsOfTheRoomHaveTheirLimits) {
  const auto law = [](const char* id, double x) { return law_of(id, std::array{x}); };
  EXPECT_GT(law("ground_effect", 0.03)[0], 0.05);
  EXPECT_LT(law("ground_effect", 0.14)[0], -0.03);
  EXPECT_NEAR(law("ground_effect", 0.6)[0], 0, 1e-9);
  for (double c = 0.02; c < 0.3; c += 0.01) EXPECT_GT(law("ceiling_effect", c)[0], law("ceiling_effect", c + 0.01)[0]);
  for (double d = 0.09; d < 0.4; d += 0.01) {
    EXPECT_GT(law("wall_effect", d)[0], law("wall_effect", d + 0.01)[0]);
    EXPECT_GT(law("wall_effect", d)[1], law("wall_effect", d + 0.01)[1]);
  }
  EXPECT_LT(law("wall_effect", 0.4)[1], 2e-3);
  EXPECT_GT(laws::wake_share(laws::kWakeChords), 0.9 * laws::kWake);
  EXPECT_LT(laws::wake_share(4), 0) << "the wake's downwash";
  EXPECT_EQ(laws::wake_share(0), 0);
}

TEST(FamilyC, AirsEnergyAndMomentumCloseWithTheVirtualMass) {
  Build build;
  build.added_mass = 1.7;
  const RobotParameters f = drawn_parameters(nominal(), 3);
  Mechanism mechanism(f, build);
  mjModel& m = mechanism.model();
  mjData& d = const_cast<mjData&>(mechanism.data());
  struct Ellipsoid {
    int geom;
    double mass_kg, growth_m_s;
  };
  std::vector<Ellipsoid> ellipsoids;
  const auto only = [&](std::size_t side, std::size_t strip) {
    for (std::size_t i = 0; i < 2; ++i)
      for (std::size_t j = 0; j < Mechanism::kStrips; ++j)
        mechanism.scale_air(i, j, side == 2 || (i == side && j == strip) ? 1 : 0);
  };
  for (std::size_t side = 0; side < 2; ++side)
    for (std::size_t i = 0; i < Mechanism::kStrips; ++i) {
      const std::string name = (side == 0 ? "left_strip_" : "right_strip_") + std::to_string(i);
      const int geom = mj_name2id(&m, mjOBJ_GEOM, name.c_str());
      only(side, i);
      for (int k = 0; k < 3; ++k) d.qvel[k] = 1e-3 * d.geom_xmat[9 * geom + 3 * k];  // along its normal
      ellipsoids.push_back({geom, 2e6 * mechanism.virtual_mass_energy(),
                            laws::kGrowthPeriods * f.sides[side].planform.chord_m * f.flapping_Hz});
    }
  only(2, 0);
  // what the ellipsoids carry in W, and the part of its turning that suction does not make
  const auto carried = [&] {
    std::pair<Eigen::Vector3d, Eigen::Vector3d> sum = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
    for (const Ellipsoid& one : ellipsoids) {
      mjtNum v[6];
      mj_objectVelocity(&m, &d, mjOBJ_GEOM, one.geom, v, 0);
      const Eigen::Vector3d normal(d.geom_xmat[9 * one.geom], d.geom_xmat[9 * one.geom + 3],
                                   d.geom_xmat[9 * one.geom + 6]);
      const double along = normal.dot(Eigen::Vector3d(v + 3));
      const Eigen::Vector3d p = one.mass_kg * laws::carried_air(along, one.growth_m_s).momentum_m_s * normal;
      sum.first += p;
      sum.second += (1 - laws::kSuction) * Eigen::Vector3d(v).cross(p);
    }
    return sum;
  };
  Random random(1, "state");
  const int nv = static_cast<int>(m.nv);
  Eigen::VectorXd accelerations(nv);
  for (int trial = 0; trial < 4; ++trial) {
    for (int i = 0; i < nv; ++i) {
      d.qvel[i] = (i < 3 ? 1 : i < 6 ? 10 : 200) * random.uniform(-1, 1);
      accelerations[i] = (i < 3 ? 10 : i < 6 ? 1e3 : 3e4) * random.uniform(-1, 1);
    }
    for (int i = 7; i < m.nq; ++i) d.qpos[i] = 0.7 * random.uniform(-1, 1);
    mj_forward(&m, &d);
    // the work that the robot does on the air is what its energy gains, by central differences
    const Eigen::VectorXd q = Eigen::Map<Eigen::VectorXd>(d.qpos, m.nq), v = Eigen::Map<Eigen::VectorXd>(d.qvel, nv);
    const double power_W = -mechanism.virtual_mass_load(accelerations).dot(v), scale = mechanism.virtual_mass_energy();
    const Eigen::Vector3d force_N = mechanism.virtual_mass_load(accelerations).head<3>() - carried().second;
    const double h = 1e-7;
    std::array<double, 2> energy_J{};
    std::array<Eigen::Vector3d, 2> momentum;
    for (const int side : {0, 1}) {
      const double dt = side == 0 ? -h : h;
      Eigen::Map<Eigen::VectorXd>(d.qpos, m.nq) = q;
      const Eigen::VectorXd between = v + dt / 2 * accelerations;
      mj_integratePos(&m, d.qpos, between.data(), dt);
      Eigen::Map<Eigen::VectorXd>(d.qvel, nv) = v + dt * accelerations;
      mj_forward(&m, &d);
      energy_J[static_cast<std::size_t>(side)] = mechanism.virtual_mass_energy();
      momentum[static_cast<std::size_t>(side)] = carried().first;
    }
    // truncation is of the order h^2; rounding 1e-16/h of the energy
    EXPECT_NEAR(power_W, (energy_J[1] - energy_J[0]) / (2 * h), 1e-6 * scale / h * 1e-2 + 1e-6 * std::abs(power_W));
    EXPECT_GT(std::abs(power_W), 1e-6);
    EXPECT_LT((force_N + (momentum[1] - momentum[0]) / (2 * h)).norm(), 1e-5 * force_N.norm());
  }
}

TEST(FamilyC, CarriedAirIsItsClosedForms) {
  // mass and energy follow from the momentum; the mass coefficient of an oscillation rises from 1 with its period parameter
  const double v0 = 5.3;
  for (double v = -20; v <= 20; v += 1.7) {
    const double h = 1e-5;
    const laws::CarriedAir before = laws::carried_air(v - h, v0), after = laws::carried_air(v + h, v0),
                           now = laws::carried_air(v, v0);
    EXPECT_NEAR((after.momentum_m_s - before.momentum_m_s) / (2 * h), now.mass, 1e-8);
    EXPECT_NEAR((after.energy_m2_s2 - before.energy_m2_s2) / (2 * h), v * now.mass, 1e-6);
    EXPECT_TRUE(now.mass >= 1 && now.mass <= 1 + laws::kGrowth);
  }
  double last = 1;
  for (const double period : {1, 4, 16, 64}) {
    double sum = 0, weight = 0;
    for (int i = 0; i < 400; ++i) {
      const double phase = 2 * M_PI * (i + 0.5) / 400, cosine = std::cos(phase);
      sum += cosine * cosine * laws::carried_air(v0 * period / laws::kGrowthPeriods * std::sin(phase), v0).mass;
      weight += cosine * cosine;
    }
    EXPECT_GT(sum / weight, last);
    EXPECT_LT(sum / weight, 1 + laws::kGrowth);
    last = sum / weight;
  }
  // blade elements of flat elliptic discs, 4/3 pi rho a b^2 / E [Lamb, chapter V]: a stroke that speeds up with the chord
  // upright, and the moment of a steady one; the moments of inertia fall out or are what is left at rest
  const Planform& p = nominal().sides[0].planform;
  const double growth = laws::kGrowthPeriods * p.chord_m * nominal().flapping_Hz, rate = 180, angle = 0.6, a = 2e4;
  const auto law = [](double rotation, double stroke_rate, double acceleration) {
    return law_of("added_mass", std::array{rotation, stroke_rate, 0.0, acceleration, 0.0});
  };
  double whole = 0, inertia = -law(0, 0, a)[0] / a, more = 0, munk = 0;
  for (const Strip& strip : strips_of(p)) {
    const double half_chord = 2 * p.chord_m / M_PI, half = half_length(strip) * p.length_m,
                 r = strip.radius * p.length_m;
    const double least = std::min(half, half_chord), most = std::max(half, half_chord), of = least / most;
    const double mass =
        4.0 / 3 * M_PI * nominal().density_kg_m3 * most * least * least / std::comp_ellint_2(std::sqrt(1 - of * of));
    whole += mass;
    inertia -= mass * r * r;
    more += mass * r * r * (laws::carried_air(rate * r, growth).mass - 1);
    munk += mass * rate * r * std::sin(angle) * laws::carried_air(rate * r * std::cos(angle), growth).momentum_m_s;
  }
  EXPECT_NEAR(whole, kVirtual_kg, 0.02 * kVirtual_kg);
  Build build;
  build.added_mass = 1;
  Mechanism robot(nominal(), build);
  const_cast<mjData&>(robot.data()).qvel[0] = 1e-3;  // along the normals of both wings
  EXPECT_NEAR(robot.virtual_mass_energy(), kVirtual_kg * 1e-6, 1e-3 * kVirtual_kg * 1e-6);
  EXPECT_NEAR(law(0, 0, a)[0] - law(0, rate, a)[0], more * a, 0.03 * more * a);
  const double steady = -laws::kSuction * munk - rate * rate * inertia * std::sin(angle) * std::cos(angle);
  EXPECT_NEAR(law(angle, rate, 0)[1], steady, 0.03 * std::abs(steady));
}

TEST(FamilyC, FlightsHaveTheLawOfTheVirtualMass) {
  // what a step's coordinates lack to move as without the effect is the law's force at their accelerations
  Build build;
  build.added_mass = 1;
  const RobotParameters f = drawn_parameters(nominal(), 3);
  Mechanism with_mass(f, build), without(f, {});
  const int nv = static_cast<int>(without.model().nv);
  for (Mechanism* one : {&with_mass, &without}) {
    mjData& d = const_cast<mjData&>(one->data());
    for (int i = 0; i < nv; ++i) d.qvel[i] = (i < 3 ? 0.5 : i < 6 ? 3.0 : 150.0) * (i % 2 == 0 ? 1 : -0.7);
    for (int i = 7; i < one->model().nq; ++i) d.qpos[i] = 0.3;
    mj_forward(&one->model(), &d);
  }
  const Mechanism before(f, build);  // the same model, to evaluate the law where the step began
  mjData& at = const_cast<mjData&>(before.data());
  std::copy_n(with_mass.data().qpos, before.model().nq, at.qpos);
  std::copy_n(with_mass.data().qvel, nv, at.qvel);
  mj_forward(&before.model(), &at);
  with_mass.step({0, 0}, {0, 0}, {});
  without.step({0, 0}, {0, 0}, {});
  const Eigen::VectorXd a = Eigen::Map<const Eigen::VectorXd>(with_mass.data().qacc, nv),
                        b = Eigen::Map<const Eigen::VectorXd>(without.data().qacc, nv);
  Eigen::VectorXd lacking(nv);
  const Eigen::VectorXd apart = a - b;
  mj_mulM(&without.model(), const_cast<mjData*>(&without.data()), lacking.data(), apart.data());
  const Eigen::VectorXd constraint = Eigen::Map<const Eigen::VectorXd>(with_mass.data().qfrc_constraint, nv) -
                                     Eigen::Map<const Eigen::VectorXd>(without.data().qfrc_constraint, nv);
  const Eigen::VectorXd load = before.virtual_mass_load(a);
  EXPECT_GT(load.tail(4).norm(), 1e-5);
  EXPECT_LT((lacking - constraint - load).norm(), 0.02 * load.norm()) << lacking.transpose() << "\n"
                                                                      << load.transpose();
}

TEST(FamilyC, EnginesLawsAreTheirClosedForms) {
  const Side& side = nominal().sides[0];
  const double rho = nominal().density_kg_m3;
  const std::vector<double> drag = law_of("body_drag", std::array{2.0, 0.0, 0.0});
  EXPECT_NEAR(drag[0], -rho / 2 * kBodyDrag_m2 * 4, 1e-3 * -drag[0]);
  // the part that is odd in the rate of rotation: blade elements of Sane and Dickinson, whose chords are level by sin
  const auto lift = [](double rate) { return law_of("rotational_lift", std::array{0.5, 200.0, rate})[0]; };
  const Planform& p = side.planform;
  const double area_radius = p.r11 * p.length_m * p.length_m * p.chord_m;
  const double elements = -rho * kRotation * p.chord_m * area_radius * 200 * 100 * std::sin(0.5);
  EXPECT_NEAR((lift(100) - lift(-100)) / 2, elements, 0.01 * std::abs(elements));
  // no torque within the play, and none that pushes the wrong way beyond it
  for (double x = -0.007; x <= 0.007; x += 0.001) EXPECT_EQ(law_of("gear_backlash", std::array{x, 3.0})[0], 0);
  EXPECT_GT(law_of("gear_backlash", std::array{0.02, 0.0})[0], 0);
  EXPECT_LT(law_of("gear_backlash", std::array{-0.02, 0.0})[0], 0);
  EXPECT_GT(law_of("stop_compliance", std::array{0.2, 0.0})[0], law_of("stop_compliance", std::array{0.1, 0.0})[0]);
  EXPECT_GE(law_of("stop_compliance", std::array{0.1, -150.0})[0], 0) << "a stop never pulls";
}

TEST(FamilyC, LawsOfTheDriveLoseEnergyAndHaveTheirLimits) {
  for (double volts = -18; volts <= 18; volts += 3)
    for (double amps = -1; amps <= 1; amps += 0.05) {
      EXPECT_GE(laws::bridge_loss_V(volts, amps, Drive::kBattery_V) * amps, 0);
      const double current = winding_A(volts, 0.7 * volts, 12.4, 1, Drive::kBattery_V);
      EXPECT_NEAR(12.4 * current + laws::bridge_loss_V(0.7 * volts, current, Drive::kBattery_V), volts, 1e-8);
    }
  // two steps of a constant command are one; a small one is a lag, a large one slews
  const double whole = laws::slewed_V(-3, 9, 1e-3, 1);
  EXPECT_NEAR(laws::slewed_V(laws::slewed_V(-3, 9, 4e-4, 1), 9, 6e-4, 1), whole, 1e-9);
  EXPECT_NEAR(laws::slewed_V(0, 1e-3, 1e-3, 1), 1e-3 * (1 - std::exp(-1e-3 / laws::kSlewTime_s)), 1e-8);
  EXPECT_NEAR(laws::slewed_V(0, 1000, 1e-5, 1), laws::kSlew_V_s * 1e-5, 1e-4);
  // at a standstill the loss all leaves; a short time heats the mass
  EXPECT_NEAR(laws::warmed_K(0, 1, laws::kWash_m_s, 1e3), laws::kWinding_K_W + laws::kHousing_K_W / 2, 1e-9);
  EXPECT_NEAR(laws::warmed_K(0, 1, 0, 1e-3), 1e-3 / laws::kWinding_J_K, 1e-6);
  for (double t = 0.1; t < 30; t += 1)
    EXPECT_GT(law_of("battery_sag", std::array{t + 1, 0.3})[0], law_of("battery_sag", std::array{t, 0.3})[0]);
  // friction acts against the motion, and what it has above Coulomb's falls by e for 53 rad/s
  const auto friction = [](double rate) { return law_of("coulomb_friction", std::array{rate})[0]; };
  for (double rate = -240; rate <= 240; rate += 30) EXPECT_LE(friction(rate) * rate, 0);
  EXPECT_NEAR(friction(10) / friction(63), M_E, 1e-9);
  // a spring: odd, so it has a potential, and as stiff as two far out
  const Spring& spring = nominal().sides[0].spring;
  EXPECT_NEAR(second_spring_Nm(spring, 0.9), -second_spring_Nm(spring, -0.9), 1e-15);
  EXPECT_NEAR((second_spring_Nm(spring, 1.6) - second_spring_Nm(spring, 1.5)) / 0.1,
              -laws::kSecondSpring * spring.positive_Nm_rad, 1e-3 * spring.positive_Nm_rad);
  // a command waits at most a period, and later ones never come sooner
  double last_s = 0;
  for (int k = 0; k < 40; ++k) {
    const double delay_s = law_of("command_delay", std::array{static_cast<double>(k)})[0], at_s = 1e-3 * k + delay_s;
    EXPECT_GE(delay_s, laws::kDoor_s - 1e-12);
    EXPECT_LT(delay_s, laws::kDoor_s + laws::kTask_s + 1e-8);
    EXPECT_GE(at_s, last_s - 1e-12);
    last_s = at_s;
  }
}

TEST(FamilyC, GustsHaveTheirSpectrum) {
  double power = 0, half = 0;  // integral, and correlation half a pulse apart, by the midpoint rule
  const double df = 1e-3;
  for (double f = df / 2; f < 40; f += df) {
    power += laws::gust_spectrum(f) * df;
    half += laws::gust_spectrum(f) * std::cos(M_PI * f * laws::kGust_s) * df;
  }
  EXPECT_NEAR(power, 1, 1e-3);
  EXPECT_NEAR(half, 1.0 / 6, 1e-3) << "of two pulses that overlap by a half";
  Mechanism mechanism(nominal(), {});
  Air air(nominal(), Magnitudes({{"wind", 1}}), 1, 0);
  std::vector<double> x;
  const double step_s = laws::kGust_s / 50;
  for (int i = 0; i < 100000; ++i) {
    air.act(mechanism, step_s);
    x.push_back(mechanism.model().opt.wind[0]);
  }
  const double mean = std::accumulate(x.begin(), x.end(), 0.0) / 1e5;
  double square = 0, apart = 0;
  for (std::size_t i = 0; i + 25 < x.size(); ++i) {
    square += (x[i] - mean) * (x[i] - mean) / 1e5;
    apart += (x[i] - mean) * (x[i + 25] - mean) / 1e5;
  }
  // 4000 pulses: the variance is known to 3 %
  EXPECT_NEAR(std::sqrt(square) / laws::kGust_m_s, 1, 0.05);
  EXPECT_NEAR(apart / square, 1.0 / 6, 0.05);
}

TEST(FamilyC, LawsOfSensorsHaveTheirLimits) {
  EXPECT_EQ(law_of("gyro_bias", std::array{1.5})[0], 0);
  EXPECT_NEAR(law_of("gyro_bias", std::array{1e3})[0], laws::kGyroWarm_rad_s, 1e-9);
  // far beyond the knee the mean of |sin| is 2/pi
  const double large = law_of("vibration_rectification", std::array{6e4, 500.0})[0];
  EXPECT_NEAR(large / (laws::kRectified * 6e4 * 2 / M_PI), 1, 1e-3);
  EXPECT_EQ(law_of("vibration_rectification", std::array{0.0, 100.0})[0], 0);
  // bending is a rotation by its slope, to first order: the change of place over a small step
  const Eigen::Vector3d way(0.6, 0.8, 0), at(0.3, -0.2, 0.9);
  const Eigen::Vector3d axis = laws::bend_rad(at.z(), 1) * Eigen::Vector3d::UnitZ().cross(way);
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d step = 1e-6 * Eigen::Vector3d::Unit(i);
    const Eigen::Vector3d moved = (laws::bent_by(at + step, way, 1) - laws::bent_by(at - step, way, 1)) / 2;
    const Eigen::Vector3d strain = moved - axis.cross(step);
    EXPECT_LT(std::abs(strain.x()) + std::abs(strain.y()), 1e-12);
    if (i < 2) EXPECT_LT(strain.norm(), 1e-12);
  }
  const std::vector<double> markers = law_of("marker_offset", std::array{0.0, 0.0, 0.0});
  EXPECT_NEAR(Eigen::Vector3d(markers.data()).norm(), laws::kStalkSet_m, 1e-12) << "gravity along the stalks";
  // tether and its potential
  const Eigen::Vector3d p(0.3, 0.2, 0.8);
  const auto energy = [](const Eigen::Vector3d& q) {
    return laws::kWires_N_m / 2 * q.head<2>().squaredNorm() + laws::kWires_kg_m * 9.81 * q.z();
  };
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d step = 1e-6 * Eigen::Vector3d::Unit(i);
    const double slope = (energy(p + step) - energy(p - step)) / 2e-6;
    if (i < 2) EXPECT_NEAR(laws::tether_N(p, 9.81)[i], -slope, 1e-9);
  }
}

TEST(FamilyC, WingInertiaIsMirroredAndKeepsItsMoments) {
  const RobotParameters before = Robot(plain(), 0).parameters(), after = Robot(with("wing_inertia", 1), 0).parameters();
  std::array<double, 2> farther{}, product{};
  for (std::size_t side = 0; side < 2; ++side) {
    const RigidBody &was = before.sides[side].wing, &is = after.sides[side].wing;
    farther[side] = was.com_m.z() - is.com_m.z();
    product[side] = is.inertia_kg_m2(1, 2) - was.inertia_kg_m2(1, 2);
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(is.inertia_kg_m2(i, i) / was.inertia_kg_m2(i, i), 1, 1e-3);
  }
  EXPECT_NEAR(std::abs(farther[0]), kWingCom_m, 1e-12);
  EXPECT_NEAR(farther[1], farther[0], 1e-15);
  EXPECT_NEAR(product[1], -product[0], 1e-3 * kWingProduct_kg_m2);
  EXPECT_NEAR(std::abs(product[0]), kWingProduct_kg_m2, 1e-3 * kWingProduct_kg_m2);
  for (std::uint64_t seed = 0; seed < 20; ++seed) {  // at the largest magnitude there is a body for each robot
    Assignment a = with("wing_inertia", 4);
    a.seed = seed;
    a.own_parameters = true;
    EXPECT_NO_THROW(Robot(a, 0)) << seed;
  }
}

TEST(FamilyC, ProductsOfInertiaActInAllAngularAccelerations) {
  const Contrast contrast = contrast_of(plain(), 0, "inertia_products", 1, {0.3, 0.4});
  std::array<double, 6> largest{};
  for (const auto& beat : contrast.change)
    for (std::size_t i = 0; i < 30; ++i) largest[i / 5] = std::max(largest[i / 5], std::abs(beat[i]));
  for (std::size_t channel = 3; channel < 6; ++channel) EXPECT_GT(largest[channel], 5) << channel;
  for (std::size_t channel = 0; channel < 3; ++channel) EXPECT_LT(largest[channel], 2) << channel;
}

TEST(FamilyC, AProgrammeOfAnotherSessionIsFlownAmongTheNoiseOfThisOne) {
  Assignment own = busy(1);
  const flightlog::FlightLog alone = short_log(own, 2);
  own.programme_of = 1;
  EXPECT_EQ(short_log(own, 2), alone);
  Assignment other = busy(1);
  other.programme_of = 0;
  for (std::size_t flight = 0; flight < 3; ++flight) {
    const Programme asked(other, flight, nominal()), that(busy(0), flight, nominal());
    EXPECT_EQ(asked.start_W(), that.start_W());
    for (double t = 0; t < 10; t += 0.37) {
      const Inputs a = asked.excitation(t), b = that.excitation(t);
      EXPECT_EQ(asked.target(t).position_W, that.target(t).position_W);
      EXPECT_EQ(asked.target(t).heading_rad, that.target(t).heading_rad);
      EXPECT_EQ((std::array{a.amplitude_V, a.difference_V, a.bias_V, a.split_cycle}),
                (std::array{b.amplitude_V, b.difference_V, b.bias_V, b.split_cycle}));
    }
  }
  // the robot and all noise are those of session 1
  const Robot here(other, 0), there(busy(1), 0);
  EXPECT_EQ(mjcf_text(here.parameters(), {}, 1e-4), mjcf_text(there.parameters(), {}, 1e-4));
  EXPECT_EQ(stream_of(other, 2), stream_of(busy(1), 2));
  EXPECT_NE(short_log(other, 2), short_log(busy(0), 2));
  const BenchProgramme bench(other, 0, nominal()), first(busy(0), 0, nominal());
  EXPECT_EQ(bench.inputs(1).amplitude_V, first.inputs(1).amplitude_V);
}

TEST(FamilyC, ASessionTurnsThePilotsGains) {
  Assignment a = plain();
  EXPECT_EQ(Pilot(nominal(), a, 0).gains().turn, Pilot::Gains().turn);
  a.session = 3;
  const Pilot::Gains gains = Pilot(nominal(), a, 0).gains(), same = Pilot(nominal(), a, 2).gains();
  EXPECT_EQ(gains.place_1_s, same.place_1_s) << "once for a session";
  EXPECT_NE(gains.place_1_s, Pilot::Gains().place_1_s);
  EXPECT_NEAR(gains.turn_hold.z() / Pilot::Gains().turn_hold.z(), 1, 0.0351);
}

TEST(FamilyC, RefusesWhatItDoesNotKnow) {
  const auto refusal = [](const auto& call) -> std::string {
    try {
      call();
    } catch (const io::InputError& error) {
      return error.what();
    }
    return "";
  };
  const auto family = make_family_c();
  EXPECT_EQ(refusal([&] { family->fly(with("wnid", 1), 0); }),
            "effect wnid: family C has no such effect; did you mean \"wind\"?");
  EXPECT_EQ(refusal([&] { family->fly(with("wind", 4.5), 0); }),
            "effect wind: magnitude 4.5 is out of range; accepted: a number from 0 to 4");
  EXPECT_EQ(refusal([&] { family->fly(with("wind", std::nan("")), 0); }),
            "effect wind: magnitude nan is out of range; accepted: a number from 0 to 4");
  EXPECT_EQ(refusal([&] { family->contrast(plain(), 0, "wind", -1); }),
            "effect wind: magnitude -1 is out of range; accepted: a number from 0 to 4");
  EXPECT_NE(refusal([&] { family->fly(plain(), 3); }).find("flight 3"), std::string::npos);
  EXPECT_EQ(refusal([&] { family->law("wnid", {}); }),
            "effect wnid: family C has no such effect; did you mean \"wind\"?");
  EXPECT_EQ(refusal([&] { family->law("wind", std::array{1.0}); }), "law of wind: 1 arguments; accepted: 2");
  EscapeAssignment rules;
  rules.observation = {"velocty"};
  EXPECT_NE(refusal([&] { escape_of(plain(), 0, rules, 0.1); }).find("did you mean \"velocity\""), std::string::npos);
}

}  // namespace
}  // namespace flappy::blind::c
