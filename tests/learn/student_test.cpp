// Many teachers distilled into one policy, and what LibTorch learns through time.
#include "learn/student.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <random>

#include "io/files.hpp"
#include "learn/run_folder.hpp"
#include "learn/torch/torch_learner.hpp"
#include "model/effects/registry.hpp"
#include "policy/actor.hpp"
#include "rollout/fly_fixture.hpp"
#include "sim/lanes.hpp"

namespace flappy::learn {
namespace {

namespace fs = std::filesystem;
using flight::Folder;

const std::vector<std::string> kSmall = {
    "collect.flappers=64",    "collect.vehicles=16",    "learn.updates=60",
    "evaluate.every=60",      "evaluate.vehicles=16",   "checkpoint.every=60",
    "learn.replay=20000",     "student.redraw=2",       "student.teacher_updates=12",
    "student.rounds=4",       "student.flights=12",     "student.steps=5",
    "student.batch=4",        "student.kept=2",         "student.led=2",
    "collect.steps_before=4", "networks.critic=[16,16]"};

TrainConfig config(std::vector<std::string> more = {}) {
  std::vector<std::string> all = kSmall;
  for (const model::CatalogueEffect& e : model::catalogue_of(test::identified()))
    if (const std::string id = e.info.id; id != "wing_damage" && id != "command_delay" && id != "wind")
      all.push_back("drawn_effects.weights." + id + "=0");
  all.insert(all.end(), more.begin(), more.end());
  return read_train_config(test::source_path("configs/train/escape_student.toml"), all);
}

policy::Actor random_actor(bool recurrent) {
  policy::Actor a;
  a.widths = {3, 4, 5, 2};
  a.recurrent = recurrent;
  a.mean = {0.1, -0.2, 0}, a.scale = {1, 2, 0.5};
  std::mt19937 engine(3);
  std::normal_distribution<double> normal(0, 0.5);
  a.weights.resize(policy::weight_count(a.widths, false, recurrent));
  for (double& w : a.weights) w = normal(engine);
  return a;
}

Lessons random_lessons() {
  Lessons l{3, 2, {}, {}, {1, 1, 1, 1, 1, 0}};  // the second flight ends after two actions
  std::mt19937 engine(4);
  std::normal_distribution<float> normal;
  for (int i = 0; i < 3 * 2 * 3; ++i) l.observation.push_back(normal(engine));
  for (int i = 0; i < 3 * 2 * 2; ++i) l.wanted.push_back(std::tanh(normal(engine)));
  return l;
}

/// The mean square of TorchStudent::learn(), by the lanes that fly.
double loss_of(const policy::Actor& a, const Lessons& l) {
  using L = model::Lanes<double, 1>;
  const auto view = policy::view_of(a, a.weights.data(), a.mean.data(), a.scale.data());
  double sum = 0, count = 0;
  for (std::size_t f = 0; f < l.flights; ++f) {
    L memory[policy::kMaxMemory];
    for (L& m : memory) m = L(0);
    for (std::size_t t = 0; t < l.actions; ++t) {
      L in[3], out[2];
      for (std::size_t i = 0; i < 3; ++i) in[i] = L(static_cast<double>(l.observation[(t * l.flights + f) * 3 + i]));
      policy::evaluate(view, in, out, memory);
      if (l.counts[t * l.flights + f] == 0) continue;
      for (std::size_t k = 0; k < 2; ++k, ++count)
        sum += std::pow(out[k].raw[0] - static_cast<double>(l.wanted[(t * l.flights + f) * 2 + k]), 2);
    }
  }
  return sum / count;
}

/// The loss is that of the lanes within single precision, and so are three steps of Adam by slopes from differences, whose
/// length is limited to 1. Adam divides by slopes: where they are flat, single precision decides their sign.
TEST(TorchStudent, DescendsWhatTheLanesFly) {
  int limited = 0;
  for (const bool recurrent : {false, true}) {
    policy::Actor a = random_actor(recurrent);
    const Lessons lessons = random_lessons();
    const auto student = torch_functions().make_student(a);
    constexpr double kRate = 1e-2;
    const std::size_t count = a.weights.size();
    std::vector<double> first(count, 0), second(count, 0);
    std::vector<char> steep(count, 1);
    for (int step = 1; step <= 3; ++step) {
      EXPECT_NEAR(student->learn(lessons, kRate), loss_of(a, lessons), 1e-5);
      std::vector<double> slope;
      double square = 0;
      for (std::size_t i = 0; i < count; ++i) {
        policy::Actor up = a, down = a;
        constexpr double kStep = 1e-5;
        up.weights[i] += kStep, down.weights[i] -= kStep;
        slope.push_back((loss_of(up, lessons) - loss_of(down, lessons)) / (2 * kStep));
        square += slope[i] * slope[i];
        steep[i] = static_cast<char>(steep[i] != 0 && std::abs(slope[i]) > 1e-3);
      }
      limited += square > 1;
      const std::vector<double> moved = student->weights();
      for (std::size_t i = 0; i < count; ++i) {
        const double g = slope[i] / std::max(1.0, std::sqrt(square));
        first[i] = 0.9 * first[i] + 0.1 * g, second[i] = 0.999 * second[i] + 0.001 * g * g;
        a.weights[i] -=
            kRate * first[i] / (1 - std::pow(0.9, step)) / (std::sqrt(second[i] / (1 - std::pow(0.999, step))) + 1e-8);
        if (steep[i] != 0)
          EXPECT_NEAR(moved[i], a.weights[i], 2e-4 * kRate) << i << ", step " << step << ", recurrent " << recurrent;
      }
      a.weights = moved;
    }
    EXPECT_GT(std::ranges::count(steep, 1), 30);
  }
  EXPECT_GT(limited, 0);
  EXPECT_LT(limited, 6);
}

TEST(Student, IsARunThatGoesOnToTheSameBytes) {
  const Folder folder;
  TrainOptions options;
  options.commit = "0123456789ab";
  options.folder = folder / "whole";
  const TrainSummary whole = train(config({"threads=1"}), options);
  EXPECT_FALSE(whole.stopped);
  EXPECT_EQ(whole.updates, 20u);
  const FinishedRun run = read_finished_run(options.folder);
  EXPECT_TRUE(run.fly.actor->recurrent);
  EXPECT_EQ(run.fly.actor->widths, (std::vector<int>{29, 16, 32, 4}));
  EXPECT_EQ(read_metrics(options.folder / "metrics.jsonl").column("success_rate").size(), 4u);

  // stopped at the second teacher, and again while the student learns
  const auto stop_at = [](std::uint64_t update) {
    return [update](const TrainProgress& p) { return p.updates == 60 || p.update < update; };  // 60: of the ancestor
  };
  options.folder = folder / "stopped";
  options.keep_going = stop_at(12);
  EXPECT_TRUE(train(config({"threads=2"}), options).stopped);
  EXPECT_TRUE(fs::exists(options.folder / "ancestor" / "summary.json"));
  EXPECT_EQ(read_train_config(options.folder / "config" / "train.toml").sha256,
            config().sha256);  // as --resume reads it
  EXPECT_TRUE(fs::exists(options.folder / "teachers" / "wing_damage_gain.json"));
  EXPECT_FALSE(fs::exists(options.folder / "teachers" / "wind.json"));
  options.goes_on = true;
  options.keep_going = stop_at(41);
  EXPECT_TRUE(train(config({"threads=2"}), options).stopped);
  EXPECT_TRUE(fs::exists(options.folder / "teachers" / "wind.json"));
  EXPECT_FALSE(fs::exists(options.folder / "summary.json"));
  options.keep_going = nullptr;
  EXPECT_FALSE(train(config({"threads=2"}), options).stopped);
  for (const char* file : {"best.json", "last.json", "metrics.jsonl", "teachers/wind_gain.json"})
    EXPECT_TRUE(io::read_text(options.folder / file) == io::read_text(folder / "whole" / file)) << file;
}

TEST(Student, RefusesWhatItCannotLearn) {
  const auto refused = [](const std::string& override) { return flight::message([&] { config({override}); }); };
  EXPECT_NE(refused("student.memory=65").find("student.memory"), std::string::npos) << refused("student.memory=65");
  EXPECT_NE(refused("student.redraw=0").find("student.redraw"), std::string::npos);
  EXPECT_NE(refused("networks.activation=\"silu\"").find("accepted: "), std::string::npos);
  const std::string nothing = flight::message(
      [] { read_train_config(test::source_path("configs/train/escape_student.toml"), {"fly=../fly/escape.toml"}); });
  EXPECT_NE(nothing.find("has no effects to be taught, for none are drawn; accepted: a flight with [drawn_effects]"),
            std::string::npos)
      << nothing;
  EXPECT_NE(refused("student.hidden=[]").find("student.hidden"), std::string::npos);
  EXPECT_NE(refused("student.more=1").find("student.more"), std::string::npos);
}

}  // namespace
}  // namespace flappy::learn
