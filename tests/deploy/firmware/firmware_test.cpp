// The exported app of the Crazyflie's firmware, around a stub of it, on this machine and on a Cortex-M4F: the bits of the simulator's flight.
#include "deploy/firmware/firmware.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "deploy/header/exported_files.hpp"
#include "deploy/header/policy_vectors.hpp"
#include "deploy/proof/board.hpp"
#include "flight/flight_block.hpp"
#include "io/files.hpp"
#include "model/jointed.hpp"
#include "rollout/fly_fixture.hpp"
#include "rollout/rollout.hpp"
#include "sim/storage.hpp"

namespace flappy::deploy {
namespace {

using flight::Folder;
using flight::message;
using flight::source_path;
using rollout::FlyConfig;
using Words = std::vector<std::string>;

enum State : std::uint32_t { kRefused, kReady, kHovering, kActing, kReturned };
enum Flag : std::uint32_t { kHandedBack = 4, kTakenBack = 8, kLate = 16, kAway = 32, kNotFinite = 64, kUnready = 128 };

struct In {  // as crazyflie_board.c has them
  std::uint32_t us = 0;
  float position_m[3]{}, velocity_m_s[3]{}, attitude[4]{1, 0, 0, 0}, gyro_deg_s[3]{};
  std::int32_t flies = 1, act = 1, in_world = 1;
};
struct Out {
  float thrust;
  std::int32_t roll, pitch, yaw, pid;
  float to_m[3];
  std::uint32_t state, flags, us, events;
};

/// A dash within what the firmware can set. Body rates come in degrees, which not every float of radians has, so the
/// policy does not see them where bits are compared.
FlyConfig dash(const Words& overrides = {}) {
  Words all = {"task.action.amplitude_V=[0.3,0.75]", "task.action.bias_V=[-0.19,0.19]",
               R"(task.observation=["rotation_matrix","position_error","velocity","heading_error","previous_action"])"};
  all.insert(all.end(), overrides.begin(), overrides.end());
  FlyConfig c = rollout::read_fly_config(source_path("configs/fly/flapper_dash.toml"), all);
  c.randomisation.reset();
  policy::Actor a;
  a.task = c.fleet.task.name;
  for (const auto& s : c.fleet.task.observation()) a.observation.push_back(s.name);
  for (const auto& s : c.fleet.task.action()) a.action.push_back(s.name);
  a.widths = {static_cast<int>(a.observation.size()), 12, 4};
  std::uint32_t random = 1;
  for (std::size_t i = 0; i < policy::weight_count(a.widths); ++i) {
    random = random * 1664525U + 1013904223U;
    a.weights.push_back(1.5 * (random / 4294967296.0 - 0.5));
  }
  a.mean.assign(a.observation.size(), 0);
  a.scale.assign(a.observation.size(), 0.5);
  c.actor = std::make_shared<const policy::Actor>(a);
  return c;
}

std::map<std::string, std::string> headers_of(const FlyConfig& config) {
  return exported_files(config, {std::string(64, 'a'), "0123456789ab", false, "a task"});
}

/// The app and its firmware, compiled in a folder as the exporter leaves it.
class App {
 public:
  explicit App(const FlyConfig& config) {
    for (const auto& [path, text] : firmware_files("crazyflie", config, headers_of(config))) {
      std::filesystem::create_directories(std::filesystem::path(folder_ / path).parent_path());
      folder_.write(path, text);
    }
    for (const char* name : {"FreeRTOS.h", "app.h", "controller.h", "controller_pid.h", "debug.h", "eventtrigger.h",
                             "log.h", "param.h", "stabilizer_types.h", "supervisor.h", "task.h", "usec_time.h"})
      folder_.write(std::string("src/") + name, "#include \"crazyflie_stub.h\"\n");
    write_board(folder_ / "");
  }
  std::string build() {
    Words command = {"gcc", "-O2"};
    append(command, options());
    for (const auto& s : sources()) command.push_back(s.string());
    append(command, {folder_ / "board_host.c", "-o", folder_ / "app", "-lm"});
    return run_limited(command).err;
  }
  std::string build_for_board() {
    Words all = {"-O2"};
    append(all, options());
    return run_limited(board_build(folder_ / "", sources(), all, folder_ / "app.elf")).err;
  }
  std::vector<Out> fly(std::vector<In> in, bool on_board = false) const {
    In over;
    over.act = -1;
    in.push_back(over);
    const io::Finished done = run_limited(on_board ? board_run(folder_ / "app.elf", false) : Words{folder_ / "app"},
                                          {reinterpret_cast<const char*>(in.data()), in.size() * sizeof(In)});
    EXPECT_EQ(done.exit_code, 0) << done.err;
    std::vector<Out> out(done.out.size() / sizeof(Out));
    std::memcpy(out.data(), done.out.data(), out.size() * sizeof(Out));
    EXPECT_EQ(out.size(), in.size() - 1);
    out.resize(in.size() - 1);
    return out;
  }

 private:
  Words options() const {
    return strict_options({folder_ / "src", folder_ / "", source_path("tests/deploy/firmware")});
  }
  std::vector<std::filesystem::path> sources() const {
    return {folder_ / "src/flappy_crazyflie.c", source_path("tests/deploy/firmware/crazyflie_board.c")};
  }
  Folder folder_;
};

App& built_app() {
  static App app(dash());
  static const std::string complaints = app.build();
  EXPECT_EQ(complaints, "");
  return app;
}

/// Two steps of the stabilizer, 1 ms each, for each control period.
std::vector<In> steps(std::size_t periods, const In& each = {}) {
  std::vector<In> all(2 * periods, each);
  for (std::size_t i = 0; i < all.size(); ++i) all[i].us = static_cast<std::uint32_t>(1000 * (i + 7));
  return all;
}

TEST(CrazyflieApp, FliesAsTheSimulatorDoes) {
  const FlyConfig config = dash();
  rollout::Rollout<float> flight(config, 1);
  auto& fleet = flight.fleet();
  constexpr std::size_t kPeriods = 300;  // then these weights have it too far away
  std::vector<In> in = steps(kPeriods);
  std::vector<std::vector<double>> inputs;
  for (std::size_t k = 0; k < kPeriods; ++k) {
    const auto rows = fleet.snapshot(0).flight;
    const float* at = &rows[offsetof(flight::FlightBlock<float>, estimate) / sizeof(float[flight::kLanes<float>])];
    for (In* record : {&in[2 * k], &in[2 * k + 1]}) {  // position, attitude, velocity, as Estimate has them
      std::copy_n(at, 3, record->position_m);
      std::copy_n(at + 3, 4, record->attitude);
      std::copy_n(at + 7, 3, record->velocity_m_s);
      for (int i = 0; i < 3; ++i) record->gyro_deg_s[i] = at[10 + i] * 57.29578F;
    }
    flight.step();
    inputs.push_back(sim::storage_of(fleet.batch()).inputs_of(0));
  }
  std::vector<std::string> names;
  for (const auto& i : model::mixed_inputs(config.vehicle)) names.push_back(i.name);
  const auto input = [&](std::size_t k, const char* name) {
    return static_cast<float>(inputs[k][static_cast<std::size_t>(std::ranges::find(names, name) - names.begin())]);
  };
  App& app = built_app();
  ASSERT_EQ(app.build_for_board(), "");
  for (const bool on_board : {false, true}) {
    const std::vector<Out> out = app.fly(in, on_board);
    float most = 0;
    for (std::size_t k = 0; k < kPeriods; ++k) {
      const float left = input(k, "left_flap"), right = input(k, "right_flap");
      for (const Out& o : {out[2 * k], out[2 * k + 1]}) {
        ASSERT_EQ(o.state, kActing) << k;
        ASSERT_EQ(o.thrust, 65535.0F * (0.5F * (left + right))) << k;
        ASSERT_EQ(o.roll, std::lround(65535.0F * (left - right))) << k;
        ASSERT_EQ(o.pitch, std::lround(65535.0F / 0.4F * (input(k, "pitch_servo") - 0.5F))) << k;
        ASSERT_EQ(o.yaw, std::lround(65535.0F * (0.5F - input(k, "yaw_servo")))) << k;
      }
      most = std::max(most, std::abs(out[2 * k].thrust - out[0].thrust));
    }
    EXPECT_GT(most, 1000) << "the policy hardly moves";
    EXPECT_EQ(out.back().events, 2 * kPeriods / 10) << "of 24 numbers, at each inference";
  }
}

/// Where the robot is, with its heading, is where the task begins.
TEST(CrazyflieApp, BeginsWhereTheRobotIs) {
  In here;
  const float half = 0.35F;
  here.position_m[0] = 1.5F, here.position_m[1] = -2, here.position_m[2] = 0.7F;
  here.attitude[0] = std::cos(half), here.attitude[3] = std::sin(half);
  here.velocity_m_s[0] = 0.2F * std::cos(0.7F), here.velocity_m_s[1] = 0.2F * std::sin(0.7F);
  here.in_world = 0;
  In there;
  there.velocity_m_s[0] = 0.2F;
  const std::vector<Out> moved = built_app().fly(steps(5, here)), original = built_app().fly(steps(5, there));
  for (std::size_t i = 0; i < moved.size(); ++i) {
    EXPECT_NEAR(moved[i].thrust, original[i].thrust, 0.5);
    EXPECT_NEAR(moved[i].pitch, original[i].pitch, 2);
    EXPECT_NEAR(moved[i].yaw, original[i].yaw, 2);
  }
  here.in_world = 1;  // 2 m away from where the task begins
  EXPECT_EQ(built_app().fly(steps(3, here)).back().flags, kUnready);
}

TEST(CrazyflieApp, LeavesTheRestToTheAutopilot) {
  App& app = built_app();
  std::vector<In> in = steps(400);
  const auto change = [&](std::size_t from, std::size_t to, const auto& how) {
    for (std::size_t k = 2 * from; k < 2 * to; ++k) how(in[k]);
  };
  change(0, 10, [](In& r) { r.act = 0; });                             // hovers under the PID
  change(10, 20, [](In& r) { r.flies = 0; });                          // wished, but on the ground
  change(100, 120, [](In& r) { r.act = 0, r.position_m[0] = 0.1F; });  // taken back
  change(120, 400, [](In& r) { r.act = 1; });
  change(300, 301, [](In& r) { r.position_m[1] = std::numeric_limits<float>::quiet_NaN(); });
  change(306, 309, [](In& r) { r.flies = 0; });
  change(310, 320, [](In& r) { r.act = 0; });
  change(350, 352, [](In& r) { r.position_m[0] = 1.6F; });
  const std::vector<Out> out = app.fly(in);
  const auto at = [&](std::size_t period) { return out[2 * period]; };
  EXPECT_EQ(at(5).state, kReady);
  EXPECT_EQ(at(15).state, kReady);
  EXPECT_EQ(at(15).pid, 31);  // each step until then
  EXPECT_EQ(at(20).state, kActing);
  EXPECT_EQ(at(99).pid, 40);
  EXPECT_EQ(at(100).state, kReturned);
  EXPECT_EQ(at(100).flags, kTakenBack);
  EXPECT_EQ(at(100).to_m[0], 9);  // the pilot's, whose wish has ended
  EXPECT_EQ(at(101).state, kReady);
  EXPECT_EQ(at(130).state, kActing);
  EXPECT_EQ(at(300).state, kReturned);
  EXPECT_EQ(at(305).to_m[0], 0);  // where it was, as long as the pilot still wishes
  EXPECT_EQ(at(305).to_m[1], 0);
  EXPECT_EQ(at(307).to_m[0], 9);  // on the ground the firmware's own
  EXPECT_EQ(at(315).to_m[0], 9);
  EXPECT_EQ(at(399).state, kReturned);  // a fault is for good
  EXPECT_EQ(at(399).flags, kTakenBack | kNotFinite);
}

TEST(CrazyflieApp, EndsAtItsTimeAndAtALateStep) {
  App app(dash({"task.end.time_s=0.2", "flight.duration_s=0.2"}));
  ASSERT_EQ(app.build(), "");
  std::vector<In> in = steps(150);
  const std::vector<Out> out = app.fly(in);
  EXPECT_EQ(out[2 * 99].state, kActing);
  EXPECT_EQ(out[2 * 100].state, kReturned);
  EXPECT_EQ(out[2 * 100].flags, kHandedBack);
  for (std::size_t k = 2 * 40; k < in.size(); ++k) in[k].us += 1500;
  EXPECT_EQ(app.fly(in)[2 * 40].flags, kLate);
}

TEST(CrazyflieApp, GivesBackFarFromItsPath) {
  std::vector<In> in = steps(40);
  for (std::size_t k = 2 * 30; k < in.size(); ++k) in[k].position_m[0] = 1.6F;
  const std::vector<Out> out = built_app().fly(in);
  EXPECT_EQ(out[2 * 29].flags, 0u);
  EXPECT_EQ(out[2 * 30].flags, kAway);
}

/// With a feedback controller, that one hovers first.
TEST(CrazyflieApp, HoversByItsOwnControllerFirst) {
  App app(dash({"controller=" + source_path("configs/controllers/pid_flapper_nimble.toml")}));
  ASSERT_EQ(app.build(), "");
  const std::vector<Out> out = app.fly(steps(1100));
  EXPECT_EQ(out[2 * 999].state, kHovering);
  EXPECT_EQ(out[2 * 1000].state, kActing);
  EXPECT_EQ(out.back().pid, 0);
  EXPECT_NEAR(out[0].thrust, 65535 * 0.587, 100);  // hover_V
}

// PWD is the folder of the shell, which make -C does not change.
TEST(CrazyflieApp, IsMadeFromAnyFolder) {
  const std::string makefile =
      firmware_files("crazyflie", dash(), {{"flappy_policy.h", ""}, {"flappy_controller.h", ""}}).at("Makefile");
  EXPECT_NE(makefile.find("\nOOT := $(CURDIR)\n"), std::string::npos);
  EXPECT_EQ(makefile.find("PWD"), std::string::npos);
}

TEST(CrazyflieApp, RefusesWhatTheFirmwareCannotSet) {
  EXPECT_EQ(message([] { firmware_files("crazyflie", dash({"task.action.bias_V=[-0.4,0.4]"}), {}); }),
            "--for crazyflie: the task's actions move pitch_servo from 0.1 to 0.9 (the firmware sets 0.301 to 0.699); "
            "accepted: what the firmware sets, after training with narrower task.action.amplitude_V, difference_V, "
            "bias_V or split_cycle");
  EXPECT_EQ(message([] {
              firmware_files("crazyflie", rollout::read_fly_config(source_path("configs/fly/escape.toml")), {});
            }),
            "--for crazyflie: the vehicle has two motors; accepted: a vehicle with left_flap, right_flap, pitch_servo, "
            "yaw_servo, such as flapper_nimble; for two motors, --for px4 or tools/onboard");
}

}  // namespace
}  // namespace flappy::deploy
