// Judging and searching.
#include "design/search.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "fixture.hpp"
#include "full.hpp"
#include "io/temporary_folder.hpp"
#include "refusal.hpp"

namespace flappy::design {
namespace {

struct Small {
  DesignConfig config;
  Judge judge;
  Search search;
  std::vector<Generation> history;
  bool done;

  explicit Small(const std::vector<std::string>& overrides = {}, const std::vector<Record>& known = {},
                 unsigned until = 1000)
      : config(small_config(overrides)), judge(config.judge), search(judge, config.search, known) {
    done = search.run([&](const Generation& g) { return history.push_back(g), g.number < until; });
  }
};

std::string lines(const std::vector<Record>& records) {
  std::string text;
  for (const Record& r : records) text += record_line(r) + "\n";
  return text;
}

const Small& searched() {
  static const Small made;
  return made;
}

TEST(Judge, GainsOfThePublishedRobotAreThoseOfItsFile) {
  const Judge& judge = searched().judge;
  const Judged j = judge.judge(judge.config().space.built, Stage::stand);
  flight::Controller was = judge.config().hover.fleet.controller, now = j.controller;
  const auto a = fields(was), b = fields(now);
  for (std::size_t i = 0; i < a.size(); ++i)
    if (!a[i].path.ends_with("_V")) EXPECT_NEAR(*b[i].value, *a[i].value, 1e-9 * std::abs(*a[i].value)) << a[i].path;
}

TEST(Judge, GainsGrowWithTheInertia) {
  const Judge& judge = searched().judge;
  const Space& space = judge.config().space;
  Robot robot = build(space, space.built);
  double flown_s = 0;
  const Stand stand = measure(robot, space.workshop, 250e-6, 9.81, flown_s);
  auto before = judge.fitted(robot, stand).constants.of<flight::PidController>();
  const double was = whole_body(robot.vehicle).inertia_kg_m2.xx;
  robot.vehicle.torso.inertia_kg_m2.xx += was;
  auto after = judge.fitted(robot, stand).constants.of<flight::PidController>();
  EXPECT_NEAR(after.roll.p / before.roll.p, 2, 1e-6);
  EXPECT_NEAR(after.roll.d / before.roll.d, 2, 1e-6);
  EXPECT_NEAR(after.yaw.p / before.yaw.p, 1, 1e-6);
}

TEST(Search, FrontIsWhatNoOtherDesignBeats) {
  std::optional<Small> longer;
  if (test::full()) longer.emplace(std::vector<std::string>{"search.generations=6", "search.population=16"});
  const Small& made = longer ? *longer : searched();
  const Search& s = made.search;
  ASSERT_TRUE(made.done);
  const std::vector<Record> front = s.front(), all = s.records();
  ASSERT_FALSE(front.empty());
  const auto beats = [&](const Record& a, const Record& b) {
    const auto x = s.objectives(a), y = s.objectives(b);
    return x != y && std::ranges::equal(x, y, std::ranges::less_equal());
  };
  for (const Record& f : front) {
    EXPECT_EQ(f.refused, "");
    for (const Record& r : all) EXPECT_FALSE(beats(r, f));
  }
  for (const Record& r : all) {
    if (!r.refused.empty()) continue;
    EXPECT_TRUE(
        std::ranges::any_of(front, [&](const Record& f) { return beats(f, r) || s.objectives(f) == s.objectives(r); }));
  }
}

TEST(Search, ObjectivesAreChangesAgainstThePublishedRobot) {
  const Search& s = searched().search;
  for (const double x : s.objectives(s.published())) EXPECT_EQ(x, 0);
  Record r = s.published();
  const std::vector<Figure>& which = s.config().objectives;
  for (const Figure f : which) r.figures[static_cast<std::size_t>(f)] *= 1.1;
  const std::vector<double> changed = s.objectives(r);
  for (std::size_t k = 0; k < which.size(); ++k)
    EXPECT_EQ(changed[k] < 0, info_of(which[k]).more_is_better) << info_of(which[k]).name;
  r.refused = "cannot be";
  for (const double x : s.objectives(r)) EXPECT_GT(x, 5);
}

TEST(Search, GivesTheSameForAnyNumberOfThreadsAndAfterAStop) {
  const Small stopped({"search.threads=1"}, {}, 1);
  EXPECT_FALSE(stopped.done);
  const Small resumed({}, stopped.search.records());
  EXPECT_EQ(lines(resumed.search.records()), lines(searched().search.records()));
  EXPECT_EQ(resumed.history.back().hypervolume, searched().history.back().hypervolume);
}

TEST(Search, RandomPointsAreOthers) {
  const Small random({"search.method=random", "search.generations=1"});
  EXPECT_TRUE(random.done);
  EXPECT_EQ(random.search.records().size(), 8U);
}

TEST(Search, CountsWhatRefusedWhereNothingIsLeft) {
  const Small none({R"(limit=[{figure="mass_kg",at_most=0.001}])", "search.generations=1"});
  ASSERT_TRUE(none.done);
  EXPECT_TRUE(none.search.front().empty());
  const std::vector<Record> all = none.search.records();
  const auto counts = refusals(all);
  ASSERT_FALSE(counts.empty());
  EXPECT_EQ(counts[0].first, "mass_kg above 0.001");
  std::size_t sum = 0;
  for (const auto& [why, count] : counts) sum += count;
  EXPECT_EQ(sum, all.size());
  for (const double share : given_away(none.search)) EXPECT_TRUE(std::isnan(share));
}

TEST(Search, JudgesThePublishedRobotPastLimitsThatItMisses) {
  const Small strict(
      {R"(limit=[{figure="stroke_rad",at_most=1.0},{figure="mass_kg",at_most=0.001}])", "search.generations=1"});
  const Record &published = strict.search.published(), &as_shipped = searched().search.published();
  EXPECT_TRUE(published.refused.starts_with("mass_kg is 0.0")) << published.refused;
  EXPECT_NE(published.refused.find(", above 0.001; stroke_rad is 1."), std::string::npos) << published.refused;
  EXPECT_EQ(as_shipped.refused, "");
  for (const Figure f : strict.search.config().objectives)
    EXPECT_EQ(figure_of(published.figures, f), figure_of(as_shipped.figures, f)) << info_of(f).name;
}

TEST(Search, PrefersAnyTimeToNoneOfThePublishedRobot) {
  DesignConfig c = small_config();
  c.judge.limits.clear();
  c.judge.escape.fleet.task.constants.success.by_s = 0.01;  // nobody is there so soon
  const Judge judge(c.judge);
  const Search search(judge, c.search);
  Record r = search.published();
  ASSERT_EQ(figure_of(r.figures, Figure::escape_time), std::numeric_limits<double>::infinity());
  const auto objective = [&](double time_s) {
    figure_of(r.figures, Figure::escape_time) = time_s;
    return search.objectives(r)[2];
  };
  EXPECT_EQ(objective(std::numeric_limits<double>::infinity()), 0);
  EXPECT_LT(objective(0.5), 0);
  EXPECT_LT(objective(0.3), objective(0.5));
}

TEST(Config, RefusesAFigureTwice) {
  const std::string twice = test::refusal(
      [] { small_config({R"(objective=[{figure="mass_kg"},{figure="stroke_rad"},{figure="mass_kg"}])"}); });
  EXPECT_NE(twice.find("figure: is an objective already; accepted: each figure in one objective"), std::string::npos)
      << twice;
  const std::string limited = test::refusal(
      [] { small_config({R"(limit=[{figure="mass_kg",at_least=0.01},{figure="mass_kg",at_most=0.001}])"}); });
  EXPECT_NE(limited.find("figure: is limited already; accepted: each figure in one limit, with at_least and at_most"),
            std::string::npos)
      << limited;
}

TEST(Records, ReadBackAsTheyWere) {
  const io::TemporaryFolder folder;
  const auto file = folder.path() / "designs.csv";
  const std::vector<Record> all = searched().search.records();
  io::write_atomically(file, record_head() + "\n" + lines(all));
  EXPECT_EQ(lines(read_records(file)), lines(all));
  io::write_atomically(file, record_head() + "\nrubbish\n");
  const std::string line = test::refusal([&] { read_records(file); });
  EXPECT_NE(line.find("line 2 is no record"), std::string::npos) << line;
}

/// The only design of a front that is worse than the published robot.
TEST(Choose, TakesWhatThereIs) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  const Small one({"search.generations=1", "search.seed=3"});
  EXPECT_EQ(choose(one.search, 5).size(), std::min<std::size_t>(5, one.search.front().size()));
}

TEST(Choose, TakesTheBestOfEachObjectiveOnce) {
  const Search& s = searched().search;
  const std::vector<Record> front = s.front(), chosen = choose(s, 3);
  EXPECT_EQ(chosen.size(), std::min<std::size_t>(3, front.size()));
  for (std::size_t i = 0; i < chosen.size(); ++i)
    for (std::size_t k = 0; k < i; ++k) EXPECT_NE(chosen[i].values, chosen[k].values);
}

}  // namespace
}  // namespace flappy::design
