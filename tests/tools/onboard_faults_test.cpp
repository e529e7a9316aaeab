// The onboard loop in the simulator: it does what it promises when something fails.
#include "tools/onboard_fixture.hpp"

namespace flappy::deploy {
namespace {

/// What is seen of a flight with a fault.
struct Outcome {
  std::array<int, 6> periods{};  // in each state
  std::uint32_t flags = 0;
  bool same_voltages = true;  // as the flapper's driver
  float highest_V = 0, highest_V_off = 0;
  double moved_m = 0, tilt_rad = 0;  // in the second after `fault`, from where it was
};

Outcome fly(const Words& program, const Script& script, int fault = kNever, const FlyConfig& config = escape()) {
  Outcome seen;
  LedFlight led(of_nominal(config), 0, program);
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
    seen.moved_m =
        std::max(seen.moved_m, std::hypot(x.position_m[0] - there.position_m[0], x.position_m[1] - there.position_m[1],
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

TEST(OnboardFaults, DropsThePolicyUponNaN) {
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

TEST(OnboardFaults, DropsAPolicyThatActsTooLong) {
  const FlyConfig config = escape({});  // whose goal is 0.21 m and half a turn away
  Loop loop({policy_text(config), controller_text(config)});
  ASSERT_EQ(loop.build("gcc", {"-O1", "-DONBOARD_ACTING_US=100000U"}), "");
  const Outcome seen = fly(loop.program(), {}, 651, config);
  EXPECT_EQ(seen.flags, kPolicyTooLong);
  EXPECT_EQ(seen.periods[kActing], 51);
  expect_flies_on(seen);
  EXPECT_LT(seen.moved_m, 0.1);
}

TEST(OnboardFaults, TurnsOffWithoutAnImu) {
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

TEST(OnboardFaults, DeadReckonsWithoutMotionCapture) {
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

TEST(OnboardFaults, DropsThePolicyUponALateTick) {
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

TEST(OnboardFaults, NeverActsAfterAFault) {
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

TEST(OnboardFaults, BeginsNowhereElse) {
  Loop loop(escape_headers());
  for (const char* limit : {"-DONBOARD_PLACE_M=1e-6F", "-DONBOARD_HEADING_RAD=1e-6F"}) {
    ASSERT_EQ(loop.build("gcc", {"-O1", limit}), "");
    EXPECT_EQ(fly(loop.program(), {}).flags, kUnready) << limit;
  }
}

TEST(OnboardFaults, JudgesSamplesAndWishes) {
  Loop loop(escape_headers());
  ASSERT_EQ(loop.build_around(source_path("tests/tools/onboard_checks.c")), "");
  const io::Finished checks = run_limited(loop.program());
  EXPECT_EQ(checks.exit_code, 0);
  EXPECT_EQ(checks.out, "all hold\n");
}

TEST(OnboardFaults, Stops) {
  Script script;
  script.stop = 700;
  const Outcome seen = fly(escape_loop(), script);
  EXPECT_EQ(seen.flags, kStopped);
  EXPECT_EQ(seen.periods[kOff], script.periods - 700);
  EXPECT_EQ(seen.highest_V_off, 0);
}

TEST(OnboardFaults, ClampsVoltages) {
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

TEST(OnboardFaults, TurnsOffWithoutAnEstimate) {
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

TEST(OnboardFaults, RefusesWhatIsCorrupted) {
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

TEST(OnboardFaults, DoesNotCompileWithHeadersThatDoNotFit) {
  const auto complaint = [](const Headers& headers) {
    Loop loop(headers);
    return first_complaint(loop.build("gcc"));
  };
  const auto has = [](const std::string& text, const char* part) { return text.find(part) != text.npos; };
  const Headers& good = escape_headers();
  Words other = kShort;
  other.push_back("task.action.repeat_s=0.02");
  EXPECT_TRUE(has(complaint({policy_text(escape(other)), good.controller}), "differ in task, periods, signals"));
  other.back() = "task.action.repeat_s=0.012";
  other.push_back("flight.control_hz=250.0");
  EXPECT_TRUE(has(complaint({policy_text(escape(other)), controller_text(escape(other))}), "is not this loop's"));
  EXPECT_TRUE(
      has(complaint({replaced(good.policy, "FLAPPY_POLICY_FORMAT 1", "FLAPPY_POLICY_FORMAT 2"), good.controller}),
          "is of another format"));
}

}  // namespace
}  // namespace flappy::deploy
