// Family A is the blind robot of its own programs, with figures and sensors drawn where an assignment asks for it.
#include "lab/blind/a/family_a.hpp"

#include <gtest/gtest.h>

#include <set>

#include "full.hpp"
#include "io/sha256.hpp"
#include "lab/blind/a/a_session.hpp"
#include "lab/blind/a/sampled_robot.hpp"

namespace flappy::blind {
namespace {

Assignment assignment() {
  Assignment a;
  a.vehicle_file = FLAPPY_SOURCE_DIR "/configs/vehicles/hummingbird_nominal.toml";
  a.seed = 41;
  a.hover = true;
  return a;
}

/// Half a second of climbing.
const ProposedFlight kShort{0.5,
                            [](double t_s) {
                              return std::array<double, 4>{0, 0, 0.5 + 0.1 * t_s, 0};
                            },
                            [](double) { return std::array<double, 4>{}; }};

FamilyFlight short_flight(Assignment a, std::size_t session) {
  a.proposed = &kShort;
  a.session = session;
  return make_family_a()->fly(a, kFlights);
}

std::string hash_of(const FamilyFlight& f) {
  std::string all;
  for (const auto& [name, text] : flightlog::flight_log_files(f.log)) all += name + text;
  return io::sha256(all);
}

TEST(FamilyA, DescribesEveryEffectOnce) {
  const std::unique_ptr<Family> family = make_family_a();
  ASSERT_EQ(family->effects().size(), kBlindEffects);
  for (std::size_t k = 0; k < kBlindEffects; ++k) {
    const FamilyEffect& e = family->effects()[k];
    EXPECT_EQ(e.id, effect_names()[k]);
    EXPECT_FALSE(e.channels.empty() || e.regimes.empty() || e.typical.empty()) << e.id;
  }
}

TEST(FamilyA, FliesWhatItsOwnProgramsFly) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  Case c = declared_case(assignment().vehicle_file);
  c.seed = 41;
  c.programme = Programme::hover;
  EXPECT_EQ(make_family_a()->fly(assignment(), 1).log, fly(c, 1).log);
}

TEST(FamilyA, DrawsFiguresAndSensorsApart) {
  Assignment a = assignment();
  const Case declared = case_of(a);
  a.own_parameters = true;
  const Case own = case_of(a);
  EXPECT_NE(own.vehicle.left.wing.mass_kg, declared.vehicle.left.wing.mass_kg);
  EXPECT_NE(own.vehicle.left.wing.mass_kg, own.vehicle.right.wing.mass_kg);
  EXPECT_NE(own.vehicle.torso.inertia_kg_m2.xx / declared.vehicle.torso.inertia_kg_m2.xx,
            own.vehicle.torso.inertia_kg_m2.yy / declared.vehicle.torso.inertia_kg_m2.yy);
  EXPECT_NEAR(own.vehicle.torso.mass_kg, declared.vehicle.torso.mass_kg, 0.09 * declared.vehicle.torso.mass_kg);
  EXPECT_EQ(own.sensors->imu, declared.sensors->imu);
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    a.seed = seed;
    Case drawn = case_of(a);
    EXPECT_FALSE(model::physical_fault(drawn.vehicle)) << seed;
  }
  a = assignment();
  a.conventions = true;
  const FamilyFlight flight = make_family_a()->fly(a, 0);
  ASSERT_FALSE(flight.crashed) << flight.how;
  const SensorSet sensors = *case_of(a).sensors;
  EXPECT_EQ(flight.log.header.imu.rate_hz, sensors.imu.rate_hz);
  EXPECT_EQ(flight.log.header.imu.latency_s, sensors.imu.latency_s) << "latencies are declared as they are";
  EXPECT_NE(flight.log.header.imu.position_m, sensors.imu.position_m);
  EXPECT_NEAR(static_cast<double>(flight.log.imu.t_s.size()), Family::kFlight_s * sensors.imu.rate_hz, 2);
}

TEST(FamilyA, SaysWhatAnEffectChanges) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  const std::unique_ptr<Family> family = make_family_a();
  const ProposedFlight hover{2,
                             [](double) {
                               return std::array<double, 4>{0, 0, 0.5, 0};
                             },
                             [](double) { return std::array<double, 4>{}; }};
  Assignment a = assignment();
  a.proposed = &hover;
  const Contrast none = family->contrast(a, 0, "mocap_tilt", 1);
  ASSERT_NEAR(static_cast<double>(none.change.size()), 34 * hover.lasts_s, 1);
  EXPECT_NEAR(none.beat_s.front(), 0, 1e-9);
  for (const auto& row : none.change)
    for (const double x : row) ASSERT_EQ(x, 0) << "only a sensor says it";
  // 1e-4 N m about a level axis turns the torso by some tens of rad/s^2, the same in every beat of hover
  const Contrast torque = family->contrast(a, 0, "outside_magnetic_torque", 1);
  const double turning = std::hypot(torque.change[20][15], torque.change[20][20]);
  EXPECT_GT(turning, 10);
  EXPECT_LT(turning, 100);
  EXPECT_NEAR(std::hypot(torque.change[50][15], torque.change[50][20]), turning, 0.2 * turning);
}

// Session 0 flies the same on every processor and in every version.
TEST(FamilyASessions, LeaveSessionZeroAsItWas) {
  Assignment a = assignment();
  a.power = a.wings = true;
  EXPECT_EQ(hash_of(short_flight(a, 0)), "9856dc4c28af8dd1ec3ca9bf1280dd1228bc748f7afb1f3102f5d300c787b9dc");
  a.own_parameters = true;  // not conventions: compilers differ in the order of their draws
  a.effects = {{"wind", 1}, {"battery_sag", 1}, {"marker_offset", 1}, {"mocap_delay", 1}};
  EXPECT_EQ(hash_of(short_flight(a, 0)), "58e19c49843ab3ea235a5ab252d11228e61387d6bd91c2e0ee4d109eb59b5f7a");
  a = assignment();
  a.hover = false;
  EXPECT_EQ(hash_of(make_family_a()->fly(a, 2)), "b849b5fbd2cce956139730d433ee90fc116e48137687adcb973bf392fa1e069b");
}

TEST(FamilyASessions, FlyOnAnotherDay) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  Assignment a = assignment();
  a.conventions = a.power = a.wings = true;
  const FamilyFlight before = short_flight(a, 0), after = short_flight(a, 1), again = short_flight(a, 1);
  ASSERT_FALSE(before.crashed || after.crashed) << before.how << after.how;
  EXPECT_EQ(after.log.header, before.log.header);
  EXPECT_EQ(flightlog::flight_log_files(after.log), flightlog::flight_log_files(again.log));
  EXPECT_NE(after.log.imu.gyro_x_rad_s, before.log.imu.gyro_x_rad_s);
  EXPECT_NE(after.log.mocap.x_m, before.log.mocap.x_m);
  EXPECT_NE(after.log.command.left_voltage_V, before.log.command.left_voltage_V);
  EXPECT_NE(short_flight(a, 2).log.imu.gyro_x_rad_s, after.log.imu.gyro_x_rad_s);
}

TEST(FamilyASessions, HaveNoiseAndProgrammesOfTheirOwn) {
  Case c = declared_case(assignment().vehicle_file);  // without harmless changes
  c.proposed = &kShort;
  c.power = c.wings = true;
  const RobotFlight before = fly(c, 0);
  c.session = 1;
  const RobotFlight after = fly(c, 0);
  EXPECT_NE(after.truth[3], before.truth[3]) << "the pilot sees other noise";
  // what does not depend on the motion: jitter of arrivals, and the sensors' noise
  EXPECT_NE(after.log.imu.t_s, before.log.imu.t_s);
  EXPECT_NE(after.log.mocap.t_s, before.log.mocap.t_s);
  EXPECT_NE(after.log.power->battery_V, before.log.power->battery_V);
  const auto noise = [](const RobotFlight& f) { return f.log.wings->left_stroke_rad[9] - f.truth[14][9]; };
  EXPECT_GT(std::abs(noise(after) - noise(before)), 1e-6);
  for (std::size_t f = 0; f < kFlights; ++f) {
    const Plan plan(Programme::rich, f, flight_room(), 41, f),
        other(Programme::rich, f, flight_room(), 41, flight_number(1, f));
    EXPECT_NE(other.excitation(3).bias_V, plan.excitation(3).bias_V) << f;
    for (int n = 0; n < 100; ++n)  // the same heights: a flight of the same kind
      ASSERT_EQ(other.at(0.1 * n).position_m.z(), plan.at(0.1 * n).position_m.z()) << f << ", " << n;
  }
}

// The programme of another session, bit for bit, under this session's noise and changes.
TEST(FamilyASessions, FlyTheProgrammeOfAnother) {
  Assignment a = assignment();
  a.hover = false;
  const auto plan_of = [&](const Assignment& which) {
    std::vector<double> all;
    const Case c = case_of(which);
    const Plan plan(c.programme, 2, flight_room(), c.seed, flight_number(c.programme_of.value_or(c.session), 2));
    for (int n = 0; n < 300; ++n) {
      const Inputs u = plan.excitation(n / 30.0);
      const Aim aim = plan.at(n / 30.0);
      all.insert(all.end(), {u.amplitude_V, u.difference_V, u.bias_V, u.split_cycle, aim.position_m.x(),
                             aim.position_m.y(), aim.position_m.z(), aim.heading_rad});
    }
    return all;
  };
  Assignment other = a;
  other.session = 2;
  const std::vector<double> own = plan_of(other);
  other.programme_of = 2;
  EXPECT_EQ(plan_of(other), own);
  other.programme_of = 0;
  EXPECT_EQ(plan_of(other), plan_of(a));
  EXPECT_NE(plan_of(other), own);
  // what is not of the programme stays that of the session: of equal programmes, all bytes
  a.session = 1;
  a.conventions = a.power = a.wings = true;
  Assignment same = a;
  same.programme_of = a.session;
  EXPECT_EQ(hash_of(short_flight(same, 1)), hash_of(short_flight(a, 1)));
  same.programme_of = 0;  // a proposed flight is its own programme
  EXPECT_EQ(hash_of(short_flight(same, 1)), hash_of(short_flight(a, 1)));
}

TEST(FamilyASessions, TuneTheGains) {
  Assignment a = assignment();
  PilotGains plain = case_of(a).gains;
  a.session = 1;
  PilotGains tuned = case_of(a).gains;
  std::vector<double> before, after;
  plain.each([&](double& g) { before.push_back(g); });
  tuned.each([&](double& g) { after.push_back(g); });
  ASSERT_EQ(before.size(), session_change(a.seed, 1).gains.size());
  for (std::size_t k = 0; k < before.size(); ++k)
    EXPECT_NEAR(after[k] / before[k] - 1, session_change(a.seed, 1).gains[k], 1e-12) << k;
}

// No two streams of a robot are one, over all flights, sessions and purposes.
TEST(FamilyASessions, HaveStreamsOfTheirOwn) {
  std::set<std::uint64_t> streams;
  std::size_t count = 0;
  const auto purposes = static_cast<std::uint64_t>(Purpose::count);
  for (std::uint64_t p = 0; p < purposes; ++p) {
    streams.insert(stream_of(static_cast<Purpose>(p))), ++count;
    for (std::size_t session = 0; session < 6; ++session)
      for (std::size_t flight = 0; flight < 40; ++flight)
        streams.insert(stream_of(static_cast<Purpose>(p), flight_number(session, flight))), ++count;
  }
  EXPECT_EQ(streams.size(), count);
  EXPECT_NE(Random(1, Purpose::gusts, 0).uniform(), Random(1, Purpose::gusts, 1).uniform());
  EXPECT_NE(Random(1, Purpose::gusts, 0).uniform(), Random(1, Purpose::gusts).uniform());
}

// The marker is glued on 1.6 mm off, in the same direction on all days; the mean of 500 samples has an sd of 5 um.
TEST(FamilyASessions, KeepTheDirectionsOfEffects) {
  const SensorSet set = sensors_of(41, false, false);
  const auto seen = [&](std::size_t session) {
    RobotMocap mocap(set, Magnitudes({{"marker_offset", 1}, {"mocap_tilt", 1}}), 41, flight_number(session, 0));
    Torso torso;
    torso.position_m.z() = 1;
    Vector3d sum = Vector3d::Zero();
    double count = 0;
    for (int n = 0; n < 500; ++n)
      if (const auto s = mocap.look(torso, n * 5e-3)) sum += s->position_m, ++count;
    return Vector3d(sum / count);
  };
  EXPECT_GT((seen(0) - Vector3d(0, 0, 1)).norm(), 1e-3);
  EXPECT_NE(seen(1), seen(0));
  EXPECT_LT((seen(1) - seen(0)).norm(), 5e-5);
  Case c = declared_case(assignment().vehicle_file);
  c.magnitudes = Magnitudes({{"wind", 1}});
  const auto blown = [&](std::size_t session) {
    c.session = session;
    Robot robot = robot_of(c, 0);
    robot.step(0, 0);
    const RobotState& x = robot.state();
    const Vector3d gust = x.gust.slow + 0.25 * laws::kGustTime_s * x.gust.rate;
    return std::pair(gust, Vector3d(x.wind_m_s - laws::kGust_m_s * gust.cwiseProduct(Vector3d(1, 1, 0.53))));
  };
  EXPECT_NE(blown(1).first, blown(0).first) << "gusts";
  EXPECT_LT((blown(1).second - blown(0).second).norm(), 1e-12) << "level and direction";
}

struct Drawn {
  const char* name;
  double value, bound, sd;
};
std::vector<Drawn> drawn(const SessionChange& s) {
  const double weather_sd = 1 / std::sqrt(3), degree = kPi / 180;
  std::vector<Drawn> all;
  const auto uniform = [&](const char* name, double value, double bound) {
    all.push_back({name, value, bound, bound / std::sqrt(3)});
  };
  const auto uniforms = [&](const char* name, const Vector3d& v, const Vector3d& bound) {
    for (int i = 0; i < 3; ++i) uniform(name, v(i), bound(i));
  };
  uniform("density", s.density, 0.0079);
  for (const std::size_t k : {0u, 1u}) {
    all.push_back({"resistance", s.resistance[k], 0.011005, 0.00393 * weather_sd * std::hypot(1.8, 1)});
    uniform("friction", s.friction[k], 0.08);
    all.push_back({"damping", s.damping[k], 0.1, weather_sd * std::hypot(0.08, 0.02)});
    uniform("rest angle", s.rest_angle_rad[k], 0.2 * degree);
  }
  uniform("torso mass", s.torso_mass, 0.0022);
  uniforms("battery's place", s.battery_m, {0.6e-3, 0.6e-3, 0.3e-3});
  uniform("battery", s.battery_V, 0.09);
  uniforms("marker", s.marker_m, Vector3d::Constant(0.2e-3));
  uniforms("marker's attitude", s.marker_rad, Vector3d::Constant(0.06 * degree));
  uniforms("IMU", s.imu_rad, Vector3d::Constant(0.12 * degree));
  uniform("clock", s.mocap_late_s, 0.3e-3);
  for (const double gain : s.gains) uniform("gain", gain, 0.04);
  return all;
}

TEST(FamilyASessions, ChangeWithinBounds) {
  constexpr std::uint64_t kSeeds = 200;
  std::vector<double> squares, sums;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    const std::vector<Drawn> all = drawn(session_change(seed, 1 + seed % 5));
    squares.resize(all.size()), sums.resize(all.size());
    for (std::size_t k = 0; k < all.size(); ++k) {
      EXPECT_LE(std::abs(all[k].value), all[k].bound) << all[k].name << ", seed " << seed;
      EXPECT_NE(all[k].value, 0) << all[k].name << ", seed " << seed;
      squares[k] += all[k].value * all[k].value, sums[k] += all[k].value;
    }
  }
  const std::vector<Drawn> none = drawn(session_change(7, 0));
  for (std::size_t k = 0; k < none.size(); ++k) {
    EXPECT_EQ(none[k].value, 0) << none[k].name;
    EXPECT_NEAR(std::sqrt(squares[k] / kSeeds), none[k].sd, 0.15 * none[k].sd) << none[k].name;
    EXPECT_NEAR(sums[k] / kSeeds, 0, 0.3 * none[k].sd) << none[k].name;  // four standard errors
  }
}

/// Each change reaches robot and sensors; the declarations stay.
TEST(FamilyASessions, ChangeTheRobotAndItsSensors) {
  Assignment a = assignment();
  a.own_parameters = a.conventions = true;
  Case before = case_of(a);
  a.session = 3;
  Case after = case_of(a);
  const SessionChange s = session_change(a.seed, a.session);
  EXPECT_NE(s.battery_V, session_change(a.seed, 2).battery_V);
  EXPECT_EQ(after.session, a.session) << "for noise and programmes";
  EXPECT_EQ(after.declared_density_kg_m3, before.declared_density_kg_m3);
  EXPECT_EQ(after.sensors->imu, before.sensors->imu);
  EXPECT_EQ(after.sensors->mocap, before.sensors->mocap);
  std::vector<std::string> changed;
  const auto was = model::parameters(before.vehicle), is = model::parameters(after.vehicle);
  ASSERT_EQ(was.size(), is.size());
  for (std::size_t k = 0; k < is.size(); ++k)
    if (*is[k].value != *was[k].value) changed.push_back(is[k].path);
  EXPECT_EQ(changed.size(), 1 + 4 + 2 * (1 + 3 + 3 + 1u)) << "density, torso, and of each side R, 3 f, 3 b, rest";
  const auto share = [](double now, double then) { return now / then - 1; };
  EXPECT_NEAR(share(after.vehicle.air_density_kg_m3, before.vehicle.air_density_kg_m3), s.density, 1e-12);
  EXPECT_NEAR(share(after.vehicle.right.motor.resistance_ohm, before.vehicle.right.motor.resistance_ohm),
              s.resistance[1], 1e-12);
  EXPECT_NEAR(share(after.vehicle.torso.mass_kg, before.vehicle.torso.mass_kg), s.torso_mass, 1e-12);
  EXPECT_FALSE(model::physical_fault(after.vehicle));
  EXPECT_EQ(after.battery_V, kBattery_V + s.battery_V);
  EXPECT_EQ(robot_of(after, 0).battery_V(), after.battery_V);
  EXPECT_EQ(after.sensors->marker_m, s.marker_m);
  EXPECT_EQ(after.sensors->mocap_late_s, s.mocap_late_s);
  const auto turned = [](const Matrix3d& m) { return Eigen::AngleAxisd(m).angle(); };
  EXPECT_NEAR(turned(after.sensors->imu_turned * before.sensors->imu_turned.transpose()), s.imu_rad.norm(), 1e-9);
  EXPECT_NEAR(turned(after.sensors->marker_turned.toRotationMatrix()), s.marker_rad.norm(), 1e-9);
}

/// Equal noise in both sessions leaves what the session did.
/// Mean moment (N m) of the air about the torso's x axis, over four beats of a robot that is held.
double roll(const Assignment& a) {
  Robot robot = robot_of(case_of(a), 0);
  robot.hold_torso(true);
  double sum = 0;
  const auto steps = static_cast<int>(4 / 34.0 / kRobotStep_s);
  for (int n = 0; n < steps; ++n) {
    const double volts = 10 * std::cos(2 * kPi * 34 * n * kRobotStep_s);
    robot.step(volts, volts);
    sum += robot.air().moment_Nm.x() / steps;
  }
  return sum;
}

TEST(FamilyAChanges, SwapTheWingsWithTheirFaults) {
  Assignment a = assignment();
  a.effects = {{"wing_damage", 2}};
  const double before = roll(a);
  EXPECT_GT(std::abs(before), 1e-5);
  a.changes.swapped_wings = true;
  EXPECT_NEAR(roll(a), -before, 1e-9);
  a.own_parameters = true;
  const model::Vehicle swapped = case_of(a).vehicle;
  a.changes = {};
  const model::Vehicle own = case_of(a).vehicle;
  EXPECT_EQ(swapped.left.wing.mass_kg, own.right.wing.mass_kg);
  EXPECT_EQ(swapped.left.wing.com_m.y, -own.right.wing.com_m.y);
  EXPECT_EQ(swapped.right.leading_edge.inertia_kg_m2.xy, -own.left.leading_edge.inertia_kg_m2.xy);
  EXPECT_EQ(swapped.left.rotation.lower_rad, own.right.rotation.lower_rad);
  EXPECT_EQ(swapped.left.planform.mean_chord_m, own.right.planform.mean_chord_m);
  EXPECT_EQ(swapped.left.motor.resistance_ohm, own.left.motor.resistance_ohm) << "motors stay";
}

TEST(FamilyAChanges, AddAWeightAndTakeEffectsAway) {
  Assignment a = assignment();
  a.effects = {{"tether", 1}, {"wind", 1}};
  const model::RigidBody before = case_of(a).vehicle.torso;
  a.changes.added_mass_kg = 0.5e-3;
  a.changes.added_at_m = {0.02, 0, -0.01};
  a.changes.without = {"tether"};
  const Case c = case_of(a);
  const model::RigidBody after = c.vehicle.torso;
  EXPECT_NEAR(after.mass_kg, before.mass_kg + 0.5e-3, 1e-15);
  EXPECT_NEAR(after.mass_kg * after.com_m.x, before.mass_kg * before.com_m.x + 0.5e-3 * 0.02, 1e-15);
  // about the origin, inertias add
  const auto about_y = [](const model::RigidBody& b) {
    return b.inertia_kg_m2.yy + b.mass_kg * (b.com_m.x * b.com_m.x + b.com_m.z * b.com_m.z);
  };
  EXPECT_NEAR(about_y(after), about_y(before) + 0.5e-3 * (4e-4 + 1e-4), 1e-15);
  EXPECT_EQ(c.magnitudes[Effect::tether], 0);
  EXPECT_EQ(c.magnitudes[Effect::wind], 1);
  EXPECT_EQ(short_flight(a, 1).log.header.changes, a.changes);
}

TEST(FamilyASessions, ShowInMotionCapture) {
  Assignment a = assignment();
  const auto seen = [&](std::size_t session) {
    a.session = session;
    RobotMocap mocap(*case_of(a).sensors, {}, 1, 0);
    std::array<double, 7> sum{};
    double count = 0;
    for (int n = 0; n < 2000; ++n)
      if (const auto s = mocap.look({}, n * 5e-3)) {
        ++count;
        for (int i = 0; i < 3; ++i) {
          sum[static_cast<std::size_t>(i)] += s->position_m(i);
          sum[static_cast<std::size_t>(3 + i)] += 2 * s->attitude.vec()(i);
        }
        sum[6] += s->arrival_s - n * 5e-3;
      }
    for (double& x : sum) x /= count;
    return sum;
  };
  const std::array<double, 7> before = seen(0), after = seen(2);
  const SessionChange s = session_change(a.seed, 2);
  for (int i = 0; i < 3; ++i) {
    const auto k = static_cast<std::size_t>(i);
    EXPECT_NEAR(after[k] - before[k], s.marker_m(i), 1e-9);
    EXPECT_NEAR(after[3 + k] - before[3 + k], s.marker_rad(i), 1e-4);
  }
  EXPECT_NEAR(after[6] - before[6], s.mocap_late_s, 1e-9);
}

TEST(FamilyASessions, CalmFlightsAreSlow) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  Assignment a = assignment();
  a.hover = false;
  a.calm = true;
  for (std::size_t f = 0; f < kFlights; ++f) {
    const Plan plan(Programme::calm, f, flight_room(), 41, f);
    for (int n = 0; n < 1000; ++n) {
      const Aim aim = plan.at(0.01 * n);
      const Inputs u = plan.excitation(0.01 * n);
      ASSERT_EQ(std::abs(u.amplitude_V) + std::abs(u.difference_V) + std::abs(u.bias_V) + std::abs(u.split_cycle), 0);
      if (f == 0) ASSERT_EQ(aim.position_m, Vector3d(0, 0, 0.5));
      ASSERT_LT(aim.velocity_m_s.norm(), 0.2);
      ASSERT_LE(std::abs(aim.heading_rad_s), 0.3 + 1e-9);
    }
  }
  for (std::uint64_t seed = 1; seed <= (test::full() ? 6 : 3); ++seed) {
    a.seed = seed;
    a.session = seed % 2;
    a.own_parameters = a.conventions = seed > 1;
    const std::size_t flight = 1 + seed % 2;
    const RobotFlight f = fly(case_of(a), flight);
    ASSERT_FALSE(f.crashed) << seed << ": " << f.how;
    double most = 0, path_m = 0;  // of the mean over five beats: within a beat the torso shakes by 0.2 m/s
    constexpr std::size_t kBeats = 74;
    for (std::size_t k = kBeats; k < f.truth[0].size(); k += kBeats) {
      const auto moved = [&](std::size_t column) { return f.truth[column][k] - f.truth[column][k - kBeats]; };
      const double step_m = std::hypot(moved(1), moved(2), moved(3));
      most = std::max(most, step_m / (kBeats * kControl_s));
      path_m += step_m;
    }
    EXPECT_LT(most, 0.25) << seed;
    EXPECT_GT(path_m, 0.6) << "flight " << flight << " goes around, seed " << seed;
    EXPECT_NEAR(f.log.command.t_s.back(), kFlight_s, 0.01);
  }
}

}  // namespace
}  // namespace flappy::blind
