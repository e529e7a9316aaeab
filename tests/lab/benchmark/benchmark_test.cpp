// The blind benchmark from making to scoring, with a predictor that costs nothing.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <filesystem>
#include <set>
#include <sstream>

#include "full.hpp"
#include "gap/next/next_experiment.hpp"
#include "gap/question/verdict_rule.hpp"
#include "io/files.hpp"
#include "io/sha256.hpp"
#include "lab/benchmark/calibrate.hpp"
#include "lab/benchmark/families.hpp"
#include "lab/benchmark/foresee_bench.hpp"
#include "lab/benchmark/make.hpp"
#include "lab/benchmark/records.hpp"
#include "lab/benchmark/score_bench.hpp"
#include "lab/benchmark/stub_family.hpp"
#include "model/effects/registry.hpp"
#include "refusal.hpp"

namespace flappy::benchmark {
namespace {

namespace fs = std::filesystem;

const std::string kConfigs = FLAPPY_SOURCE_DIR "/configs/";

/// A folder of its own.
class Benchmark : public testing::Test {
 protected:
  Benchmark() : root_(fs::path(testing::TempDir()) / ("blind_" + name())) {
    fs::remove_all(root_);
    fs::create_directories(root_);
  }
  ~Benchmark() override { fs::remove_all(root_); }

  static std::string name() { return testing::UnitTest::GetInstance()->current_test_info()->name(); }

  bool make(std::size_t at_most, const std::string& part = "singles") const {
    MakeCommand c;
    c.out = root_ / "bench";
    c.vehicle = kConfigs + "vehicles/hummingbird_nominal.toml";
    c.randomise = kConfigs + "randomisation/published.toml";
    c.plan.effects = {"ground_effect", "ceiling_effect"};
    c.plan.parts = {part};
    c.plan.at_most = at_most;
    c.other_sessions = 0;
    c.threads = 2;
    return make_bench(c);
  }

  /// Two robots of a part as make() leaves them, flown once for all tests.
  void copy_two(const std::string& part = "singles") const {
    const fs::path kept = made() / part;
    if (!fs::exists(kept)) {
      ASSERT_TRUE(make(2, part));
      fs::create_directories(made());
      fs::copy(root_ / "bench", kept, fs::copy_options::recursive);
    } else {
      fs::copy(kept, root_ / "bench", fs::copy_options::recursive);
    }
  }
  static void TearDownTestSuite() { fs::remove_all(made()); }

  /// Says ground effect, whatever it is asked, unless it may not.
  ScoreCommand command() {
    ScoreCommand c;
    c.folders = {root_ / "bench"};
    c.priors = kConfigs + "gap/priors.toml";
    c.threads = 2;
    c.predictor = [this](const Question& q) {
      ++asked_;
      Prediction p;
      gap::Diagnosis& d = p.diagnosis;
      d.refit_loss = 1;
      const bool may = std::ranges::count(q.withheld, "ground_effect") == 0;
      d.verdict = {may ? gap::VerdictKind::effect : gap::VerdictKind::unknown, {}, false, 0.8};
      gap::RankedHypothesis h;
      h.effects = {may ? "ground_effect" : "ceiling_effect"};
      h.probability = may ? 0.8 : 0.1;
      h.loss = may ? 0.5 : 0.25;
      h.loss_gain_sd = 0.01;
      if (may) {
        d.verdict.effects = {"ground_effect"};
      }
      d.hypotheses = {h};
      EXPECT_EQ(q.flights.size(), 3U);
      return p;
    };
    return c;
  }

  static fs::path made() { return fs::path(testing::TempDir()) / "blind_made"; }
  fs::path root_;
  std::atomic<int> asked_ = 0;
};

TEST_F(Benchmark, PredictsSealsAndScores) {
  copy_two();
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
  EXPECT_TRUE(json.at("top1_current").is_null());
  for (const char* key : {"top1_mocap_imu", "top1_current", "group_top1", "top3", "false_alarm_none", "unknown",
                          "unknown_wrong", "ece", "closure_median", "pairs_f1", "hover_abstain"})
    for (const char* end : {"", "_low", "_high"}) EXPECT_TRUE(json.contains(std::string(key) + end)) << key << end;
  // once more: nothing is asked again
  EXPECT_EQ(score_bench(command()), json);

  // the same table from what it wrote of the cases, without their flights
  ScoreCommand merged;
  merged.cases = {bench / "cases.jsonl"};
  merged.out = root_ / "merged";
  const nlohmann::ordered_json again = score_bench(merged);
  EXPECT_EQ(again.at("families"), json.at("families"));
  EXPECT_EQ(io::read_text(merged.out / "score.csv"), io::read_text(bench / "score.csv"));
  merged.cases.push_back(merged.cases.front());
  EXPECT_TRUE(test::refusal([&] { score_bench(merged); }).ends_with(": is given twice; accepted: each case once"));
  const std::string cases = io::read_text(bench / "cases.jsonl");
  io::write_atomically(bench / "half.jsonl", cases.substr(0, cases.size() / 4));
  merged.cases = {bench / "half.jsonl"};
  EXPECT_EQ(test::refusal([&] { score_bench(merged); }),
            (bench / "half.jsonl").string() + ":1: is no JSON; accepted: a line that flappy-blind score wrote");
  fs::remove(bench / "half.jsonl");

  // robots that fly stand beside those that are on a bench, too; a contrast in flight does not stand beside one on a bench
  const auto write = [&](const char* name, const std::string& part, bool clamped) {
    std::string text;
    std::istringstream lines(cases);
    for (std::string line; std::getline(lines, line);) {
      auto record = nlohmann::ordered_json::parse(line);
      if (!record.contains("bench")) continue;
      record["bench"] = clamped;
      record["part"] = part;
      text += record.dump() + "\n";
    }
    io::write_atomically(root_ / name, text);
    return root_ / name;
  };
  merged.cases = {write("one.jsonl", "singles", false), write("other.jsonl", "singles_bench", true)};
  EXPECT_EQ(score_bench(merged).at("cases"), 4);
  merged.cases = {write("one.jsonl", "changed", false), write("other.jsonl", "changed", true)};
  EXPECT_TRUE(test::refusal([&] {
                score_bench(merged);
              }).ends_with("is clamped and others fly; accepted: one of both in a table"));
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

// Of two robots, each of which is said to have ground effect by 40 nats and ceiling effect by 30, one has the one and one the other: ten
// nats are worth next to nothing.
TEST_F(Benchmark, LearnsWhatANatIsWorth) {
  copy_two();
  CalibrateCommand calibrated{.folders = {root_ / "bench"}, .out = root_ / "verdict.toml"};
  EXPECT_TRUE(test::refusal([&] {
                calibrate(calibrated);
              }).ends_with("was not scored; accepted: folders of flappy-blind score"));
  ScoreCommand c = command();
  c.predictor = [](const Question&) {
    Prediction p;
    const auto weighed = [&](std::vector<std::string> effects, double nats, double prior) {
      gap::RankedHypothesis h;
      h.kind = effects.empty() ? gap::HypothesisKind::parameters : gap::HypothesisKind::effect;
      h.effects = std::move(effects);
      h.log_evidence = nats + std::log(prior);
      h.log_prior = std::log(prior);
      p.diagnosis.hypotheses.push_back(std::move(h));
    };
    weighed({}, 0, 0.4);
    weighed({"ground_effect"}, 40, 0.3);
    weighed({"ceiling_effect"}, 30, 0.3);
    return p;
  };
  score_bench(c);
  const nlohmann::ordered_json json = calibrate(calibrated);
  EXPECT_EQ(json.at("cases"), 2);
  const gap::VerdictRule before = gap::read_verdict_rule(), after = gap::read_verdict_rule(calibrated.out);
  EXPECT_GT(after.tempering.nats, 2 * before.tempering.nats);
  EXPECT_EQ(after.naming.of_all, before.naming.of_all) << "what is not learnt stays";
  EXPECT_LT(json.at("said.slope").get<double>() + json.at("said.offset").get<double>(), 1) << "half of it was wrong";
  // nearly one half each, which is the best that can be said of both
  EXPECT_LT(json.at("score_before").get<double>(), json.at("score").get<double>() - 0.1);
  EXPECT_GT(json.at("score").get<double>(), std::log(0.4));
  // what was scored by one file may teach another, as far as both have the same evidence
  calibrated.verdict = calibrated.out, calibrated.out = root_ / "again.toml";
  EXPECT_NEAR(calibrate(calibrated).at("score_before").get<double>(), json.at("score").get<double>(), 1e-3);
  std::string text = io::read_text(calibrated.verdict);
  const std::string key = "\npenalty_nats = ";
  text.insert(text.find(key) + key.size(), "1");
  io::write_atomically(calibrated.verdict, text);
  EXPECT_EQ(
      test::refusal([&] { calibrate(calibrated); }),
      (root_ / "bench").string() +
          ": was scored with other constants that calibrate does not learn; accepted: a --verdict that has those of " +
          (root_ / "bench/predictions/verdict.toml").string());
}

TEST_F(Benchmark, OpensLabelsOnceAllPredictionsAreSealed) {
  copy_two();
  const fs::path labels = root_ / "bench/sealed/labels.json";
  fs::remove(labels);
  EXPECT_TRUE(test::refusal([&] { score_bench(command()); }).starts_with(labels.string()));
  EXPECT_EQ(asked_, 2);
  EXPECT_TRUE(fs::exists(root_ / "bench/predictions.sha256"));
}

TEST_F(Benchmark, GoesOnWhereItWasStopped) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  copy_two("none");
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
  EXPECT_EQ(score_bench(c).at("false_alarm_none"), 1.0);
  EXPECT_EQ(asked_, 2);
}

TEST_F(Benchmark, TakesNoPredictionOnceLabelsAreOpen) {
  copy_two();
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
  // nor is a folder gone on with under other options
  fs::remove_all(root_ / "bench" / "true_fits");
  ScoreCommand other = command();
  other.verdict = kConfigs + "gap/contrast_verdict.toml";
  EXPECT_EQ(test::refusal([&] { score_bench(other); }),
            (root_ / "bench").string() +
                ": its predictions were begun with another --verdict; accepted: the same options, or a new benchmark");
  // or under another plan
  fs::remove(root_ / "bench" / "manifest.json");
  EXPECT_EQ(
      test::refusal([&] { make(3); }),
      (root_ / "bench").string() + ": begun with another plan; accepted: the same options, or a name for a new folder");
}

/// A blind contrast from start to end: a cable that was not there before, one or two flights of each of two sessions.
class BlindContrast : public Benchmark {
 protected:
  nlohmann::ordered_json made_and_scored(const std::string& part, std::size_t flights,
                                         const Predictor& predictor = predict) {
    MakeCommand m;
    m.out = root_ / "bench";
    m.plan = {.contrast = true, .parts = {part}, .effects = {"tether"}, .at_most = 1, .flights = flights};
    m.other_sessions = 0;
    m.threads = 2;
    EXPECT_TRUE(make_bench(m));
    EXPECT_FALSE(fs::exists(m.out / "cases/0001" / ("flight_" + std::to_string(flights + 1))));
    ScoreCommand s;
    s.predictor = predictor;
    s.folders = {m.out};
    s.discrepancy = kConfigs + "lab/discrepancy/without_a.toml";
    s.sessions = kConfigs + "lab/sessions/without_a.toml";
    s.verdict = kConfigs + "lab/sessions/verdict_without_a.toml";
    s.threads = 1;
    nlohmann::ordered_json json = score_bench(s);
    EXPECT_EQ(json.at("cases"), 1);
    return json;
  }
};

TEST_F(BlindContrast, AsksWithTheFlightsOfBothSessions) {
  const auto tether = [](const Question& q) {
    EXPECT_EQ(q.flights.size(), 1U);
    EXPECT_EQ(q.reference.size(), 1U);
    EXPECT_NE(q.flights, q.reference);
    Prediction p;
    p.diagnosis.verdict = {gap::VerdictKind::effect, {"tether"}, false, 0.8};
    p.diagnosis.hypotheses.emplace_back().effects = {"tether"};
    return p;
  };
  EXPECT_EQ(made_and_scored("changed", 1, tether).at("contrast_all_top1"), 1.0);
}

TEST_F(BlindContrast, NamesWhatChanged) {
  if (!test::full()) GTEST_SKIP() << "takes a minute: with --full";
  EXPECT_EQ(made_and_scored("changed", 1).at("contrast_all_top1"), 1.0);
}

TEST_F(BlindContrast, CallsUnknownWhatTheCatalogueLacks) {
  if (!test::full()) GTEST_SKIP() << "takes minutes: with --full";
  EXPECT_EQ(made_and_scored("changed_withheld", 2).at("contrast_unknown"), 1.0);
}

TEST_F(Benchmark, PlansContrasts) {
  const blind::Family& family = family_named("a");
  PlanOptions options;
  options.contrast = true;
  std::map<std::string, std::size_t> count;
  std::map<std::string, std::set<std::string>> effects;
  std::map<std::uint64_t, std::set<std::string>> by_seed;
  std::set<double> magnitudes;
  std::vector<PlannedCase> cases = plan_cases(family, options);
  std::ranges::stable_sort(cases, {}, [](const PlannedCase& c) { return c.part != "changed"; });
  for (const PlannedCase& c : cases) {
    ++count[c.part];
    EXPECT_EQ(c.reference_sessions, c.references) << "each reference is of its own session";
    EXPECT_TRUE(c.own_parameters && c.conventions);
    EXPECT_EQ(c.references, c.part == "changed_short_reference" ? 1U : 3U) << c.part;
    EXPECT_EQ(c.flights, c.part == "changed_short_test" ? 1U : 3U) << c.part;
    EXPECT_EQ(c.calm_reference, c.part.ends_with("_calm")) << c.part;
    EXPECT_EQ(c.withheld.empty(), c.part != "changed_withheld");
    EXPECT_EQ(c.effects.empty(), c.part.starts_with("unchanged"));
    for (const blind::BlindEffect& e : c.effects) {
      if (c.part == "changed_outside") EXPECT_EQ(e.magnitude, 2);
      else EXPECT_TRUE(e.magnitude >= 0.7 && e.magnitude <= 2) << e.magnitude;
      magnitudes.insert(e.magnitude);
      if (c.part.starts_with("changed_short")) EXPECT_TRUE(by_seed[c.seed].contains(e.id)) << "a robot of part changed";
      effects[c.part].insert(e.id);
      by_seed[c.seed].insert(e.id);
    }
    const std::optional<blind::Assignment> reference = reference_of(c, "vehicle.toml");
    ASSERT_TRUE(reference);
    EXPECT_TRUE(reference->effects.empty());
    EXPECT_EQ(reference->session, 0U);
    EXPECT_EQ(assignment_of(c, "vehicle.toml").session, 1U);
  }
  const std::map<std::string, std::size_t> expected = {
      {"changed", 60},      {"changed_short_reference", 60}, {"changed_short_test", 60}, {"unchanged", 30},
      {"changed_calm", 30}, {"unchanged_calm", 30},          {"changed_withheld", 30},   {"changed_outside", 20},
      {"changed_pairs", 20}};
  EXPECT_EQ(count, expected);
  EXPECT_GT(magnitudes.size(), 100U) << "each robot has its own";
  EXPECT_LT(*magnitudes.begin(), 0.75);
  EXPECT_GT(*magnitudes.rbegin(), 1.9);
  EXPECT_EQ(effects["changed"].size(), 30U) << "every effect, even one that sessions hide";
  for (const auto& [seed, ids] : by_seed)
    if (ids.size() > 1) EXPECT_EQ(ids.size(), 2U) << "of a pair, not of another robot: " << seed;
  options.parts = {"singles"};
  EXPECT_TRUE(test::refusal([&] {
                plan_cases(family, options);
              }).starts_with("--part singles: not with --contrast; accepted: changed, "));
}

/// Keeps which runs were asked for.
struct RecordingFamily final : StubFamily {
  using StubFamily::StubFamily;
  bool has_bench() const override { return true; }
  blind::FamilyFlight fly(const blind::Assignment& a, std::size_t flight) const override {
    flown.emplace_back(a.session, flight);
    return {};
  }
  mutable std::vector<std::pair<std::size_t, std::size_t>> flown;  ///< session, flight
};

// Runs on a bench have inputs of their own, by which sessions of one run each would differ.
TEST(FlyDrawn, EachSessionHasAllRunsOfABench) {
  using Flown = std::vector<std::pair<std::size_t, std::size_t>>;
  const auto flown = [](bool bench) {
    const RecordingFamily family("recording");
    blind::Assignment a, reference;
    a.bench = reference.bench = bench;
    a.session = 1;
    fly_drawn(family, a, 1, {}, reference, 2);
    return family.flown;
  };
  EXPECT_EQ(flown(true), (Flown{{0, 0}, {0, 1}, {0, 2}, {2, 0}, {2, 1}, {2, 2}, {1, 0}, {1, 1}, {1, 2}}));
  EXPECT_EQ(flown(false), (Flown{{0, 0}, {2, 1}, {0, 2}, {1, 0}, {1, 1}, {1, 2}}));
}

std::vector<blind::FamilyEffect> two_effects() {
  std::vector<blind::FamilyEffect> effects(2);
  effects[0].id = "wind", effects[1].id = "coulomb_friction";
  return effects;
}

TEST(PlanCases, ReferencesOnABenchAreWholeSessions) {
  const RecordingFamily family("recording", two_effects());
  PlanOptions options;
  options.contrast = options.bench = true;
  options.parts = {"unchanged"};
  options.at_most = 1;
  const PlannedCase c = plan_cases(family, options).front();
  EXPECT_EQ(c.reference_sessions, 3U);
  EXPECT_EQ(c.references, 9U);
  EXPECT_EQ(c.flights, 3U);
  options.parts = {"changed_short_reference"};
  EXPECT_EQ(plan_cases(family, options).front().reference_sessions, 1U);
  EXPECT_EQ(plan_cases(family, options).front().references, 3U);
  options.parts = {"unchanged"};
  options.bench = false;
  EXPECT_NE(plan_cases(family, options).front().seed, c.seed);
}

TEST(PlanCases, TakesCasesOfSomeNumbersAsTheyAreAmongAll) {
  const RecordingFamily family("recording", two_effects());
  PlanOptions options;
  options.parts = {"singles"};
  options.at_most = 4;
  const std::vector<PlannedCase> all = plan_cases(family, options);
  ASSERT_EQ(all.size(), 4U);
  options.only = {4, 2};
  const std::vector<PlannedCase> some = plan_cases(family, options);
  ASSERT_EQ(some.size(), 2U);
  for (const std::size_t i : {0U, 1U}) {
    EXPECT_EQ(some[i].number, 2 * (i + 1));
    EXPECT_EQ(some[i].seed, all[some[i].number - 1].seed);
    EXPECT_EQ(some[i].effects.front().id, all[some[i].number - 1].effects.front().id);
  }
  options.only = {5};
  EXPECT_EQ(test::refusal([&] { plan_cases(family, options); }), "--only 5: no such case; accepted: 1 to 4");
}

TEST(PlanCases, LeavesOutTheFirstOfEachPart) {
  const RecordingFamily family("recording", two_effects());
  PlanOptions options;
  options.parts = {"none"};
  options.at_most = 3;
  const auto seeds = [&] {
    std::set<std::uint64_t> all;
    for (const PlannedCase& c : plan_cases(family, options)) all.insert(c.seed);
    return all;
  };
  const std::uint64_t first = *seeds().begin();
  EXPECT_EQ(seeds(), (std::set<std::uint64_t>{first, first + 1, first + 2}));
  options.skip = 2;
  EXPECT_EQ(seeds(), (std::set<std::uint64_t>{first + 2, first + 3, first + 4}));
  options.skip = 1000;
  EXPECT_EQ(test::refusal(seeds), "--skip 1000: leaves no case; accepted: less than a part has");
}

TEST_F(Benchmark, PlansEveryPart) {
  const blind::Family& family = family_named("a");
  const std::vector<PlannedCase> plan = plan_cases(family, {});
  std::map<std::string, std::size_t> count;
  std::set<std::size_t> numbers;
  std::map<std::uint64_t, std::vector<const PlannedCase*>> by_seed;
  std::size_t in_order = 0;
  std::set<std::string> hidden;
  for (const PlannedCase& c : plan) {
    ++count[c.part];
    numbers.insert(c.number);
    by_seed[c.seed].push_back(&c);
    in_order += c.number > 1 && plan[c.number - 1].part == plan[c.number - 2].part;
    EXPECT_GE(c.seed, 10'000'000U);
    EXPECT_LT(c.seed, 15'000'000U);
    for (const blind::BlindEffect& e : c.effects) {
      if (c.part == "outside") EXPECT_DOUBLE_EQ(e.magnitude, 2) << e.id;
      else EXPECT_TRUE(e.magnitude >= 0.7 && e.magnitude <= 2) << e.id;
      if (c.part == "hover") hidden.insert(e.id);
      EXPECT_EQ(e.id.starts_with("outside_"), c.part == "outside") << e.id;
    }
    if (c.part == "pairs") {
      ASSERT_EQ(c.effects.size(), 2U);
      EXPECT_NE(model::group_of(c.effects[0].id), model::group_of(c.effects[1].id));
    }
    const bool harmless =
        c.part == "none" || c.part == "parameters" || c.part == "own_parameters" || c.part == "conventions";
    EXPECT_EQ(c.effects.empty(), harmless);
    EXPECT_EQ(c.own_parameters, !harmless || c.part == "own_parameters") << c.part;
    EXPECT_EQ(c.conventions, (!harmless && c.part != "redeclared") || c.part == "conventions") << c.part;
    EXPECT_EQ(c.published, c.part == "parameters");
    EXPECT_EQ(c.withheld.empty(), c.part != "withheld");
    if (c.part == "withheld" && c.effects[0].id == "wind")
      EXPECT_EQ(std::ranges::count(c.withheld, "tether"), 1) << "of its group";
    EXPECT_EQ(c.power, c.part == "singles_current");
    EXPECT_EQ(c.hover, c.part == "hover");
  }
  // 30 effects in turn, 10 outside
  EXPECT_TRUE(hidden.contains("body_drag") && hidden.contains("ceiling_effect"));
  EXPECT_FALSE(hidden.contains("wing_damage") || hidden.contains("wind")) << "they act in hover, too";
  const std::size_t of_hover = (100 + hidden.size() - 1) / hidden.size() * hidden.size();
  const std::map<std::string, std::size_t> expected = {{"singles", 120}, {"singles_current", 120}, {"redeclared", 100},
                                                       {"none", 100},    {"parameters", 100},      {"withheld", 60},
                                                       {"outside", 50},  {"own_parameters", 100},  {"conventions", 100},
                                                       {"pairs", 100},   {"hover", of_hover}};
  EXPECT_EQ(count, expected);
  EXPECT_EQ(numbers.size(), plan.size());
  EXPECT_EQ(*numbers.rbegin(), plan.size());
  EXPECT_LT(in_order, plan.size() / 3) << "numbers follow parts";
  // a robot flies once, but with current, and as declared otherwise
  for (const auto& [seed, cases] : by_seed) {
    const std::size_t times = !cases[0]->part.starts_with("singles") && cases[0]->part != "redeclared" ? 1U
                              : seed % 10'000 < 100                                                    ? 3U
                                                                                                       : 2U;
    EXPECT_EQ(cases.size(), times) << seed;
    for (const PlannedCase* c : cases) {
      ASSERT_EQ(c->effects.size(), cases[0]->effects.size());
      if (!c->effects.empty()) EXPECT_EQ(c->effects[0].id, cases[0]->effects[0].id);
    }
  }
  PlanOptions reported;
  reported.reported = true;
  for (const PlannedCase& c : plan_cases(family, reported)) EXPECT_TRUE(c.seed >= 15'000'000U && c.seed < 20'000'000U);
  // what a part holds does not depend on what else is made
  PlanOptions pairs;
  pairs.parts = {"pairs"};
  std::set<std::string> alone, among;
  for (const PlannedCase& c : plan_cases(family, pairs)) alone.insert(c.effects[0].id + std::to_string(c.seed));
  for (const PlannedCase& c : plan)
    if (c.part == "pairs") among.insert(c.effects[0].id + std::to_string(c.seed));
  EXPECT_EQ(alone, among);
}

TEST_F(Benchmark, FamilyAHasTheCatalogue) {
  std::set<std::string> own, catalogue;
  for (const blind::FamilyEffect& e : family_named("a").effects())
    if (in_catalogue(e)) own.insert(e.id);
  for (const model::CatalogueEffect& e : model::effects()) catalogue.insert(std::string(e.info.id));
  EXPECT_EQ(own, catalogue);
}

TEST_F(Benchmark, SealsWhereEffectsActAndWhatTheFileDeclares) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  ASSERT_TRUE(make(1));
  const Json labels = read_json(root_ / "bench/sealed/labels.json");
  ASSERT_EQ(labels.at("cases")[0].at("effects")[0].at("id"), "ceiling_effect");
  EXPECT_EQ(labels.at("cases")[0].at("regimes").dump(), R"(["ceiling","height"])");
  EXPECT_EQ(labels.at("cases")[0].at("channels").dump(), R"(["specific_force_z","angular_acceleration_y","current"])");
  EXPECT_EQ(read_manifest(root_ / "bench").family, "a");
  fs::remove_all(root_ / "bench");
  // a robot of the published randomisation declares the file, and no file of its own stays
  ASSERT_TRUE(make(1, "parameters"));
  const auto drawn = flightlog::read_flight_log(root_ / "bench/cases/0001/flight_1").header;
  const std::string declared = io::read_text(kConfigs + "vehicles/hummingbird_nominal.toml");
  EXPECT_EQ(drawn.vehicle_sha256, io::sha256(declared));
  EXPECT_EQ(std::distance(fs::directory_iterator(root_ / "bench/sealed"), {}), 2) << "the plan and the labels";
}

TEST_F(Benchmark, ScoresSeveralFoldersTogether) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  copy_two();
  fs::rename(root_ / "bench", root_ / "first");
  copy_two("none");
  ScoreCommand c = command();
  c.folders.push_back(root_ / "first");
  c.out = root_ / "out";
  const nlohmann::ordered_json json = score_bench(c);
  EXPECT_EQ(json.at("cases"), 4);
  EXPECT_EQ(json.at("group_top1"), 1.0) << "ground effect, said of the ceiling's";
  EXPECT_EQ(json.at("false_alarm_none"), 1.0);
  EXPECT_EQ(json.at("families").at("a").at("cases"), 4);
  const std::string list = io::read_text(root_ / "out/score.csv");
  EXPECT_EQ(std::ranges::count(list, '\n'), 5);
}

// Robots of every family follow a flight that is proposed: half a metre along x and a quarter of a turn in two seconds, and hold there.
TEST_F(Benchmark, FamiliesFlyWhatIsProposed) {
  const blind::ProposedFlight flight{3,
                                     [](double t_s) {
                                       const double s = std::clamp(t_s / 2, 0.0, 1.0),
                                                    way = s * s * s * (10 + s * (-15 + 6 * s));
                                       return std::array<double, 4>{0.5 * way, 0, 0.6, 1.57 * way};
                                     },
                                     [](double t_s) {
                                       return std::array<double, 4>{t_s < 0.5 ? 0.3 * std::sin(40 * t_s) : 0, 0, 0, 0};
                                     }};
  for (const char* name : kFamilies) {
#ifndef FLAPPY_FAMILIES
    if (name != std::string("a")) continue;
#endif
#ifndef FLAPPY_HAVE_MUJOCO
    if (name == std::string("c")) continue;
#endif
    blind::Assignment a;
    a.vehicle_file = kConfigs + "vehicles/hummingbird_nominal.toml";
    a.seed = 3;
    a.proposed = &flight;
    const blind::FamilyFlight flown = family_named(name).fly(a, kProposedFlight);
    ASSERT_FALSE(flown.crashed) << name << ": " << flown.how;
    const flightlog::MocapStream& m = flown.log.mocap;
    EXPECT_NEAR(flown.log.command.t_s.back(), 3, 0.01) << name;
    EXPECT_NEAR(m.x_m.back(), 0.5, 0.12) << name;
    EXPECT_NEAR(m.z_m.back(), 0.6, 0.12) << name;
    EXPECT_NEAR(2 * std::atan2(m.qz.back(), m.qw.back()), 1.57, 0.2) << name;
    // the excitation is there, and ends
    const auto shaken = [&](double from_s) {
      const auto& c = flown.log.command;
      double least = 1e9, most = -1e9;
      for (std::size_t i = 0; i < c.t_s.size(); ++i)
        if (c.t_s[i] >= from_s && c.t_s[i] < from_s + 0.4) {
          least = std::min(least, c.inputs->amplitude_V[i]);
          most = std::max(most, c.inputs->amplitude_V[i]);
        }
      return most - least;
    };
    EXPECT_GT(shaken(0.05), shaken(2.5) + 0.3) << name;
  }
}

// A diagnosis that abstains proposes an intervention; its maker makes it, the robot flies the manoeuvre, as near to the ceiling of its room as that is
// to its own, and all flights are diagnosed.
TEST_F(Benchmark, FliesWhatADiagnosisProposes) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  ASSERT_TRUE(make(1, "hover"));
  ScoreCommand c = command();
  std::filesystem::copy(kConfigs, root_ / "configs", std::filesystem::copy_options::recursive);
  c.experiments = root_ / "configs/gap/experiments";
  io::write_atomically(c.experiments / gap::kInterventions,
                       "schema = 1\n[[intervention]]\nname = \"swapped\"\nmanoeuvre = \"ceiling_steps\"\n"
                       "cost = \"time\"\nchanges = { swapped_wings = true }\n");
  double highest_m = 0, lasts_s = 0;
  c.predictor = [&](const Question& q) {
    Prediction p;
    p.diagnosis.verdict = {gap::VerdictKind::parameters, {}, false, 0.4};
    p.diagnosis.next.emplace().manoeuvre = "swapped";
    if (q.flights.size() == 4) {
      const auto log = flightlog::read_flight_log(q.flights.back());
      EXPECT_TRUE(log.header.changes.swapped_wings);
      highest_m = std::ranges::max(log.mocap.z_m);
      lasts_s = log.command.t_s.back();
      p.diagnosis.verdict.kind = gap::VerdictKind::effect;
      p.diagnosis.verdict.effects = {"ceiling_effect"};
    }
    return p;
  };
  const nlohmann::ordered_json json = score_bench(c);
  EXPECT_EQ(json.at("hover_abstain"), 1.0);
  EXPECT_EQ(json.at("hover_next"), 1.0);
  EXPECT_NEAR(highest_m, 2 - 0.09, 0.08) << "in its own room the manoeuvre goes up to 0.71 m";
  EXPECT_NEAR(lasts_s, 5.5, 0.01);
}

TEST_F(Benchmark, PlansBeforeItScores) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  copy_two();
  BenchQuestions plan;
  plan.folders = {root_ / "bench"};
  plan.threads = 2;
  ASSERT_TRUE(foresee_bench(plan));
  const std::optional<Foresight> own = read_foreseen(root_ / "bench", 1, "tether");
  ASSERT_TRUE(own);
  EXPECT_GT(own->nats, 0);
  EXPECT_GT(own->probability, 0);
  EXPECT_FALSE(read_foreseen(root_ / "bench", 3, "tether")) << "there are two cases";
  EXPECT_NE(io::read_text(root_ / "bench" / kForeseenFile).find("\n2,tether,"), std::string::npos);
  ScoreCommand c = command();
  c.predictor = [](const Question&) {
    Prediction p;
    gap::RankedHypothesis h;
    h.effects = {"ground_effect"};
    p.diagnosis.hypotheses.push_back(h);
    p.diagnosis.hypotheses.emplace_back().kind = gap::HypothesisKind::parameters;
    return p;
  };
  const nlohmann::ordered_json json = score_bench(c);
  EXPECT_TRUE(json.contains("plan_rank"));
  EXPECT_NE(test::refusal([&] { foresee_bench(plan); }).find("its labels were opened"), std::string::npos);
}

TEST_F(Benchmark, RefusesWhatThereIsNot) {
  EXPECT_EQ(test::refusal([] { family_named("d"); }), "--family d: no such family; accepted: a, b or c");
#ifndef FLAPPY_FAMILIES
  EXPECT_EQ(test::refusal([] { family_named("b"); }),
            "--family b: this build has only a; accepted: a, or a build with -DFLAPPY_FAMILIES=ON");
#else
  EXPECT_EQ(family_named("b").name(), "b");
#endif
  EXPECT_EQ(test::refusal([] { check_engine("bench", "a", ""); }), "accepted");
  EXPECT_EQ(test::refusal([] { check_engine("bench", "a", "MuJoCo 3.17.0"); }),
            "bench/manifest.json: its robots are of MuJoCo 3.17.0, and fly otherwise with family a here; accepted: a "
            "build with MuJoCo 3.17.0");
  blind::Assignment a;
  a.vehicle_file = kConfigs + "vehicles/hummingbird_nominal.toml";
  a.effects = {{"wnd", 1}};
  EXPECT_EQ(test::refusal([&] { family_named("a").fly(a, 0); }),
            "--effect wnd: no such effect; accepted: what `flappy-blind effects` lists; did you mean \"wind\"?");
  a.effects = {};
  EXPECT_EQ(test::refusal([&] { family_named("a").fly(a, 3); }),
            "flight 3: there is none of this number; accepted: 0, 1 and 2");
}

TEST_F(Benchmark, RefusesEffectsThatItCannotPlan) {
  PlanOptions options;
  options.effects = {"grund_effect"};
  EXPECT_TRUE(test::refusal([&] {
                plan_cases(family_named("a"), options);
              }).starts_with("--effects grund_effect: no effect of the catalogue; accepted: "));
  options.effects = {"ground_effect", "ceiling_effect"};
  options.parts = {"pairs"};
  EXPECT_EQ(test::refusal([&] { plan_cases(family_named("a"), options); }),
            "--effects: all are of one group; accepted: of two groups for pairs");
}

}  // namespace
}  // namespace flappy::benchmark
