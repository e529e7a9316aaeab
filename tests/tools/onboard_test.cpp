// The onboard loop in the simulator: its flapper moves as one that the lanes fly, to the bit.
#include "deploy/flown/flown.hpp"
#include "deploy/header/exported_files.hpp"
#include "full.hpp"
#include "tools/own_flight.hpp"

namespace flappy::deploy {
namespace {

TEST(Onboard, FliesAsTheLanesDo) {
  const FlyConfig config = escape(), nominal = of_nominal(config);
  fly_as_the_lanes(nominal, 0, escape_loop());
  for (std::uint32_t flapper = 0; flapper < 3; ++flapper) fly_as_the_lanes(config, flapper, escape_loop());
}

TEST(Onboard, FliesAnyPolicyAsTheLanesDo) {
  // with its turn, several samples in a control period, and a tracker that does not always see
  FlyConfig config = escape({"task.history=3", "sensors.mocap.loss_probability=0.1", "sensors.mocap.loss_length=1.5",
                             "sensors.imu.rate_hz=1000.0", "sensors.mocap.rate_hz=750.0"});
  policy::Actor a = *config.actor;
  a.widths = {static_cast<int>(a.observation.size()), 16, 16, flight::kMaxActions};
  a.hidden = policy::Activation::relu;
  std::mt19937 random(7);
  a.weights.clear();
  for (std::size_t i = 0; i < policy::weight_count(a.widths); ++i)
    a.weights.push_back(0.6 * (static_cast<double>(random()) / 0x1p31 - 1));
  config.actor = std::make_shared<const policy::Actor>(a);
  Loop loop({policy_text(config), controller_text(config)});
  ASSERT_EQ(loop.build("gcc"), "");
  for (std::uint32_t flapper = 0; flapper < 3; ++flapper) fly_as_the_lanes(config, flapper, loop.program());
}

TEST(Onboard, IsTheSameFromOtherCompilers) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  Loop loop(escape_headers());
  for (const char* level : {"-O0", "-O3"}) {
    ASSERT_EQ(loop.build("gcc", {level}), "");
    fly_as_the_lanes(escape(), 5, loop.program());
  }
  if (!in_path("clang")) GTEST_SKIP() << "not installed: clang";
  ASSERT_EQ(loop.build("clang"), "");
  fly_as_the_lanes(escape(), 5, loop.program());
}

TEST(Onboard, FliesOnTheBoardAsTheLanesDo) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  if (const std::string missing = board_missing(); !missing.empty()) GTEST_SKIP() << missing;
  Loop loop(escape_headers());
  ASSERT_EQ(loop.build_for_board(), "");
  Script script;  // bytes are slow there
  script.manoeuvre = 500;
  script.periods = 800;
  fly_as_the_lanes(of_nominal(escape()), 0, loop.board(), script);
}

/// The log of a loop, checked against what was exported.
Flown checked(const Words& program) {
  Folder exported;
  for (const auto& [name, text] : exported_files(escape(), kRun)) exported.write(name, text);
  LedFlight led(of_nominal(escape()), 0, program);
  Script script;
  script.manoeuvre = 520;
  while (led.period() < 700) led.step(script);
  EXPECT_EQ(led.program().finish(), 0);
  EXPECT_TRUE(led.log().begin_s);
  return FlownCheck(exported / "").check(led.log());
}

const char* const kSwapped =
    "sample->accel_m_s2 = vector(in.imu[imu_taken].accel_m_s2);\n"
    "  sample->accel_m_s2 = flappy_vector_of(sample->accel_m_s2.y, sample->accel_m_s2.x, "
    "sample->accel_m_s2.z);";

Flown checked_on_board(Loop& loop) {
  EXPECT_EQ(loop.build_for_board(), "");
  return checked(loop.board());
}

TEST(Onboard, MistakesOfTheBoardAreFoundInItsLog) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  if (const std::string missing = board_missing(); !missing.empty()) GTEST_SKIP() << missing;
  Loop right(escape_headers());
  const Flown same = checked_on_board(right);
  EXPECT_TRUE(same.as_exported) << same.share << " " << same.from_s;
  Loop swapped(escape_headers());
  swapped.spoil("sample->accel_m_s2 = vector(in.imu[imu_taken].accel_m_s2);", kSwapped);
  const Flown axes = checked_on_board(swapped);
  ASSERT_EQ(axes.mistakes.size(), 1U) << axes.unexplained;
  EXPECT_EQ(axes.mistakes[0].id, "accel_swap_xy") << axes.mistakes[0].words;
  FlyConfig before = escape();
  before.actor = upright_actor(before.fleet.task, 4);
  Loop old({policy_text(before), escape_headers().controller});
  const Flown header = checked_on_board(old);
  ASSERT_EQ(header.mistakes.size(), 1U) << header.unexplained;
  EXPECT_EQ(header.mistakes[0].id, "another_policy") << header.mistakes[0].words;
}

}  // namespace
}  // namespace flappy::deploy
