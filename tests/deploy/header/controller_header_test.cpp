// The exported controller flies side by side with the lanes: to the bit, at every tick.
#include "deploy/header/controller_header.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <deque>
#include <memory>
#include <random>

#include "deploy/header/controller_library.hpp"
#include "deploy/proof/board.hpp"
#include "flight/flight_block.hpp"
#include "full.hpp"
#include "model/jointed.hpp"
#include "rollout/rollout.hpp"
#include "sim/storage.hpp"

namespace flappy::deploy {
namespace {

using flight::Fleet;
using flight::FlightBlock;
using flight::source_path;
using rollout::FlyConfig;

const std::string kEveryPart =
    R"(task.observation=["rotation_matrix","position_error","velocity","body_rate","beat_phase","heading_error",)"
    R"("previous_action","goal_rotation","time","trim"])";

/// Random weights, large enough that the outputs reach their ends.
std::shared_ptr<const policy::Actor> random_actor(const flight::Task& task) {
  policy::Actor a;
  a.task = task.name;
  for (const auto& s : task.observation()) a.observation.push_back(s.name);
  for (const auto& s : task.action()) a.action.push_back(s.name);
  a.widths = {static_cast<int>(a.observation.size()), 16, flight::kMaxActions};
  std::mt19937 random(7);
  for (std::size_t i = 0; i < policy::weight_count(a.widths); ++i)
    a.weights.push_back(static_cast<double>(random()) / 4294967296.0 - 0.5);
  a.mean.assign(a.observation.size(), 0);
  a.scale.assign(a.observation.size(), 0.5);
  return std::make_shared<const policy::Actor>(a);
}

FlyConfig config_of(const std::string& name, const std::vector<std::string>& overrides = {}) {
  FlyConfig c = rollout::read_fly_config(source_path("configs/fly/" + name + ".toml"), overrides);
  c.actor = random_actor(c.fleet.task);
  return c;
}

const policy::RunInfo kRun{"0123", "abcd", false, "a task"};

/// The header as gcc makes it at its lowest level and clang at its highest, as gcc alone for `few`; with --full as both do at every level.
std::vector<std::unique_ptr<ControllerLibrary>> libraries(const std::string& header, bool few = false) {
  std::vector<std::unique_ptr<ControllerLibrary>> list;
  for (const char* compiler : {"gcc", "clang"})
    for (const auto& level : {std::vector<std::string>{"-O0"}, {"-O2"}, {"-O3", "-march=native"}}) {
      if (few && !list.empty()) continue;
      const bool both_ends = level[0] == (std::string(compiler) == "gcc" ? "-O0" : "-O3");
      if (!few && !test::full() && !both_ends) continue;
      std::vector<std::string> options{compiler};
      options.insert(options.end(), level.begin(), level.end());
      list.push_back(std::make_unique<ControllerLibrary>(header, options));
    }
  return list;
}

/// Rows of a flight's block.
std::vector<float> rows(const std::vector<float>& all, std::size_t offset, std::size_t count) {
  const auto begin = all.begin() + static_cast<std::ptrdiff_t>(offset / sizeof(float[flight::kLanes<float>]));
  return {begin, begin + static_cast<std::ptrdiff_t>(count)};
}

testing::AssertionResult same_bits(const std::vector<float>& is, const std::vector<float>& should_be) {
  if (is.size() != should_be.size()) return testing::AssertionFailure() << is.size() << " numbers";
  for (std::size_t i = 0; i < is.size(); ++i)
    if (std::memcmp(&is[i], &should_be[i], sizeof(float)) != 0)
      return testing::AssertionFailure() << "number " << i << ": " << is[i] << ", not " << should_be[i];
  return testing::AssertionSuccess();
}

std::int64_t whole_us(double s) { return std::llround(s * 1e6); }

struct Sample {
  std::int64_t taken_us, arrived_us;
  bool valid;
  std::vector<float> x;
};

/// What is to be seen of a flight, so that a test cannot pass on an empty sky.
struct Seen {
  int handed_back = 0, early = 0, lost = 0, updates = 0;  // early: before its time
};

/// Flies `count` vehicles and their controllers in every library, or in one, for `periods`.
Seen fly_beside(const FlyConfig& config, std::size_t count, int periods, bool few = false) {
  rollout::Rollout<float> flights(config, count);
  Fleet<float>& fleet = flights.fleet();
  const flight::FleetOptions& o = fleet.options();
  fleet.record(true);

  const auto all = libraries(controller_header(config, kRun, record_controller(config)), few);
  const std::uint32_t zero_us = 0U - static_cast<std::uint32_t>(whole_us(fleet.period_s()) * (periods / 3));  // wraps
  std::vector<std::vector<ControllerUnit>> units(all.size());
  const auto estimator_of = [](const auto& s) {
    return rows(s.flight, offsetof(FlightBlock<float>, estimator), flight::kEstimatorRows);
  };
  const auto estimate_of = [](const auto& s) {
    return rows(s.flight, offsetof(FlightBlock<float>, estimate), flight::kEstimateRows);
  };
  const auto pid_of = [](const auto& s) {
    return rows(s.flight, offsetof(FlightBlock<float>, controller), model::kRows<flight::Pid>);
  };
  for (std::size_t l = 0; l < all.size(); ++l)
    for (std::size_t i = 0; i < count; ++i) {
      const auto s = fleet.snapshot(i);
      ControllerUnit& c = units[l].emplace_back(*all[l]);
      c.load(c.at(), zero_us, estimator_of(s).data(), estimate_of(s).data(), pid_of(s).data(), s.phase);
    }

  const std::size_t observed = o.task.observation().size();
  std::vector<std::vector<std::vector<float>>> observation(periods + 1,
                                                           std::vector(count, std::vector<float>(observed)));
  std::vector<std::deque<Sample>> imu(count), poses(count);
  Seen seen;
  for (int period = 0; period < periods; ++period) {
    for (std::size_t i = 0; i < count; ++i) fleet.observation(i, observation[period][i].data());
    flights.step();
    const std::int64_t end_us = whole_us(fleet.period_s()) * (period + 1);
    for (std::size_t i = 0; i < count; ++i) {
      for (const auto& s : fleet.imu_samples(i)) {
        const std::int64_t at = whole_us(s.arrival_s);
        std::vector<float> x;
        for (const double v : s.gyro_rad_s) x.push_back(static_cast<float>(v));
        for (const double v : s.accel_m_s2) x.push_back(static_cast<float>(v));
        imu[i].push_back({at - whole_us(o.sensors.imu.latency_s), at, true, x});
      }
      for (const auto& s : fleet.mocap_samples(i)) {
        const std::int64_t at = whole_us(s.arrival_s);
        std::vector<float> x;
        for (const double v : s.position_m) x.push_back(static_cast<float>(v));
        for (const double v : s.attitude) x.push_back(static_cast<float>(v));
        if (!s.valid) x = {1e30F, 0, 0, std::nanf(""), 0, 0, 0}, ++seen.lost;  // nobody may look at it
        poses[i].push_back({at - whole_us(o.sensors.mocap.latency_s), at, s.valid, x});
      }
      const auto now = fleet.snapshot(i);
      const auto updates = rollout::driver_updates(fleet, i);
      const auto adds = fleet.adds(i);
      const sim::Input u = fleet.input(i);
      const std::vector<float> input = {static_cast<float>(u.amplitude_V), static_cast<float>(u.difference_V),
                                        static_cast<float>(u.bias_V), static_cast<float>(u.split_cycle)};
      seen.updates += static_cast<int>(updates.size());
      std::vector<float> driven;  // voltages of the motors, or the robot's inputs
      for (const auto& d : updates)
        driven.insert(driven.end(), {static_cast<float>(d.left_V), static_cast<float>(d.right_V)});
      if (!model::mixed_inputs(config.vehicle).empty())
        for (driven.clear(); const double x : sim::storage_of(fleet.batch()).inputs_of(i))
          driven.push_back(static_cast<float>(x));
      for (std::size_t l = 0; l < all.size(); ++l) {
        ControllerUnit& c = units[l][i];
        const auto where = [&] {
          return all[l]->name() + ", flapper " + std::to_string(i) + ", period " + std::to_string(period);
        };
        std::vector<float> row(observed), is(4), is_driven;
        c.observe(c.at(), row.data());
        const auto fail = [&](const char* what, const auto& result) {
          EXPECT_TRUE(result) << what << " of " << where();
          return !result;
        };
        if (fail("observation", same_bits(row, observation[period][i]))) return seen;
        c.act(c.at(), adds.data());
        c.steer(c.at(), is.data());
        if (fail("input", same_bits(is, input))) return seen;
        const std::size_t calls = model::mixed_inputs(config.vehicle).empty() ? updates.size() : 1;
        for (std::size_t d = 0; d < calls; ++d) {
          std::vector<float> held(driven.size() / calls);
          c.drive(c.at(), held.data());
          is_driven.insert(is_driven.end(), held.begin(), held.end());
        }
        if (fail("voltages or inputs", same_bits(is_driven, driven))) return seen;
        for (const Sample& s : imu[i])
          if (s.arrived_us <= end_us)
            EXPECT_TRUE(c.imu(c.at(), zero_us + static_cast<std::uint32_t>(s.taken_us), s.x.data()));
        for (const Sample& s : poses[i])
          if (s.arrived_us <= end_us)
            EXPECT_TRUE(c.pose(c.at(), zero_us + static_cast<std::uint32_t>(s.taken_us), s.valid, s.x.data()));
        const bool back = c.tick(c.at(), zero_us + static_cast<std::uint32_t>(end_us)) != 0;
        if (fail("hand-back", testing::AssertionResult(back == fleet.handed_back(i)))) return seen;
        std::vector<float> estimator(flight::kEstimatorRows), estimate(flight::kEstimateRows),
            pid(model::kRows<flight::Pid>);
        c.state(c.at(), estimator.data(), estimate.data(), pid.data());
        if (fail("estimator", same_bits(estimator, estimator_of(now))) ||
            fail("estimate", same_bits(estimate, estimate_of(now))) || fail("PID", same_bits(pid, pid_of(now))))
          return seen;
      }
      const double at_s = o.task.constants.hand_back.at_s;
      if (std::abs((period + 1) * fleet.period_s() - (at_s - fleet.period_s())) < 1e-6)
        seen.early += fleet.handed_back(i);
      const auto past = [&](const Sample& s) { return s.arrived_us <= end_us; };
      std::erase_if(imu[i], past);
      std::erase_if(poses[i], past);
    }
  }
  for (std::size_t i = 0; i < count; ++i) seen.handed_back += fleet.handed_back(i);
  return seen;
}

TEST(ControllerHeader, FliesAnEscapeAsTheLanesDo) {
  const FlyConfig config = config_of("escape");
  const int flights = test::full() ? 64 : 8;
  const Seen seen = fly_beside(config, flights, 1500);
  EXPECT_EQ(seen.handed_back, flights);
  EXPECT_EQ(seen.updates, flights * 3000);
}

/// Above a PID with a notch. Actions come at once, as from the exported C.
TEST(ControllerHeader, FiltersTheWingBeatAsTheLanesDo) {
  fly_beside(config_of("escape_robust", {"drawn_jitter.action_s=0"}), 4, 400, true);
}

TEST(ControllerHeader, HandsBackWhereItArrives) {
  // each with limits that decide: some arrive, some are handed back to at the time
  const std::vector<std::string> wide = {"task.hand_back.distance_m=0.3", "task.hand_back.speed_m_s=9.0",
                                         "task.hand_back.tilt_rad=1.5", "task.hand_back.heading_rad=3.1",
                                         "task.hand_back.body_rate_rad_s=90.0"};
  for (const std::vector<std::string>& narrow :
       std::vector<std::vector<std::string>>{{"heading_rad=3.0", "body_rate_rad_s=8.0", "x_m=-0.2", "distance_m=0.22"},
                                             {"tilt_rad=0.12", "x_m=-0.19"},
                                             {"speed_m_s=0.3", "x_m=-0.19"},
                                             {"speed_x_m_s=0.1", "x_m=-0.19"}}) {
    std::vector<std::string> overrides = wide;
    for (const std::string& n : narrow) overrides.push_back("task.hand_back." + n);
    const Seen seen = fly_beside(config_of("escape", overrides), 32, 180, true);
    EXPECT_EQ(seen.handed_back, 32) << narrow[0];
    EXPECT_GT(seen.early, 0) << narrow[0];
    EXPECT_LT(seen.early, 32) << narrow[0];
  }
}

TEST(ControllerHeader, SeesEveryPart) { fly_beside(config_of("escape", {kEveryPart}), 4, 250); }

/// A robot that is known by its mean forces, under the policy alone and under the PID.
TEST(ControllerHeader, SetsTheInputsOfABeatAveragedRobot) {
  fly_beside(config_of("flapper_dash"), 4, 600);
  fly_beside(config_of("flapper_nimble", {"precision=\"float\""}), 4, 300, true);
}

/// Turns on its way.
const std::string kTurns =
    "task.path.waypoint=[{t_s=0.0,x_m=0.0,y_m=0.0,z_m=0.0},{t_s=1.0,x_m=0.0,y_m=0.1,z_m=0.3,heading_rad=0.8},"
    "{t_s=2.5,x_m=0.4,y_m=0.1,z_m=0.4,heading_rad=-2.0},{t_s=3.5,x_m=0.4,y_m=-0.2,z_m=0.4,heading_rad=-4.0}]";

TEST(ControllerHeader, FollowsAPathThroughLosses) {
  if (!test::full()) GTEST_SKIP() << "onboard_test flies losses and late samples, too: with --full";
  const Seen seen =
      fly_beside(config_of("waypoints",
                           {kEveryPart, kTurns, "sensors.mocap.loss_probability=0.05", "sensors.mocap.loss_length=4.0",
                            "sensors.imu.rate_hz=1000.0", "sensors.imu.low_pass_hz=90.0", "sensors.mocap.rate_hz=240.0",
                            "sensors.mocap.latency_s=0.0231", "sensors.imu.position_m={x=0.01,y=-0.02,z=0.03}"}),
                 8, 2000);
  EXPECT_GT(seen.lost, 100);
}

TEST(ControllerHeader, WaitsForALateImu) {
  if (!test::full()) GTEST_SKIP() << "onboard_test flies losses and late samples, too: with --full";
  fly_beside(config_of("figure_eight",
                       {"sensors.imu.latency_s=0.004", "sensors.mocap.latency_s=0.0", "sensors.imu.rate_hz=400.0"}),
             4, 1500);
}

TEST(ControllerHeader, WorksOutTheSameMathematics) {
  // every so many bit patterns, negative, subnormal, infinite and NaN ones too, beside another and near 1
  const std::uint64_t stride = test::full() ? 1009 : 65537;
  std::vector<float> x, y;
  const auto number = [](std::uint32_t bits) { return std::bit_cast<float>(bits); };
  for (std::uint64_t bits = 0; bits < (std::uint64_t{1} << 32); bits += stride) {
    x.push_back(number(static_cast<std::uint32_t>(bits)));
    y.push_back(number(static_cast<std::uint32_t>(bits * 2654435761U)));
    if (bits % 16 == 0) x.push_back(static_cast<float>(bits % 4000001) * 1e-6F - 2), y.push_back(x[x.size() / 2]);
  }
  for (const std::uint32_t bits :
       {0U, 1U, 0x007fffffU, 0x00800000U, 0x3f800000U, 0x3f7fffffU, 0x7f7fffffU, 0x7f800000U, 0x7fc00000U})
    for (const std::uint32_t other : {0U, 1U, 0x3f800000U, 0x7f7fffffU, 0x7f800000U, 0x7fc00000U})
      for (const std::uint32_t signs : {0U, 1U, 2U, 3U}) {
        x.push_back(number(bits | signs << 31));
        y.push_back(number(other | (signs & 2U) << 30));
      }
  using L = model::Lanes<float, 1>;
  const auto of = [](L l) { return l.raw[0]; };
  const auto all = libraries(controller_header(config_of("escape"), kRun, record_controller(config_of("escape"))));
  std::vector<float> lanes, out(10 * x.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    const L a(x[i]), b(y[i]);
    const auto near = model::sin_cos(a), pi = model::sin_cos_pi(a), wide = model::sin_cos_wide(a);
    for (const L& each : {L(sqrt(a)), L(model::atan2(b, a)), L(model::asin(a)), near.sin, near.cos, pi.sin, pi.cos,
                          wide.sin, wide.cos, L(model::cos_pi(a))})
      lanes.push_back(of(each));
  }
  for (const auto& library : all) {
    library->function<void(const float*, const float*, float*, std::uint32_t)>("w_mathematics")(
        x.data(), y.data(), out.data(), static_cast<std::uint32_t>(x.size()));
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      for (std::size_t k = 0; k < 10; ++k) {
        const float is = out[10 * i + k], lane = lanes[10 * i + k];
        const bool same = std::isnan(lane) ? std::isnan(is) : std::memcmp(&is, &lane, sizeof is) == 0;
        if (!same && wrong++ < 5)
          ADD_FAILURE() << library->name() << ", function " << k << " of " << x[i] << ", " << y[i] << ": " << is
                        << ", not " << lane;
      }
    }
    EXPECT_EQ(wrong, 0u);
  }
}

/// A header of the escape, once.
const std::string& escape_header() {
  static const std::string text = controller_header(config_of("escape"), kRun, record_controller(config_of("escape")));
  return text;
}

TEST(ControllerHeader, TestsItself) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  for (const auto& library : libraries(escape_header())) {
    EXPECT_EQ(library->function<int()>("w_selftest")(), 0) << library->name();
    EXPECT_EQ(library->function<float()>("w_selftest_error")(), 0) << library->name();
  }
  const FlyConfig lossy = config_of("waypoints", {"sensors.mocap.loss_probability=0.2", "sensors.imu.latency_s=0.003",
                                                  "sensors.mocap.latency_s=0.0"});
  for (const int begin : {1, 60}) {
    const ControllerTrace trace = record_controller(lossy, 20, begin);
    const ControllerLibrary late(controller_header(lossy, kRun, trace), {"gcc", "-O0"});
    EXPECT_EQ(late.function<float()>("w_selftest_error")(), 0) << begin;
  }
  // what is computed otherwise is found, by the trace or by a sample that gets in
  const FlyConfig flies = config_of("hover");
  const std::string header = controller_header(flies, kRun, record_controller(flies, 20, 60));
  const auto test_of = [&](const std::string& right, const std::string& wrong) {
    std::string text = header;
    if (text.find(right) == std::string::npos) return -1;
    text.replace(text.find(right), right.size(), wrong);
    return ControllerLibrary(text, {"gcc", "-O0"}).function<int()>("w_selftest")();
  };
  EXPECT_EQ(test_of("/* forward */", "/* forward */"), 0);
  EXPECT_EQ(test_of("m->integral_x += flappy", "m->integral_x += 2.0F * flappy"), 2);
  EXPECT_EQ(test_of("const float share = ", "const float share = 0.99F * "), 2);
  EXPECT_EQ(test_of("a_l = flappy_velocity_pid(&k->left", "a_l = flappy_velocity_pid(&k->forward"), 2);
  EXPECT_EQ(test_of("u.amplitude_V = k->hover_V", "u.amplitude_V = -k->hover_V"), 2);
  EXPECT_EQ(test_of("return flappy_within(flappy_fma(amplitude", "return flappy_within(-flappy_fma(amplitude"), 2);
  EXPECT_EQ(test_of("if (!flappy_plausible_imu(gyro_rad_s, accel_m_s2)", "if (0"), 3);
  EXPECT_EQ(test_of("if (!flappy_plausible_pose(position_m, attitude)", "if (0"), 3);
  EXPECT_EQ(test_of("#define FLAPPY_CONTROLLER_LENGTH_LIMIT 0.1F", "#define FLAPPY_CONTROLLER_LENGTH_LIMIT 1.1F"), 3);
  EXPECT_EQ(test_of("flappy_abs(square - 1.0F) <", "square - 1.0F <"), 3);
  EXPECT_EQ(test_of("flappy_abs(square - 1.0F) <", "1.0F - square <"), 3);
}

TEST(ControllerHeader, CatchesEveryFlippedBit) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  const ControllerLibrary library(escape_header(), {"gcc", "-O2", "-Dconst="});
  const auto test = library.function<int()>("w_selftest");
  const auto list = library.function<std::uint32_t(std::uint32_t, std::uint32_t**)>("w_constants");
  ASSERT_EQ(test(), 0);
  std::size_t flipped = 0, missed = 0;
  std::uint32_t* words = nullptr;
  for (std::uint32_t which = 0; const std::uint32_t count = list(which, &words); ++which)
    for (std::uint32_t i = 0; i < count; ++i)
      for (unsigned bit = 0; bit < 32; ++bit) {
        words[i] ^= 1U << bit;
        missed += test() == 0;
        words[i] ^= 1U << bit;
        ++flipped;
      }
  EXPECT_EQ(missed, 0u);
  EXPECT_GT(flipped, 10000u);
  EXPECT_EQ(test(), 0);
}

TEST(ControllerHeader, CompilesWithoutAWarning) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  const flight::Folder folder;
  const std::string use =
      "#include \"flappy_controller.h\"\n#include \"flappy_controller.h\"\n"
      "int use(flappy_controller *c, float *obs);\n"
      "int use(flappy_controller *c, float *obs) { flappy_controller_observe(c, obs); return "
      "flappy_controller_selftest(); }\n";
  const FlyConfig flapper = config_of("flapper_dash");
  for (const std::string& header : {escape_header(), controller_header(flapper, kRun, record_controller(flapper))})
    for (const std::string suffix : {"c", "cpp"}) {
      folder.write("flappy_controller.h", header);
      const std::string source = folder.write("use." + suffix, use);
      for (const std::string compiler : {suffix == "c" ? "gcc" : "g++", suffix == "c" ? "clang" : "clang++"})
        for (const char* level : {"-O0", "-O3"}) {
          const io::Finished f =
              io::run({compiler, suffix == "c" ? "-std=c99" : "-std=c++17", level, "-Wall", "-Wextra", "-Wpedantic",
                       "-Wconversion", "-Wfloat-equal", "-Wdouble-promotion", "-Wshadow", "-Werror", "-c", source, "-o",
                       folder / "use.o"});
          EXPECT_EQ(f.exit_code, 0) << compiler << level << f.err;
        }
    }
}

TEST(ControllerHeader, IsTheSameFromAnyNumberOfThreads) {
  FlyConfig config = config_of("escape");
  config.fleet.batch.threads = 2;
  EXPECT_EQ(controller_header(config, kRun, record_controller(config)), escape_header());
  config.fleet.batch.instruction_set = "scalar";
  EXPECT_EQ(controller_header(config, kRun, record_controller(config)), escape_header());
}

TEST(ControllerHeader, RefusesWhatItCannotExport) {
  const ControllerTrace trace = record_controller(config_of("escape"));
  const auto refused = [&](const std::vector<std::string>& overrides) {
    return flight::message([&] { controller_header(config_of("escape", overrides), kRun, trace); });
  };
  EXPECT_EQ(refused({"controller=../controllers/arc.toml"}),
            "controller: is none that can be exported; accepted: kind = \"pid\"");
  EXPECT_EQ(
      refused({"task.observation=[\"goal_rotation\", \"wings\"]"}),
      "controller: cannot be exported: the policy sees the wings, which it has no sensor for; accepted: a task that "
      "leaves it to fly");
  EXPECT_EQ(refused({"flight.control_hz=300.0", "flight.step_s=3.3333333333333335e-5"}),
            "a control period of 0.0033333333333333335 s is no whole number of microseconds, in which headers count; "
            "accepted: one that is");
}

TEST(ControllerHeader, SaysHowLateSamplesAre) {
  const FlyConfig late = config_of("hover", {"sensors.imu.latency_s=0.004", "sensors.mocap.latency_s=0.0231"});
  const std::string text = controller_header(late, kRun, record_controller(late));
  // periods: one of waiting, 12 of latency, 4 of the time between two frames; two to spare
  for (const char* line : {"IMU_LATENCY_US 4000U", "POSE_LATENCY_US 23100U", "RING 18U", "later than 36 ms is dropped"})
    EXPECT_NE(text.find(line), text.npos) << line;
}

TEST(ControllerHeader, FliesOnAMicrocontroller) {
  if (!board_missing().empty()) GTEST_SKIP() << board_missing();
  const flight::Folder folder;
  folder.write("flappy_controller.h", escape_header());
  const std::string source =
      folder.write("main.c",
                   "#include \"flappy_controller.h\"\nint main(void) {\n"
                   "  const float error = flappy_controller_selftest_error();\n"
                   "  return 10 * flappy_controller_selftest() + (error == 0.0F ? 40 : 41);\n}\n");
  write_board(folder / "");
  for (const char* level : {"-O0", "-O2"}) {
    const io::Finished made = io::run(board_build(folder / "", {source}, {"-std=c99", level}, folder / "main.elf"));
    ASSERT_EQ(made.exit_code, 0) << made.err;
    EXPECT_EQ(run_limited(board_run(folder / "main.elf", false)).exit_code, 40) << level;  // to the bit there too
  }
}

/// A unit at rest, its clock about to wrap.
struct Rest {
  ControllerLibrary library{escape_header(), {"gcc", "-O2"}};
  ControllerUnit c{library};
  std::uint32_t now_us = 0xfffff000U;
  std::vector<float> origin = {0, 0, 0, 1, 0, 0, 0}, still = {0, 0, 0, 0, 0, 9.81F};
  Rest() { c.start(c.at(), now_us, origin.data()); }
  void period(int frame = -1, const std::vector<float>& pose = {0, 0, 0, 1, 0, 0, 0}) {
    float input[4];
    c.steer(c.at(), input);
    now_us += 2000;
    c.imu(c.at(), now_us, still.data());
    if (frame >= 0) c.pose(c.at(), now_us - 30000, frame, pose.data());
    c.tick(c.at(), now_us);
  }
  std::vector<float> estimate() {
    std::vector<float> estimator(46), estimate(13), pid(14);
    c.state(c.at(), estimator.data(), estimate.data(), pid.data());
    for (const auto* list : {&estimator, &estimate, &pid})
      for (const float x : *list) EXPECT_TRUE(std::isfinite(x));
    return estimate;
  }
};

TEST(ControllerHeader, StaysFiniteWithoutMotionCapture) {
  Rest rest;
  for (int i = 0; i < 5000; ++i) rest.period();
  const std::vector<float> x = rest.estimate();
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(x[k], 0, 0.1);
  // and takes a pose again, within the noise it reckons with by then
  for (int i = 0; i < 200; ++i) rest.period(i % 3 == 0 ? 1 : -1, {1, 2, 3, 1, 0, 0, 0});
  const std::vector<float> y = rest.estimate();
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(y[k], k + 1, 0.05);
}

TEST(ControllerHeader, DropsWhatIsNoSample) {
  Rest rest;
  const float nan = std::nanf(""), infinite = INFINITY;
  for (const float bad : {nan, infinite, -infinite, 1e30F})
    for (int k = 0; k < 6; ++k) {
      std::vector<float> x = rest.still;
      x[k] = bad;
      EXPECT_EQ(rest.c.imu(rest.c.at(), rest.now_us + 1000, x.data()), 0);
    }
  EXPECT_EQ(rest.c.imu(rest.c.at(), rest.now_us, rest.still.data()), 0);         // not newer
  EXPECT_EQ(rest.c.imu(rest.c.at(), rest.now_us - 1000, rest.still.data()), 0);  // older
  EXPECT_EQ(rest.c.imu(rest.c.at(), rest.now_us + 4001, rest.still.data()), 0);  // from the future
  for (int k = 0; k < 6; ++k) {
    std::vector<float> x = rest.still;
    x[k] = k < 3 ? 201.0F : -1001.0F;
    EXPECT_EQ(rest.c.imu(rest.c.at(), rest.now_us + 1000, x.data()), 0) << k;
    x[k] = k < 3 ? -199.0F : 999.0F;
    EXPECT_EQ(rest.c.imu(rest.c.at(), rest.now_us + 1000, x.data()), 1) << k;
    rest.c.start(rest.c.at(), rest.now_us, rest.origin.data());
  }
  EXPECT_EQ(rest.c.pose(rest.c.at(), rest.now_us, 1, rest.origin.data()), 0);  // at the horizon
  EXPECT_EQ(rest.c.pose(rest.c.at(), rest.now_us + 4001, 1, rest.origin.data()), 0);
  EXPECT_EQ(rest.c.imu(rest.c.at(), rest.now_us + 4000, rest.still.data()), 1);
  rest.now_us += 4000;
  rest.c.tick(rest.c.at(), rest.now_us);
  for (int i = 0; i < 30; ++i) rest.period();
  const auto before = rest.estimate();
  for (int k = 0; k < 7; ++k) {
    std::vector<float> x = {5, 5, 5, 1, 0, 0, 0};
    x[k] = k % 2 == 0 ? nan : infinite;
    rest.period(1, x);
  }
  for (const float q : {0.0F, 0.47F, 0.53F, 2.0F}) rest.period(1, {5, 5, 5, q, q, q, q});  // length 0, 0.94, 1.06, 4
  for (int i = 0; i < 30; ++i) rest.period();
  const auto after = rest.estimate();
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(after[k], before[k], 1e-3);
  const float added[4] = {nan, infinite, 0, -infinite};
  rest.c.act(rest.c.at(), added);
  float input[4];
  rest.c.steer(rest.c.at(), input);
  for (const float u : input) EXPECT_TRUE(std::isfinite(u));
}

TEST(ControllerHeader, OutlivesASilentImu) {
  Rest rest;
  for (int i = 0; i < 30; ++i) rest.period(i % 3 == 0 ? 1 : -1);
  rest.still = {3, -2, 5, 1, 2, 12};
  rest.period(1);
  for (int i = 0; i < 3000; ++i) {
    float input[4];
    rest.c.steer(rest.c.at(), input);
    rest.now_us += 2000;
    if (i % 3 == 0) rest.c.pose(rest.c.at(), rest.now_us - 30000, 1, rest.origin.data());
    rest.c.tick(rest.c.at(), rest.now_us);
  }
  rest.estimate();
}

}  // namespace
}  // namespace flappy::deploy
