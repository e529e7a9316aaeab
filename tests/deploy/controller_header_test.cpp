// The exported controller flies side by side with the lanes: to the bit, at every tick.
#include "deploy/controller_header.hpp"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <deque>
#include <memory>
#include <random>

#include "deploy/controller_library.hpp"
#include "flight/flight_block.hpp"
#include "flight/recorder.hpp"
#include "flight/settle.hpp"

namespace flappy::deploy {
namespace {

using flight::Fleet;
using flight::FlightBlock;
using flight::FlyConfig;
using flight::source_path;

const std::string kEveryPart =
    R"(task.observation=["rotation_matrix","position_error","velocity","body_rate","beat_phase","heading_error",)"
    R"("previous_action","goal_rotation","time","trim"])";

/// Random weights, large enough that the outputs reach their ends.
std::shared_ptr<const flight::Actor> random_actor(const flight::Task& task) {
  flight::Actor a;
  a.task = task.name;
  for (const auto& s : task.observation()) a.observation.push_back(s.name);
  for (const auto& s : task.action()) a.action.push_back(s.name);
  a.widths = {static_cast<int>(a.observation.size()), 16, flight::kActions};
  std::mt19937 random(7);
  for (std::size_t i = 0; i < flight::weight_count(a.widths); ++i)
    a.weights.push_back(static_cast<double>(random()) / 4294967296.0 - 0.5);
  a.mean.assign(a.observation.size(), 0);
  a.scale.assign(a.observation.size(), 0.5);
  return std::make_shared<const flight::Actor>(a);
}

FlyConfig config_of(const std::string& name, const std::vector<std::string>& overrides = {}) {
  FlyConfig c = flight::read_fly_config(source_path("configs/fly/" + name + ".toml"), overrides);
  c.actor = random_actor(c.fleet.task);
  return c;
}

const RunInfo kRun{"0123", "abcd", false, "a task"};

std::vector<std::unique_ptr<ControllerLibrary>> libraries(const std::string& header) {
  std::vector<std::unique_ptr<ControllerLibrary>> list;
  for (const char* compiler : {"gcc", "clang"})
    for (const auto& level : {std::vector<std::string>{"-O0"}, {"-O2"}, {"-O3", "-march=native"}}) {
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
  int handed_back = 0, lost = 0, updates = 0;
};

/// Flies `count` vehicles and their controllers in every library for `periods`.
Seen fly_beside(const FlyConfig& config, std::size_t count, int periods) {
  flight::FleetOptions o = config.fleet;
  o.batch.threads = 2;
  const auto vehicle = [&](std::uint32_t flapper) { return config.vehicle_of(flapper); };
  Fleet<float> fleet(count, config.vehicle, o);
  std::vector<flight::Snapshot<float>> hover;
  if (o.task.start.settled) hover = flight::settle<float>(o, count, flight::kHover_s, vehicle);
  for (std::size_t i = 0; i < count; ++i) {
    if (hover.empty()) {
      fleet.set_vehicle(i, vehicle(static_cast<std::uint32_t>(i) + o.first_flapper));
      fleet.start(i, 0);
    } else {
      fleet.start(i, 0, hover[i]);
    }
  }
  fleet.set_actor(config.actor);
  fleet.record(true);

  const auto all = libraries(controller_header(config, kRun, record_controller(config)));
  const std::uint32_t zero_us = 0U - static_cast<std::uint32_t>(whole_us(fleet.period_s()) * (periods / 3));  // wraps
  std::vector<std::vector<ControllerUnit>> units(all.size());
  const auto estimator_of = [](const auto& s) {
    return rows(s.flight, offsetof(FlightBlock<float>, fusion), flight::kFusionRows);
  };
  const auto estimate_of = [](const auto& s) {
    return rows(s.flight, offsetof(FlightBlock<float>, estimate), flight::kEstimateRows);
  };
  const auto pid_of = [](const auto& s) {
    return rows(s.flight, offsetof(FlightBlock<float>, controller), flight::kPidRows);
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
    fleet.step();
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
      const auto updates = driver_updates(fleet, i);
      const auto adds = fleet.adds(i);
      const sim::Input u = fleet.input(i);
      const std::vector<float> input = {static_cast<float>(u.amplitude_V), static_cast<float>(u.difference_V),
                                        static_cast<float>(u.bias_V), static_cast<float>(u.split_cycle)};
      seen.updates += static_cast<int>(updates.size());
      std::vector<float> volts;
      for (const auto& d : updates)
        volts.insert(volts.end(), {static_cast<float>(d.left_V), static_cast<float>(d.right_V)});
      for (std::size_t l = 0; l < all.size(); ++l) {
        ControllerUnit& c = units[l][i];
        const auto where = [&] {
          return all[l]->name() + ", flapper " + std::to_string(i) + ", period " + std::to_string(period);
        };
        std::vector<float> row(observed), is(4), left_right;
        c.observe(c.at(), row.data());
        const auto fail = [&](const char* what, const auto& result) {
          EXPECT_TRUE(result) << what << " of " << where();
          return !result;
        };
        if (period > 0) {
          if (fail("observation", same_bits(row, observation[period][i]))) return seen;
        } else {  // the lanes show the first one in double
          for (std::size_t k = 0; k < observed; ++k) EXPECT_NEAR(row[k], observation[0][i][k], 1e-5) << where();
        }
        c.act(c.at(), adds.data());
        c.steer(c.at(), is.data());
        if (fail("input", same_bits(is, input))) return seen;
        for (std::size_t d = 0; d < updates.size(); ++d) {
          float v[2];
          c.drive(c.at(), v);
          left_right.insert(left_right.end(), {v[0], v[1]});
        }
        if (fail("voltages", same_bits(left_right, volts))) return seen;
        for (const Sample& s : imu[i])
          if (s.arrived_us <= end_us)
            EXPECT_TRUE(c.imu(c.at(), zero_us + static_cast<std::uint32_t>(s.taken_us), s.x.data()));
        for (const Sample& s : poses[i])
          if (s.arrived_us <= end_us)
            EXPECT_TRUE(c.pose(c.at(), zero_us + static_cast<std::uint32_t>(s.taken_us), s.valid, s.x.data()));
        const bool back = c.tick(c.at(), zero_us + static_cast<std::uint32_t>(end_us)) != 0;
        if (fail("hand-back", testing::AssertionResult(back == fleet.handed_back(i)))) return seen;
        std::vector<float> estimator(flight::kFusionRows), estimate(flight::kEstimateRows), pid(flight::kPidRows);
        c.state(c.at(), estimator.data(), estimate.data(), pid.data());
        if (fail("estimator", same_bits(estimator, estimator_of(now))) ||
            fail("estimate", same_bits(estimate, estimate_of(now))) || fail("PID", same_bits(pid, pid_of(now))))
          return seen;
      }
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
  const Seen seen = fly_beside(config, 64, 1500);
  EXPECT_EQ(seen.handed_back, 64);
  EXPECT_EQ(seen.updates, 64 * 3000);
}

TEST(ControllerHeader, SeesEveryPart) { fly_beside(config_of("escape", {kEveryPart}), 4, 250); }

TEST(ControllerHeader, FollowsAPathThroughLosses) {
  const Seen seen =
      fly_beside(config_of("waypoints",
                           {kEveryPart, "sensors.mocap.loss_probability=0.05", "sensors.mocap.loss_length=4.0",
                            "sensors.imu.rate_hz=1000.0", "sensors.imu.low_pass_hz=90.0", "sensors.mocap.rate_hz=240.0",
                            "sensors.mocap.latency_s=0.0231", "sensors.imu.position_m={x=0.01,y=-0.02,z=0.03}"}),
                 8, 2000);
  EXPECT_GT(seen.lost, 100);
}

TEST(ControllerHeader, WaitsForALateImu) {
  fly_beside(config_of("figure_eight",
                       {"sensors.imu.latency_s=0.004", "sensors.mocap.latency_s=0.0", "sensors.imu.rate_hz=400.0"}),
             4, 1500);
}

}  // namespace
}  // namespace flappy::deploy
