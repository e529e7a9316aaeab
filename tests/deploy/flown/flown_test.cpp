// Whether the robot flew what was exported: each mistake is put between the samples of a flight and the exported C, and
// has to be found again from samples and voltages.
#include "deploy/flown/flown.hpp"

#include <gtest/gtest.h>

#include <random>

#include "deploy/flown/inferences.hpp"
#include "deploy/flown/replay_flown.hpp"
#include "deploy/header/exported_files.hpp"
#include "deploy/header/policy_vectors.hpp"
#include "full.hpp"
#include "refusal.hpp"
#include "rollout/fly_fixture.hpp"
#include "rollout/rollout.hpp"

namespace flappy::deploy {
namespace {

using flight::Folder;
using flight::source_path;

std::shared_ptr<const policy::Actor> random_actor(const flight::Task& task, std::uint32_t seed) {
  policy::Actor a;
  a.task = task.name;
  for (const auto& s : task.observation()) a.observation.push_back(s.name);
  for (const auto& s : task.action()) a.action.push_back(s.name);
  a.widths = {static_cast<int>(a.observation.size()), 16, flight::kMaxActions};
  std::mt19937 random(seed);
  for (std::size_t i = 0; i < policy::weight_count(a.widths); ++i)
    a.weights.push_back(0.6 * (static_cast<double>(random()) / 4294967296.0 - 0.5));
  for (std::size_t i = 0; i < a.observation.size(); ++i) {
    a.mean.push_back(0.1 + 0.02 * static_cast<double>(i));
    a.scale.push_back(0.5 + 0.03 * static_cast<double>(i));
  }
  return std::make_shared<const policy::Actor>(a);
}

/// Samples of a lively flight; commands at all times of the driver, their voltages still 0.
OnboardLog samples(double lasts_s) {
  rollout::FlyConfig config = rollout::read_fly_config(source_path("configs/fly/lively.toml"), {"precision=float"});
  rollout::Rollout<float> flight(config, 1);
  flight.fleet().record(true);
  OnboardLog log;
  log.imu_latency_s = config.fleet.sensors.imu.latency_s;
  log.pose_latency_s = config.fleet.sensors.mocap.latency_s;
  while (flight.t_s() < lasts_s && !flight.over()) {
    flight.step();
    for (const auto& s : flight.fleet().imu_samples(0)) {
      OnboardLog::Imu to{s.arrival_s, {}, {}};
      std::ranges::copy(s.gyro_rad_s, to.rate_rad_s.begin());
      std::ranges::copy(s.accel_m_s2, to.force_m_s2.begin());
      log.imu.push_back(to);
    }
    for (const auto& s : flight.fleet().mocap_samples(0)) {
      OnboardLog::Pose to{s.arrival_s, {}, {}};
      std::ranges::copy(s.position_m, to.position_m.begin());
      std::ranges::copy(s.attitude, to.attitude.begin());
      if (s.valid) log.poses.push_back(to);
    }
  }
  const double hold_s = config.vehicle.driver.hold_s;
  for (std::int64_t i = 0; static_cast<double>(i) * hold_s < lasts_s; ++i)
    log.commands.push_back({static_cast<double>(i) * hold_s, 0, 0});
  log.mode = OnboardLog::Mode::task;
  log.begin_s = 0.2;
  return log;
}

/// An exported policy that acts for 0.35 s.
class FlownTest : public testing::Test {
 protected:
  FlownTest() {
    rollout::FlyConfig config =
        rollout::read_fly_config(source_path("configs/fly/escape.toml"), {"task.hand_back.distance_m=1e-9"});
    config.actor = random_actor(config.fleet.task, 7);
    for (const auto& [name, text] : exported_files(config, {"0123", "abcd", false, "escape"}))
      folder_.write(name, text);
    check_.emplace(folder_ / "");
    exact_.emplace(folder_ / "", Build::exact);
  }

  OnboardLog flown_with(OnboardLog log, const Wiring& wiring) const {
    const auto volts = replay(*exact_, check_->contract(), log, wiring).volts;
    for (std::size_t i = 0; i < volts.size(); ++i)
      log.commands[i].left_V = volts[i][0], log.commands[i].right_V = volts[i][1];
    return log;
  }

  Folder folder_;
  std::optional<FlownCheck> check_;
  std::optional<ExportedC> exact_;
};

/// What passed the processor of a simulated robot, by its log.
OnboardLog onboard(const flightlog::FlightLog& log) {
  OnboardLog to;
  to.imu_latency_s = *log.header.flown->imu_latency_s;
  to.pose_latency_s = log.header.mocap.latency_s;
  for (std::size_t i = 0; i < log.imu.t_s.size(); ++i)
    to.imu.push_back({log.imu.t_s[i],
                      {log.imu.gyro_x_rad_s[i], log.imu.gyro_y_rad_s[i], log.imu.gyro_z_rad_s[i]},
                      {log.imu.accel_x_m_s2[i], log.imu.accel_y_m_s2[i], log.imu.accel_z_m_s2[i]}});
  const flightlog::MocapStream& m = log.mocap;
  for (std::size_t i = 0; i < m.t_s.size(); ++i)
    to.poses.push_back({m.t_s[i], {m.x_m[i], m.y_m[i], m.z_m[i]}, {m.qw[i], m.qx[i], m.qy[i], m.qz[i]}});
  const flightlog::CommandStream& c = log.command;
  for (std::size_t i = 0; i < c.t_s.size(); ++i)
    to.commands.push_back({c.t_s[i], c.left_voltage_V[i], c.right_voltage_V[i]});
  const flightlog::FlownHeader& flown = *log.header.flown;
  to.start_s = flown.start_s, to.start_pose = flown.start_pose, to.begin_s = flown.begin_s;
  to.mode = OnboardLog::Mode::task;
  to.start_memory.assign(flown.start_memory.begin(), flown.start_memory.end());
  to.start_phase = flown.start_phase;
  for (std::size_t k = 0; k < log.header.policy.size(); ++k)
    to.policy_numbers.push_back(k), to.policy_steps.push_back(0);
  for (std::size_t i = 0; i < log.policy->t_s.size(); ++i) {
    to.inferences.push_back({log.policy->t_s[i], {}});
    for (const flightlog::Column& column : log.policy->numbers) to.inferences.back().numbers.push_back(column[i]);
  }
  return to;
}

// A log of the simulator says how its flight began, whether from a hover, in the air or on the ground: the exported C
// goes on from there as the simulated robot did.
TEST_F(FlownTest, KnowsAFlightOfTheSimulatorAgain) {
  for (const char* start : {"settled", "flying", "standing"}) {
    rollout::FlyConfig config =
        rollout::read_fly_config(source_path("configs/fly/escape.toml"),
                                 {"task.hand_back.distance_m=1e-9", "flight.duration_s=0.6", "flight.seed=3",
                                  "precision=float", std::string("task.start.kind=") + start});
    config.actor = random_actor(config.fleet.task, 7);
    rollout::Rollout<float> flight(config, 1);
    flight.record();
    while (!flight.over()) flight.step();
    const auto log = flight.recorders()[0].log();
    ASSERT_TRUE(log && log->header.flown) << start;
    const flightlog::FlightLog back = flightlog::parse_flight_log(flightlog::flight_log_files(*log), "log");
    EXPECT_EQ(back.header.flown, log->header.flown);
    EXPECT_EQ(log->header.flown->start_memory.size(), check_->remembered());
    OnboardLog is = onboard(back);
    const Flown flown = check_->check(is);
    EXPECT_TRUE(flown.as_exported) << start << " " << flown.share << " from " << flown.from_s << " "
                                   << flown.unexplained;
    is.start_memory.clear();                                // without it, the same flight is another one
    if (start == std::string("settled") && test::full()) {  // it looks for every mistake
      EXPECT_LT(check_->check(is).share, 0.5);
    }
  }
}

TEST_F(FlownTest, FindsEachMistakeAgain) {
  const OnboardLog log = samples(0.5);
  const Flown right = check_->check(flown_with(log, {}));
  EXPECT_TRUE(right.as_exported);
  EXPECT_EQ(right.share, 1);
  int number = 0, tried = 0, found = 0, silent = 0;
  for (const Mistake& m : mistakes_of(check_->contract(), *exact_, false)) {
    if (number++ % 24 != 8 && !test::full()) continue;  // each takes half a second
    std::vector<double> p = m.starts.empty() ? std::vector<double>() : m.starts.front();
    for (std::size_t k = 0; k < p.size(); ++k) p[k] += 0.7 * m.scales[k];  // not where the search begins
    Wiring wiring;
    m.make(wiring, p);
    if (wiring.build != Build::exact) continue;
    const Flown flown = check_->check(flown_with(log, wiring));
    if (flown.as_exported) {
      ++silent;
      std::printf("%s changes nothing\n", m.id.c_str());
      continue;
    }
    ++tried;
    const bool is = flown.mistakes.size() == 1 && flown.mistakes[0].id == m.id;
    found += is;
    if (!is) {
      std::printf("%s:", m.said(p).c_str());
      for (const FlownMistake& other : flown.mistakes) std::printf(" %s", other.words.c_str());
      std::printf(" %s (%.3f)\n", flown.unexplained.c_str(), flown.explained);
    }
  }
  std::printf("%d of %d mistakes found, %d change nothing\n", found, tried, silent);
  EXPECT_GT(tried, 3);
  EXPECT_GE(found, 0.9 * tried) << "a stamp rate that is off where the search begins is not found";
}

/// The flight as a log has it that kept one of two samples of the IMU.
OnboardLog half_logged(OnboardLog log) {
  log.imu_Hz = static_cast<double>(log.imu.size() - 1) / (log.imu.back().arrived_s - log.imu.front().arrived_s);
  std::vector<OnboardLog::Imu> half;
  for (std::size_t i = 0; i < log.imu.size(); i += 2) half.push_back(log.imu[i]);
  log.imu = std::move(half);
  return log;
}

TEST_F(FlownTest, FindsMistakesWhereEverySecondSampleIsLost) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  OnboardLog log = samples(0.5);
  log.begin_s.reset();  // a random policy would make much of what was lost
  const Flown right = check_->check(half_logged(flown_with(log, {})));
  EXPECT_TRUE(right.as_exported) << right.share;
  EXPECT_GT(right.tolerance_V, 1e-3) << "what was lost";
  for (const Mistake& m : mistakes_of(check_->contract(), *exact_, false)) {
    if (m.id != "accel_sign" && m.id != "accel_sign_z") continue;
    Wiring wiring;
    m.make(wiring, {});
    const Flown flown = check_->check(half_logged(flown_with(log, wiring)));
    ASSERT_EQ(flown.mistakes.size(), 1U) << m.id << " " << flown.unexplained;
    EXPECT_EQ(flown.mistakes[0].id, m.id);
  }
}

TEST_F(FlownTest, TakesLogsThatLackCommands) {
  const OnboardLog whole = flown_with(samples(0.5), {});
  OnboardLog thin = whole, gap = whole;
  thin.commands.clear();
  for (std::size_t i = 0; i < whole.commands.size(); i += 5) thin.commands.push_back(whole.commands[i]);
  std::erase_if(gap.commands, [](const OnboardLog::Command& c) { return c.t_s > 0.1 && c.t_s < 0.25; });
  EXPECT_EQ(check_->check(thin).share, 1);
  EXPECT_EQ(check_->check(gap).share, 1);
}

// A sample that arrives 0.8 us after a control period belongs to the next one, where the log has all digits of times.
TEST_F(FlownTest, TakesArrivalsAsPreciselyAsTheLogHasThem) {
  OnboardLog log = samples(0.3);
  const std::size_t at = log.imu.size() / 2;
  const double tick_s = check_->contract().control_s;
  log.imu[at].arrived_s = std::ceil(log.imu[at].arrived_s / tick_s) * tick_s + 8e-7;
  OnboardLog rounded = log;
  rounded.time_step_s = 2e-6;
  EXPECT_NE(replay(*exact_, check_->contract(), log, {}).volts, replay(*exact_, check_->contract(), rounded, {}).volts);
}

// What no mistake explains, and a log that has what the policy got and gave.
TEST_F(FlownTest, SaysWhereNothingExplainsIt) {
  OnboardLog log = samples(test::full() ? 0.4 : 0.3);
  const std::size_t seen = check_->contract().observation.size();
  for (std::size_t i = 0; i < seen + check_->contract().action.size(); ++i) log.policy_numbers.push_back(i);
  log.policy_steps.assign(log.policy_numbers.size(), 0);
  const auto logged = [&](const Wiring& wiring) {
    OnboardLog to = flown_with(log, wiring);
    to.inferences = replay(*exact_, check_->contract(), log, wiring).inferences;
    return to;
  };
  OnboardLog unknown = logged({});
  unknown.begin_s.reset(), unknown.mode.reset();
  const Flown estimated = check_->check(unknown);
  EXPECT_TRUE(estimated.as_exported);
  EXPECT_NEAR(estimated.begin_s.value_or(0), 0.2, 1e-9);
  Wiring order;  // four numbers turned round, of three parts
  for (std::size_t i = 0; i < seen; ++i) order.order.push_back(static_cast<int>(i));
  std::swap(order.order[1], order.order[7]);
  std::swap(order.order[4], order.order[9]);
  const Flown observation = check_->check(logged(order));
  EXPECT_TRUE(observation.unexplained.starts_with("the observation's y_error, from 0.2")) << observation.unexplained;
  if (!test::full()) return;
  log.policy_numbers.clear(), log.policy_steps.clear();
  const Flown silent = check_->check(logged(order));
  ASSERT_EQ(silent.mistakes.size(), 1U) << "a log that has no observation";
  EXPECT_EQ(silent.mistakes[0].id, "another_policy");
}

/// A robot with inputs: what its policy got and gave, and the inputs that it asked for.
class InferencesTest : public testing::Test {
 protected:
  InferencesTest() {
    config_ = rollout::read_fly_config(source_path("configs/fly/flapper_dash.toml"));
    config_.actor = random_actor(config_.fleet.task, 7);
    for (const auto& [name, text] : exported_files(config_, {"0123", "abcd", false, "flapper_dash"}))
      folder_.write(name, text);
    contract_ = read_contract(folder_ / "");
    const policy::PolicyVectors flown = roll_out(config_, 0, 2);
    const auto seen = static_cast<std::size_t>(flown.inputs), acts = static_cast<std::size_t>(flown.outputs);
    for (std::size_t k = 0; k < seen + acts; ++k) log_.policy_numbers.push_back(k), log_.policy_steps.push_back(0);
    for (const Contract::Input& i : contract_.inputs) inputs_.push_back({i.name, {}});
    for (std::size_t row = 0; row < flown.rows(); ++row) {
      OnboardLog::Inference& to = log_.inferences.emplace_back();
      for (std::size_t k = 0; k < seen; ++k)
        to.numbers.push_back(static_cast<double>(flown.observation[row * seen + k]));
      for (std::size_t k = 0; k < acts; ++k) to.numbers.push_back(static_cast<double>(flown.action[row * acts + k]));
      for (std::size_t i = 0; i < inputs_.size(); ++i) {
        double value = contract_.inputs[i].neutral;
        for (std::size_t k = 0; k < acts; ++k) value += contract_.inputs[i].mix[k] * to.numbers[seen + k];
        inputs_[i].value.push_back(std::clamp(value, contract_.inputs[i].low, contract_.inputs[i].high));
      }
    }
  }
  Inferences check() { return check_inferences(folder_ / "", contract_, log_, inputs_); }
  LoggedInput& input(const std::string& name) { return *std::ranges::find(inputs_, name, &LoggedInput::name); }

  Folder folder_;
  rollout::FlyConfig config_;
  Contract contract_;
  OnboardLog log_;
  std::vector<LoggedInput> inputs_;
};

TEST_F(InferencesTest, KnowsTheExportedPolicy) {
  const Inferences found = check();
  EXPECT_EQ(found.rows, log_.inferences.size());
  EXPECT_GT(found.rows, 50u);
  EXPECT_EQ(found.same, found.rows);
  EXPECT_TRUE(found.as_exported());
  ASSERT_EQ(found.inputs.size(), 4u);
  for (const auto& i : found.inputs) EXPECT_EQ(i.share, 1) << i.name;
  for (auto& row : log_.inferences)  // three digits behind the point
    for (double& x : row.numbers) x = std::round(x * 1000) / 1000;
  log_.policy_steps.assign(log_.policy_steps.size(), 1e-3);
  EXPECT_TRUE(check().as_exported());
  log_.inferences[0].numbers.assign(log_.inferences[0].numbers.size(), 0);  // before the first inference
  EXPECT_EQ(check().rows, log_.inferences.size() - 1);
  const std::string missing = inputs_.back().name;
  inputs_.pop_back();
  EXPECT_NE(test::refusal([&] { check(); }).find("steers by " + missing + ", which the log lacks"), std::string::npos);
}

TEST_F(InferencesTest, SeesAnotherPolicyAndOtherInputs) {
  for (double& x : input("yaw_servo").value) x = 1 - x;
  for (double& x : input("pitch_servo").value) x += 0.03;
  Inferences found = check();
  EXPECT_FALSE(found.as_exported());
  EXPECT_EQ(found.same, found.rows);
  for (const auto& i : found.inputs) {
    EXPECT_EQ(i.share > 0.9, i.name.ends_with("flap")) << i.name;
    if (i.name == "pitch_servo") EXPECT_NEAR(i.offset, 0.03, 1e-9);
  }
  const std::size_t roll_rate = 15;  // its sign
  ASSERT_EQ(contract_.observation[roll_rate].name, "roll_rate");
  for (auto& row : log_.inferences) row.numbers[roll_rate] *= -1;
  found = check();
  EXPECT_LT(found.same, found.rows / 10);
  EXPECT_GT(found.largest, 0.001);
  log_.policy_numbers[3] = 999;
  EXPECT_EQ(flight::message([&] { check(); }),
            std::string(folder_ / "") +
                ": is checked by all that the policy got and gave, and the log lacks observation_R_yx; "
                "accepted: a log with policy.csv, as the mapping beside the exported app makes it");
}

}  // namespace
}  // namespace flappy::deploy
