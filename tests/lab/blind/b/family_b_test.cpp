#include "lab/blind/b/family_b.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "flightlog/flight_log.hpp"
#include "io/parallel.hpp"
#include "lab/blind/b/b_contrast.hpp"
#include "lab/blind/b/b_escape.hpp"
#include "lab/blind/b/b_flight.hpp"
#include "lab/blind/b/b_session.hpp"
#include "lab/blind/b/family_b_tests.hpp"
#include "refusal.hpp"

namespace flappy::blind::b {
namespace {

std::string bytes(const flightlog::FlightLog& log) {
  std::string all;
  for (const auto& [name, text] : flightlog::flight_log_files(log)) all += name + "\n" + text;
  return all;
}

/// Acceleration of the torso's origin against free fall, in B, at a state amid a stroke.
Felt felt_at(const Effects& effects, const Vector3d& position, const Vector3d& velocity = Vector3d::Zero(),
             double stroke_rate = 240) {
  const Plant p = plant(effects);
  State x{}, rate;
  for (std::size_t k = 0; k < 3; ++k) {
    x[kPosition + k] = position[static_cast<Eigen::Index>(k)];
    x[kVelocity + k] = velocity[static_cast<Eigen::Index>(k)];
  }
  x[kQuaternion] = 1;
  for (std::size_t j = 0; j < 2; ++j) x[kStrokeRate + j] = stroke_rate, x[kRotation + j] = -0.78;
  Felt felt;
  felt.acceleration = {Vector3d::Zero(), Vector3d::Zero()};
  p.rates(x, {0, 0}, p.fresh(), Surroundings{}, nullptr, rate, felt);
  return felt;
}

TEST(FamilyBEffects, OfGroundAndCeilingVanishFarAway) {
  const auto more = [](const std::string& effect, double z) {
    return felt_at({{effect, 1}}, {0, 0, z}).acceleration.v.z() / felt_at({}, {0, 0, z}).acceleration.v.z() - 1;
  };
  EXPECT_GT(more("ground_effect", 0.02), 0.05);
  EXPECT_LT(more("ground_effect", 0.02), 0.14) << "it stays finite";
  EXPECT_LT(more("ground_effect", 0.15), more("ground_effect", 0.05));
  EXPECT_NEAR(more("ground_effect", 1.9), 0, 3e-4);
  EXPECT_GT(more("ceiling_effect", 1.95), 0.05);
  EXPECT_NEAR(more("ceiling_effect", 0.1), 0, 5e-4);
}

TEST(FamilyBEffects, DrawToTheWall) {
  const auto to_wall = [](double y) {
    return felt_at({{"wall_effect", 1}}, {0, y, 1}).acceleration.v.y() - felt_at({}, {0, y, 1}).acceleration.v.y();
  };
  EXPECT_GT(to_wall(0.89), 0.1);
  EXPECT_GT(to_wall(0.89), 3 * std::abs(to_wall(0.75)));
  EXPECT_NEAR(to_wall(-1), 0, 1e-3);
}

TEST(FamilyBEffects, OfDragOpposeMotionEvenInSign) {
  const auto drag = [](const Vector3d& v) {
    return Vector3d(felt_at({{"body_drag", 1}}, {0, 0, 1}, v, 0).acceleration.v -
                    felt_at({}, {0, 0, 1}, v, 0).acceleration.v);
  };
  const Vector3d ahead = drag({1, 0, 0}), back = drag({-1, 0, 0}), fast = drag({2, 0, 0});
  EXPECT_LT(ahead.x(), -0.01);
  EXPECT_NEAR(ahead.x(), -back.x(), 1e-12);
  EXPECT_NEAR(fast.x(), 4 * ahead.x(), 1e-9);
  EXPECT_LT(drag({0, 0, 1}).z(), 0);
  EXPECT_NEAR(drag({0, 0, 0}).norm(), 0, 1e-15);
}

TEST(FamilyBEffects, HaveTheirSigns) {
  const Vector3d none = felt_at({}, {0, 0, 1}).acceleration.v;
  EXPECT_LT(felt_at({{"tether", 1}}, {0, 0, 1}).acceleration.v.z(), none.z()) << "a cable weighs";
  EXPECT_LT(felt_at({{"tether", 1}}, {0, 0, 1}).acceleration.v.z(),
            felt_at({{"tether", 1}}, {0, 0, 0.3}).acceleration.v.z() - 1e-6);
  EXPECT_EQ(felt_at({{"rotational_lift", 1}}, {0, 0, 1}).acceleration.v, none) << "no rotation, no lift of it";
  EXPECT_NEAR(felt_at({{"clap_and_fling", 1}}, {0, 0, 1}).acceleration.v.z(), none.z(), 1e-6)
      << "the wings are far apart";
  const std::size_t side = static_cast<std::size_t>(effect_magnitudes_of({}, 3).damaged_side);
  EXPECT_NEAR(plant({{"wing_damage", 1}}).wing(side).area_m2() / plant().wing(side).area_m2(),
              1 - family_effects()[kWingDamage].numbers[1], 1e-12);
  EXPECT_NEAR(plant({{"wing_damage", 1}}).wing(1 - side).area_m2() / plant().wing(1 - side).area_m2(), 1, 1e-12);
  EXPECT_NEAR(plant().wing(0).area_m2(), 0.07 * 0.021212121212121, 1e-12) << "the file's area";
  EXPECT_GT(plant({{"added_mass", 1}}).wing(0).added().trace(), 0);
  EXPECT_EQ(plant().wing(0).added().norm(), 0);

  // less stroke, so less thrust
  const RobotParameters f = nominal();
  const double thrust = held(f, {10, 0, 0, 0}).f.z();
  for (const char* effect : {"coulomb_friction", "driver_dead_zone", "outside_torn_flap"})
    EXPECT_LT(held(f, {10, 0, 0, 0}, {{effect, 1}}).f.z(), thrust) << effect;
}

TEST(FamilyBEffects, OfMagnitudeZeroLeaveTheSameBytesAndOthersChangeThem) {
  const Times brief{0.1, 0.2};
  Assignment a = assignment();
  a.power = a.wings = true;
  const std::string none = bytes(fly_programme(a, 0, brief).log);
  for (const FamilyEffect& e : family_effects()) a.effects.emplace_back(e.id, 0);
  EXPECT_TRUE(bytes(fly_programme(a, 0, brief).log) == none);
  std::vector<char> same(kEffects, 0);
  io::parallel_for(kEffects, 0, [&](std::size_t i) {
    Assignment one = assignment({{family_effects()[i].id, 1}});
    one.power = one.wings = true;
    // packets are lost later than the others act
    if (i == kCommandDropout)
      same[i] = bytes(fly_programme(one, 0, {0.7, 0.4}).log) == bytes(fly_programme(assignment(), 0, {0.7, 0.4}).log);
    else same[i] = bytes(fly_programme(one, 0, brief).log) == none;
  });
  for (std::size_t i = 0; i < kEffects; ++i) EXPECT_FALSE(same[i]) << family_effects()[i].id;
}

TEST(FamilyBEffects, AreInTheCatalogueOrOutside) {
  const std::vector<FamilyEffect>& all = family_effects();
  ASSERT_EQ(all.size(), static_cast<std::size_t>(kEffects));
  EXPECT_EQ(all[kMocapDelay].id, "mocap_delay");
  EXPECT_EQ(all[kSpringSlip].id, "outside_spring_slip");
  const std::vector<std::string> channels = {"specific_force_x",
                                             "specific_force_y",
                                             "specific_force_z",
                                             "angular_acceleration_x",
                                             "angular_acceleration_y",
                                             "angular_acceleration_z",
                                             "gyro",
                                             "accelerometer",
                                             "mocap",
                                             "current"};
  const std::vector<std::string> regimes = {
      "always",   "height", "ceiling",      "wall", "place",       "amplitude", "difference", "bias",   "split_cycle",
      "velocity", "rate",   "acceleration", "time", "temperature", "charge",    "stroke",     "heading"};
  int outside = 0;
  for (const FamilyEffect& e : all) {
    outside += e.id.starts_with("outside_");
    EXPECT_FALSE(e.typical.empty() || e.channels.empty() || e.regimes.empty()) << e.id;
    for (const std::string& c : e.channels)
      EXPECT_TRUE(std::ranges::find(channels, c) != channels.end()) << e.id << " " << c;
    for (const std::string& r : e.regimes)
      EXPECT_TRUE(std::ranges::find(regimes, r) != regimes.end()) << e.id << " " << r;
  }
  EXPECT_EQ(all.size() - static_cast<std::size_t>(outside), 30U);
  EXPECT_GE(outside, 8);
}

TEST(FamilyBFlight, HoversAndIsALogThatCanBeRead) {
  Assignment a = assignment();
  a.hover = a.power = a.wings = a.own_parameters = a.conventions = true;
  const FamilyFlight flight = fly_programme(a, 1, {1, 1});
  EXPECT_FALSE(flight.crashed) << flight.how;
  const flightlog::FlightLog read = flightlog::parse_flight_log(flightlog::flight_log_files(flight.log), "robot");
  EXPECT_EQ(read.command.t_s.size(), 1000U);
  EXPECT_GT(read.imu.t_s.size(), 480U);
  EXPECT_GT(read.mocap.t_s.size(), 120U);
  ASSERT_TRUE(read.power && read.wings && read.command.inputs && read.command.phase_rad);
  EXPECT_NEAR(read.power->battery_V.front(), 18, 0.5);
  EXPECT_NEAR(read.mocap.z_m.back(), 0.8, 0.1);
  EXPECT_EQ(read.header.ambient.walls.size(), 1U);
}

TEST(FamilyBFlight, SaysThatItCrashed) {
  const FamilyFlight flight =
      fly_programme(assignment({{"wing_damage", 4}, {"command_delay", 4}, {"com_offset", 4}}), 0, {0.5, 2});
  EXPECT_TRUE(flight.crashed);
  EXPECT_FALSE(flight.how.empty());
}

TEST(FamilyBFlight, IsTheSameOnAnyThread) {
  Assignment a = assignment({{"wind", 1}, {"gyro_bias", 1}});
  a.own_parameters = a.conventions = true;
  const Times brief{0.1, 0.15};
  const std::string once = bytes(fly_programme(a, 2, brief).log);
  std::vector<std::string> again(3);
  io::parallel_for(again.size(), 3, [&](std::size_t i) { again[i] = bytes(fly_programme(a, 2, brief).log); });
  for (const std::string& each : again) EXPECT_TRUE(each == once);
  a.seed = 4;
  EXPECT_FALSE(bytes(fly_programme(a, 2, brief).log) == once);
}

/// Flown briefly, with currents and wing angles.
FamilyFlight flown_in(std::size_t session, std::size_t flight) {
  Assignment a = assignment({{"wind", 1}});
  a.own_parameters = a.conventions = a.power = a.wings = true;
  a.session = session;
  return fly_programme(a, flight, {0.1, 0.15});
}

TEST(FamilyBSession, ZeroIsWhatWasFlownBeforeThereWereSessions) {
  Assignment a = assignment();
  a.own_parameters = true;
  // first frame of motion capture, then the fourth sample of the accelerometer's z
  const std::array<std::array<double, 4>, 3> before = {{{-0.067494619, -0.054661208, 0.341815413, 21.583916},
                                                        {-0.100226694, -0.173758181, 1.572063329, 21.904849},
                                                        {-0.485915972, 0.556238638, 0.890731841, 21.483325}}};
  for (std::size_t flight = 0; flight < 3; ++flight) {
    const flightlog::FlightLog log = fly_programme(a, flight, {0.1, 0.15}).log;
    EXPECT_NEAR(log.mocap.x_m[0], before[flight][0], 1e-7);
    EXPECT_NEAR(log.mocap.y_m[0], before[flight][1], 1e-7);
    EXPECT_NEAR(log.mocap.z_m[0], before[flight][2], 1e-7);
    EXPECT_NEAR(log.imu.accel_z_m_s2[3], before[flight][3], 1e-5);
  }
}

TEST(FamilyBSession, HasOtherRowsUnderTheSameHeader) {
  for (std::size_t flight = 0; flight < 3; ++flight) {
    const flightlog::FlightLog drawn = flown_in(0, flight).log, one = flown_in(1, flight).log;
    const flightlog::LogFiles before = flightlog::flight_log_files(drawn), after = flightlog::flight_log_files(one);
    ASSERT_EQ(before.size(), after.size());
    for (const auto& [name, text] : before)
      EXPECT_EQ(after.at(name) == text, name == flightlog::log_file::kHeader) << name << " of flight " << flight;
    // nothing but a stream of its own moves the first sample of the wings
    EXPECT_NE(one.wings->t_s.front(), drawn.wings->t_s.front());
    EXPECT_TRUE(bytes(flown_in(1, flight).log) == bytes(one));
    EXPECT_FALSE(bytes(flown_in(2, flight).log) == bytes(one));
  }
}

TEST(FamilyBSession, FliesTheProgrammeOfAnother) {
  const Times brief{0.1, 0.15};
  Assignment a = assignment({{"wind", 1}, {"gyro_bias", 1}});
  a.own_parameters = a.conventions = a.power = a.wings = true;
  a.session = 2;
  const std::string own = bytes(fly_programme(a, 1, brief).log);
  a.programme_of = 2;
  EXPECT_TRUE(bytes(fly_programme(a, 1, brief).log) == own);
  a.programme_of = 0;
  const Case c = make_case(a);
  const Programme flown(a, 1, c.parameters, c.room);
  const flightlog::FlightLog other = fly_programme(a, 1, brief).log;
  Assignment first = a;
  first.programme_of.reset();
  first.session = 0;
  const Programme of_first(first, 1, c.parameters, c.room);
  for (double t = 0; t < 10; t += 0.1) {
    EXPECT_EQ(flown.target(t).position_m, of_first.target(t).position_m);
    EXPECT_EQ(flown.excitation(t).bias_V, of_first.excitation(t).bias_V);
  }
  // what session 2 draws stays: the first sample of the wings comes when it did
  first.session = 2;
  const flightlog::FlightLog same_noise = fly_programme(first, 1, brief).log;
  EXPECT_EQ(other.wings->t_s.front(), same_noise.wings->t_s.front());
  EXPECT_EQ(make_case(a).parameters.torso.mass_kg, make_case(first).parameters.torso.mass_kg);
}

TEST(FamilyBSession, HasGustsOfItsOwnInContrasts) {
  const Times brief{0.1, 0.15};
  Assignment a = assignment();
  a.programme_of = 0;
  std::array<Vector3d, 2> gust;
  for (std::size_t session = 0; session < 2; ++session)
    gust[session] = Gusts(Random(a.seed, draw_number(0, session), Stream::kEffect, kWind)).at(0.1);
  EXPECT_GT((gust[1] - gust[0]).norm(), 1e-3);
  a.session = 1;
  const Contrast one = contrast_of(a, 0, "wind", 1, brief);
  a.session = 0;
  const Contrast zero = contrast_of(a, 0, "wind", 1, brief);
  ASSERT_EQ(one.change.size(), zero.change.size());
  EXPECT_NE(one.change, zero.change);
}

TEST(FamilyBSession, KeepsTheRobotsEffectsAndTheKindsOfFlights) {
  Assignment a = assignment({{"com_offset", 1}});
  const Case drawn = make_case(a);
  a.session = 1;
  EXPECT_NE(draw_number(0, 1), draw_number(1, 0));
  const Case later = make_case(a);
  EXPECT_EQ(later.effect_magnitudes.com_m, drawn.effect_magnitudes.com_m);
  EXPECT_EQ(later.effect_magnitudes.wind_direction_rad, drawn.effect_magnitudes.wind_direction_rad);
  EXPECT_NE(later.parameters.torso.mass_kg, drawn.parameters.torso.mass_kg);
  const auto start = [&](std::size_t session, std::size_t flight) {
    a.session = session;
    return Programme(a, flight, drawn.parameters, drawn.room).start_m();
  };
  for (std::size_t flight = 0; flight < 3; ++flight) {
    EXPECT_EQ(start(1, flight).z(), start(0, flight).z());
    EXPECT_NE(start(1, flight), start(0, flight));
    EXPECT_LT((start(1, flight) - start(0, flight)).norm(), 0.3);
  }
}

/// Root mean square of what 200 robots draw, in shares of its bound; fails where a draw is 0 or out of bounds.
double spread(double bound, const std::function<double(const SessionChange&)>& drawn) {
  double squares = 0;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    const double x = drawn(draw_session(seed, 1)) / bound;
    EXPECT_LE(std::abs(x), 1 + 1e-12) << seed;
    EXPECT_NE(x, 0) << seed;
    EXPECT_NE(x * bound, drawn(draw_session(seed, 2))) << seed;
    squares += x * x / 200;
  }
  return std::sqrt(squares);
}

TEST(FamilyBSession, DrawsWithinItsBounds) {
  const std::vector<std::pair<double, std::function<double(const SessionChange&)>>> uniform = {
      {3, [](const auto& c) { return c.warmer_K; }},
      {0.009, [](const auto& c) { return c.pressure; }},
      {0.004, [](const auto& c) { return c.mass; }},
      {0.06e-3, [](const auto& c) { return c.com_m.z(); }},
      {0.0035, [](const auto& c) { return c.full_supply; }},
      {0.0035, [](const auto& c) { return c.brush[0]; }},
      {0.0035, [](const auto& c) { return c.brush[1]; }},
      {0.09, [](const auto& c) { return c.wear[0]; }},
      {0.09, [](const auto& c) { return c.wear[1]; }},
      {0.05, [](const auto& c) { return c.grease[0]; }},
      {0.05, [](const auto& c) { return c.grease[1]; }},
      {0.2 * kDegree, [](const auto& c) { return c.rest_angle_rad[0]; }},
      {0.2 * kDegree, [](const auto& c) { return c.rest_angle_rad[1]; }},
      {0.15 * kDegree, [](const auto& c) { return c.imu_turn_rad.norm(); }},
      {0.1 * kDegree, [](const auto& c) { return c.marker_turn_rad.norm(); }},
      {0.18e-3, [](const auto& c) { return c.marker_m.norm(); }},
      {0.1 * kDegree, [](const auto& c) { return c.clamp_turn_rad.norm(); }},
      {0.1e-3, [](const auto& c) { return c.clamp_m.norm(); }},
      {0.4e-3, [](const auto& c) { return c.mocap_late_s; }},
      {0.1e-3, [](const auto& c) { return c.imu_late_s; }},
      {0.04, [](const auto& c) { return c.gains.position - 1; }},
      {0.04, [](const auto& c) { return c.gains.yaw_rate - 1; }}};
  for (std::size_t i = 0; i < uniform.size(); ++i)
    EXPECT_NEAR(spread(uniform[i].first, uniform[i].second), std::sqrt(1.0 / 3), 0.07) << i;
  for (int axis = 0; axis < 2; ++axis)
    EXPECT_NEAR(spread(0.16e-3, [&](const auto& c) { return c.com_m[axis]; }), 0.5, 0.06) << "of a disc";
  EXPECT_LE(spread(0.16e-3, [](const auto& c) { return c.com_m.template head<2>().norm(); }), 1);
}

TEST(FamilyBSession, ChangesRobotAndSensorsByLessThanEffectsOfAFifth) {
  const RobotParameters before = nominal();
  double density = 0, resistance = 0, thinner = 0;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    const SessionChange by = draw_session(seed, 1);
    RobotParameters f = before;
    SensorTruth sensors;
    change(by, f, sensors);
    const Motor &was = before.side[1].motor, &is = f.side[1].motor;
    const double denser = f.density_kg_m3 / before.density_kg_m3 - 1, more = is.resistance_ohm / was.resistance_ohm - 1;
    EXPECT_LT(std::abs(denser), 0.2 * ground_share(0.019)) << "less than at the ground";
    EXPECT_LT(by.marker_m.norm(), 0.2 * misfit(0, {kMarkerMoved_m, 0, 0}).shift_m.norm());
    EXPECT_LT(by.com_m.head<2>().norm(), 0.2 * kComLevel_m);
    EXPECT_LT(std::abs(more), 0.02) << "less than a winding heats up";
    density += denser * denser / 200, resistance += more * more / 200;
    EXPECT_LT(std::abs(is.torque_constant_Nm_A / was.torque_constant_Nm_A - 1), 0.007);
    EXPECT_LT(std::abs(is.friction_Nm / was.friction_Nm - 1), 0.2);
    EXPECT_LT(std::abs(is.damping_Nm_s / was.damping_Nm_s - 1), 0.12);
    EXPECT_NE(is.friction_Nm / was.friction_Nm, f.side[0].motor.friction_Nm / before.side[0].motor.friction_Nm);
    EXPECT_NEAR(f.torso.mass_kg / before.torso.mass_kg, 1 + by.mass, 1e-12);
    EXPECT_EQ(f.torso.com_m, before.torso.com_m + by.com_m);
    EXPECT_EQ(f.side[0].rest_angle_rad, by.rest_angle_rad[0]);
    EXPECT_NEAR(Eigen::AngleAxisd(sensors.imu_turn).angle(), by.imu_turn_rad.norm(), 1e-9);
    EXPECT_NEAR(sensors.mocap_late_s - SensorTruth{}.mocap_late_s, by.mocap_late_s, 1e-12);
    EXPECT_NEAR(sensors.imu_late_s - SensorTruth{}.imu_late_s, by.imu_late_s, 1e-12);
    if (std::abs(by.warmer_K) > 1) EXPECT_GT(more * by.warmer_K, 0) << "warm windings resist more";
    thinner -= denser * by.warmer_K;
  }
  EXPECT_GT(thinner, 0) << "warm air is thin";
  EXPECT_NEAR(std::sqrt(density), 0.0079, 0.0013);
  EXPECT_NEAR(std::sqrt(resistance), 0.0071, 0.0012);
}

TEST(FamilyBSession, MovesTheMarkersAndTheSupply) {
  const Assignment a = assignment();
  const auto first = [&](const Case& c) {
    Flight flight(a, c, 0, {0, 0, 1}, 0.5, 0);
    while (flight.ticks() < 60) flight.tick(flight.pilot().trim());
    return flight.log(0.06).mocap;
  };
  Case moved = make_case(a);
  const flightlog::MocapStream before = first(moved);
  moved.sensors.marker_m = {0.3e-3, 0.1e-3, -0.2e-3};
  moved.sensors.marker_turn = turned({1e-3, 0, 1e-3});
  const flightlog::MocapStream after = first(moved);
  EXPECT_NEAR(after.x_m[0] - before.x_m[0], 0.3e-3 * std::cos(0.5) - 0.1e-3 * std::sin(0.5), 3e-5);
  EXPECT_NEAR(after.y_m[0] - before.y_m[0], 0.3e-3 * std::sin(0.5) + 0.1e-3 * std::cos(0.5), 3e-5);
  const Eigen::Quaterniond was(before.qw[0], before.qx[0], before.qy[0], before.qz[0]),
      is(after.qw[0], after.qx[0], after.qy[0], after.qz[0]);
  EXPECT_NEAR(was.angularDistance(is), 1e-3 * std::sqrt(2), 1e-5);

  RobotParameters f = nominal();
  f.full_supply = 0.997;
  Robot robot(f, effect_magnitudes_of({{"battery_sag", 1}}, 3), open_air(), 1, 0);
  EXPECT_EQ(robot.supply(), 0.997);
  robot.drive({0, 0});
  EXPECT_EQ(robot.supply(), 0.997) << "nothing flows yet";
}

TEST(FamilyBSession, LosesPacketsAtItsOwnTimes) {
  Assignment a = assignment({}, 5);  // both early
  const Times brief{0.2, 0.55};
  std::array<double, 2> lost{};
  for (a.session = 0; a.session < 2; ++a.session) {
    const Contrast c = contrast_of(a, 0, "outside_command_dropout", 1, brief);
    std::size_t first = 0;
    while (first < c.change.size() && std::ranges::all_of(c.change[first], [](double x) { return x == 0; })) ++first;
    ASSERT_LT(first, c.change.size());
    lost[a.session] = c.beat_s[first];
    Random random(a.seed, draw_number(0, a.session), Stream::kEffect, kCommandDropout);
    EXPECT_NEAR(lost[a.session], random.uniform(0.3, 1) - brief.trim_s, 0.03);
  }
  EXPECT_GT(std::abs(lost[1] - lost[0]), 0.06);
}

/// Acceleration of the torso in a symmetric state of flapping, angular about x of B (rad/s^2).
double roll(const Assignment& a) {
  const Case c = make_case(a);
  const Plant p(c.parameters, c.effect_magnitudes);
  State x{}, rate;
  x[kPosition + 2] = x[kQuaternion] = 1;
  for (std::size_t j = 0; j < 2; ++j) x[kStrokeRate + j] = 240, x[kRotation + j] = -0.78;
  Felt felt;
  felt.acceleration = {Vector3d::Zero(), Vector3d::Zero()};
  p.rates(x, {0, 0}, p.fresh(), Surroundings{}, nullptr, rate, felt);
  return felt.acceleration.w.x();
}

TEST(FamilyBChanges, SwapTheWingsWithTheirFaults) {
  for (const char* effect : {"wing_damage", "outside_torn_flap"}) {
    // the declared torso is not quite symmetric, which turns a hundredth of the moment into another axis
    Assignment a = assignment({{effect, 2}});
    const double none = roll(assignment()), before = roll(a) - none;
    EXPECT_GT(std::abs(before), 100) << effect;
    a.changes.swapped_wings = true;
    EXPECT_NEAR(roll(a) - none, -before, 0.01 * std::abs(before)) << effect;
  }
  Assignment a = assignment();
  a.own_parameters = true;
  const std::array<Side, 2> own = make_case(a).parameters.side;
  a.changes.swapped_wings = true;
  const std::array<Side, 2> swapped = make_case(a).parameters.side;
  EXPECT_EQ(swapped[0].wing.mass_kg, own[1].wing.mass_kg);
  EXPECT_EQ(swapped[0].wing.com_m.y(), -own[1].wing.com_m.y());
  EXPECT_EQ(swapped[1].edge.inertia_kg_m2(0, 1), -own[0].edge.inertia_kg_m2(0, 1));
  EXPECT_EQ(swapped[0].rotation.lower_rad, own[1].rotation.lower_rad);
  EXPECT_EQ(swapped[1].lift, own[0].lift);
  EXPECT_EQ(swapped[0].motor.resistance_ohm, own[0].motor.resistance_ohm) << "motors stay";
}

TEST(FamilyBEffects, OfTheClockOfMotionCaptureStampFramesAlone) {
  const Times brief{0.1, 0.15};
  const flightlog::MocapStream exact = fly_programme(assignment(), 0, brief).log.mocap;
  const flightlog::FlightLog with = fly_programme(assignment({{"mocap_delay", 1}}), 0, brief).log;
  const double sign = effect_magnitudes_of({}, 3).delay_sign;
  // frames come in the same order; those near both ends may be stamped out of the log
  const auto from = static_cast<std::size_t>(std::ranges::find(exact.x_m, with.mocap.x_m.at(5)) - exact.x_m.begin());
  ASSERT_LT(from, exact.x_m.size());
  EXPECT_NEAR(with.mocap.t_s[5] - exact.t_s[from], sign * clock_late_s(exact.t_s[from], 1), 5e-5)
      << "to latency times rate";
  EXPECT_EQ(with.imu.accel_z_m_s2, fly_programme(assignment(), 0, brief).log.imu.accel_z_m_s2)
      << "the flight is the same";
}

TEST(FamilyBEffects, OfWingInertiaAreTheSameOnBothWings) {
  const RobotParameters none = nominal(), with = plant({{"wing_inertia", 1}}).parameters();
  for (std::size_t j = 0; j < 2; ++j) {
    const Link &was = none.side[j].wing, &is = with.side[j].wing;
    EXPECT_NEAR(std::abs(is.com_m.z() - was.com_m.z()), kWingCom_m, 1e-15);
    EXPECT_EQ(is.com_m.z() - was.com_m.z(), with.side[0].wing.com_m.z() - none.side[0].wing.com_m.z());
    const Matrix3d more = is.inertia_kg_m2 - was.inertia_kg_m2;
    EXPECT_EQ(more.diagonal().norm(), 0) << "moments are kept";
    EXPECT_NEAR(std::abs(more(1, 2)), kWingProduct_kg_m2, 1e-20);
    EXPECT_EQ(std::signbit(more(1, 2)) !=
                  std::signbit((with.side[0].wing.inertia_kg_m2 - none.side[0].wing.inertia_kg_m2)(1, 2)),
              j == 1)
        << "mirror images";
  }
}

TEST(FamilyBChanges, AddAWeightAndTakeEffectsAway) {
  Assignment a = assignment({{"tether", 1}, {"wind", 1}});
  const Link before = make_case(a).parameters.torso;
  a.changes.added_mass_kg = 0.5e-3;
  a.changes.added_at_m = {0.02, 0, -0.01};
  a.changes.without = {"tether"};
  const Case c = make_case(a);
  const Link after = c.parameters.torso;
  EXPECT_NEAR(after.mass_kg, before.mass_kg + 0.5e-3, 1e-15);
  EXPECT_NEAR(after.mass_kg * after.com_m.x(), before.mass_kg * before.com_m.x() + 0.5e-3 * 0.02, 1e-15);
  // about the origin, inertias add
  const auto about_y = [](const Link& l) {
    return l.inertia_kg_m2(1, 1) + l.mass_kg * (l.com_m.x() * l.com_m.x() + l.com_m.z() * l.com_m.z());
  };
  EXPECT_NEAR(about_y(after), about_y(before) + 0.5e-3 * (4e-4 + 1e-4), 1e-15);
  EXPECT_FALSE(c.effect_magnitudes.any(kTether));
  EXPECT_TRUE(c.effect_magnitudes.any(kWind));
  EXPECT_EQ(fly_programme(a, 0, {0.1, 0.15}).log.header.changes, a.changes);
}

TEST(FamilyBCalm, FliesSlowlyWithoutExcitation) {
  Assignment a = assignment();
  a.calm = true;
  for (a.seed = 0; a.seed < 50; ++a.seed)
    for (std::size_t flight = 0; flight < 3; ++flight) {
      const Programme programme(a, flight, nominal(), {});
      double way = 0;
      for (double t = 0; t < 10; t += 0.01) {
        const Target now = programme.target(t), next = programme.target(t + 0.01);
        ASSERT_LT(now.velocity_m_s.norm(), 0.161);
        ASSERT_LT(std::abs(next.heading_rad - now.heading_rad) / 0.01, 0.251);
        ASSERT_TRUE(now.position_m.cwiseAbs().y() < 0.8 && now.position_m.z() > 0.39 && now.position_m.z() < 1.3);
        const Beat more = programme.excitation(t);
        ASSERT_EQ(std::abs(more.amplitude_V) + std::abs(more.bias_V) + std::abs(more.split_cycle), 0);
        ASSERT_EQ(more.difference_V, 0);
        way += 0.01 * now.velocity_m_s.norm();
      }
      if (flight == 0) EXPECT_EQ(way, 0);
      else EXPECT_GT(way, 0.3);
    }
  a.seed = 3, a.hover = true;
  EXPECT_EQ(Programme(a, 1, nominal(), {}).target(9).velocity_m_s.norm(), 0) << "hover stays";
}

TEST(FamilyBCalm, StaysSlow) {
  std::vector<double> fastest(5);
  std::vector<char> crashed(5);
  io::parallel_for(5, 0, [&](std::size_t i) {
    Assignment a = assignment({}, 1 + i);
    a.calm = a.own_parameters = a.conventions = true;
    a.session = i % 3;
    Path path;
    crashed[i] = fly_programme(a, 1 + i % 2, {1.5, 2.5}, &path).crashed;
    constexpr std::size_t kOver = 4000, kFrom = 30000;  // 0.2 s, after the trimming; in steps
    for (std::size_t at = kFrom; at + kOver < path.pose.size(); at += 100) {
      const auto &p = path.pose[at], &q = path.pose[at + kOver];
      fastest[i] = std::max(fastest[i], Vector3d(q[0] - p[0], q[1] - p[1], q[2] - p[2]).norm() / (kOver * kStep_s));
    }
  });
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_FALSE(crashed[i]) << i;
    EXPECT_LT(fastest[i], 0.25) << i;
    EXPECT_GT(fastest[i], 0.05) << i;
  }
}

TEST(FamilyBConventions, AreExactOrWithinBounds) {
  double latest = 0, place = 0, turn = 0, quietest = 9, loudest = 0, clock = 0, rate = 0;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    Assignment a = assignment({}, seed);
    a.power = a.wings = true;
    flightlog::FlightHeader h;
    SensorTruth t = draw_sensors(a, 18, h);
    EXPECT_EQ(t.sample, Sample::kInstant);
    EXPECT_EQ(h.imu.latency_s, t.imu_late_s);
    EXPECT_EQ(h.imu.rate_hz, t.imu_rate_hz);
    EXPECT_EQ(h.imu.gyro_noise_rad_s, t.gyro_noise_rad_s);
    EXPECT_EQ(h.imu.position_m[0], t.imu_place_m.x());
    EXPECT_EQ(h.mocap.latency_s, t.mocap_late_s);
    EXPECT_EQ(t.imu_turn, Matrix3d::Identity());
    EXPECT_EQ(t.imu_clock * t.mocap_clock * t.power_clock, 1);
    a.conventions = true;
    flightlog::FlightHeader drawn;
    t = draw_sensors(a, 18, drawn);
    latest = std::max(latest, std::abs(drawn.imu.latency_s - t.imu_late_s));
    place = std::max(
        place,
        (Vector3d(drawn.imu.position_m[0], drawn.imu.position_m[1], drawn.imu.position_m[2]) - t.imu_place_m).norm());
    turn = std::max(turn, Eigen::AngleAxisd(t.imu_turn).angle());
    for (const double noise :
         {drawn.imu.gyro_noise_rad_s / t.gyro_noise_rad_s, drawn.mocap.position_noise_m / t.position_noise_m})
      quietest = std::min(quietest, noise), loudest = std::max(loudest, noise);
    clock = std::max({clock, t.imu_clock, t.mocap_clock, t.power_clock});
    rate = std::max(rate, std::abs(drawn.imu.rate_hz / t.imu_rate_hz - 1));
    EXPECT_EQ(drawn.imu.bandwidth_hz, h.imu.bandwidth_hz);
  }
  EXPECT_GT(latest, 0.3e-3);
  EXPECT_LE(latest, 0.5e-3);
  EXPECT_GT(place, 2e-3);
  EXPECT_LE(place, 3.01e-3);
  EXPECT_GT(turn, 0.9 * std::numbers::pi / 180);
  EXPECT_LE(turn, std::numbers::pi / 180 + 1e-9);
  EXPECT_LT(quietest, 0.75);
  EXPECT_GE(quietest, 0.7);
  EXPECT_GT(loudest, 1.4);
  EXPECT_LE(loudest, 1.5);
  EXPECT_GT(clock, 1 + 40e-6);
  EXPECT_LE(clock, 1 + 50e-6);
  EXPECT_LE(rate, 0.021);
}

TEST(FamilyBFigures, AreDrawnApartWithinThreeStandardDeviations) {
  const RobotParameters declared = nominal();
  double heaviest = 0, left_right = 0;
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    RobotParameters f = declared;
    draw_parameters(seed, f);
    EXPECT_LE(std::abs(f.torso.mass_kg / declared.torso.mass_kg - 1), 0.09);
    heaviest = std::max(heaviest, std::abs(f.torso.mass_kg / declared.torso.mass_kg - 1));
    EXPECT_LE(std::abs(f.side[0].motor.resistance_ohm / 12.4 - 1), 0.21);
    EXPECT_LE(std::abs(f.side[1].rest_angle_rad), 3 * std::numbers::pi / 180);
    EXPECT_TRUE(is_inertia(f.side[0].wing.inertia_kg_m2));
    left_right += std::abs(f.side[0].lift - f.side[1].lift);
  }
  EXPECT_GT(heaviest, 0.03);
  EXPECT_GT(left_right, 0.5);
}

TEST(FamilyBContrast, SeesWhatActsAlongTheFlight) {
  const Times brief{0.15, 0.2};
  const auto largest = [&](const std::string& effect, double magnitude, std::size_t channel) {
    const Contrast c = contrast_of(assignment(), 0, effect, magnitude, brief);
    EXPECT_GE(c.beat_s.size(), 5U);
    EXPECT_GE(c.beat_s.front(), 0);
    double most = 0;
    for (const auto& beat : c.change)
      for (std::size_t n = 0; n < 5; ++n) most = std::max(most, std::abs(beat[channel * 5 + n]));
    return most;
  };
  EXPECT_EQ(largest("added_mass", 0, 0), 0);
  EXPECT_GT(largest("added_mass", 1, 0), 0.1);
  EXPECT_EQ(largest("mocap_tilt", 1, 2), 0);
  EXPECT_GT(largest("accelerometer_misalignment", 1, 0), 0.01);
  EXPECT_GT(largest("outside_soft_imu_mount", 1, 0), 0.5);
}

EscapeAssignment rules() {
  EscapeAssignment r;
  r.observation = {"goal_rotation", "position_error", "velocity", "body_rate",
                   "beat_phase",    "time",           "trim",     "previous_action"};
  r.policy = [](const std::vector<double>&) { return std::array<double, 4>{}; };
  r.start_m = {0.01, 0, 0};
  r.hand_back_at_s = 0.05;
  r.capture = {0.2, 2, 30, 1, 1};
  r.keep = {0.3, 3, 50, 1.2, 1.5};
  r.capture_by_s = 0.2;
  r.keep_from_s = 0.2;
  r.keep_until_s = 0.4;
  return r;
}

TEST(FamilyBEscape, HandsBackAndCaptures) {
  EscapeAssignment r = rules();
  std::vector<std::vector<double>> seen;
  r.policy = [&](const std::vector<double>& o) {
    seen.push_back(o);
    return std::array<double, 4>{0.1, 0, 0, 0};
  };
  const FamilyEscape flown = fly_escape(assignment(), 0, r, 0.6);
  EXPECT_TRUE(flown.success);
  EXPECT_GT(flown.captured_s, 0);
  ASSERT_EQ(seen.size(), 5U) << "10 ms each until the hand-back";
  ASSERT_EQ(seen[0].size(), 9U + 3 + 3 + 3 + 2 + 1 + 4 + 4);
  EXPECT_NEAR(seen[0][8], 1, 0.05) << "upright";
  EXPECT_NEAR(seen[0][9], 0.01, 0.03) << "behind the goal";
  EXPECT_EQ(seen[1].back(), 0) << "of the split cycle nothing was added";
  EXPECT_EQ(seen[1][25], 0.1) << "the amplitude was";
  r.keep.distance_m = 1e-6;
  EXPECT_FALSE(fly_escape(assignment(), 0, r, 0.6).success);
}

TEST(FamilyBEscape, MayTurnOver) {
  EscapeAssignment r = rules();
  r.policy = [](const std::vector<double>&) { return std::array<double, 4>{0, 3, 3.5, 0}; };
  r.hand_back_at_s = 1;
  r.keep_until_s = 0.3;
  const FamilyEscape flown = fly_escape(assignment(), 0, r, 0.6);
  double least_up = 1;
  for (std::size_t i = 0; i < flown.log.mocap.t_s.size(); ++i)
    least_up = std::min(least_up, 1 - 2 * (std::pow(flown.log.mocap.qx[i], 2) + std::pow(flown.log.mocap.qy[i], 2)));
  EXPECT_LT(least_up, -0.5);
  EXPECT_FALSE(flown.crashed);
}

TEST(FamilyB, RefusesWhatItCannotDo) {
  const std::unique_ptr<Family> family = make_family_b();
  EXPECT_EQ(family->name(), "b");
  const auto line = [&](const Effects& effects) { return test::refusal([&] { family->fly(assignment(effects), 0); }); };
  EXPECT_TRUE(line({{"ground_efect", 1}}).ends_with("; did you mean \"ground_effect\"?"))
      << line({{"ground_efect", 1}});
  EXPECT_EQ(line({{"wind", 4.5}}), "effect wind: magnitude 4.5 is out of range; accepted: from 0 to 4");
  EXPECT_EQ(line({{"wind", -1}}), "effect wind: magnitude -1 is out of range; accepted: from 0 to 4");
  EXPECT_NE(line({{"wind", std::numeric_limits<double>::quiet_NaN()}}), "accepted");
  EXPECT_EQ(line({{"wind", 1}, {"wind", 1}}), "effect wind: named twice; accepted: each once");
  EXPECT_EQ(test::refusal([&] { family->fly(assignment(), 3); }),
            "flight 3: there is none of this number; accepted: 0, 1 and 2");
  EXPECT_NE(test::refusal([&] { family->contrast(assignment({{"wind", 1}}), 0, "wind", 1); }), "accepted");
  EscapeAssignment r = rules();
  r.observation = {"velocty"};
  EXPECT_TRUE(test::refusal([&] { family->escape(assignment(), 0, r); }).ends_with("did you mean \"velocity\"?"));
  Assignment gone = assignment();
  gone.vehicle_file = "no_such_vehicle.toml";
  EXPECT_NE(test::refusal([&] { family->fly(gone, 0); }).find("no_such_vehicle.toml"), std::string::npos);
}

}  // namespace
}  // namespace flappy::blind::b
