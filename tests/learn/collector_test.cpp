// What reaches the replay memory, by what each flight must have earned.
#include "learn/collector.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

#include "learn/training.hpp"
#include "sim/lanes.hpp"

namespace flappy::learn {
namespace {

constexpr int kSteps = 60;  // of 10 ms: every flight begins again

/// A policy that stirs.
std::shared_ptr<const policy::Actor> actor_of(const TrainConfig& c) {
  policy::Actor a = c.blank_actor();
  a.widths = {static_cast<int>(a.observation.size()), 5, static_cast<int>(a.action.size())};
  a.mean.assign(a.observation.size(), 0);
  a.scale.assign(a.observation.size(), 0.3);
  for (std::size_t k = 0; k < policy::weight_count(a.widths); ++k)
    a.weights.push_back(static_cast<double>(k * 29 % 61) / 128 - 0.25);
  return std::make_shared<policy::Actor>(std::move(a));
}

struct Collected {
  Replay replay;
  EpisodeSums sums;
  std::uint64_t episodes, env_steps;
};

Collected collect(const TrainConfig& c, int steps = kSteps) {
  Collector collector(c);
  Replay replay(c.learner.shape, c.replay);
  const auto actor = actor_of(c);
  for (int step = 0; step < steps; ++step) {
    collector.begin(actor);
    for (std::size_t i = collector.items(); i-- > 0;) collector.run(i);
    collector.end(replay);
  }
  const std::uint64_t episodes = collector.episodes(), env_steps = collector.env_steps();
  return {std::move(replay), collector.take_sums(), episodes, env_steps};
}

/// A reward that can be told from how long a flight lasts: 1 a period.
Overrides plain(std::size_t steps) {
  Overrides list = {"learn.replay=20000",  "reward.scale=0.5",
                    "reward.discount=0.9", "reward.steps=" + std::to_string(steps),
                    "task.reward.alive=1", "task.reward.until_s=0"};
  for (const char* off : {"action", "near", "facing", "level", "goal", "arrival", "kept"})
    list.push_back(std::string("task.reward.") + off + "=0");
  return list;
}

class Transitions {
 public:
  Transitions(const TrainConfig& c, const Replay& replay)
      : replay_(replay), flappers_(c.flappers), inputs_(c.learner.shape.observation) {
    const auto signals = c.fly.fleet.task.observation();
    for (std::size_t k = 0; k < signals.size(); ++k)
      if (signals[k].name == "time") time_ = k;
  }
  /// With a return of one step there is one transition of every flapper in each step.
  const float* row(int step, std::size_t i) const {
    return replay_.row(static_cast<std::size_t>(step) * flappers_ + i);
  }
  const float* seen(const float* row) const { return row + replay_.layout().observation; }
  const float* next(const float* row) const { return row + replay_.layout().next_observation; }
  float reward(const float* row) const { return row[replay_.layout().reward]; }
  float discount(const float* row) const { return row[replay_.layout().discount]; }
  double time_s(const float* observation) const { return observation[time_]; }
  bool same(const float* a, const float* b) const { return std::equal(a, a + inputs_, b); }

 private:
  const Replay& replay_;
  std::size_t flappers_;
  int inputs_;
  std::size_t time_ = 0;
};

TEST(Collector, OneStepTransitionsAreWhatWasFlown) {
  const TrainConfig c = small_training(plain(1));
  const Collected all = collect(c);
  ASSERT_EQ(all.replay.size(), kSteps * c.flappers);
  const Transitions t(c, all.replay);
  double episodes = 0, returns = 0;
  for (std::size_t i = 0; i < c.flappers; ++i) {
    double since = 0;
    for (int step = 0; step < kSteps; ++step) {
      const float* row = t.row(step, i);
      ASSERT_NEAR(t.time_s(t.next(row)), t.time_s(t.seen(row)) + 0.01, 1e-6);
      const bool ended = t.discount(row) == 0;
      ASSERT_NEAR(t.reward(row), 0.5 * 5, 1e-5);  // the periods of an action, handed back within it or not
      since += t.reward(row);
      if (ended) episodes += 1, returns += since, since = 0;
      else ASSERT_FLOAT_EQ(t.discount(row), 0.9F);
      if (step + 1 == kSteps) continue;
      const float* after = t.row(step + 1, i);
      EXPECT_EQ(t.same(t.next(row), t.seen(after)), !ended);
      EXPECT_EQ(t.time_s(t.seen(after)) == 0, ended);
    }
  }
  EXPECT_GE(episodes, c.flappers);  // 0.6 s of flights of at most 0.35 s
  EXPECT_EQ(all.sums.episodes, episodes);
  EXPECT_EQ(all.episodes, episodes);
  EXPECT_NEAR(all.sums.returns, returns, 1e-3 * returns);
  EXPECT_EQ(all.sums.handed_back + all.sums.terminated, episodes);
  EXPECT_EQ(all.env_steps, kSteps * 5 * c.flappers);
}

TEST(Collector, ReturnsAreSumsOverTheirSteps) {
  const TrainConfig one = small_training(plain(1)), three = small_training(plain(3));
  const Collected single = collect(one), summed = collect(three);
  const Transitions s(one, single.replay);
  // by their first observation, which no two transitions share
  const auto key = [&](const Transitions& t, const float* row) {
    return std::vector<float>(t.seen(row), t.seen(row) + one.learner.shape.observation);
  };
  const Transitions m(three, summed.replay);
  std::map<std::vector<float>, const float*> rows;
  for (std::size_t k = 0; k < summed.replay.size(); ++k) rows[key(m, summed.replay.row(k))] = summed.replay.row(k);
  EXPECT_EQ(rows.size(), summed.replay.size());
  std::size_t compared = 0, cut_short = 0;
  for (std::size_t i = 0; i < one.flappers; ++i)
    for (int step = 0; step + 3 <= kSteps; ++step) {
      const float* row = s.row(step, i);
      double sum = 0, weight = 1;
      const float* last = row;
      for (int k = 0; k < 3; ++k) {
        last = s.row(step + k, i);
        sum += weight * s.reward(last);
        weight *= 0.9;
        if (s.discount(last) == 0) {
          weight = 0;
          cut_short += k < 2;
          break;
        }
      }
      const auto found = rows.find(key(s, row));
      ASSERT_NE(found, rows.end()) << i << " " << step;
      EXPECT_NEAR(m.reward(found->second), sum, 1e-5 * (1 + std::abs(sum)));
      EXPECT_NEAR(m.discount(found->second), weight, 1e-6);
      EXPECT_TRUE(m.same(m.next(found->second), s.next(last)));
      ++compared;
    }
  EXPECT_EQ(compared, (kSteps - 2) * one.flappers);
  EXPECT_GE(cut_short, 2 * one.flappers);
}

/// After the hand-back the controller flies on, and what that earns is the last action's. Here every flight captures its goal.
TEST(Collector, PaysTheLastActionForWhatComesAfterIt) {
  Overrides list = plain(1);
  list.back() = "task.reward.until_s=0.5";
  for (const char* wide :
       {"end.distance_m=100", "success.capture.distance_m=100", "success.capture.speed_m_s=1000",
        "success.capture.body_rate_rad_s=1e4", "success.capture.tilt_rad=3.2", "success.capture.heading_rad=3.2"})
    list.push_back(std::string("task.") + wide);
  const TrainConfig c = small_training(list);
  const Collected all = collect(c, 100);
  EXPECT_GE(all.sums.handed_back, c.flappers);
  std::size_t last = 0, others = 0;
  for (std::size_t k = 0; k < all.replay.size(); ++k) {
    const float* row = all.replay.row(k);
    if (row[all.replay.layout().discount] > 0) {
      EXPECT_FLOAT_EQ(row[all.replay.layout().reward], 2.5F);
      ++others;
    } else if (row[all.replay.layout().reward] > 2.5F) {
      // by 0.35 s at the latest, to 0.5 s: 15 steps and its own at the least
      EXPECT_GE(row[all.replay.layout().reward], 2.5F * 16 - 1e-3F);
      ++last;
    }
  }
  EXPECT_EQ(last, static_cast<std::size_t>(all.sums.handed_back));
  EXPECT_GT(others, 20 * last);
  EXPECT_EQ(all.sums.terminated, 0);
  EXPECT_NEAR(all.sums.returns / all.sums.episodes, 0.5 * 250, 1e-3);  // 0.5 s each
}

TEST(Collector, ATimeOutIsNoTermination) {
  Overrides list = plain(2);
  list.push_back("task.end.time_s=0.05");
  const TrainConfig c = small_training(list);
  const Collected all = collect(c, 10);
  EXPECT_EQ(all.sums.terminated, 0);
  EXPECT_EQ(all.sums.handed_back, 0);
  EXPECT_EQ(all.sums.episodes, 2 * c.flappers);
  std::size_t of_one = 0, of_two = 0;
  for (std::size_t k = 0; k < all.replay.size(); ++k) {
    const float discount = all.replay.row(k)[all.replay.layout().discount];
    of_one += std::abs(discount - 0.9F) < 1e-6F;
    of_two += std::abs(discount - 0.81F) < 1e-6F;
  }
  EXPECT_EQ(of_one, 2 * c.flappers);  // the last action of each episode
  EXPECT_EQ(of_one + of_two, all.replay.size());
}

/// Every transition's action is what the policy makes of its observation, and its two numbers are followed by its return.
TEST(Collector, KeepsTwoVoltagesOfEachAction) {
  Overrides list = plain(3);
  std::erase(list, "task.reward.until_s=0");
  for (const char* more : {"collect.noise_low=0", "collect.noise_high=0", "task.end.distance_m=0.03"})
    list.push_back(more);
  const TrainConfig c = small_training(list, "hover_voltages");
  ASSERT_EQ(c.learner.shape.action, 2);
  const Collected all = collect(c, 90);
  const policy::Actor a = *actor_of(c);
  const std::vector<float> weights(a.weights.begin(), a.weights.end()), mean(a.mean.begin(), a.mean.end()),
      scale(a.scale.begin(), a.scale.end());
  const auto view = policy::view_of(a, weights.data(), mean.data(), scale.data());
  using L = model::Lanes<float, 1>;
  const TransitionLayout& at = all.replay.layout();
  ASSERT_GT(all.replay.size(), 80 * c.flappers);
  EXPECT_GT(all.sums.terminated, 0);
  std::set<float> left;
  for (std::size_t k = 0; k < all.replay.size(); ++k) {
    const float* row = all.replay.row(k);
    std::vector<L> seen, acted(2);
    for (std::size_t i = 0; i < a.observation.size(); ++i) seen.push_back(L::load(row + at.observation + i));
    policy::evaluate(view, seen.data(), acted.data());
    for (std::size_t i = 0; i < 2; ++i) ASSERT_EQ(row[at.action + i], acted[i].raw[0]) << k;
    ASSERT_GT(row[at.reward], 0);
    left.insert(row[at.action]);
  }
  EXPECT_GT(left.size(), all.replay.size() / 2);
}

TEST(Collector, VehiclesAndStartsDiffer) {
  const TrainConfig c = small_training(plain(1));
  const Collected all = collect(c, 1);
  const Transitions t(c, all.replay);
  std::set<std::vector<float>> starts, trims;
  for (std::size_t i = 0; i < c.flappers; ++i) {
    const float* o = t.seen(t.row(0, i));
    std::vector<float> start, trim;
    const auto signals = c.fly.fleet.task.observation();
    for (std::size_t k = 0; k < signals.size(); ++k) {
      if (signals[k].name.ends_with("_error")) start.push_back(o[k]);
      if (signals[k].name.starts_with("trim_")) trim.push_back(std::round(o[k] * 1e3F));
    }
    EXPECT_EQ(start.size(), 3u);
    starts.insert(start);
    trims.insert(trim);
  }
  EXPECT_EQ(starts.size(), c.flappers);
  EXPECT_GT(trims.size(), 4u);  // of 8 vehicles, sampled 40 times: all but 1 in 25 of them
  EXPECT_LE(trims.size(), 8u);
}

}  // namespace
}  // namespace flappy::learn
