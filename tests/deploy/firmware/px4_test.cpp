// The exported module of PX4, around a stub of it, on this machine and on a Cortex-M4F: the vehicle moves as under the training
// server's own controller and policy, to the bit.
#include "deploy/firmware/firmware.hpp"
#include "full.hpp"
#include "tools/own_flight.hpp"

namespace flappy::deploy {
namespace {

/// The module and its PX4, compiled in a folder as the exporter leaves it.
class Module {
 public:
  explicit Module(const FlyConfig& config) {
    const Headers& h = escape_headers();
    std::map<std::string, std::string> shims;
    for (const char* name :
         {"drivers/drv_hrt.h", "px4_platform_common/module.h",
          "px4_platform_common/px4_work_queue/ScheduledWorkItem.hpp", "string.h", "uORB/Publication.hpp",
          "uORB/Subscription.hpp", "uORB/topics/actuator_armed.h", "uORB/topics/actuator_motors.h",
          "uORB/topics/debug_array.h", "uORB/topics/sensor_combined.h", "uORB/topics/vehicle_odometry.h"})
      shims["stub/" + std::string(name)] = "#include \"px4_stub.hpp\"\n";
    for (const auto& files :
         {firmware_files("px4", config, {{"flappy_policy.h", h.policy}, {"flappy_controller.h", h.controller}}), shims})
      for (const auto& [path, text] : files) {
        std::filesystem::create_directories(std::filesystem::path(folder_ / path).parent_path());
        folder_.write(path, text);
      }
    write_board(folder_ / "");
  }
  std::string build(bool for_board) {
    // flags of PX4 that change numbers, and what the module sets against them (its CMakeLists.txt)
    Words options = {"-O2", "-fno-exceptions", "-fno-math-errno", "-freciprocal-math", "-fno-reciprocal-math"};
    append(options, strict_options({folder_ / "src/modules/flappy_control", folder_ / "stub", folder_ / "",
                                    source_path("tests/deploy/firmware"), source_path("tools/onboard")}));
    const std::string object = folder_ / "module.o", flight_logic = folder_ / "src/modules/flappy_control/onboard.c";
    Words compile = {for_board ? arm_compiler().prefix + "gcc" : "gcc", "-fno-rtti", "-ffreestanding", "-std=c++17"};
    if (for_board) append(compile, board_machine());
    append(compile, options);
    append(compile, {"-c", source_path("tests/deploy/firmware/px4_board.cpp"), "-o", object});
    if (const std::string complaints = run_limited(compile).err; !complaints.empty()) return complaints;
    if (for_board)
      return run_limited(board_build(folder_ / "", {object, flight_logic}, options, folder_ / "module.elf")).err;
    Words link = {"gcc"};
    append(link, options);
    append(link, {object, flight_logic, folder_ / "board_host.c", "-o", folder_ / "module"});
    return run_limited(link).err;
  }
  Words program() const { return {folder_ / "module"}; }
  Words board() const { return board_run(folder_ / "module.elf", false); }

 private:
  Folder folder_;
};

TEST(Px4Module, FliesAsTheLanesDo) {
  const FlyConfig config = escape();
  Module module(config);
  ASSERT_EQ(module.build(false), "");
  fly_as_the_lanes(of_nominal(config), 0, module.program());
  fly_as_the_lanes(config, 2, module.program());
}

TEST(Px4Module, FliesOnTheBoardAsTheLanesDo) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  const FlyConfig config = escape();
  Module module(config);
  ASSERT_EQ(module.build(true), "");
  fly_as_the_lanes(of_nominal(config), 0, module.board());
}

// flappy_px4.cc turns north, east, down to north, west, up, and so has the import of its log to do.
TEST(Px4Module, ImportsPosesAsItTakesThem) {
  const auto files = firmware_files("px4", escape(), {{"flappy_policy.h", ""}, {"flappy_controller.h", ""}});
  const std::string& mapping = files.at("mapping.toml");
  EXPECT_NE(mapping.find("\nworld = \"ned_x_north\"\n"), std::string::npos);
  EXPECT_EQ(mapping.find("\"ned\""), std::string::npos);
}

TEST(Px4Module, RefusesWhatItCannotFly) {
  EXPECT_EQ(flight::message([] {
              firmware_files("px4", rollout::read_fly_config(source_path("configs/fly/flapper_dash.toml")), {});
            }),
            "--for px4: the vehicle has inputs in place of two motors; accepted: a vehicle with motors; for these "
            "inputs, --for crazyflie");
  EXPECT_EQ(
      flight::message(
          [] { firmware_files("px4", rollout::read_fly_config(source_path("configs/fly/hover_voltages.toml")), {}); }),
      "--for px4: the policy sets the motors' voltages by itself; accepted: a task that leaves the controller to fly");
  EXPECT_EQ(flight::message([] {
              firmware_files("px4", escape({"task.history=3"}), {});
            }).find("--for px4: the policy gets and gives "),
            0u);
}

}  // namespace
}  // namespace flappy::deploy
