#include "learn/learning_curve.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <functional>
#include <random>

#include "io/files.hpp"
#include "learn/metrics.hpp"
#include "refusal.hpp"

namespace flappy::learn {
namespace {

using test::refusal;

void expect_interval(const std::vector<double>& values, double low, double high) {
  const io::Interval interval = bootstrap_interval(values);
  // sums of up to three halves, thirds or ones, rounded once each
  EXPECT_NEAR(interval.low, low, 1e-15);
  EXPECT_NEAR(interval.high, high, 1e-15);
}

/// Three seeds, two evaluations.
std::vector<SeedCurve> three_runs() {
  return {{11, {{1000, 10, 0.25}, {2000, 20, 0.5}}},
          {5, {{1000, 12, 0.5}, {2000, 29, 0.5}}},
          {7, {{1000, 11, 0.75}, {2000, 21, 0.5}}}};
}

class CurveFiles : public testing::Test {
 protected:
  ~CurveFiles() override { std::filesystem::remove_all(folder_); }
  const std::filesystem::path folder_ =
      testing::TempDir() + "flappy_curve_" + testing::UnitTest::GetInstance()->current_test_info()->name();
  const bool made_ = std::filesystem::create_directories(folder_);
};

TEST(LearningCurve, InterquartileMeanCutsAQuarterAtEachEnd) {
  EXPECT_EQ(interquartile_mean({3}), 3);
  EXPECT_EQ(interquartile_mean({9, 0, 3}), 4);
  EXPECT_EQ(interquartile_mean({100, 2, 1, -50}), 1.5);
  EXPECT_EQ(interquartile_mean({100, 2, 1, 6, -50}), 3);
  EXPECT_EQ(interquartile_mean({8, 1, 7, 2, 6, 3, 5, 100}), 5.25);
  EXPECT_THROW(interquartile_mean({}), std::logic_error);
}

// With zeros and ones the mean of a resample follows from the binomial number B of ones in it. 10,000 resamples give a
// probability within 0.0025 of those below (one standard deviation is at most 0.0019 for the two that decide).
TEST(LearningCurve, IntervalIsTheMiddle95PercentOfTheResamples) {
  expect_interval({0.5, 0.5, 0.5, 0.5, 0.5}, 0.5, 0.5);
  expect_interval({7}, 7, 7);
  // B of 3 with p 1/3: P(B = 3) = 0.037, above 0.025; it would be 2/3 for the middle 90 %
  expect_interval({0, 0, 1}, 0, 1);
  expect_interval({0, 1, 1}, 0, 1);
  // B of 5 with p 1/5, one cut at each end: P(B >= 4) = 0.0067, below 0.025, P(B = 3) = 0.051
  expect_interval({0, 0, 0, 0, 1}, 0, 2.0 / 3);
  expect_interval({1, 1, 1, 0, 1}, 1.0 / 3, 1);
}

// 16 values from a uniform distribution, 300 times. Were the mean's distribution normal, an interval from resamples would
// cover P(|t| < 1.96 sqrt(15/16)) of them: 0.92 with 15 degrees of freedom, 0.90 with the 7 that are left of the half in
// the middle. Three standard deviations of 300 trials are 0.052.
TEST(LearningCurve, IntervalCoversTheTruth) {
  std::mt19937_64 generator(3);
  int covered = 0;
  for (int trial = 0; trial < 300; ++trial) {
    std::vector<double> values(16);
    for (double& value : values) value = static_cast<double>(generator() >> 11) * 0x1p-53;
    const io::Interval interval = bootstrap_interval(values);
    covered += interval.low <= 0.5 && 0.5 <= interval.high;
  }
  EXPECT_GT(covered / 300.0, 0.90 - 0.052);
  EXPECT_LT(covered / 300.0, 0.92 + 0.052);
}

TEST(LearningCurve, PutsTheSeedsTogether) {
  const LearningCurve curve = learning_curve(three_runs());
  EXPECT_EQ(curve.seeds, (std::vector<std::uint64_t>{11, 5, 7}));
  ASSERT_EQ(curve.rows.size(), 2u);
  EXPECT_EQ(curve.rows[0].update, 1000u);
  EXPECT_EQ(curve.rows[0].median_wall_s, 11);
  EXPECT_EQ(curve.rows[1].median_wall_s, 21);
  EXPECT_EQ(curve.rows[0].mean, 0.5);
  EXPECT_EQ(curve.rows[0].interval.low, 0.25) << "1 of 27 resamples is three times the least";
  EXPECT_EQ(curve.rows[0].scores, (std::vector{0.25, 0.5, 0.75}));
  EXPECT_EQ(curve.rows[1].interval.low, 0.5);
  EXPECT_EQ(curve.rows[1].interval.high, 0.5);
}

TEST(LearningCurve, RefusesRunsThatDoNotFitTogether) {
  const std::string none = "learning curve: no evaluations; accepted: at least one run with evaluations";
  EXPECT_EQ(refusal([&] { learning_curve({}); }), none);
  EXPECT_EQ(refusal([&] { learning_curve(std::vector{SeedCurve{1, {}}}); }), none);
  auto runs = three_runs();
  runs[1].points.pop_back();
  EXPECT_EQ(refusal([&] { learning_curve(runs); }),
            "learning curve: seed 5 has 1 evaluations, seed 11 2, or at other updates; accepted: runs evaluated at the "
            "same updates");
  runs = three_runs();
  runs[2].points[1].update = 2001;
  EXPECT_NE(refusal([&] { learning_curve(runs); }), "accepted");
  runs = three_runs();
  runs[2].points[1].score = std::nan("");
  EXPECT_EQ(refusal([&] { learning_curve(runs); }),
            "learning curve: seed 7, update 2000: the score is not finite; accepted: a number");
}

TEST_F(CurveFiles, ReadsTheEvaluationsOfARun) {
  {
    Metrics metrics(folder_, {{"update", "success"}, {"steps_per_s", "wall_s"}});
    for (int i = 1; i <= 4; ++i)
      metrics.record(std::vector{100.0 * i, i % 2 == 0 ? 0.25 * i : std::nan("")}, std::vector{1e6, 1.5 * i});
  }
  const SeedCurve curve = read_seed_curve(folder_, 9, "success");
  EXPECT_EQ(curve.seed, 9u);
  ASSERT_EQ(curve.points.size(), 2u);
  EXPECT_EQ(curve.points[1].update, 400u);
  EXPECT_EQ(curve.points[1].wall_s, 6);
  EXPECT_EQ(curve.points[1].score, 1);
  io::write_atomically(folder_ / "timing.jsonl", "{\"update\":100,\"wall_s\":1}\n");
  EXPECT_EQ(refusal([&] { read_seed_curve(folder_, 9, "success"); }),
            (folder_ / "timing.jsonl").string() + ": has fewer records than metrics.jsonl; accepted: files of one run");
}

TEST_F(CurveFiles, WritesATable) {
  write_curve_csv(folder_ / "a.csv", learning_curve(three_runs()));
  EXPECT_EQ(io::read_text(folder_ / "a.csv"),
            "update,median_wall_s,mean,iqm,low,high,seed_11,seed_5,seed_7\n"
            "1000,11,0.5,0.5,0.25,0.75,0.25,0.5,0.75\n2000,21,0.5,0.5,0.5,0.5,0.5,0.5,0.5\n");
}

TEST_F(CurveFiles, DrawsTheSameFigureTwice) {
  const LearningCurve curve = learning_curve(three_runs());
  std::filesystem::create_directory(folder_ / "other");
  write_curve_svg(folder_ / "a.svg", curve, "success_rate");
  write_curve_svg(folder_ / "other" / "b.svg", curve, "success_rate");
  const std::string figure = io::read_text(folder_ / "a.svg");
  EXPECT_EQ(figure, io::read_text(folder_ / "other" / "b.svg"));
  EXPECT_TRUE(figure.starts_with("<?xml"));
  EXPECT_TRUE(figure.ends_with("</svg>\n\n") || figure.ends_with("</svg>\n")) << figure.substr(figure.size() - 20);
  for (const char* part : {"success rate", "95 % interval", "interquartile mean of 3 seeds", "each seed", "update"})
    EXPECT_NE(figure.find(part), std::string::npos) << part;
  EXPECT_EQ(figure.find(folder_.string()), std::string::npos);
  // one evaluation of one seed is a figure as well
  write_curve_svg(folder_ / "one.svg", learning_curve(std::vector{SeedCurve{1, {{1000, 10, 0.25}}}}), "success_rate");
  EXPECT_NE(io::read_text(folder_ / "one.svg").find("interquartile"), std::string::npos);
}

TEST_F(CurveFiles, SaysThatGnuplotIsMissing) {
  const std::string path = std::getenv("PATH");
  setenv("PATH", folder_.c_str(), 1);
  const std::string message =
      refusal([&] { write_curve_svg(folder_ / "a.svg", learning_curve(three_runs()), "success_rate"); });
  setenv("PATH", path.c_str(), 1);
  EXPECT_EQ(message, (folder_ / "a.svg").string() + ": is not written: gnuplot is not installed");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "a.svg"));
}

}  // namespace
}  // namespace flappy::learn
