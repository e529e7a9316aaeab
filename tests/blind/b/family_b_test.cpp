#include "blind/b/family_b.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "blind/b/contrast.hpp"
#include "blind/b/escape.hpp"
#include "blind/b/family_b_tests.hpp"
#include "blind/b/flight.hpp"
#include "flightlog/flight_log.hpp"
#include "io/parallel.hpp"
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
  EXPECT_NEAR(more("ground_effect", 1.9), 0, 1e-9);
  EXPECT_GT(more("ceiling_effect", 1.95), 0.05);
  EXPECT_NEAR(more("ceiling_effect", 0.1), 0, 1e-9);
}

TEST(FamilyBEffects, DrawToTheWall) {
  const auto to_wall = [](double y) {
    return felt_at({{"wall_effect", 1}}, {0, y, 1}).acceleration.v.y() - felt_at({}, {0, y, 1}).acceleration.v.y();
  };
  EXPECT_GT(to_wall(0.89), 0.1);
  EXPECT_GT(to_wall(0.89), 3 * std::abs(to_wall(0.75)));
  EXPECT_NEAR(to_wall(-1), 0, 1e-6);
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
  EXPECT_NEAR(plant({{"wing_damage", 1}}).wing(side).area_m2() / plant().wing(side).area_m2(), 0.95, 1e-6);
  EXPECT_NEAR(plant({{"wing_damage", 1}}).wing(1 - side).area_m2() / plant().wing(1 - side).area_m2(), 1, 1e-12);
  EXPECT_NEAR(plant().wing(0).area_m2(), 0.07 * 0.021212121212121, 1e-12) << "the file's area";
  EXPECT_GT(plant({{"added_mass", 1}}).wing(0).added().trace(), 0);
  EXPECT_EQ(plant().wing(0).added().norm(), 0);

  // less stroke, so less thrust
  const RobotParameters f = nominal();
  const double thrust = held(f, {10, 0, 0, 0}).f.z();
  for (const char* effect : {"coulomb_friction", "driver_dead_zone", "outside_common_supply"})
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
  EXPECT_EQ(all[kCommonSupply].id, "outside_common_supply");
  const std::vector<std::string> channels = {"force_x",  "force_y", "force_z",       "torque_x", "torque_y",
                                             "torque_z", "gyro",    "accelerometer", "mocap",    "current"};
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
