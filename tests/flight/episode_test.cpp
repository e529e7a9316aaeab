// The course of an episode: reward, ends, hand-back, actions and observation, by formulas of the test's own and in fleets.
#include "flight/episode.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <chrono>
#include <cmath>
#include <cstring>
#include <map>
#include <random>

#include "flight/fleets.hpp"
#include "refusal.hpp"

namespace flappy::flight::episode_test {
namespace {

using V = model::Vec3<double>;

struct Sample {
  Truth<double> truth;
  Setpoint<double> ref;
  Episode<double> episode;
  Eigen::Matrix3d relative;  // attitude seen from the set point's heading
};

Sample random_sample(std::mt19937& engine) {
  std::normal_distribution<double> normal;
  const auto vector = [&](double size) {
    return V{size * normal(engine), size * normal(engine), size * normal(engine)};
  };
  Sample s;
  const Eigen::Quaterniond q =
      Eigen::Quaterniond(normal(engine), normal(engine), normal(engine), normal(engine)).normalized();
  const double heading = 3 * normal(engine);
  s.truth = {vector(0.5), {q.w(), q.x(), q.y(), q.z()}, vector(1), vector(10)};
  s.ref = {vector(0.5), vector(1), vector(1), {std::sin(heading), std::cos(heading)}, normal(engine)};
  s.episode = {};
  for (int i = 0; i < kMaxActions; ++i) {
    s.episode.action[i] = std::tanh(normal(engine)), s.episode.previous[i] = std::tanh(normal(engine));
    s.episode.added[i] = normal(engine);
  }
  s.relative = Eigen::AngleAxisd(-heading, Eigen::Vector3d::UnitZ()).toRotationMatrix() * q.toRotationMatrix();
  return s;
}

TEST(Reward, IsItsFormula) {
  std::mt19937 engine(2);
  std::uniform_real_distribution<double> weight(-2, 2);
  for (int i = 0; i < 300; ++i) {
    const Sample s = random_sample(engine);
    Reward<double> k{};
    for (double* w = &k.action; w <= &k.near_1_m; ++w) *w = weight(engine);
    if (i % 3 == 0)
      k.action = k.action_change = k.position = k.angles = k.velocity = k.body_rate = 0;  // C = 0: 1/1e-6 is the most
    const Eigen::Matrix3d& R = s.relative;
    const double dx = s.truth.position_m.x - s.ref.position_m.x, dy = s.truth.position_m.y - s.ref.position_m.y,
                 dz = s.truth.position_m.z - s.ref.position_m.z;
    const double vx = s.truth.velocity_m_s.x - s.ref.velocity_m_s.x, vy = s.truth.velocity_m_s.y - s.ref.velocity_m_s.y,
                 vz = s.truth.velocity_m_s.z - s.ref.velocity_m_s.z;
    const V& w = s.truth.body_rate_rad_s;
    double effort = 0, change = 0;
    for (int n = 0; n < 4; ++n)
      effort += std::pow(s.episode.action[n], 2), change += std::pow(s.episode.action[n] - s.episode.previous[n], 2);
    const double roll = std::atan2(R(2, 1), R(2, 2)), pitch = std::asin(-R(2, 0)), yaw = std::atan2(R(1, 0), R(0, 0));
    const double c = effort * k.action + change * k.action_change +
                     std::sqrt(dx * dx + dy * dy + dz * dz) * k.position +
                     std::sqrt(roll * roll + pitch * pitch + yaw * yaw) * k.angles +
                     std::sqrt(vx * vx + vy * vy + vz * vz) * k.velocity +
                     std::sqrt(w.x * w.x + w.y * w.y + w.z * w.z) * k.body_rate;
    const double expected = k.inverse_square / (c * c + 1e-6) - k.cost * c + k.facing * R(0, 0) +
                            k.upright * std::min(0.0, R(2, 2)) + k.behind * std::min(0.0, dx + k.behind_m) + k.alive +
                            k.level * R(2, 2) + k.near / (1 + std::pow(k.near_1_m, 2) * (dx * dx + dy * dy + dz * dz));
    const Score<double> score = score_of(s.truth, s.ref);
    EXPECT_NEAR(score.roll_rad, roll, 1e-12);
    EXPECT_NEAR(score.pitch_rad, pitch, 1e-9);  // asin near its end
    EXPECT_NEAR(score.yaw_rad, yaw, 1e-12);
    EXPECT_NEAR(score.facing, R(0, 0), 1e-13);
    EXPECT_NEAR(score.upright, R(2, 2), 1e-13);
    // a difference of 1e-12 in C, where the terms cancel to a small one, comes out 1e12 x larger in 1/(C^2 + 1e-6) at most
    EXPECT_NEAR(running_reward(k, score, s.truth, s.episode), expected,
                1e-9 * (1 + std::abs(expected)) + 1e-12 * std::abs(2 * c) / std::pow(c * c + 1e-6, 2));
  }
}

TEST(Reward, ClosenessFallsOffWithEveryError) {
  std::mt19937 engine(3);
  std::uniform_real_distribution<double> weight(0.1, 3);
  for (int i = 0; i < 300; ++i) {
    const Sample s = random_sample(engine);
    Reward<double> k{};
    for (double* w = &k.goal_1_m; w <= &k.goal_1_heading; ++w) *w = weight(engine);
    const Score<double> score = score_of(s.truth, s.ref);
    const Eigen::Matrix3d& R = s.relative;
    const auto norm = [](const V& v) { return std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z); };
    const double errors[] = {k.goal_1_m * norm(score.position_m), k.goal_s_m * norm(score.velocity_m_s),
                             k.goal_s_rad * norm(s.truth.body_rate_rad_s), k.goal_1_tilt * std::acos(R(2, 2)),
                             k.goal_1_heading * std::atan2(R(1, 0), R(0, 0))};
    double expected = 1;
    for (const double x : errors) expected /= 1 + x * x;
    EXPECT_NEAR(closeness(k, score, s.truth), expected, 1e-10 * expected);  // acos near its ends
  }
}

TEST(Reward, PaysArrivalOnceAndAfterTheHandBackOnlyWhoCaptured) {
  std::mt19937 engine(4);
  const Sample s = random_sample(engine);
  const Score<double> score = score_of(s.truth, s.ref);
  Reward<double> k{};
  k.alive = 0.3, k.goal = 0.7, k.arrival = 11, k.kept = 5, k.goal_1_m = 1;
  const double G = closeness(k, score, s.truth), tick_s = 0.002;
  for (const double until_s : {0.0, 0.5})
    for (int bits = 0; bits < 32; ++bits) {
      const bool done = bits & 1, handed_back = bits & 2, captured = bits & 4, lost = bits & 8, then = bits & 16;
      Episode<double> e{};
      e.handed_back = handed_back, e.captured_s = captured ? 0.2 : 0, e.lost_s = lost ? 0.3 : 0;
      k.until_s = until_s;
      double expected = 0.3 + (0.7 + (done && !handed_back ? 11 : 0)) * G;
      if (until_s > 0 && then && captured && !lost) expected += 5;
      if (until_s > 0 && handed_back && !captured) expected = 0;
      for (const double time_s : {then ? 0.501 : 0.499, then ? 0.5011 : 0.503})
        EXPECT_NEAR(reward_of(k, score, s.truth, time_s, tick_s, done, e), expected, 1e-14) << bits << " " << until_s;
    }
}

TEST(Reward, SeesHowTheActionChanges) {
  std::string text = staying("kind = \"standing\"");
  text.replace(text.find("alive = 1.0\nposition_1_m = 2.0"), 30, "cost = 1.0\naction_change = 1.0");
  FleetOptions o = fleet_options(sensors("paper"), {}, task(text));
  o.batch.world.ground_z_m = 0;
  Fleet<double> fleet(1, test::nominal(), o);
  const double expected[4] = {-0.5, 0, -0.25, 0};
  for (int period = 0; period < 4; ++period) {
    if (period == 0) set_action(fleet, 0, std::array{0.5, 0.0, -0.5, 0.0});
    if (period == 2) set_action(fleet, 0, std::array{0.0, 0.0, -0.5, 0.0});
    fleet.step();
    EXPECT_NEAR(fleet.reward(0), expected[period], 1e-12) << period;
  }
}

/// Bits of the ends at a position relative to the set point, 1 s into the episode unless told.
std::uint32_t ends(const Limits<double>& k, const V& p, double facing = 1, double time_s = 1) {
  Score<double> s{};
  s.position_m = p, s.facing = facing, s.upright = 1;
  std::uint32_t bits = 0;
  check_termination(k, s, time_s, [&](bool mask, std::uint32_t bit) { bits |= mask ? bit : 0; });
  return bits;
}

TEST(Ends, EachLimitEndsTheEpisodeByItsOwnBit) {
  const Limits<double> k{10, -0.2, 0.3, 0.4, 0.5, 0.55, 2, 3, -0.1};
  EXPECT_EQ(ends(k, {0, 0, 0}), 0u);
  for (const V& p : {V{-0.21, 0, 0}, V{0.31, 0, 0}, V{0, 0.41, 0}, V{0, -0.41, 0}, V{0, 0, 0.51}, V{0, 0, -0.51},
                     V{0.25, 0.35, 0.36}})
    EXPECT_EQ(ends(k, p), kOutOfBounds) << p.x << " " << p.y << " " << p.z;
  for (const V& p : {V{-0.19, 0, 0}, V{0.29, 0, 0}, V{0, 0.39, 0}, V{0, -0.39, 0}, V{0, 0, 0.49}, V{0, 0, -0.49},
                     V{0.25, 0.34, 0.34}})
    EXPECT_EQ(ends(k, p), 0u) << p.x << " " << p.y << " " << p.z;
  EXPECT_EQ(ends(k, {0, 0, 0}, -0.1, 1.99), 0u);
  EXPECT_EQ(ends(k, {0, 0, 0}, -0.1, 2.01), kHeadingLate);
  EXPECT_EQ(ends(k, {0, 0, 0}, 0.1, 2.01), 0u);
  EXPECT_EQ(ends(k, {-0.11, 0, 0}, 1, 2.99), 0u);
  EXPECT_EQ(ends(k, {-0.11, 0, 0}, 1, 3.01), kArrivalLate);
  EXPECT_EQ(ends(k, {0, 0, 0}, 1, 9.999), 0u);
  EXPECT_EQ(ends(k, {0, 0, 0}, 1, 10), kTimeOut);
  EXPECT_EQ(ends(k, {1, 0, 0}, -1, 11), kTimeOut | kOutOfBounds | kHeadingLate);
}

std::string with_end(const std::string& text, const std::string& end) {
  return text.substr(0, text.find("[end]")) + "[end]\n" + end;
}

TEST(Ends, TimeOutComesAtItsTickAndIsTheOnlyBit) {
  for (const double control_hz : {500.0, 400.0, 625.0, 200.0, 1000.0})
    for (const double time_s : {0.1, 0.105, 0.7, 1.3}) {
      FleetOptions o = fleet_options(
          sensors("paper"), {},
          task(with_end(staying("kind = \"standing\""), "time_s = " + std::to_string(time_s)), 1 / control_hz));
      o.control_hz = control_hz;
      o.batch.step_s = 1e-4;
      o.batch.world.ground_z_m = 0;
      Fleet<float> f(1, test::nominal(), o);
      Fleet<double> d(1, test::nominal(), o);
      const int last = static_cast<int>(std::ceil(time_s * control_hz - 1e-6));
      for (int tick = 1; tick <= last + 1; ++tick) {
        f.step(), d.step();
        ASSERT_EQ(f.ended(0), tick >= last ? kTimeOut : 0u) << time_s << " s at " << control_hz << " Hz, tick " << tick;
        ASSERT_EQ(d.ended(0), f.ended(0));
        ASSERT_EQ(f.tick(0), static_cast<std::uint32_t>(tick));
      }
      f.start(0, 1);
      EXPECT_EQ(f.ended(0), 0u);
      EXPECT_EQ(f.tick(0), 0u);
    }
}

TEST(Ends, ContactAndImplausibleFlightsEndByTheirOwnBits) {
  const std::string text = staying();
  const FleetOptions o = [&] {
    FleetOptions all = fleet_options(sensors("paper"), {}, task(with_end(text, "time_s = 10.0\ncontact = true")));
    all.batch.world.ground_z_m = -0.02;
    all.batch.world.walls = {{1, 0, -1, 0}};
    return all;
  }();
  Fleet<float> fleet(4, test::nominal(), o);
  sim::FlapperState s;
  s.position_m[0] = 0.95;
  fleet.start(1, 0, s, sim::Start::flying);  // at the wall
  s = {};
  s.velocity_m_s[2] = 200;
  fleet.start(2, 0, s, sim::Start::flying);
  s = {};
  s.position_m[2] = 5;
  fleet.start(3, 0, s, sim::Start::flying);
  fleet.step();
  EXPECT_EQ(fleet.ended(0), 0u);
  EXPECT_EQ(fleet.ended(1), kContact);
  EXPECT_EQ(fleet.ended(2), kNotFinite);
  for (int period = 0; period < 40; ++period) fleet.step();  // falls 2 cm in 64 ms
  EXPECT_EQ(fleet.ended(0), kContact);
  EXPECT_EQ(fleet.ended(3), 0u);
  for (std::size_t i = 0; i < 4; ++i)
    for (const double x : fleet.observation(i)) EXPECT_TRUE(std::isfinite(x));

  FleetOptions careless = o;
  careless.task = task(with_end(text, "time_s = 10.0\ncontact = false"));
  Fleet<float> falling(1, test::nominal(), careless);
  for (int period = 0; period < 40; ++period) falling.step();
  EXPECT_EQ(falling.ended(0), 0u);
}

TEST(HandBack, NeedsEveryConditionAndLatches) {
  const HandBack<double> k{1, 0, -0.1, 0.3, 0.5, 0.8, std::cos(0.4), std::cos(0.3), 2, 0.35};
  const double early = 0.1;
  Truth<double> t{{0, 0, 0}, {1, 0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
  Score<double> good{};
  good.heading_cos = good.upright = 1;
  const auto changed = [&](const auto& change) {
    Score<double> s = good;
    change(s);
    return arrived(k, s, t.body_rate_rad_s, early);
  };
  EXPECT_TRUE(arrived(k, good, t.body_rate_rad_s, early));
  EXPECT_TRUE(changed([](Score<double>& s) { s.position_m = {-0.09, 0.2, 0.2}; }));
  EXPECT_FALSE(changed([](Score<double>& s) { s.position_m = {-0.11, 0, 0}; }));
  EXPECT_FALSE(changed([](Score<double>& s) { s.position_m = {0, 0.25, 0.25}; }));
  EXPECT_FALSE(changed([](Score<double>& s) { s.velocity_m_s = {-0.51, 0, 0}; }));
  EXPECT_FALSE(changed([](Score<double>& s) { s.velocity_m_s = {0, 0, 0.81}; }));
  EXPECT_FALSE(changed([](Score<double>& s) { s.heading_cos = std::cos(0.41); }));
  EXPECT_FALSE(changed([](Score<double>& s) { s.upright = std::cos(0.31); }));
  t.body_rate_rad_s = {1.5, 1.5, 0};
  EXPECT_FALSE(arrived(k, good, t.body_rate_rad_s, early));
  t.body_rate_rad_s = {0, 0, 0};
  HandBack<double> off = k;
  off.enabled = 0;
  EXPECT_FALSE(arrived(off, good, t.body_rate_rad_s, early));
  EXPECT_TRUE(arrived(k, Score<double>{}, t.body_rate_rad_s, 0.35));  // done or not: it is time

  // it falls through the place where it is handed back, and stays handed back below
  Task task_back = task(staying() + "[hand_back]\ndistance_m = 0.05\n");
  Fleet<float> fleet(2, test::nominal(), fleet_options(sensors("paper"), {}, task_back));
  sim::FlapperState s;
  s.position_m[2] = 0.1;
  fleet.start(0, 0, s, sim::Start::flying);
  s.position_m[2] = -0.1;
  fleet.start(1, 0, s, sim::Start::flying);
  for (std::size_t i = 0; i < 2; ++i) set_action(fleet, i, std::array{1.0F, 1.0F, 1.0F, 1.0F});
  bool was = false;
  for (int period = 0; period < 200; ++period) {
    const bool before = fleet.handed_back(0);
    fleet.step();
    EXPECT_GE(fleet.handed_back(0), before);
    EXPECT_FALSE(fleet.handed_back(1));
    // whoever was handed back before the period flies without the policy
    EXPECT_EQ(fleet.input(0).bias_V, before ? 0 : 3.5);
    EXPECT_EQ(fleet.input(1).bias_V, 3.5);
    was = was || fleet.handed_back(0);
  }
  EXPECT_TRUE(was);
  EXPECT_LT(fleet.truth(0).position_m[2], -0.05);
  EXPECT_TRUE(fleet.handed_back(0));
  fleet.start(0, 1, s, sim::Start::flying);
  EXPECT_FALSE(fleet.handed_back(0));
}

TEST(Action, SpansItsRangeAboutTheMiddleAndIsClipped) {
  std::string text = staying();
  text.replace(text.find("amplitude_V = [-5.0, 5.0]"), 25, "amplitude_V = [-1.0, 3.0]");
  Fleet<double> fleet(1, test::nominal(), fleet_options(sensors("paper"), {}, task(text)));
  const auto amplitude = [&](double a) {
    set_action(fleet, 0, std::array{a, a, a, a});
    fleet.step();
    EXPECT_NEAR(fleet.input(0).split_cycle, 0.15 * std::min(1.0, std::max(-1.0, a)) + 0.01, 1e-12);
    return fleet.input(0).amplitude_V;
  };
  fleet.set_added(0, {0.5, 0, 0, 0.01});
  EXPECT_NEAR(amplitude(0), 1.5, 1e-12);
  EXPECT_NEAR(amplitude(1), 3.5, 1e-12);
  EXPECT_NEAR(amplitude(-1), -0.5, 1e-12);
  EXPECT_NEAR(amplitude(0.5), 2.5, 1e-12);
  EXPECT_NEAR(amplitude(7), 3.5, 1e-12);
  const std::vector<Signal> signals = fleet.options().task.action();
  ASSERT_EQ(signals.size(), 4u);
  EXPECT_EQ(signals[0].name, "amplitude");
  EXPECT_EQ(signals[0].low, -1);
  EXPECT_EQ(signals[0].high, 3);
}

TEST(Observation, RowsAreWhatTheirNamesSay) {
  const std::string parts =
      "\"previous_action\", \"rotation_matrix\", \"beat_phase\", \"position_error\", \"velocity\", \"heading_error\", "
      "\"body_rate\"";
  const Task t = task(along(waypoint(0, 0, 0, 0, 0.3) + waypoint(1, 0.4, 0.1, 0.2, 1), "kind = \"flying\"", parts));
  Fleet<double> fleet(3, test::nominal(), fleet_options(sensors("paper"), controller("pid"), t));
  std::vector<std::string> names;
  for (const Signal& s : t.observation()) names.push_back(s.name);
  ASSERT_EQ(names.size(), 9u + 3 + 3 + 3 + 2 + 2 + 4);
  for (int period = 0; period < 100; ++period) {
    for (std::size_t i = 0; i < 3; ++i) {
      const Motion e = fleet.estimate(i);
      const Target ref = fleet.target(i);
      const Eigen::Matrix3d R =
          Eigen::Quaterniond(e.attitude[0], e.attitude[1], e.attitude[2], e.attitude[3]).toRotationMatrix();
      const double heading = std::atan2(R(1, 0), R(0, 0)) - std::atan2(ref.heading_sin, ref.heading_cos);
      const double beats = 34.0 * 0.002 * period;
      std::map<std::string, double> expected = {{"beat_sin", std::sin(2 * M_PI * beats)},
                                                {"beat_cos", std::cos(2 * M_PI * beats)},
                                                {"heading_sin", std::sin(heading)},
                                                {"heading_cos", std::cos(heading)}};
      const char* axes = "xyz";
      const char* turns[3] = {"roll_rate", "pitch_rate", "yaw_rate"};
      for (int a = 0; a < 3; ++a) {
        for (int b = 0; b < 3; ++b) expected[std::string("R_") + axes[a] + axes[b]] = R(a, b);
        expected[std::string(1, axes[a]) + "_error"] = e.position_m[a] - ref.position_m[a];
        expected[std::string(1, axes[a]) + "_velocity"] = e.velocity_m_s[a] - ref.velocity_m_s[a];
        expected[turns[a]] = e.body_rate_rad_s[a];
      }
      const char* inputs[4] = {"amplitude", "difference", "bias", "split_cycle"};
      for (int k = 0; k < 4; ++k)
        expected["added_" + std::string(inputs[k])] =
            t.constants.action_low[k] + (t.constants.action_high[k] - t.constants.action_low[k]) / 2 *
                                            (1 + (period > 0 ? 0.01 * (period - 1) - 0.1 * k : 0));
      const std::vector<double> row = fleet.observation(i);
      ASSERT_EQ(row.size(), names.size());
      for (std::size_t k = 0; k < names.size(); ++k)
        ASSERT_NEAR(row[k], expected.at(names[k]), 2e-7)  // phase: half of 2^-32 turns each update
            << names[k] << ", period " << period;
    }
    for (std::size_t i = 0; i < 3; ++i)
      set_action(fleet, i, std::array{0.01 * period, 0.01 * period - 0.1, 0.01 * period - 0.2, 0.01 * period - 0.3});
    fleet.step();
  }
}

/// A batch that is given the voltages by hand flies the same; what is seen of the wings is where they are.
template <class T>
void fly_by_voltages() {
  const Task t = task(voltages_task("\"previous_action\", \"wings\", \"body_rate\""));
  const Sensors in_step =
      sensors("paper", {"imu.rate_hz=500.0", "mocap.rate_hz=500.0"});  // physics is cut by no sample
  Fleet<T> fleet(3, test::nominal(), fleet_options(in_step, {}, t));
  sim::Batch<T> by_hand(3, test::nominal(), fleet.options().batch);
  std::vector<std::string> names;
  for (const Signal& s : t.observation()) names.push_back(s.name);
  EXPECT_EQ(names, (std::vector<std::string>{"roll_rate", "pitch_rate", "yaw_rate", "previous_left_voltage",
                                             "previous_right_voltage", "left_stroke", "right_stroke",
                                             "left_stroke_rate", "right_stroke_rate"}));
  ASSERT_EQ(t.action().size(), 2u);
  EXPECT_EQ(t.action()[0].name, "left_voltage");
  EXPECT_EQ(t.action()[1].unit, "V");
  EXPECT_EQ(t.action()[0].low, -20);
  for (std::size_t i = 0; i < 3; ++i) by_hand.reset(i, {});
  for (int period = 0; period < 60; ++period) {
    for (std::size_t i = 0; i < 3; ++i) {
      const double a = 0.9 * std::sin(0.43 * period + static_cast<double>(i)), b = i == 2 ? -1.3 : 0.8 * a;
      set_action(fleet, i, std::array{static_cast<T>(a), static_cast<T>(b)});
      const auto adds = fleet.adds(i);
      EXPECT_NEAR(adds[0], -1 + 19 * a, 1e-5);
      EXPECT_NEAR(adds[1], 17 * std::max(b, -1.0), 1e-5);
      EXPECT_EQ(adds[2], 0);
      EXPECT_EQ(fleet.action(i)[3], 0);
      by_hand.set_voltages(i, adds[0], adds[1]);
    }
    fleet.step();
    by_hand.step(8);
    for (std::size_t i = 0; i < 3; ++i) {
      const sim::FlapperState x = fleet.batch().state(i), y = by_hand.state(i);
      ASSERT_EQ(std::memcmp(&x, &y, sizeof x), 0) << period;
      EXPECT_EQ(fleet.input(i).amplitude_V, 0);
      const std::vector<double> seen = fleet.observation(i);
      ASSERT_EQ(seen.size(), names.size());
      EXPECT_EQ(seen[3], fleet.adds(i)[0]);
      for (std::size_t side = 0; side < 2; ++side) {
        EXPECT_EQ(seen[5 + side], x.stroke_rad[side]);
        EXPECT_EQ(seen[7 + side], x.stroke_rate_rad_s[side]);
      }
    }
  }
  EXPECT_GT(std::abs(by_hand.state(0).stroke_rad[0]), 0.1);
  // as a snapshot has it, it flies on
  const auto voltages = fleet.adds(0);
  const auto before = fleet.batch().state(0);
  fleet.start(1, 5, fleet.snapshot(0));
  EXPECT_EQ(fleet.batch().state(1).stroke_rate_rad_s[1], before.stroke_rate_rad_s[1]);
  EXPECT_EQ(fleet.observation(1)[7], fleet.observation(0)[7]);
  EXPECT_EQ(fleet.adds(1)[0], -1);  // its own action is the middle of the range until it acts
  EXPECT_NE(fleet.adds(0)[0], -1);
  EXPECT_EQ(fleet.adds(0), voltages);
}
TEST(Voltages, OfAPolicyReachTheMotors) {
  fly_by_voltages<float>();
  fly_by_voltages<double>();
}

TEST(Voltages, AreScoredAsTheirActionsAre) {
  Task t = task(voltages_task());
  t.constants.reward.action = 1, t.constants.reward.action_change = 10, t.constants.reward.cost = 1;
  t.constants.reward.alive = t.constants.reward.position = 0;
  t.constants.contact_ends = 1;
  Fleet<double> fleet(1, test::nominal(), fleet_options(sensors("paper"), {}, t));
  set_action(fleet, 0, std::array{0.5, -0.25});
  fleet.step();
  EXPECT_NEAR(fleet.reward(0), -11 * (0.25 + 0.0625), 1e-12);
  fleet.step();
  EXPECT_NEAR(fleet.reward(0), -(0.25 + 0.0625), 1e-12);
  EXPECT_EQ(fleet.ended(0), 0u) << "that its voltages are set is no contact";
}

TEST(Voltages, HaveNoControllerBesideThem) {
  const auto o = fleet_options(sensors("paper"), {}, task(voltages_task()));
  Fleet<float> fleet(1, test::nominal(), o);
  EXPECT_THROW(fleet.set_adds(0, std::array{0.0, 0.0, 0.0, 0.0}), std::invalid_argument);
  EXPECT_THROW(fleet.set_adds(0, std::array{0.0}), std::invalid_argument);
  EXPECT_THROW(fleet.set_added(0, {1, 0, 0, 0}), std::invalid_argument);
  fleet.set_added(0, {});
  FleetOptions led = o;
  led.controller = controller("pid");
  EXPECT_THROW(Fleet<float>(1, test::nominal(), led), std::invalid_argument);

  const auto refused = [](const std::string& text) { return test::refusal([&] { task(text); }); };
  EXPECT_EQ(refused(voltages_task()), "accepted");
  const auto with = [&](const std::string& line) { return refused(voltages_task().insert(0, line + "\n")); };
  EXPECT_EQ(with("base = \"trim\""),
            "task.toml:1:8: base: is \"trim\", but an action of kind \"voltages\" has no controller; accepted: "
            "no base, or \"controller\"");
  EXPECT_EQ(with("hand_back = {at_s = 1.0}"),
            "task.toml:1:13: hand_back: is given, but an action of kind \"voltages\" has no controller; "
            "accepted: a task without it");
  EXPECT_NE(refused(voltages_task("\"wings\"", "kind = \"settled\"")).find("start.kind: is \"settled\", but"),
            std::string::npos);
  for (const char* part : {"trim", "beat_phase"})
    EXPECT_NE(refused(voltages_task("\"" + std::string(part) + "\""))
                  .find("observation: " + std::string(part) + " belongs to a controller or a wing beat"),
              std::string::npos);
  const auto replaced = [&](const std::string& from, const std::string& to) {
    std::string text = voltages_task();
    return refused(text.replace(text.find(from), from.size(), to));
  };
  EXPECT_NE(
      replaced("[reward]\n", "[reward]\nkept = 2.0\n").find("reward.kept: is never paid without until_s; accepted"),
      std::string::npos);
  EXPECT_NE(replaced("kind = \"voltages\"\nleft_V", "kind = \"volts\"\nleft_V")
                .find("action.kind: \"volts\" is not known; accepted: \"wing_beat\", \"voltages\""),
            std::string::npos);
  EXPECT_NE(
      replaced("left_V = [-20.0, 18.0]", "left_V = [1.0, -1.0]").find("action.left_V: is no range; accepted: [low"),
      std::string::npos);
  EXPECT_NE(replaced("left_V = [-20.0, 18.0]", "bias_V = [-1.0, 1.0]").find("action.left_V: "), std::string::npos);
  EXPECT_EQ(
      test::refusal([&] {
        task(along(
            waypoint(0, 0, 0, 0), "kind = \"flying\"",
            "\"rotation_matrix\", \"position_error\", \"velocity\", \"body_rate\", \"beat_phase\", \"heading_error\", "
            "\"previous_action\", \"goal_rotation\", \"time\", \"trim\", \"wings\""));
      }),
      "task.toml:3:15: observation: has 44 numbers; accepted: parts of at most 40");
  EXPECT_NE(replaced("right_V = [", "bias_V = [-1.0, 1.0]\nright_V = [").find("action.bias_V: unknown key"),
            std::string::npos);
}

TEST(Starts, FallWithinTheirRangesAndDependOnTheirKeyAlone) {
  const Task t = task(staying(
      "kind = \"flying\"\nx_high_m = 1.1\n[start.position_m]\nx = 1.0\nx_half = 0.2\nz = 2.0\n[start.rotation_rad]\n"
      "z = 3.0\nz_half = 0.5\n[start.velocity_m_s]\ny_half = 0.3\n[start.body_rate_rad_s]\nx = -1.0"));
  Fleet<float> fleet(64, test::nominal(), fleet_options(sensors("paper"), {}, t));
  double least = 9, most = 0, mean_turn = 0;
  for (std::size_t i = 0; i < 64; ++i) {
    const Motion m = fleet.truth(i);
    least = std::min(least, m.position_m[0]), most = std::max(most, m.position_m[0]);
    EXPECT_NEAR(m.position_m[2], 2, 1e-6);
    EXPECT_LE(std::abs(m.velocity_m_s[1]), 0.3);
    EXPECT_NEAR(m.body_rate_rad_s[0], -1, 1e-6);
    const double turn = 2 * std::atan2(m.attitude[3], m.attitude[0]);
    EXPECT_LE(std::abs(turn - 3), 0.5 + 1e-5);
    EXPECT_NEAR(std::hypot(m.attitude[0], m.attitude[3]), 1, 1e-6);
    mean_turn += turn / 64;
  }
  EXPECT_GE(least, 0.8 - 1e-6);
  EXPECT_LT(least, 0.85);
  EXPECT_NEAR(most, 1.1, 1e-6);  // a quarter of them
  EXPECT_NEAR(mean_turn, 3, 4.5 * 0.5 / std::sqrt(3 * 64));
  const Motion first = fleet.truth(5);
  fleet.start(5, 1);
  EXPECT_NE(fleet.truth(5).velocity_m_s[1], first.velocity_m_s[1]);
  fleet.start(5, 0);
  EXPECT_EQ(fleet.truth(5).velocity_m_s[1], first.velocity_m_s[1]);
}

TEST(Fleet, MayBeEmptyAndRefusesWhatMakesNoSense) {
  const FleetOptions o = fleet_options(sensors("paper"), controller("pid"), task(staying()));
  Fleet<float> none(0, test::nominal(), o);
  none.step();
  EXPECT_EQ(none.size(), 0u);
  EXPECT_THROW(none.truth(0), std::out_of_range);
  EXPECT_THROW(none.start(0, 0), std::out_of_range);
  FleetOptions bad = o;
  bad.control_hz = 300;
  EXPECT_THROW(Fleet<float>(1, test::nominal(), bad), std::invalid_argument);
  bad = o;
  bad.task.path.clear();
  EXPECT_THROW(Fleet<float>(1, test::nominal(), bad), std::invalid_argument);
  bad = o;
  bad.sensors.imu.rate_hz = 20000;
  EXPECT_THROW(Fleet<float>(1, test::nominal(), bad), std::invalid_argument);

  Fleet<float> one(1, test::nominal(), o);
  EXPECT_TRUE(one.imu_samples(0).empty());  // nobody recorded
  one.step();
  EXPECT_TRUE(one.imu_samples(0).empty());
  one.record(true);
  EXPECT_TRUE(one.imu_samples(0).empty());
  one.step();
  EXPECT_EQ(one.imu_samples(0).size(), 1u);
  EXPECT_THROW(one.imu_samples(1), std::out_of_range);
  EXPECT_THROW(one.mocap_samples(1), std::out_of_range);
  one.record(false);
  EXPECT_TRUE(one.imu_samples(0).empty());
}

TEST(Fleet, FitsItsBudget) {
  for (const char* name : {"paper", "code"}) {
    const Fleet<float> fleet(1, test::nominal(), fleet_options(sensors(name), controller("arc"), task(staying())));
    const std::size_t bytes = fleet.bytes_per_flapper() + sim::Batch<float>::bytes_per_flapper();
    EXPECT_LE(bytes, 2048u) << name;
    EXPECT_GE(bytes, 800u) << name;
  }
}

TEST(Fleet, TakesAnotherVehicleInFlight) {
  Fleet<float> fleet(20, test::nominal(), fleet_options(sensors("paper"), controller("pid"), task(staying())));
  Fleet<float> other(20, test::nominal(), fleet_options(sensors("paper"), controller("pid"), task(staying())));
  for (int period = 0; period < 1000; ++period) {
    if (period == 250) fleet.set_vehicle(7, test::identified());
    fleet.step();
    other.step();
  }
  EXPECT_EQ(fleet.hash(0, 7), other.hash(0, 7));
  EXPECT_EQ(fleet.hash(8, 20), other.hash(8, 20));
  EXPECT_NE(fleet.hash(7, 8), other.hash(7, 8));
  EXPECT_EQ(fleet.batch().status(7), 0u);
  for (const double x : fleet.truth(7).position_m) EXPECT_LT(std::abs(x), 0.5);
}

/// Lanes beyond the last flapper fall for ever: nothing of it may reach the others or slow them down.
TEST(Fleet, LanesBeyondTheLastFlapperAreHarmless) {
  const FleetOptions o = fleet_options(sensors("code"), controller("arc"), task(staying()));
  Fleet<float> fleet(17, test::nominal(), o), full(32, test::nominal(), o);
  const auto seconds = [&](Fleet<float>& f, int periods) {
    const auto from = std::chrono::steady_clock::now();
    for (int period = 0; period < periods; ++period) f.step();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - from).count();
  };
  seconds(fleet, 15000);  // by then they have long been frozen
  seconds(full, 15000);
  EXPECT_EQ(fleet.hash(), full.hash(0, 17));
  double partly = 1e9, wholly = 1e9;  // the fastest of some, lest others on the machine count
  for (int i = 0; i < 10; ++i)
    partly = std::min(partly, seconds(fleet, 50)), wholly = std::min(wholly, seconds(full, 50));
  EXPECT_LT(partly, 2 * wholly);
}

}  // namespace
}  // namespace flappy::flight::episode_test
