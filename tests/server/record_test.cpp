// A simulated robot's topics, recorded, are the flight log that the simulator writes itself.
#include "server/record/record.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <thread>

#include "rollout/fly_fixture.hpp"
#include "server/dds_fixture.hpp"
#include "server/sitl/sitl.hpp"

namespace flappy::server {
namespace {

using flightlog::FlightLog;

/// Flies at constant inputs, answering every tick.
void answer(int domain) {
  const Participant p(loopback(domain));
  const Reader<Tick> ticks(p, "/flappy/tick", {true, true, 64});
  const Writer<WingInput> inputs(p, "/flappy/wing_input", {true, true, 64});
  WaitSet waiting(p);
  waiting.add(ticks.entity());
  for (bool over = false; !over && waiting.wait(std::chrono::seconds(5));)
    ticks.take([&](const Tick& t, const dds_sample_info_t&) {
      over |= t.wish == 255;
      char frame[] = "";
      WingInput u{};
      u.header.frame_id = frame;
      u.tick = t.tick;
      u.amplitude_v = 10;
      if (!over) inputs.write(u);
    });
}

flightlog::Mapping mapping(int domain) {
  return flightlog::read_mapping(flight::source_path("configs/mapping/sitl.toml"),
                                 {"dds.domain=" + std::to_string(domain)});
}

TEST(Record, LeavesTheLogOfTheFlight) {
  const flight::Folder folder;
  const int domain = own_domain();
  rollout::FlyConfig config = rollout::read_fly_config(
      flight::source_path("configs/fly/escape.toml"),
      {"flight.duration_s=0.6", "log.power.battery_nominal_V=18", "log.power.rate_hz=500", "log.power.latency_s=0.0",
       "log.power.voltage_noise_V=0.01", "log.power.current_noise_A=0.02", "log.wings.rate_hz=500",
       "log.wings.noise_rad=0.01", "dds.domain=" + std::to_string(domain)});
  config.fleet.task.forbid_actions();
  std::atomic<bool> over = false;
  Recorded recorded;
  std::thread recorder([&] {
    RecordOptions o;
    o.out = folder / "recorded";
    o.keep_going = [&](const auto&) { return !over.load(); };
    recorded = record(config.dds, mapping(domain), o);
  });
  std::thread autopilot([&] { answer(domain); });
  SitlOptions o;
  o.lock_step = false;  // as slow as a robot
  o.log_folder = folder / "direct";
  fly_sitl(config, o);
  autopilot.join();
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  over = true;
  recorder.join();

  const FlightLog direct = flightlog::read_flight_log(folder / "direct"),
                  log = flightlog::read_flight_log(folder / "recorded");
  // the recorder may have found a topic after its first samples; the first of IMU and pose are those before the flight
  const auto last_of = [&](const flightlog::Column& all, flightlog::Column some, std::size_t before = 0) {
    ASSERT_GT(some.size(), all.size() / 2);
    if (some.size() > all.size()) some.erase(some.begin(), some.begin() + static_cast<std::ptrdiff_t>(before));
    ASSERT_LE(some.size(), all.size());
    for (std::size_t k = 0; k < some.size(); ++k)
      ASSERT_EQ(some[k], all[all.size() - some.size() + k]) << k << " of " << some.size();
  };
  last_of(direct.command.left_voltage_V, log.command.left_voltage_V);
  last_of(direct.command.inputs->amplitude_V, log.command.inputs->amplitude_V);
  last_of(direct.imu.gyro_y_rad_s, log.imu.gyro_y_rad_s, 1);
  last_of(direct.wings->left_rotation_rad, log.wings->left_rotation_rad);
  last_of(direct.power->left_current_A, log.power->left_current_A);
  // poses of the last 30 ms never arrive; the others are in both logs, by when they arrived and by when they were taken
  const flightlog::MocapStream &here = direct.mocap, &there = log.mocap;
  ASSERT_GT(there.x_m.size(), 40U);
  constexpr std::size_t kSome = 5;
  const auto at = static_cast<std::size_t>(std::ranges::find(here.x_m, there.x_m[kSome]) - here.x_m.begin());
  ASSERT_LT(at, here.x_m.size());
  for (std::size_t k = kSome; k < there.x_m.size(); ++k) {
    const std::size_t same = at + k - kSome;
    ASSERT_EQ(there.x_m[k], here.x_m[same]);
    ASSERT_EQ(there.qz[k], here.qz[same]);
    ASSERT_NEAR(there.t_s[k] - there.t_s[kSome], here.t_s[same] - here.t_s[at], 2e-9)
        << "as stamps are whole nanoseconds";
  }
  EXPECT_EQ(recorded.refused, 0U);
  EXPECT_TRUE(std::filesystem::exists(folder / "recorded.mcap"));
}

TEST(Record, RefusesATopicOfAnotherType) {
  const flight::Folder folder;
  const int domain = own_domain();
  const Participant p(loopback(domain));
  const Writer<Clock> clock(p, "/flappy/imu", kSensorData);
  RecordOptions o;
  o.out = folder / "log";
  o.duration_s = 5;
  EXPECT_NE(test::refusal([&] {
              record(loopback(domain), mapping(domain), o);
            }).find("/flappy/imu: is a rosgraph_msgs/msg/Clock; accepted: "),
            std::string::npos);
}

TEST(Record, SaysWhatIsMissingAndWhereTheMessagesAre) {
  const flight::Folder folder;
  const int domain = own_domain();
  RecordOptions o;
  o.out = folder / "log";
  o.duration_s = 0.05;
  const std::string line = test::refusal([&] { record(loopback(domain), mapping(domain), o); });
  EXPECT_NE(line.find("sitl.toml:"), std::string::npos) << line;
  EXPECT_NE(line.find("; the messages are in " + (folder / "log.mcap").string()), std::string::npos) << line;
  EXPECT_EQ(test::refusal([&] { record(loopback(domain), mapping(domain), o); }),
            (folder / "log.mcap").string() +
                ": exists, and a flight cannot be recorded twice; accepted: a name that is not in use");
}

}  // namespace
}  // namespace flappy::server
