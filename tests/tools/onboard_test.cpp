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

/// Keeps roll and pitch as the feedback would, besides small weights of everything it sees.
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
      double w = 0.005 * (static_cast<double>(random()) / 0x1p31 - 1);
      if (out == 1 && name == "goal_R_zy") w = -16.7 / 3;
      if (out == 1 && name == "roll_rate") w = -0.708 / 3;
      if (out == 2 && name == "goal_R_zx") w = 14.9 / 3.5;
      if (out == 2 && name == "pitch_rate") w = -0.319 / 3.5;
      a.weights.push_back(w);
    }
  }
  return std::make_shared<const flight::Actor>(a);
}

FlyConfig escape(const Words& overrides = {}) {
  FlyConfig c = flight::read_fly_config(source_path("configs/fly/escape.toml"), overrides);
  c.actor = upright_actor(c.fleet.task);
  return c;
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

[[maybe_unused]] std::string replaced(std::string text, const std::string& from, const std::string& to) {
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
  std::string build(const std::string& compiler, const Words& options = {"-O2"}) {
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
  static const std::string complaints = loop.build("gcc");
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

void fly_as_the_lanes(const FlyConfig& config, std::uint32_t flapper, const Words& program) {
  const Script script;
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
  EXPECT_LT(led.distance_m(0), 0.1) << "of the goal";
}

TEST(Onboard, FliesAsTheLanesDo) {
  for (std::uint32_t flapper = 0; flapper < 4; ++flapper) fly_as_the_lanes(escape(), flapper, escape_loop());
}

}  // namespace
}  // namespace flappy::deploy
