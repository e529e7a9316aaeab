// The exported controller and policy as a process of their own, at the other end of DDS.
#include "server/sitl/sitl.hpp"

#include <thread>

#include "flight/setup.hpp"
#include "io/progress.hpp"
#include "server/dds_fixture.hpp"
#include "tools/own_flight.hpp"

namespace flappy::server {
namespace {

using deploy::escape;
using rollout::FlyConfig;
using Words = std::vector<std::string>;

/// Compiles the onboard loop with its DDS port around the headers of an escape, once.
const std::string& pilot() {
  static const flight::Folder folder;
  static const std::string program = [] {
    folder.write("flappy_policy.h", deploy::escape_headers().policy);
    folder.write("flappy_controller.h", deploy::escape_headers().controller);
    const std::string at = flight::source_path("tools/onboard/"), idl = FLAPPY_BUILD_DIR "/src/";
    Words command = {"gcc", "-std=c99", "-O2"};
    for (const std::string& source :
         {at + "main.c", at + "onboard.c", at + "hal_dds.c", idl + "ros2_msgs.c", idl + "flappy_msgs.c"})
      command.push_back(source);
    for (const std::string& word : {"-I" + (folder / "").string(), "-I" + at, "-I" + idl, std::string("-lddsc"),
                                    std::string("-o"), (folder / "pilot").string()})
      command.push_back(word);
    const std::string complaints = deploy::run_limited(command).err;
    if (!complaints.empty()) throw std::runtime_error(complaints);
    return (folder / "pilot").string();
  }();
  return program;
}

/// The pilot as a process that finds us on the loopback interface, until it ends.
class Pilot {
 public:
  explicit Pilot(int domain)
      : thread_([this, domain] {
          finished_ = deploy::run_limited({"env", "CYCLONEDDS_URI=" + cyclone_xml(loopback(domain)),
                                           "ROS_DOMAIN_ID=" + std::to_string(domain), pilot()});
        }) {}
  ~Pilot() {
    if (thread_.joinable()) thread_.join();
  }
  int exit_code() { return thread_.join(), finished_.exit_code; }

 private:
  io::Finished finished_;
  std::thread thread_;
};

FlyConfig led(FlyConfig config, double duration_s) {
  config.actor.reset();
  config.fleet.task.forbid_actions();
  config.dds.domain = own_domain();
  config.duration_s = duration_s;
  return config;
}

constexpr int kManoeuvre = 700, kPeriods = 1000;

SitlOptions options() {
  SitlOptions o;
  o.manoeuvre_s = kManoeuvre * 0.002;
  return o;
}

TEST(Sitl, FliesInLockStepAsInOneProcess) {
  const FlyConfig config = escape();
  deploy::OwnFlight own(config, 0);
  for (int period = 0; period < kPeriods; ++period) {
    if (period == kManoeuvre) own.begin();
    own.fleet().step();
  }
  pilot();  // compiled before the clock runs
  const FlyConfig flown = led(config, kPeriods * 0.002);
  Pilot process(flown.dds.domain);
  const SitlResult r = fly_sitl(flown, options());
  EXPECT_EQ(process.exit_code(), 0);
  EXPECT_EQ(r.periods, static_cast<std::uint64_t>(kPeriods));
  EXPECT_EQ(r.missed + r.refused + r.stray, 0U);
  EXPECT_EQ(r.hash, own.fleet().batch().hash(0, 1));
  EXPECT_FALSE(r.crashed);
}

TEST(Sitl, CountsWhatARealTimeFlightMisses) {
  const FlyConfig flown = led(escape(), 0.5);
  pilot();
  Pilot process(flown.dds.domain);
  SitlOptions o = options();
  o.lock_step = false;
  const double started_s = io::steady_seconds();
  const SitlResult r = fly_sitl(flown, o);
  EXPECT_EQ(process.exit_code(), 0);
  EXPECT_GE(io::steady_seconds() - started_s, 0.5);
  EXPECT_EQ(r.periods, 250U);
  EXPECT_LT(r.missed, 250U) << "no input came in time at all";
  EXPECT_GE(r.missed, r.stray) << "an input that came late was missed before";
}

TEST(Sitl, SaysWhenNobodyFlies) {
  SitlOptions o = options();
  o.timeout_s = 0.05;
  EXPECT_EQ(test::refusal([&] { fly_sitl(led(escape(), 1), o); }),
            "no autopilot reads /flappy/tick within 0.05 s; accepted: one in the same domain and within dds.reach");
}

TEST(Sitl, RefusesATaskOfVoltages) {
  const FlyConfig config = rollout::read_fly_config(flight::source_path("configs/fly/hover_voltages.toml"));
  EXPECT_EQ(
      test::refusal([&] { fly_sitl(config, options()); }),
      "task \"hover_voltages\" sets the motors' voltages, but an autopilot sends inputs of the wing beat; accepted: "
      "a task whose action is of kind \"wing_beat\"");
}

/// An autopilot of the test, that answers every tick as it is told.
void answer(int domain, const std::function<std::optional<WingInput>(const Tick&)>& say) {
  const Participant p(loopback(domain));
  const Reader<Tick> ticks(p, "/flappy/tick", {true, true, 64});
  const Writer<WingInput> inputs(p, "/flappy/wing_input", {true, true, 64});
  WaitSet waiting(p);
  waiting.add(ticks.entity());
  for (bool over = false; !over && waiting.wait(std::chrono::seconds(2));)
    ticks.take([&](const Tick& t, const dds_sample_info_t&) {
      over |= t.wish == 255;
      if (auto input = over ? std::nullopt : say(t)) {
        char frame[] = "";
        input->header.frame_id = frame;
        inputs.write(*input);
      }
    });
}

TEST(Sitl, RefusesWhatIsNoNumberAndWhatIsForAnotherPeriod) {
  const FlyConfig flown = led(escape(), 0.2);  // long, for on a busy machine the first answers come late
  std::thread other([&] {
    answer(flown.dds.domain, [](const Tick& t) {
      WingInput u{};
      u.tick = t.tick % 10 == 5 ? t.tick - 1 : t.tick;
      u.amplitude_v = t.tick % 10 == 3 ? std::nan("") : 10;
      return u;
    });
  });
  SitlOptions o = options();
  o.lock_step = false;
  const SitlResult r = fly_sitl(flown, o);
  other.join();
  EXPECT_GE(r.refused, 1U);
  EXPECT_LE(r.refused, 10U) << "no others";
  EXPECT_GE(r.stray, 1U);
  EXPECT_GE(r.missed, 2U);
}

TEST(Sitl, EndsWhereALockStepIsNotAnswered) {
  const FlyConfig flown = led(escape(), 0.1);
  std::thread other([&] {
    answer(flown.dds.domain, [](const Tick& t) {
      WingInput u{};
      u.tick = t.tick;
      return t.tick < 3 ? std::optional(u) : std::nullopt;
    });
  });
  SitlOptions o = options();
  o.timeout_s = 2;
  EXPECT_EQ(test::refusal([&] { fly_sitl(flown, o); }),
            "no input for tick 3 within 2 s; accepted: an autopilot that answers every tick, or --real-time");
  other.join();
}

}  // namespace
}  // namespace flappy::server
