// The onboard loop in the simulator: it flies as the lanes do, to the bit, and does what it promises when something fails.
#include <gtest/gtest.h>

#include <cstddef>
#include <random>

#include "deploy/board.hpp"
#include "deploy/controller_header.hpp"
#include "deploy/policy_header.hpp"
#include "deploy/rollout.hpp"
#include "flight/constants.hpp"
#include "io/run_program.hpp"
#include "sim/storage.hpp"
#include "tools/onboard_loop.hpp"

namespace flappy::deploy {
namespace {

using flight::Fleet;
using flight::FlightBlock;
using flight::Folder;
using flight::FlyConfig;
using flight::source_path;
using Words = std::vector<std::string>;

/// Keeps roll, pitch and height much as the feedback would, besides small weights of everything it sees.
std::shared_ptr<const flight::Actor> upright_actor(const flight::Task& task) {
  flight::Actor a;
  a.task = task.name;
  std::mt19937 random(3);
  for (const auto& s : task.observation()) a.observation.push_back(s.name);
  for (const auto& s : task.action()) a.action.push_back(s.name);
  a.widths = {static_cast<int>(a.observation.size()), flight::kActions};
  a.mean.assign(a.observation.size(), 0);
  a.scale.assign(a.observation.size(), 1);
  a.clip = 100;
  const double none[] = {-0.235, 0, 0, 0};  // what adds nothing, of -5 to 8 V for the amplitude
  for (int out = 0; out < flight::kActions; ++out) {
    a.weights.push_back(none[out]);
    for (const std::string& name : a.observation) {
      double w = (name.starts_with("trim") ? 0.0002 : 0.005) * (static_cast<double>(random()) / 0x1p31 - 1);
      if (out == 0 && name == "z_error") w = -15 / 6.5;
      if (out == 0 && name == "z_velocity") w = -4 / 6.5;
      if (out == 1 && name == "goal_R_zy") w = -16.7 / 3;
      if (out == 1 && name == "roll_rate") w = -0.708 / 3;
      if (out == 2 && name == "goal_R_zx") w = 14.9 / 3.5;
      if (out == 2 && name == "pitch_rate") w = -0.319 / 3.5;
      a.weights.push_back(w);
    }
  }
  return std::make_shared<const flight::Actor>(a);
}

/// A short way, which the feedback can go if the policy does not.
const Words kShort = {"task.start.position_m.x=-0.05", "task.start.x_low_m=-0.1", "task.start.x_high_m=0.1",
                      "task.start.rotation_rad.z=0.1", "task.hand_back.distance_m=0.01"};

FlyConfig escape(const Words& overrides = kShort) {
  FlyConfig c = flight::read_fly_config(source_path("configs/fly/escape.toml"), overrides);
  c.actor = upright_actor(c.fleet.task);
  return c;
}

FlyConfig of_nominal(FlyConfig config) {
  config.randomisation.reset();
  return config;
}

const RunInfo kRun{std::string(64, 'a'), "0123456789ab", false, "escape"};

std::string policy_text(const FlyConfig& config) {
  const PolicyNetwork network = network_of(config);
  PolicyVectors v = every_nth(roll_out(config, 0, 4), network.inputs(), network.outputs(), 20);
  const PolicyVectors wild = corners(network, config.fleet.task.observation());
  v.observation.insert(v.observation.end(), wild.observation.begin(), wild.observation.end());
  v.action = evaluate(network, v.observation);
  return policy_header(config, kRun, network, v);
}

std::string controller_text(const FlyConfig& config) {
  return controller_header(config, kRun, record_controller(config));
}

struct Headers {
  std::string policy, controller;
};
const Headers& escape_headers() {
  static const Headers headers{policy_text(escape()), controller_text(escape())};
  return headers;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  if (at == std::string::npos) throw std::runtime_error("nowhere: " + from);
  return text.replace(at, from.size(), to);
}

/// The loop compiled around headers.
class Loop {
 public:
  explicit Loop(const Headers& headers) {
    folder_.write("flappy_policy.h", headers.policy);
    folder_.write("flappy_controller.h", headers.controller);
    write_board(folder_ / "");
  }
  /// Of this machine; the complaints of the compiler.
  std::string build(const std::string& compiler, const Words& options = {"-O1"}) {
    Words command = {compiler};
    append(command, strict());
    append(command, options);
    append(command, sources());
    append(command, {folder_ / "board_host.c", "-o", folder_ / "loop"});
    return run_limited(command).err;
  }
  std::string build_for_board(const Words& options = {"-O2"}) {
    Words all = strict();
    append(all, options);
    std::vector<std::filesystem::path> list;
    for (const std::string& s : sources()) list.emplace_back(s);
    return run_limited(board_build(folder_ / "", list, all, folder_ / "loop.elf")).err;
  }
  Words program() const { return {folder_ / "loop"}; }
  Words board() const { return board_run(folder_ / "loop.elf", false); }

 private:
  Words strict() const {
    Words options = {"-std=c99"};
    append(options, strict_options({folder_ / "", source_path("tools/onboard")}));
    return options;
  }
  static Words sources() {
    const std::string at = source_path("tools/onboard/");
    return {at + "main.c", at + "onboard.c", at + "hal_simulated.c"};
  }
  Folder folder_;
};

/// The escape's loop on this machine, once.
const Words& escape_loop() {
  static Loop loop(escape_headers());
  static const std::string complaints = loop.build("gcc", {"-O2"});
  if (!complaints.empty()) throw std::runtime_error(complaints);
  static const Words program = loop.program();
  return program;
}

// A flapper that flies by itself.

constexpr std::uint32_t kHoverTick = 1000000;  // of a path that begins with the goal and never gets there by itself

/// The escape with the place where it begins as a set point of its own.
flight::FleetOptions with_hover(const FlyConfig& config, std::uint32_t flapper) {
  flight::FleetOptions o = LedFlight::with_number(config.fleet, flapper);
  flight::Segment<double> hover{kHoverTick, {}};
  for (int i = 0; i < 3; ++i) hover.coefficients[i][0] = o.task.start.position_m[i].centre;
  hover.coefficients[3][0] = o.task.start.rotation_rad[2].centre;
  o.task.path.push_back(hover);
  return o;
}

FlightBlock<float>& block_of(Fleet<float>& fleet) {
  return *reinterpret_cast<FlightBlock<float>*>(fleet.memory()[1].data());
}

class OwnFlight {
  using L = model::Lanes<float, 1>;
  template <template <class> class S>
  static S<L> lanes_of(const float (*rows)[flight::kLanes<float>]) {
    return flight::rounded<L>(sim::get<S<double>>(rows, 0));
  }

 public:
  OwnFlight(const FlyConfig& config, std::uint32_t flapper)
      : fleet_(1, config.vehicle_of(flapper), with_hover(config, flapper)) {
    LedFlight::place(fleet_, config);
    fleet_.set_actor(config.actor);
    FlightBlock<float>& f = block_of(fleet_);
    auto estimate = sim::get<flight::Estimate<double>>(f.estimate, 0);
    estimate.velocity_m_s = estimate.body_rate_rad_s = {0, 0, 0};  // as an estimator assumes that sees the first pose
    sim::put(estimate, f.estimate, 0);
    auto fusion = sim::get<flight::Fusion<double>>(f.fusion, 0);
    fusion.horizon.velocity_m_s = fusion.now.velocity_m_s = {0, 0, 0};
    sim::put(fusion, f.fusion, 0);
    for (auto& row : f.controller) row[0] = 0;
    f.tick[0] = kHoverTick;
    set_handed_back(true);
  }
  /// The manoeuvre, from now on.
  void begin() {
    FlightBlock<float>& f = block_of(fleet_);
    const flight::Task& task = fleet_.options().task;
    f.tick[0] = f.segment[0] = 0;
    set_handed_back(false);
    const double middle[flight::kActions] = {};
    fleet_.set_action(0, middle);
    // what the end of the period before would have shown
    flight::Segment<float> goal{0, {}};
    for (int i = 0; i < 4; ++i)
      for (int k = 0; k < 6; ++k) goal.coefficients[i][k] = static_cast<float>(task.path[0].coefficients[i][k]);
    const flight::PathView<float> path{&goal, 1, static_cast<float>(fleet_.period_s())};
    const auto ref = flight::setpoint_at<L>(path, f.tick, f.segment);
    const auto pid = flight::rounded<float>(flight::flight_constants(fleet_.options()).pid);
    L row[flight::kMaxObservation];
    const int rows =
        flight::observe(task.parts, lanes_of<flight::Estimate>(f.estimate), ref, lanes_of<flight::Episode>(f.episode),
                        L(model::beat_fraction<float>(fleet_.snapshot(0).phase)), L(0),
                        flight::trim(pid, lanes_of<flight::Pid>(f.controller)), row);
    for (int i = 0; i < rows; ++i) f.observation[i][0] = row[i].raw[0];
  }
  Fleet<float>& fleet() { return fleet_; }

 private:
  void set_handed_back(bool to) {
    FlightBlock<float>& f = block_of(fleet_);
    auto episode = sim::get<flight::Episode<double>>(f.episode, 0);
    episode.handed_back = to;
    sim::put(episode, f.episode, 0);
  }
  Fleet<float> fleet_;
};

void fly_as_the_lanes(const FlyConfig& config, std::uint32_t flapper, const Words& program,
                      const Script& script = {}) {
  OwnFlight own(config, flapper);
  LedFlight led(config, flapper, program);
  for (const loop_output& said : led.before()) {
    ASSERT_EQ(said.state, kWaiting);
    for (std::uint32_t d = 0; d < said.drive_count; ++d) ASSERT_EQ(said.volts[d][0], 0);
  }
  int acted = 0;
  while (led.period() < script.periods) {
    const int period = led.period();
    if (period == script.manoeuvre) own.begin();
    ASSERT_TRUE(led.step(script)) << "voltages of period " << period;
    own.fleet().step();
    const auto is = led.fleet().snapshot(0), should_be = own.fleet().snapshot(0);
    ASSERT_EQ(is.phase, should_be.phase);
    for (std::size_t r = 0; r < is.body.size(); ++r)
      ASSERT_EQ(std::bit_cast<std::uint32_t>(is.body[r]), std::bit_cast<std::uint32_t>(should_be.body[r]))
          << "row " << r << " of the body, period " << period << ", flapper " << flapper << ": " << is.body[r]
          << ", not " << should_be.body[r];
    acted += led.said().state == kActing;
  }
  EXPECT_EQ(acted, 175);
  EXPECT_EQ(led.said().state, kReturned);
  EXPECT_EQ(led.said().flags, kHandedBack);
  EXPECT_EQ(led.program().finish(), 0);
  if (!config.randomisation) EXPECT_LT(led.distance_m(0), 0.05) << "of the goal";
}

TEST(Onboard, FliesAsTheLanesDo) {
  const FlyConfig config = escape(), nominal = of_nominal(config);
  fly_as_the_lanes(nominal, 0, escape_loop());
  for (std::uint32_t flapper = 0; flapper < 3; ++flapper) fly_as_the_lanes(config, flapper, escape_loop());
}

TEST(Onboard, FliesAnyPolicyAsTheLanesDo) {
  FlyConfig config = escape({});  // with its turn
  flight::Actor a = *config.actor;
  a.widths = {static_cast<int>(a.observation.size()), 16, 16, flight::kActions};
  a.hidden = flight::Activation::relu;
  std::mt19937 random(7);
  a.weights.clear();
  for (std::size_t i = 0; i < flight::weight_count(a.widths); ++i)
    a.weights.push_back(0.6 * (static_cast<double>(random()) / 0x1p31 - 1));
  config.actor = std::make_shared<const flight::Actor>(a);
  Loop loop({policy_text(config), controller_text(config)});
  ASSERT_EQ(loop.build("gcc"), "");
  for (std::uint32_t flapper = 0; flapper < 3; ++flapper) fly_as_the_lanes(config, flapper, loop.program());
}

/// What is seen of a flight with a fault.
struct Outcome {
  std::array<int, 6> periods{};  // in each state
  std::uint32_t flags = 0;
  bool same_voltages = true;  // as the flapper's driver
  float highest_V = 0, highest_V_off = 0;
  double moved_m = 0, tilt_rad = 0;  // in the second after `fault`, from where it was
};

Outcome fly(const Words& program, const Script& script, int fault = kNever) {
  Outcome seen;
  LedFlight led(of_nominal(escape()), 0, program);
  flight::Motion there{};
  while (led.period() < script.periods) {
    seen.same_voltages &= led.step(script);
    const loop_output& said = led.said();
    ++seen.periods[said.state];
    seen.flags = said.flags;
    for (std::uint32_t d = 0; d < said.drive_count; ++d)
      for (const float v : said.volts[d]) {
        float& highest = said.state == kOff || said.state == kRefused ? seen.highest_V_off : seen.highest_V;
        highest = v == v ? std::max(highest, std::abs(v)) : 1e9F;
      }
    if (led.period() < fault || led.period() > fault + 500) continue;
    const flight::Motion x = led.fleet().truth(0);
    if (led.period() == fault) there = x;
    seen.moved_m = std::max(seen.moved_m, std::hypot(x.position_m[0] - there.position_m[0],
                                                     x.position_m[1] - there.position_m[1],
                                                     x.position_m[2] - there.position_m[2]));
    seen.tilt_rad = std::max(seen.tilt_rad, led.tilt_rad());
  }
  EXPECT_EQ(led.program().finish(), 0);
  return seen;
}

/// Fly on where it was: half a metre is what a cage has room for, and a hover tilts by less than half a radian.
void expect_flies_on(const Outcome& seen) {
  EXPECT_TRUE(seen.same_voltages);
  EXPECT_LT(seen.moved_m, 0.3);
  EXPECT_LT(seen.tilt_rad, 0.6);
  EXPECT_EQ(seen.periods[kOff], 0);
}

TEST(Onboard, DropsThePolicyUponNaN) {
  Headers headers = escape_headers();
  headers.controller = replaced(headers.controller, "  (void)row;\n",
                                "  if (c->tick >= 31) {\n    flappy_float nan;\n    nan.bits = 0x7fc00000U;\n"
                                "    row[-1] = nan.number;\n  }\n");
  Loop loop(headers);
  ASSERT_EQ(loop.build("gcc"), "");
  const Outcome seen = fly(loop.program(), {}, 635);
  EXPECT_EQ(seen.flags, kPolicyRefused);
  EXPECT_EQ(seen.periods[kActing], 35);  // it acts every fifth
  expect_flies_on(seen);
}

TEST(Onboard, DropsAPolicyThatActsTooLong) {
  Loop loop(escape_headers());
  ASSERT_EQ(loop.build("gcc", {"-O1", "-DONBOARD_ACTING_US=100000U"}), "");
  const Outcome seen = fly(loop.program(), {}, 651);
  EXPECT_EQ(seen.flags, kPolicyTooLong);
  EXPECT_EQ(seen.periods[kActing], 51);
  expect_flies_on(seen);
}

TEST(Onboard, TurnsOffWithoutAnImu) {
  Script script;
  script.imu_silent = 650;
  for (const bool not_numbers : {false, true}) {
    script.not_numbers = not_numbers;
    const Outcome seen = fly(escape_loop(), script);
    EXPECT_EQ(seen.flags, kImuStale | kImuLost);
    EXPECT_EQ(seen.periods[kActing], 55);  // more than 10 ms after the sample at 649
    EXPECT_EQ(seen.periods[kReturned], 20);
    EXPECT_EQ(seen.periods[kOff], script.periods - 675);
    EXPECT_EQ(seen.highest_V_off, 0);
    EXPECT_GT(seen.highest_V, 5);
    EXPECT_TRUE(seen.same_voltages);
  }
  script.imu_back = 655;  // in time
  const Outcome brief = fly(escape_loop(), script);
  EXPECT_EQ(brief.flags, kHandedBack);
  EXPECT_EQ(brief.periods[kActing], 175);
  script.imu_back = 670;
  const Outcome longer = fly(escape_loop(), script, 655);
  EXPECT_EQ(longer.flags, kImuStale);
  expect_flies_on(longer);
}

TEST(Onboard, DeadReckonsWithoutMotionCapture) {
  Script script;
  script.mocap_silent = 650;
  script.periods = 1500;
  for (const bool not_numbers : {false, true}) {
    script.not_numbers = not_numbers;
    Outcome seen = fly(escape_loop(), script, 676);
    EXPECT_EQ(seen.flags, kPoseStale | kPoseLost);
    EXPECT_NEAR(seen.periods[kActing], 75, 2);  // a frame comes every 3.3 periods
    EXPECT_NEAR(seen.periods[kReturned], 725, 1);
    EXPECT_NEAR(seen.periods[kOff], 100, 2);
    EXPECT_EQ(seen.highest_V_off, 0);
    seen.periods[kOff] = 0;
    expect_flies_on(seen);
  }
}

TEST(Onboard, DropsThePolicyUponALateTick) {
  Script script;
  script.late = 650;
  script.late_us = 900;
  const Outcome hardly = fly(escape_loop(), script);
  EXPECT_EQ(hardly.flags, kHandedBack);
  script.late_us = 1100;
  const Outcome late = fly(escape_loop(), script, 651);
  EXPECT_EQ(late.flags, kLate);
  EXPECT_EQ(late.periods[kActing], 50);
  EXPECT_LT(late.moved_m, 0.3);
  script.late_us = 0;
  script.late_periods = 3;
  const Outcome later = fly(escape_loop(), script, 654);
  EXPECT_EQ(later.flags, kLate);
  EXPECT_EQ(later.periods[kActing], 50);
  expect_flies_on(later);  // the beat has kept its time
}

TEST(Onboard, NeverActsAfterAFault) {
  Script script;
  script.mocap_silent = 300, script.mocap_back = 350;
  const Outcome seen = fly(escape_loop(), script, 700);
  EXPECT_EQ(seen.flags, kPoseStale | kUnready);
  EXPECT_EQ(seen.periods[kHovering], script.periods);
  expect_flies_on(seen);
  Script early;
  early.manoeuvre = 499;
  EXPECT_EQ(fly(escape_loop(), early).flags, kUnready);
  early.manoeuvre = 500;
  EXPECT_EQ(fly(escape_loop(), early).flags, kHandedBack);
}

TEST(Onboard, Stops) {
  Script script;
  script.stop = 700;
  const Outcome seen = fly(escape_loop(), script);
  EXPECT_EQ(seen.flags, kStopped);
  EXPECT_EQ(seen.periods[kOff], script.periods - 700);
  EXPECT_EQ(seen.highest_V_off, 0);
}

TEST(Onboard, ClampsVoltages) {
  Script script;
  script.periods = 100;
  Loop low(escape_headers());
  ASSERT_EQ(low.build("gcc", {"-O1", "-DONBOARD_LIMIT_V=7.0F"}), "");
  const Outcome seen = fly(low.program(), script);
  EXPECT_EQ(seen.highest_V, 7);
  EXPECT_EQ(seen.flags, kClamped);

  Headers headers = escape_headers();
  headers.controller = replaced(headers.controller, "  c->phase += FLAPPY_CONTROLLER_PHASE_STEP;\n",
                                "  c->phase += FLAPPY_CONTROLLER_PHASE_STEP;\n"
                                "  if (c->tick == 90 && c->hovering) *left_V = *left_V / 0.0F * 0.0F;\n");
  Loop loop(headers);
  ASSERT_EQ(loop.build("gcc"), "");
  LedFlight led(of_nominal(escape()), 0, loop.program());
  while (led.period() < 95) {
    const bool same = led.step(script);
    EXPECT_EQ(same, led.period() != 91);
    const loop_output& said = led.said();
    for (std::uint32_t d = 0; d < said.drive_count; ++d) {
      EXPECT_EQ(said.volts[d][0] == 0, led.period() == 91) << led.period();
      EXPECT_NE(said.volts[d][1], 0);
    }
    EXPECT_EQ(said.flags, led.period() > 91 ? kClamped : 0U);
  }
}

TEST(Onboard, TurnsOffWithoutAnEstimate) {
  Script script;
  script.periods = 200;
  Headers headers = escape_headers();
  headers.controller = replaced(headers.controller, "  flappy_controller_estimate(c);\n",
                                "  flappy_controller_estimate(c);\n"
                                "  if (c->tick == 99 && c->hovering) c->estimate.attitude.x /= 0.0F;\n");
  Loop loop(headers);
  ASSERT_EQ(loop.build("gcc"), "");
  const Outcome seen = fly(loop.program(), script);
  EXPECT_EQ(seen.flags, kNotFinite);
  EXPECT_EQ(seen.periods[kHovering], 100);
  EXPECT_EQ(seen.periods[kOff], 100);
  EXPECT_EQ(seen.highest_V_off, 0);
}

TEST(Onboard, RefusesWhatIsCorrupted) {
  const auto state_of = [](const Headers& headers) {
    Loop loop(headers);
    EXPECT_EQ(loop.build("gcc"), "");
    Script script;
    script.periods = 50;
    LedFlight led(of_nominal(escape()), 0, loop.program());
    float highest_V = 0;
    while (led.period() < 50) {
      led.step(script);
      for (std::uint32_t d = 0; d < led.said().drive_count; ++d)
        for (const float v : led.said().volts[d]) highest_V = std::max(highest_V, std::abs(v));
    }
    EXPECT_EQ(highest_V == 0, led.said().state == kRefused);
    return std::pair{led.said().state, led.said().flags};
  };
  // the last bit of a weight, and of a gain
  const auto corrupted = [](const std::string& text, const std::string& list) {
    const std::size_t at = text.find("p-", text.find(list)) - 1;
    return text.substr(0, at) + (text[at] == '2' ? '4' : '2') + text.substr(at + 1);
  };
  const Headers& good = escape_headers();
  EXPECT_EQ(state_of(good), std::pair(std::uint32_t{kHovering}, 0U));
  EXPECT_EQ(state_of({corrupted(good.policy, "flappy_policy_weights["), good.controller}),
            std::pair(std::uint32_t{kRefused}, std::uint32_t{kBadPolicy}));
  EXPECT_EQ(state_of({good.policy, corrupted(good.controller, "flappy_controller_k = {")}),
            std::pair(std::uint32_t{kRefused}, std::uint32_t{kBadController}));
}

TEST(Onboard, DoesNotCompileWithHeadersThatDoNotFit) {
  const auto complaint = [](const Headers& headers) {
    Loop loop(headers);
    return first_complaint(loop.build("gcc"));
  };
  const auto has = [](const std::string& text, const char* part) { return text.find(part) != text.npos; };
  const Headers& good = escape_headers();
  Words other = kShort;
  other.push_back("task.action.hold_s=0.02");
  EXPECT_TRUE(has(complaint({policy_text(escape(other)), good.controller}), "differ in task, periods, signals"));
  other.back() = "task.action.hold_s=0.012";
  other.push_back("flight.control_hz=250.0");
  EXPECT_TRUE(has(complaint({policy_text(escape(other)), controller_text(escape(other))}), "is not this loop's"));
  EXPECT_TRUE(has(complaint({replaced(good.policy, "FLAPPY_POLICY_FORMAT 1", "FLAPPY_POLICY_FORMAT 2"),
                             good.controller}),
                  "is of another format"));
}

TEST(Onboard, IsTheSameFromOtherCompilers) {
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
  if (const std::string missing = board_missing(); !missing.empty()) GTEST_SKIP() << missing;
  Loop loop(escape_headers());
  ASSERT_EQ(loop.build_for_board(), "");
  Script script;  // bytes are slow there
  script.manoeuvre = 500;
  script.periods = 800;
  fly_as_the_lanes(of_nominal(escape()), 0, loop.board(), script);
}

}  // namespace
}  // namespace flappy::deploy
