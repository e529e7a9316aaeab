// The blind benchmark from making to scoring, with a predictor that costs nothing.
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <set>

#include "benchmark/make.hpp"
#include "benchmark/records.hpp"
#include "benchmark/score_bench.hpp"
#include "io/files.hpp"
#include "model/effects/registry.hpp"
#include "refusal.hpp"

namespace flappy::benchmark {
namespace {

namespace fs = std::filesystem;

const std::string kConfigs = FLAPPY_SOURCE_DIR "/configs/";

/// Every effect is detectable at 0.2, but the tether; wind cannot be told from it.
std::string detectability() {
  std::string text = "schema = 1\n";
  for (const model::EffectEntry& e : model::effects()) {
    const std::string id = e.info.id;
    text += "[" + id + "]\n";
    text += id == "tether" ? "undetectable = true\n" : "detectable = 0.2\n";
    text += id == "wind" ? "inseparable = [\"tether\"]\n" : "inseparable = []\n";
  }
  return text +
         "[outside_slosh]\nundetectable = true\ninseparable = []\n[outside_vortex_ring]\ndetectable = 1.5\n"
         "inseparable = []\ngain_at_typical = 8.1\nmisfit = 0.1\ncatalogue = { x = 1 }\n";
}

/// A folder of its own, with the table of detectability in it.
class Benchmark : public testing::Test {
 protected:
  Benchmark() : root_(fs::path(testing::TempDir()) / ("blind_" + name() + "_" + std::to_string(getpid()))) {
    fs::remove_all(root_);
    fs::create_directories(root_);
    io::write_atomically(root_ / "detectable.toml", detectability());
  }
  ~Benchmark() override { fs::remove_all(root_); }

  static std::string name() { return testing::UnitTest::GetInstance()->current_test_info()->name(); }

  bool make(std::size_t at_most, const std::string& part = "singles") const {
    MakeCommand c;
    c.out = root_ / "bench";
    c.vehicle = kConfigs + "vehicles/hummingbird_nominal.toml";
    c.randomise = kConfigs + "randomisation/published.toml";
    c.detectable = root_ / "detectable.toml";
    c.plan.parts = {part};
    c.plan.at_most = at_most;
    c.threads = 2;
    c.true_values = [](const blind::Case& flown, const std::vector<blind::BlindEffect>& effects) {
      EXPECT_TRUE(flown.sizes.has(blind::Effect::ground_effect) || flown.sizes.has(blind::Effect::ceiling_effect));
      return std::map<std::string, std::optional<double>>{{effects.front().id + ".gain", 0.1},
                                                          {effects.front().id + ".length_m", std::nullopt}};
    };
    return make_bench(c);
  }

  /// Says ground effect, whatever it is asked, unless it may not.
  ScoreCommand command() {
    ScoreCommand c;
    c.folder = root_ / "bench";
    c.priors = kConfigs + "gap/priors.toml";
    c.threads = 2;
    c.predictor = [this](const Question& q) {
      ++asked_;
      Prediction p;
      p.refit = 1;
      const bool may = std::ranges::count(q.withheld, "ground_effect") == 0;
      p.kind = may ? "effect" : "unknown";
      p.probability = 0.8;
      if (may) {
        p.effects = {"ground_effect"};
        p.sets = {{{"ground_effect"}, 0.8, {{"ground_effect.gain", {0.1, 0.05, 0.15}}}, 0.5, 0.01}};
      } else {
        p.sets = {{{"ceiling_effect"}, 0.1, {}, 0.25, 0.01}};
      }
      EXPECT_EQ(q.flights.size(), 3U);
      return p;
    };
    return c;
  }

  fs::path root_;
  std::atomic<int> asked_ = 0;
};

TEST_F(Benchmark, PredictsSealsAndScores) {
  ASSERT_TRUE(make(2));
  const fs::path bench = root_ / "bench";
  EXPECT_FALSE(fs::exists(bench / "sealed" / "0001.json")) << "labels stand in the sealed file alone";
  EXPECT_EQ(io::read_text(bench / "manifest.json").find("ground_effect"), std::string::npos);
  for (const auto& e : fs::recursive_directory_iterator(bench)) EXPECT_NE(e.path().filename(), "truth.csv");

  const nlohmann::ordered_json json = score_bench(command());
  // the two singles are of ground and ceiling effect, in some order; the second is fitted afterwards
  EXPECT_EQ(asked_, 3);
  EXPECT_EQ(json.at("cases"), 2);
  EXPECT_EQ(json.at("top1_mocap_imu"), 0.5);
  EXPECT_EQ(json.at("group_top1"), 1.0);
  EXPECT_NEAR(json.at("closure_median").get<double>(), 0.5 * (1 + 0.5 / 0.75), 1e-12);
  EXPECT_EQ(json.at("interval_coverage"), 1.0);
  EXPECT_EQ(json.at("interval_coverage_count"), 1);
  EXPECT_TRUE(json.at("top1_current").is_null());
  EXPECT_EQ(json.at("undetectable").dump(), R"(["outside_slosh","tether"])");
  for (const char* key :
       {"top1_mocap_imu", "top1_current", "group_top1", "top3", "false_alarm", "withheld_unknown",
        "withheld_confidently_wrong", "ece", "closure_median", "interval_coverage", "pairs_f1", "hover_abstain"})
    for (const char* end : {"", "_low", "_high"}) EXPECT_TRUE(json.contains(std::string(key) + end)) << key << end;
  // once more: nothing is asked again
  EXPECT_EQ(score_bench(command()), json);
  EXPECT_EQ(asked_, 3);

  const auto refused = [&] { return test::refusal([&] { score_bench(command()); }); };
  const std::string was_predicted = io::read_text(bench / "predictions" / "0001.json");
  io::write_atomically(bench / "predictions" / "0001.json", was_predicted + " ");
  EXPECT_EQ(refused(), (bench / "predictions/0001.json").string() + ": has changed; accepted: what was sealed");
  io::write_atomically(bench / "predictions" / "0001.json", was_predicted);
  const std::string sums = io::read_text(bench / "predictions.sha256");
  fs::remove(bench / "predictions.sha256");
  EXPECT_EQ(refused(), (bench / "predictions.sha256").string() +
                           ": is missing, though labels were opened; accepted: what was sealed");
  io::write_atomically(bench / "predictions.sha256", sums);
  const std::string labels = io::read_text(bench / "sealed" / "labels.json");
  io::write_atomically(bench / "sealed" / "labels.json", labels + "\n");
  EXPECT_EQ(refused(), (bench / "sealed/labels.json").string() + ": has changed; accepted: what was sealed");
  io::write_atomically(bench / "sealed" / "labels.json", labels);
  const fs::path log = bench / "cases/0002/flight_3/mocap.csv";
  const std::string was = io::read_text(log);
  io::write_atomically(log, was + "\n");
  EXPECT_EQ(refused(), log.string() + ": has changed; accepted: what was sealed");
  io::write_atomically(log, was);
  const fs::path lie = bench / "cases/0002/flight_3/truth.csv";
  io::write_atomically(lie, "t_s\n");
  EXPECT_EQ(refused(), lie.string() + ": is new; accepted: what was sealed");
  fs::remove(lie);
  EXPECT_EQ(refused(), "accepted");
  const std::string manifest = io::read_text(bench / "manifest.json");
  EXPECT_TRUE(make(2)) << "nothing is left to do";
  EXPECT_EQ(io::read_text(bench / "manifest.json"), manifest);
  EXPECT_EQ(test::refusal([&] { make(1); }),
            bench.string() + ": begun with another plan; accepted: the same options, or a name for a new folder");
}

TEST_F(Benchmark, OpensLabelsOnceAllPredictionsAreSealed) {
  ASSERT_TRUE(make(2));
  const fs::path labels = root_ / "bench/sealed/labels.json";
  fs::remove(labels);
  EXPECT_TRUE(test::refusal([&] { score_bench(command()); }).starts_with(labels.string()));
  EXPECT_EQ(asked_, 2);
  EXPECT_TRUE(fs::exists(root_ / "bench/predictions.sha256"));
}

TEST_F(Benchmark, GoesOnWhereItWasStopped) {
  ASSERT_TRUE(make(2, "none"));
  ScoreCommand c = command();
  const Predictor whole = c.predictor;
  c.threads = 1;
  c.predictor = [&](const Question& q) {
    if (asked_ == 1) throw io::InputError("stopped");
    return whole(q);
  };
  EXPECT_EQ(test::refusal([&] { score_bench(c); }), "stopped");
  EXPECT_FALSE(fs::exists(root_ / "bench" / "predictions.sha256"));
  c.predictor = whole;
  EXPECT_EQ(score_bench(c).at("false_alarm"), 1.0);
  EXPECT_EQ(asked_, 2);
}

TEST_F(Benchmark, TakesNoPredictionOnceLabelsAreOpen) {
  ASSERT_TRUE(make(2));
  ScoreCommand c = command();
  const Predictor whole = c.predictor;
  c.threads = 1;
  c.predictor = [&](const Question& q) {
    if (asked_ == 2) throw io::InputError("stopped");  // in the fit of a true effect
    return whole(q);
  };
  EXPECT_EQ(test::refusal([&] { score_bench(c); }), "stopped");
  const fs::path sums = root_ / "bench" / "predictions.sha256";
  fs::remove(sums);
  fs::remove(root_ / "bench" / "predictions" / "0001.json");
  EXPECT_EQ(test::refusal([&] { score_bench(command()); }),
            sums.string() + ": is missing, though labels were opened; accepted: what was sealed");
  EXPECT_EQ(asked_, 2);
  // nor is a folder gone on with under another plan
  fs::remove(root_ / "bench" / "manifest.json");
  EXPECT_EQ(
      test::refusal([&] { make(3); }),
      (root_ / "bench").string() + ": begun with another plan; accepted: the same options, or a name for a new folder");
}

TEST_F(Benchmark, PlansEveryPart) {
  const auto of = read_detectability(root_ / "detectable.toml");
  const std::vector<PlannedCase> plan = plan_cases(of, {});
  std::size_t outside = 0;
  std::map<std::string, std::size_t> count;
  std::set<std::size_t> numbers;
  std::map<std::uint64_t, std::vector<const PlannedCase*>> by_seed;
  std::size_t in_order = 0;
  for (const PlannedCase& c : plan) {
    ++count[c.part];
    numbers.insert(c.number);
    by_seed[c.seed].push_back(&c);
    in_order += c.number > 1 && plan[c.number - 1].part == plan[c.number - 2].part;
    EXPECT_GE(c.seed, 10001U);
    EXPECT_LT(c.seed, 700001U);
    for (const blind::BlindEffect& e : c.effects) {
      if (c.part.starts_with("singles") || c.part == "pairs") EXPECT_DOUBLE_EQ(e.size, 0.4) << e.id;
      if (c.part == "typical") EXPECT_DOUBLE_EQ(e.size, 1) << e.id;
      if (c.part != "hover" && c.part != "typical") EXPECT_NE(e.id, "tether") << "undetectable, in " << c.part;
    }
    if (c.part == "pairs") {
      ASSERT_EQ(c.effects.size(), 2U);
      EXPECT_NE(model::group_of(c.effects[0].id), model::group_of(c.effects[1].id));
    }
    EXPECT_EQ(c.effects.empty(), c.part == "none" || c.part == "parameters");
    const std::vector<std::string> rivals(c.effects.size() == 1 && c.effects[0].id == "wind" ? 1 : 0, "tether");
    if (c.part == "singles") EXPECT_EQ(c.inseparable, rivals);
    // nothing that gains too little at typical size is told from anything
    if (c.part == "typical") EXPECT_EQ(c.inseparable.size(), model::effects().size() - 1);
    if (c.part == "withheld" && c.effects[0].id == "wind")
      EXPECT_EQ(std::ranges::count(c.withheld, "tether"), 1) << "of its group";
    if (c.part == "withheld" && c.withheld.empty()) {
      EXPECT_TRUE(c.effects[0].id.starts_with("outside_"));
      EXPECT_NE(c.effects[0].id, "outside_slosh") << "undetectable";
      EXPECT_DOUBLE_EQ(c.effects[0].size, c.effects[0].id == "outside_vortex_ring" ? 3 : 2) << c.effects[0].id;
      ++outside;
    }
    EXPECT_EQ(c.randomised, c.part != "none");
    EXPECT_EQ(c.power, c.part == "singles_current");
    EXPECT_EQ(c.hover, c.part == "hover");
  }
  const std::map<std::string, std::size_t> expected = {{"singles", 145},   {"singles_current", 145}, {"none", 40},
                                                       {"parameters", 40}, {"withheld", 60},         {"pairs", 40},
                                                       {"hover", 30},      {"typical", 60}};
  EXPECT_EQ(count, expected);
  EXPECT_EQ(outside, 30U);
  EXPECT_EQ(numbers.size(), plan.size());
  EXPECT_EQ(*numbers.rbegin(), plan.size());
  EXPECT_LT(in_order, plan.size() / 3) << "numbers follow parts";
  // a robot flies once, but with and without current
  for (const auto& [seed, cases] : by_seed)
    EXPECT_EQ(cases.size(), cases[0]->part.starts_with("singles") ? 2U : 1U) << seed;
  PlanOptions reported;
  reported.reported = true;
  for (const PlannedCase& c : plan_cases(of, reported)) EXPECT_GE(c.seed, 700001U);
  // what a part holds does not depend on what else is made
  PlanOptions pairs;
  pairs.parts = {"pairs"};
  std::set<std::string> alone, among;
  for (const PlannedCase& c : plan_cases(of, pairs)) alone.insert(c.effects[0].id + std::to_string(c.seed));
  for (const PlannedCase& c : plan)
    if (c.part == "pairs") among.insert(c.effects[0].id + std::to_string(c.seed));
  EXPECT_EQ(alone, among);
}

TEST_F(Benchmark, RefusesATableOfSizesThatIsNone) {
  const fs::path file = root_ / "detectable.toml";
  io::write_atomically(file, detectability() + "[no_such_effect]\ndetectable = 1\n");
  EXPECT_NE(test::refusal([&] { read_detectability(file); }).find("no_such_effect"), std::string::npos);
  std::string text = detectability();
  text.replace(text.find("detectable = 0.2"), 16, "detectable = 2.1");
  io::write_atomically(file, text);
  EXPECT_NE(test::refusal([&] { read_detectability(file); }).find("twice that is beyond size 4"), std::string::npos);
}

}  // namespace
}  // namespace flappy::benchmark
