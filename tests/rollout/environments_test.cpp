#include "rollout/environments.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>

#include "rollout/rollout.hpp"
#include "sim/storage.hpp"
#include "vehicles.hpp"

namespace flappy::rollout {
namespace {

const std::string kHover = test::source_path("configs/fly/hover_direct.toml");
const std::string kEscape = test::source_path("configs/fly/escape.toml");
const std::string kVoltages = test::source_path("configs/fly/hover_voltages.toml");

/// Environments with the memory that their steps are written to.
struct Bench {
  std::unique_ptr<Environments> all;
  std::vector<float> observation, reward;
  std::unique_ptr<bool[]> terminated, truncated;

  Bench(const std::string& config, const std::vector<std::string>& overrides, const EnvironmentOptions& options)
      : all(make_environments(read_fly_config(config, overrides), options)),
        observation(options.count * all->observed().size()),
        reward(options.count),
        terminated(new bool[options.count]()),
        truncated(new bool[options.count]()) {}
  Bench(const Bench& of)
      : all(of.all->copy()),
        observation(of.observation),
        reward(of.reward),
        terminated(new bool[reward.size()]()),
        truncated(new bool[reward.size()]()) {}
  void reset(std::optional<std::uint64_t> seed) {
    all->reset(seed, observation.data());
    std::ranges::fill(reward, 0.0F);
    for (std::size_t i = 0; i < reward.size(); ++i) terminated[i] = truncated[i] = false;
  }
  void step(const std::vector<float>& action) {
    all->step(action.data(), {observation.data(), reward.data(), terminated.get(), truncated.get()});
  }
  const float* row(std::size_t i) const { return &observation[i * all->observed().size()]; }
  std::size_t actions() const { return all->actions().size(); }
};

/// Something to do that differs from one environment to the next and from step to step.
std::vector<float> some_actions(std::size_t count, std::size_t actions, int step, std::uint32_t first = 0) {
  std::vector<float> list;
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t k = 0; k < actions; ++k)
      list.push_back(0.4F * static_cast<float>(
                                std::sin(static_cast<double>(first + i) + 0.7 * static_cast<double>(k) + 0.3 * step)));
  return list;
}

/// Hash of the whole course of environment `i`: observations, rewards and ends of all steps.
std::uint64_t course(Bench& bench, std::size_t i, std::uint64_t before) {
  const auto add = [&](float x) { before = sim::mixed(before, std::bit_cast<std::uint32_t>(x)); };
  for (std::size_t k = 0; k < bench.all->observed().size(); ++k) add(bench.row(i)[k]);
  add(bench.reward[i]);
  return sim::mixed(before, (bench.terminated[i] ? 2U : 0U) + (bench.truncated[i] ? 1U : 0U));
}

/// What flappy-fly flies, action by action.
TEST(Environments, FlyAsFlappyFlyDoes) {
  for (const auto& flown : {std::pair{kHover, std::vector<std::string>{}},
                            {kEscape, {"precision=\"double\"", "flight.first_flapper=5"}},
                            {kVoltages, {}},
                            {kEscape, {"task.history=2"}}}) {
    const auto& path = flown.first;
    const auto& overrides = flown.second;
    const FlyConfig config = read_fly_config(path, overrides);
    Bench bench(path, overrides, {3, Autoreset::disabled});
    bench.reset(config.fleet.seed);
    const auto compare = [&]<class T>(T) {
      flight::Fleet<T> fleet(3, config.vehicle, config.fleet);
      const auto hover =
          config.fleet.task.start.settled
              ? settle<T>(config.fleet, 3, kHover_s, [&](std::uint32_t f) { return config.vehicle_of(f); })
              : std::vector<flight::Snapshot<T>>();
      for (std::size_t i = 0; i < 3; ++i) Rollout<T>::start(fleet, config, i, 0, hover.empty() ? nullptr : &hover[i]);
      for (int step = 0; step < 12; ++step) {
        for (std::size_t i = 0; i < 3; ++i) {
          const std::vector<double> seen = fleet.observation(i);
          for (std::size_t k = 0; k < seen.size(); ++k)
            ASSERT_EQ(bench.row(i)[k], static_cast<float>(seen[k])) << path << i << k;
        }
        const auto action = some_actions(3, bench.actions(), step);
        fleet.set_actions(0, std::vector<T>(action.begin(), action.end()).data());
        std::vector<double> reward(3);
        for (std::uint32_t k = 0; k < config.fleet.task.action_repeat; ++k) {
          fleet.step();
          for (std::size_t i = 0; i < 3; ++i) reward[i] += fleet.reward(i);
        }
        bench.step(action);
        for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(bench.reward[i], reward[i], 1e-5 * std::abs(reward[i])) << path;
      }
      std::uint64_t hash = 0;
      for (std::size_t i = 0; i < 3; ++i) hash = sim::mixed(hash, fleet.batch().hash(i, i + 1));
      EXPECT_EQ(bench.all->hash(0, 3), hash) << path;
    };
    if (config.precision == "float") compare(0.0F);
    else compare(0.0);
  }
}

/// For every kind of vehicle and memory; an episode ends before the copy is made, and one after it.
TEST(Environments, CopiesFlyOnToTheSameBytes) {
  const std::vector<std::string> ends = {"task.end.time_s=0.06"};
  const std::vector<std::string> sees_more = {"task.end.time_s=0.06", "task.history=2", "precision=\"double\""};
  for (const auto& [config, overrides] : {std::pair{kHover, ends},
                                          {kEscape, sees_more},
                                          {test::source_path("configs/fly/quadrotor.toml"), ends},
                                          {test::source_path("configs/fly/hummingbird_driven.toml"), ends},
                                          {test::source_path("configs/fly/perching.toml"), ends}}) {
    constexpr std::size_t kCount = 2;
    Bench bench(config, overrides, {kCount, Autoreset::same_step});
    const auto flown = [](Bench& b, int from, int to, float sign = 1) {
      std::uint64_t hash = 0;
      for (int step = from; step < to; ++step) {
        std::vector<float> action = some_actions(kCount, b.actions(), step);
        for (float& a : action) a *= sign;
        b.step(action);
        for (std::size_t i = 0; i < kCount; ++i) hash = course(b, i, hash);
      }
      return sim::mixed(hash, b.all->hash(0, kCount));
    };
    const int before = static_cast<int>(std::lround(0.08 / bench.all->step_s())), after = 2 * before;
    std::uint64_t expected = 0;
    for (int k = 0; k < 2; ++k) {
      bench.reset(3);
      flown(bench, 0, before);
      if (k == 0) expected = flown(bench, before, after);
    }
    const std::uint32_t episode = bench.all->episode(0);
    Bench twin(bench), other(bench);
    EXPECT_NE(flown(other, before, after, -1), expected) << config;
    EXPECT_EQ(flown(bench, before, after), expected) << config << ": the original, beside a copy that flew elsewhere";
    bench.all.reset();
    EXPECT_EQ(flown(twin, before, after), expected) << config;
    EXPECT_GT(twin.all->episode(0), episode) << config;
  }
}

/// Environment 17 is the same alone, among 24 and among 200 on two threads, over several episodes.
TEST(Environments, DependOnTheirNumberAlone) {
  const std::vector<std::string> brief = {"task.end.time_s=0.15", "task.end.distance_m=0.12"};
  const auto hash_of = [&](std::size_t count, std::uint32_t first, int threads) {
    std::vector<std::string> overrides = brief;
    overrides.push_back("flight.first_flapper=" + std::to_string(first));
    overrides.push_back("flight.threads=" + std::to_string(threads));
    Bench bench(kHover, overrides, {count, Autoreset::same_step});
    bench.reset(3);
    std::uint64_t hash = 0;
    for (int step = 0; step < 40; ++step) {
      bench.step(some_actions(count, bench.actions(), step, first));
      hash = course(bench, 17 - first, hash);
    }
    EXPECT_GT(bench.all->episode(17 - first), 1U);
    return sim::mixed(hash, bench.all->hash(17 - first, 18 - first));
  };
  const std::uint64_t alone = hash_of(1, 17, 1);
  EXPECT_EQ(hash_of(24, 0, 1), alone);
  EXPECT_EQ(hash_of(200, 0, 2), alone);
  EXPECT_EQ(hash_of(24, 10, 2), alone);
}

TEST(Environments, StartAnewAsTheyStartedFirst) {
  for (const std::string& path : {kHover, kEscape}) {
    Bench bench(path, {"task.end.time_s=0.3"}, {2, Autoreset::same_step});
    const auto fly = [&](std::optional<std::uint64_t> seed) {
      bench.reset(seed);
      std::uint64_t hash = course(bench, 1, 0);
      for (int step = 0; step < 45; ++step) {
        bench.step(some_actions(2, bench.actions(), step));
        hash = course(bench, 1, hash);
      }
      return hash;
    };
    const std::uint64_t first = fly(7), second = fly(std::nullopt), other = fly(8);
    EXPECT_EQ(fly(7), first);
    EXPECT_NE(second, first);
    EXPECT_NE(other, first);
  }
}

TEST(Environments, StartTheNextEpisodeAsAsked) {
  const std::vector<std::string> brief = {"task.end.time_s=0.05", "task.success.capture.distance_m=1"};
  for (const Autoreset mode : {Autoreset::same_step, Autoreset::next_step, Autoreset::disabled}) {
    Bench bench(kHover, brief, {2, mode}), next(kHover, brief, {2, mode});
    bench.reset(1);
    next.reset(1);
    next.reset(std::nullopt);
    for (int step = 0; step < 5; ++step) {
      EXPECT_FALSE(bench.truncated[0]);
      bench.step(some_actions(2, bench.actions(), step));
    }
    EXPECT_TRUE(bench.truncated[0] && !bench.terminated[0]);
    ASSERT_TRUE(bench.all->ended()[0] && bench.all->ended()[1]);
    const EndedEpisode& ended = bench.all->episodes()[0];
    EXPECT_EQ(ended.length, 5);
    EXPECT_GT(ended.episode_return, bench.reward[0]);
    EXPECT_EQ(ended.causes, flight::kTimeOut);
    EXPECT_TRUE(ended.success);
    // the first row of the next episode, once it has started; until then the last of the one before
    const auto starts = [&] { return std::equal(bench.row(0), bench.row(1), next.row(0)); };
    EXPECT_EQ(starts(), mode == Autoreset::same_step);
    EXPECT_EQ(std::equal(bench.row(0), bench.row(1), bench.all->final_observation()), mode != Autoreset::same_step);
    if (mode == Autoreset::disabled) {
      const bool which[2] = {true, false};
      const std::vector<float> before = bench.observation;
      bench.all->reset(which, bench.observation.data());
      EXPECT_TRUE(starts());
      EXPECT_TRUE(std::equal(bench.row(1), bench.row(1) + 18, &before[18]));
    } else {
      bench.step(some_actions(2, bench.actions(), 5));
      EXPECT_FALSE(bench.truncated[0] || bench.all->ended()[0]);
      EXPECT_EQ(starts(), mode == Autoreset::next_step);
      EXPECT_EQ(bench.reward[0] == 0, mode == Autoreset::next_step);
    }
    EXPECT_EQ(bench.all->episode(0), 1U);
  }
}

TEST(Environments, SucceedAsTheTaskSays) {
  const auto success = [](const std::vector<std::string>& overrides) {
    Bench bench(kHover, overrides, {1, Autoreset::disabled});
    bench.reset(1);
    for (int step = 0; step < 400 && !bench.all->ended()[0]; ++step) bench.step(std::vector<float>(4, 0.0F));
    return bench.all->episodes()[0].success;
  };
  EXPECT_TRUE(success({"task.end.time_s=0.05", "task.success.capture.distance_m=1"}));
  EXPECT_FALSE(success({"task.end.time_s=0.05", "task.success.capture.distance_m=1e-6"}));  // never captured
  EXPECT_FALSE(success({"task.end.time_s=0.05", "task.success.capture.distance_m=1", "task.success.keep.from_s=0.01",
                        "task.success.keep.distance_m=1e-6"}));                              // lost
  EXPECT_FALSE(success({"task.end.distance_m=0.12", "task.success.capture.distance_m=1"}));  // fell before its time
}

/// The escape hands back at 0.35 s and pays until 0.62 s: there its environment ends.
TEST(Environments, EndOnceTheyAreHandedBackAndPaid) {
  Bench bench(kEscape, {}, {1, Autoreset::disabled});
  bench.reset(1);
  int steps = 0;
  while (!bench.terminated[0] && ++steps < 100) bench.step(std::vector<float>(4, 0.0F));
  EXPECT_TRUE(steps == 62 || bench.all->episodes()[0].causes != 0) << steps;
}

TEST(Environments, RefuseAnExcitationThatChanges) {
  const std::string config = test::source_path("configs/fly/identify_multisine.toml");
  try {
    make_environments(read_fly_config(config), {});
    FAIL();
  } catch (const io::InputError& e) {
    EXPECT_TRUE(std::string(e.what()).starts_with("excitation: belongs to flights")) << e.what();
  }
}

}  // namespace
}  // namespace flappy::rollout
