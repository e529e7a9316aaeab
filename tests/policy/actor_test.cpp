// Actors: lanes against an evaluation of their own in double, and the file.
#include "policy/actor.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <random>

#include "flight/fleets.hpp"
#include "sim/lanes.hpp"

namespace flappy::flight::actor_test {
namespace {

policy::Actor random_actor(std::vector<int> widths, policy::Activation hidden, std::uint32_t seed,
                           bool layer_norm = false, bool recurrent = false) {
  std::mt19937 engine(seed);
  std::normal_distribution<double> normal;
  policy::Actor a;
  a.task = "test";
  a.widths = std::move(widths);
  a.hidden = hidden;
  a.layer_norm = layer_norm;
  a.linear = hidden == policy::Activation::elu;
  a.recurrent = recurrent;
  const auto add = [&](int inputs, int outputs) {
    for (int o = 0; o < outputs; ++o)
      for (int i = 0; i <= inputs; ++i) a.weights.push_back(normal(engine) / std::sqrt(inputs + 1.0));
  };
  if (recurrent) {
    add(a.widths[0], 3 * a.widths[1]);
    add(a.widths[1], 3 * a.widths[1]);
  }
  for (std::size_t layer = recurrent ? 1 : 0; layer + 1 < a.widths.size(); ++layer) {
    add(a.widths[layer], a.widths[layer + 1]);
    if (!layer_norm || layer + 2 == a.widths.size()) continue;
    for (int o = 0; o < a.widths[layer + 1]; ++o) a.weights.push_back(1 + 0.2 * normal(engine));
    for (int o = 0; o < a.widths[layer + 1]; ++o) a.weights.push_back(0.2 * normal(engine));
  }
  for (int i = 0; i < a.widths[0]; ++i) {
    a.observation.push_back("o" + std::to_string(i));
    a.mean.push_back(normal(engine));
    a.scale.push_back(0.5 + std::abs(normal(engine)));
  }
  a.action = {"amplitude", "difference", "bias", "split_cycle"};
  a.clip = 2.5;
  return a;
}

/// `memory`: of a recurrent actor, changed. Its GRU as torch documents nn.GRUCell, with exponentials.
std::vector<double> expected(const policy::Actor& a, std::vector<double> x, std::vector<double>* memory = nullptr) {
  for (std::size_t i = 0; i < x.size(); ++i)
    x[i] = std::min(std::max((x[i] - a.mean[i]) * a.scale[i], -a.clip), a.clip);
  std::size_t weight = 0;
  const auto sums = [&](const std::vector<double>& of, std::size_t count) {
    std::vector<double> y;
    for (std::size_t o = 0; o < count; ++o) {
      double sum = a.weights[weight++];
      for (const double in : of) sum += a.weights[weight++] * in;
      y.push_back(sum);
    }
    return y;
  };
  if (a.recurrent) {
    const std::size_t units = memory->size();
    const std::vector<double> seen = sums(x, 3 * units), kept = sums(*memory, 3 * units);
    for (std::size_t k = 0; k < units; ++k) {
      const double r = 1 / (1 + std::exp(-seen[k] - kept[k]));
      const double z = 1 / (1 + std::exp(-seen[units + k] - kept[units + k]));
      const double n = std::tanh(seen[2 * units + k] + r * kept[2 * units + k]);
      (*memory)[k] = (1 - z) * n + z * (*memory)[k];
    }
    x = *memory;
  }
  for (std::size_t layer = a.recurrent ? 2 : 1; layer < a.widths.size(); ++layer) {
    std::vector<double> y = sums(x, static_cast<std::size_t>(a.widths[layer]));
    const bool last = layer + 1 == a.widths.size();
    if (a.layer_norm && !last) {
      const double n = static_cast<double>(y.size());
      double mean = 0, variance = 0;
      for (const double v : y) mean += v / n;
      for (const double v : y) variance += (v - mean) * (v - mean) / n;
      for (std::size_t o = 0; o < y.size(); ++o)
        y[o] = (y[o] - mean) / std::sqrt(variance + 1e-5) * a.weights[weight + o] + a.weights[weight + y.size() + o];
      weight += 2 * y.size();
    }
    for (double& v : y) {
      if (last && a.linear) v = std::clamp(v, -1.0, 1.0);
      else if (last || a.hidden == policy::Activation::tanh) v = std::tanh(v);
      else if (a.hidden == policy::Activation::relu) v = std::max(v, 0.0);
      else if (a.hidden == policy::Activation::elu) v = v > 0 ? v : std::expm1(v);
      else v = v / (1 + std::exp(-v));
    }
    x = y;
  }
  EXPECT_EQ(weight, a.weights.size());
  return x;
}

template <class T>
struct Numbers {
  std::vector<T> all;
  policy::ActorView<T> view;
  explicit Numbers(const policy::Actor& a) {
    for (const auto* list : {&a.weights, &a.mean, &a.scale})
      for (const double x : *list) all.push_back(static_cast<T>(x));
    const T *weights = all.data(), *mean = weights + a.weights.size();
    view = policy::view_of(a, weights, mean, mean + a.mean.size());
  }
};

/// Weights have size 1/sqrt(inputs), so sums have size 1 and gather sqrt(inputs) roundings for each layer, which the next one
/// carries on: 40 ulp for up to six layers. Measured: 6. Layer norm divides by the deviation of a layer, which can be small where
/// that has few neurons: ten times as much.
template <class T, int N>
void lanes_agree() {
  using L = model::Lanes<T, N>;
  std::mt19937 engine(5);
  std::normal_distribution<double> normal(0, 2);
  for (const auto& [hidden, layer_norm] : {std::pair{policy::Activation::relu, false},
                                           {policy::Activation::tanh, false},
                                           {policy::Activation::elu, false},
                                           {policy::Activation::silu, false},
                                           {policy::Activation::relu, true},
                                           {policy::Activation::silu, true}})
    for (const std::vector<int>& widths :
         {std::vector<int>{3, 4}, {1, 1, 4}, {17, 31, 4}, {18, 64, 64, 4}, {5, 7, 9, 11, 13, 15, 4}, {32, 256, 7, 4}}) {
      const policy::Actor a = random_actor(widths, hidden, 3, layer_norm);
      const Numbers<T> numbers(a);
      std::vector<L> in(static_cast<std::size_t>(widths[0]));
      for (L& row : in)
        for (int i = 0; i < N; ++i) row.raw[i] = static_cast<T>(normal(engine));
      L out[kMaxActions];
      evaluate(numbers.view, in.data(), out);
      for (int i = 0; i < N; ++i) {
        std::vector<double> alone;
        for (const L& row : in) alone.push_back(row.raw[i]);
        const std::vector<double> y = expected(a, alone);
        for (std::size_t k = 0; k < y.size(); ++k)
          EXPECT_NEAR(out[k].raw[i], y[k], (layer_norm ? 400 : 40) * std::numeric_limits<T>::epsilon())
              << widths.size() << " layers, " << name_of(hidden) << ", lane " << i;
      }
      // a lane of NaN is nobody else's affair
      const std::vector<L> good = in;
      for (L& row : in) row.raw[1] = std::numeric_limits<T>::quiet_NaN();
      L beside[kMaxActions];
      evaluate(numbers.view, in.data(), beside);
      for (int k = 0; k < kMaxActions; ++k)
        for (int i = 0; i < N; ++i)
          if (i != 1) EXPECT_EQ(beside[k].raw[i], out[k].raw[i]);
    }
}

TEST(Actor, LanesOfFloatAreTheNetwork) { lanes_agree<float, 4>(); }
TEST(Actor, LanesOfDoubleAreTheNetwork) { lanes_agree<double, 2>(); }

/// Ten steps, as the memory carries roundings on: ten times the 40 ulp of above. Measured: 4.
template <class T, int N>
void memory_agrees() {
  using L = model::Lanes<T, N>;
  std::mt19937 engine(6);
  std::normal_distribution<double> normal(0, 2);
  for (const std::vector<int>& widths : {std::vector<int>{3, 1, 4}, {29, 16, 32, 4}, {5, 64, 4}}) {
    const policy::Actor a = random_actor(widths, policy::Activation::relu, 3, false, true);
    const Numbers<T> numbers(a);
    const auto units = static_cast<std::size_t>(widths[1]);
    std::vector<L> memory(units, L(0)), in(static_cast<std::size_t>(widths[0]));
    std::vector<std::vector<double>> alone(N, std::vector<double>(units, 0));
    double largest = 0;
    for (int step = 0; step < 10; ++step) {
      for (L& row : in)
        for (int i = 0; i < N; ++i) row.raw[i] = static_cast<T>(normal(engine));
      L out[kMaxActions];
      evaluate(numbers.view, in.data(), out, memory.data());
      for (std::size_t i = 0; i < N; ++i) {
        std::vector<double> seen;
        for (const L& row : in) seen.push_back(row.raw[i]);
        const std::vector<double> y = expected(a, seen, &alone[i]);
        for (std::size_t k = 0; k < y.size(); ++k)
          EXPECT_NEAR(out[k].raw[i], y[k], 400 * std::numeric_limits<T>::epsilon()) << "step " << step;
        for (std::size_t k = 0; k < units; ++k) {
          EXPECT_NEAR(memory[k].raw[i], alone[i][k], 400 * std::numeric_limits<T>::epsilon()) << "step " << step;
          largest = std::max(largest, std::abs(alone[i][k]));
        }
      }
    }
    EXPECT_GT(largest, 0.5);
    EXPECT_LE(largest, 1);
  }
}
TEST(Actor, LanesOfFloatRemember) { memory_agrees<float, 4>(); }
TEST(Actor, LanesOfDoubleRemember) { memory_agrees<double, 2>(); }

TEST(Actor, ClipsItsInputs) {
  const policy::Actor a = random_actor({3, 5, 4}, policy::Activation::tanh, 7);
  const Numbers<double> numbers(a);
  using L = model::Lanes<double, 2>;
  L in[3], out[4];
  for (int i = 0; i < 3; ++i) in[i].raw[0] = 1e6, in[i].raw[1] = a.mean[static_cast<std::size_t>(i)] + 1e3;
  evaluate(numbers.view, in, out);
  for (const L& y : out) EXPECT_EQ(y.raw[0], y.raw[1]);
}

/// The hover task, whose observation has 18 rows.
FleetOptions hovering() {
  const auto text = io::Config::load(test::source_path("configs/tasks/hover.toml"));
  return fleet_options(sensors("paper"), controller("pid"), read_task(text.root(), 0.002));
}

policy::Actor fitting(const Task& task, bool recurrent = false) {
  policy::Actor a =
      random_actor({static_cast<int>(task.observation().size()), 16, 4}, policy::Activation::relu, 9, false, recurrent);
  a.observation.clear(), a.action.clear();
  for (const Signal& s : task.observation()) a.observation.push_back(s.name);
  for (const Signal& s : task.action()) a.action.push_back(s.name);
  return a;
}

TEST(Actor, ActsInAFleetOnWhatItObserves) {
  FleetOptions o = hovering();
  o.task.history = 3;
  o.task.action_repeat = 2;
  const auto actor = std::make_shared<policy::Actor>(fitting(o.task));
  Fleet<double> with(3, test::nominal(), o), by_hand(3, test::nominal(), o);
  with.set_actor(actor);
  std::vector<double> past[3];
  for (int period = 0; period < 50; ++period) {
    std::vector<double> actions;
    for (std::size_t i = 0; i < 3 && period % 2 == 0; ++i) {
      // what it sees now, and saw at its last two actions, or first
      const std::vector<double> seen = by_hand.observation(i);
      std::vector<double> wanted(seen.begin(), seen.begin() + 18);
      for (std::size_t ago = 0; ago < 2; ++ago)
        wanted.insert(wanted.end(), past[i].empty() ? seen.begin() : past[i].end() - 18 * (1 + ago),
                      past[i].empty() ? seen.begin() + 18 : past[i].end() - 18 * ago);
      ASSERT_EQ(seen, wanted) << "period " << period;
      if (past[i].empty()) past[i].insert(past[i].end(), seen.begin(), seen.begin() + 18);
      past[i].insert(past[i].end(), seen.begin(), seen.begin() + 18);
      const std::vector<double> y = expected(*actor, seen);
      actions.insert(actions.end(), y.begin(), y.begin() + 4);
    }
    if (!actions.empty()) by_hand.set_actions(0, actions.data());
    with.step();
    by_hand.step();
    for (std::size_t i = 0; i < 3; ++i) ASSERT_NEAR(with.input(i).bias_V, by_hand.input(i).bias_V, 1e-9);
  }
}

TEST(Actor, RemembersInAFleetFromItsStart) {
  FleetOptions o = hovering();
  o.task.action_repeat = 2;
  const auto actor = std::make_shared<policy::Actor>(fitting(o.task, true));
  Fleet<double> fleet(2, test::nominal(), o);
  fleet.set_actor(actor);
  std::vector<double> memory(actor->widths[1], 0), other = memory;
  for (std::uint32_t tick = 0; tick < 20; ++tick) {
    if (tick == 7) {  // its flight begins anew, the other's goes on
      fleet.start(1, 1);
      other.assign(other.size(), 0);
    }
    std::vector<double> acted;
    if (tick % 2 == 0) acted = expected(*actor, fleet.observation(0), &memory);
    if ((tick < 7 ? tick : tick - 7) % 2 == 0) expected(*actor, fleet.observation(1), &other);
    Fleet<double> copy = fleet;
    fleet.step();
    for (std::size_t k = 0; k < acted.size(); ++k) ASSERT_NEAR(fleet.action(0)[k], acted[k], 1e-12) << tick;
    for (std::size_t k = 0; k < memory.size(); ++k) {
      ASSERT_NEAR(fleet.actor_memory(0)[k], memory[k], 1e-12) << tick;
      ASSERT_NEAR(fleet.actor_memory(1)[k], other[k], 1e-12) << tick;
    }
    if (!acted.empty()) ASSERT_NE(copy.actor_memory(0), fleet.actor_memory(0));
    copy.step();
    ASSERT_EQ(copy.hash(), fleet.hash());
  }
  EXPECT_NE(memory, other);
  Fleet<double> forgetful = fleet;  // the same but for what it remembers
  forgetful.set_actor(nullptr);
  forgetful.set_actor(actor);
  EXPECT_NE(forgetful.hash(), fleet.hash());
  fleet.set_actor(std::make_shared<policy::Actor>(fitting(o.task)));
  EXPECT_TRUE(fleet.actor_memory(0).empty());
}

TEST(Actor, HoldsItsActionAndGathersWhatItEarns) {
  FleetOptions o = hovering();
  o.task.action_repeat = 3;
  const auto actor = std::make_shared<policy::Actor>(fitting(o.task));
  Fleet<double> fleet(2, test::nominal(), o);
  fleet.set_actor(actor);
  std::vector<double> acted;
  double gained = 0;
  for (std::uint32_t tick = 0; tick < 20; ++tick) {
    if (tick == 7) fleet.start(1, 1);  // whose actions are then out of step with the other's
    if (tick % 3 == 0) acted = expected(*actor, fleet.observation(0)), gained = 0;
    fleet.step();
    gained += fleet.reward(0);
    for (std::size_t k = 0; k < kMaxActions; ++k) ASSERT_NEAR(fleet.action(0)[k], acted[k], 1e-12) << tick;
    ASSERT_NEAR(fleet.action_reward(0), gained, 1e-12) << tick;
    ASSERT_EQ(fleet.tick(1), tick < 7 ? tick + 1 : tick - 6);
  }
}

TEST(Actor, ExploresWithNoiseOfItsDeviationAndMemory) {
  FleetOptions o = hovering();
  o.task.action_repeat = 2;
  policy::Actor quiet = fitting(o.task);
  for (double& w : quiet.weights) w = 0;
  const std::size_t n = 256;
  const int steps = 40;
  Fleet<float> fleet(n, test::nominal(), o);
  fleet.set_actor(std::make_shared<policy::Actor>(quiet));
  fleet.set_exploration({0.05, 0.15, 0.6});
  std::vector<std::array<float, kMaxActions>> last(n);
  double low = 0, high = 0, with_last = 0, of_two = 0;
  const double burn_in = 15;  // 0.6^15 of the start, which is at rest, is left
  for (int step = 0; step < steps; ++step) {
    fleet.step(), fleet.step();
    for (std::size_t i = 0; i < n; ++i) {
      const auto a = fleet.action(i);
      for (std::size_t k = 0; k < kMaxActions && step >= burn_in; ++k) {
        (i < n / 2 ? low : high) += a[k] * a[k];
        const double deviation = 0.05 + 0.1 * static_cast<double>(i) / (n - 1);
        with_last += a[k] * last[i][k] / (deviation * deviation), of_two += 1;
      }
      last[i] = a;
    }
  }
  // Means of sigma^2 over each half of a line; 12,800 samples a half, of which (1 - 0.36)/(1 + 0.36) are independent: 1.8 %
  const auto half = [](double from, double to) { return (from * from + from * to + to * to) / 3; };
  EXPECT_NEAR(low / (of_two / 2) / half(0.05, 0.1), 1, 0.08);
  EXPECT_NEAR(high / (of_two / 2) / half(0.1, 0.15), 1, 0.08);
  EXPECT_NEAR(with_last / of_two, 0.6, 0.05);
  fleet.set_exploration({});
  fleet.step(), fleet.step();
  EXPECT_EQ(fleet.action(3)[1], 0);
}

TEST(Actor, MustFitItsTask) {
  const FleetOptions o = hovering();
  Fleet<float> fleet(1, test::nominal(), o);
  EXPECT_NO_THROW(fleet.set_actor(std::make_shared<policy::Actor>(fitting(o.task))));
  policy::Actor other = fitting(o.task);
  other.observation[3] = "something_else";
  EXPECT_THROW(fleet.set_actor(std::make_shared<policy::Actor>(other)), std::invalid_argument);
  other = fitting(o.task);
  std::swap(other.action[0], other.action[1]);
  EXPECT_THROW(fleet.set_actor(std::make_shared<policy::Actor>(other)), std::invalid_argument);
  EXPECT_THROW(fleet.set_actor(std::make_shared<policy::Actor>(random_actor({40, 4}, policy::Activation::relu, 1))),
               std::invalid_argument);
  fleet.step();  // and goes on with the one it had
  EXPECT_NO_THROW(fleet.set_actor(nullptr));
}

std::string file_name() { return testing::TempDir() + "actor_test.json"; }

TEST(ActorFile, ReadsBackWhatWasWritten) {
  policy::Actor a = random_actor({18, 5, 4}, policy::Activation::tanh, 11);
  a.weights[3] = -0.0, a.weights[4] = 1e-300, a.weights[5] = 1.0 / 3;
  write_actor(file_name(), a);
  const policy::Actor b = policy::read_actor(file_name());
  EXPECT_EQ(b.task, a.task);
  EXPECT_EQ(b.observation, a.observation);
  EXPECT_EQ(b.action, a.action);
  EXPECT_EQ(b.widths, a.widths);
  EXPECT_EQ(b.hidden, a.hidden);
  EXPECT_EQ(b.weights, a.weights);
  EXPECT_EQ(b.mean, a.mean);
  EXPECT_EQ(b.scale, a.scale);
  EXPECT_EQ(b.clip, a.clip);
  EXPECT_EQ(policy::weight_count({18, 5, 4}), 19u * 5 + 6 * 4);
  EXPECT_EQ(policy::weight_count({18, 5, 4}, true), 19u * 5 + 2 * 5 + 6 * 4);
  EXPECT_EQ(io::read_text(file_name()).find("layer_norm"), std::string::npos);
  write_actor(file_name(), random_actor({18, 5, 4}, policy::Activation::silu, 11, true));
  const policy::Actor c = policy::read_actor(file_name());
  EXPECT_TRUE(c.layer_norm);
  EXPECT_EQ(c.hidden, policy::Activation::silu);
  EXPECT_FALSE(c.linear);
  write_actor(file_name(), random_actor({18, 5, 4}, policy::Activation::elu, 11));
  EXPECT_TRUE(policy::read_actor(file_name()).linear);
  write_actor(file_name(), random_actor({18, 5, 4}, policy::Activation::relu, 11, false, true));
  EXPECT_TRUE(policy::read_actor(file_name()).recurrent);
  EXPECT_EQ(policy::weight_count({18, 5, 4}, false, true), 3u * 5 * (19 + 6) + 6 * 4);
}

std::string refused(const std::string& text) {
  std::ofstream(file_name()) << text;
  try {
    policy::read_actor(file_name());
    return "accepted";
  } catch (const io::InputError& e) {
    const std::string what = e.what();
    EXPECT_EQ(what.find(file_name()), 0u) << what;  // says which file
    return what;
  }
}

TEST(ActorFile, RefusesWhatIsNoActor) {
  const auto with = [](const std::function<void(policy::Actor&)>& change) {
    policy::Actor a = random_actor({3, 5, 4}, policy::Activation::relu, 13);
    change(a);
    write_actor(file_name(), a);
    return refused(io::read_text(file_name()));
  };
  const auto has = [](const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  EXPECT_EQ(with([](policy::Actor&) {}), "accepted");
  has(with([](policy::Actor& a) { a.weights.pop_back(); }), "weights has 43 entries; accepted: 44 of them");
  has(with([](policy::Actor& a) { a.observation.emplace_back("more"); }), "observation has 4");
  has(with([](policy::Actor& a) { a.action.pop_back(); }), "action has 3");
  has(with([](policy::Actor& a) { a.mean.clear(); }), "mean has 0");
  has(with([](policy::Actor& a) { a.scale.push_back(1); }), "scale has 4");
  has(with([](policy::Actor& a) { a.widths = {3}; }), "0 layers");
  has(with([](policy::Actor& a) { a.widths = {}; }), "layers");
  has(with([](policy::Actor& a) { a.widths = std::vector<int>(34, 3); }), "33 layers; accepted: 1 to 32");
  has(with([](policy::Actor& a) { a.widths = {3, 2049, 4}; }), "2049 wide; accepted: 1 to 2048");
  has(with([](policy::Actor& a) { a.widths = {3, 0, 4}; }), "0 wide");
  has(with([](policy::Actor& a) { a.widths = {3, -5, 4}; }), "-5 wide");
  has(with([](policy::Actor& a) { a.widths = {3, 5, 3}; }), "action has 4 entries; accepted: 3 of them");
  has(with([](policy::Actor& a) { a.action.emplace_back("more"), a.widths = {3, 5, 5}; }), "accepted: 1 to 4");
  has(with([](policy::Actor& a) { a.recurrent = true; }), "weights has 44 entries; accepted: 174 of them");
  has(with([](policy::Actor& a) { a.recurrent = true, a.widths = {3, 4}; }), "recurrent with one layer");
  has(with([](policy::Actor& a) {
        a.recurrent = true, a.widths = {3, 65, 4};
      }),
      "65 units; accepted: two layers or more");
  has(with([](policy::Actor& a) { a.weights[7] = std::numeric_limits<double>::quiet_NaN(); }),
      "weights has null in it; accepted: numbers");
  has(with([](policy::Actor& a) { a.mean[1] = std::numeric_limits<double>::infinity(); }),
      "mean has null in it; accepted: numbers");
  has(with([](policy::Actor& a) { a.clip = -1; }), "clip is -1");
  has(with([](policy::Actor& a) { a.clip = 0; }), "clip is 0");

  policy::write_actor(file_name(), random_actor({3, 5, 4}, policy::Activation::relu, 13));
  const std::string good = io::read_text(file_name());
  const auto edited = [&](const std::string& old, const std::string& fresh) {
    std::string text = good;
    const auto where = text.find(old);
    EXPECT_NE(where, std::string::npos) << old;
    return refused(text.replace(where, old.size(), fresh));
  };
  has(edited("\"schema\":1", "\"schema\":2"), "schema");
  has(edited("\"relu\"", "\"gelu\""), "gelu");
  has(edited("\"relu\"", "5"), "string");
  for (const char* key :
       {"schema", "task", "observation", "action", "widths", "hidden", "mean", "scale", "clip", "weights"})
    has(edited("\"" + std::string(key) + "\":", "\"x\":"), key);
  has(edited("\"widths\":[3,", "\"widths\":[\"a\","), "number");
  has(edited("\"widths\":[3,", "\"widths\":[true,"), "whole numbers");
  has(edited("\"widths\":[3,5,4]", "\"widths\":[3,4294967301,4]"), "4294967301 wide");
  has(edited("\"widths\":[3,5,4]", "\"widths\":[3,5.7,4]"), "5.7");
  has(edited("\"clip\":2.5", "\"clip\":1e999"), "no JSON");
  has(with([](policy::Actor& a) { a.weights[3] = -1e39; }), "has -1e+39 in it, which single precision does not hold");
  has(edited("\"weights\":[", "\"weights\":[[1],"), "weights has [1] in it");
  has(refused(""), "no JSON");
  has(refused("[1, 2]"), "actor file");
  has(refused(good.substr(0, good.size() / 2)), "no JSON");
  EXPECT_THROW(policy::read_actor(testing::TempDir() + "there_is_no_such_file.json"), io::InputError);
}

}  // namespace
}  // namespace flappy::flight::actor_test
