// The scores of the blind benchmark on cases made up so that every figure can be counted by hand.
#include "lab/benchmark/score.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "lab/benchmark/calibrate.hpp"
#include "lab/benchmark/change_over_sessions.hpp"
#include "lab/benchmark/predict/rivals.hpp"

namespace flappy::benchmark {
namespace {

using Names = std::vector<std::string>;

gap::RankedHypothesis fitted(Names effects, double probability, std::optional<double> left = {}, double gain_sd = 0) {
  gap::RankedHypothesis s;
  s.effects = std::move(effects);
  s.probability = probability;
  s.loss = left;
  s.loss_gain_sd = gain_sd;
  return s;
}

gap::RankedHypothesis weighed(Names effects, double nats) {
  gap::RankedHypothesis h;
  h.effects = std::move(effects);
  h.log_evidence = nats;
  return h;
}

/// A verdict with the sets that stand behind it.
ScoredCase judged(const std::string& part, Names truth, const std::string& kind, Names named, double probability,
                  std::vector<gap::RankedHypothesis> sets = {}) {
  ScoredCase c;
  c.truth.part = part;
  c.truth.effects = std::move(truth);
  c.prediction.kind = kind;
  c.prediction.effects = std::move(named);
  c.prediction.probability = probability;
  c.prediction.sets = std::move(sets);
  return c;
}

const ScoreLine& line_of(const std::vector<ScoreLine>& lines, const std::string& key) {
  for (const ScoreLine& l : lines)
    if (l.key == key) return l;
  throw std::out_of_range(key);
}

ScoreValue main_score(const std::vector<ScoredCase>& cases, const std::string& key) {
  return line_of(score(cases).lines, key).score;
}

TEST(Proportion, HasWilsonsInterval) {
  // Wilson 1927 by hand: 8 of 10, z = 1.959964: centre (0.8 + z^2/20)/(1 + z^2/10) = 0.71674, half 0.22658
  const ScoreValue s = proportion(8, 10);
  EXPECT_DOUBLE_EQ(*s.value, 0.8);
  EXPECT_NEAR(s.low, 0.4902, 1e-4);
  EXPECT_NEAR(s.high, 0.9433, 1e-4);
  EXPECT_EQ(s.count, 10U);
  EXPECT_FALSE(proportion(0, 0).value);
  EXPECT_NEAR(proportion(0, 5).low, 0, 1e-12);
  EXPECT_NEAR(proportion(5, 5).high, 1, 1e-12);
}

TEST(Resampled, IntervalOfAMeanIsThatOfTheNormalLaw) {
  // 400 cases, half 0 and half 1: the mean's sd is 0.025, of 2,000 resamples a quantile is good to 0.003
  std::vector<double> values(400);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<double>(i % 2);
  const ScoreValue s = resampled(values.size(), [&](const std::vector<std::size_t>& which) -> std::optional<double> {
    double sum = 0;
    for (const std::size_t i : which) sum += values[i];
    return sum / static_cast<double>(which.size());
  });
  EXPECT_DOUBLE_EQ(*s.value, 0.5);
  EXPECT_NEAR(s.low, 0.5 - 1.96 * 0.025, 0.006);
  EXPECT_NEAR(s.high, 0.5 + 1.96 * 0.025, 0.006);
}

TEST(RankCorrelation, SharesRanksOfEqualValues) {
  EXPECT_DOUBLE_EQ(*rank_correlation({1, 2, 3}, {10, 20, 1000}), 1);
  EXPECT_DOUBLE_EQ(*rank_correlation({1, 2, 3}, {3, 2, 1}), -1);
  // ranks 0, 1.5, 1.5, 3 and 0, 1, 2, 3: 4.5 / sqrt(4.5 x 5)
  EXPECT_NEAR(*rank_correlation({1, 2, 2, 3}, {1, 2, 3, 4}), 0.948683, 1e-6);
  EXPECT_FALSE(rank_correlation({1, 1}, {1, 2}));
}

TEST(AreaUnderCurve, CountsPairsOfRightAndWrong) {
  EXPECT_DOUBLE_EQ(*area_under_curve({{0.9, true}, {0.8, true}, {0.1, false}}), 1);
  // of right .9, .3 and wrong .5, .3: above, above, below, equal
  EXPECT_DOUBLE_EQ(*area_under_curve({{0.9, true}, {0.3, true}, {0.5, false}, {0.3, false}}), 2.5 / 4);
  EXPECT_FALSE(area_under_curve({{0.9, true}}));
}

TEST(Score, ComparesPlansWithWhatBecameOfThem) {
  std::vector<ScoredCase> cases;
  for (int i = 0; i < 20; ++i) {
    const bool right = i >= 10;
    ScoredCase c = judged("changed", {"wind"}, "effect", {right ? "wind" : "tether"}, 0.9);
    c.prediction.hypotheses = {weighed({"wind"}, 2.0 * i - 25), weighed({"tether", "wind"}, 2.0 * i - 19),
                               weighed({"tether"}, 0), weighed({}, -50)};
    c.foreseen = Foresight{10.0 * (i + 1), 0.04 * i};
    cases.push_back(c);
  }
  EXPECT_DOUBLE_EQ(*realised_nats(cases[15]), 11) << "the better of both hypotheses with wind, over tether alone";
  EXPECT_DOUBLE_EQ(*main_score(cases, "contrast_plan_rank").value, 1);
  EXPECT_DOUBLE_EQ(*main_score(cases, "contrast_plan_auc").value, 1);
  EXPECT_EQ(main_score(cases, "contrast_plan_rank").count, 20u);
  // medians of 105 and 0: nothing was brought; with ten nats more, 105 over 10
  EXPECT_FALSE(main_score(cases, "contrast_plan_hope").value);
  for (ScoredCase& c : cases) c.prediction.hypotheses[1].log_evidence += 10;
  EXPECT_DOUBLE_EQ(*main_score(cases, "contrast_plan_hope").value, 10.5);
  cases[0].prediction.effects = {"wind"};
  EXPECT_FALSE(main_score(cases, "contrast_plan_auc").value) << "fewer than ten are wrong";
  for (ScoredCase& c : cases) c.foreseen.reset();
  EXPECT_THROW(main_score(cases, "contrast_plan_rank"), std::out_of_range);
}

TEST(Score, FollowsUpWhatWasProposed) {
  ScoredCase right = judged("singles", {"wind"}, "group", {"wind", "tether"}, 0.6), wrong = right;
  right.after_next = judged("singles", {"wind"}, "effect", {"wind"}, 0.9).prediction;
  wrong.after_next = judged("singles", {"wind"}, "effect", {"tether"}, 0.9).prediction;
  EXPECT_DOUBLE_EQ(
      *main_score({right, wrong, judged("singles", {"wind"}, "effect", {"wind"}, 0.9)}, "undecided_next").value, 0.5);
}

TEST(CalibrationError, TakesItsBiasAway) {
  // 20 claims, two in each bin, given in no order: all at 0.9 but the two lowest. Shares are 0 and 1, which have no variance:
  // lowest bin |0.4 - 0| x 2, nine bins |0.9 - 1| x 2: (0.8 + 1.8)/20
  std::vector<Claim> claims;
  for (int i = 0; i < 18; ++i) claims.push_back({0.9, true});
  claims.push_back({0.5, false});
  claims.push_back({0.3, false});
  EXPECT_NEAR(calibration_error(claims), 0.13, 1e-12);
  // 50 claims of 0.7, of which 40 are right: d = -0.1 in each bin of five, s = sqrt(0.8 x 0.2/5) = 0.178885, z = -0.559017;
  // E|N| = s sqrt(2/pi) exp(-z^2/2) + d erf(z/sqrt 2) = 0.142730 x 0.855345 + 0.1 x 0.423850 = 0.164469; 2 x 0.1 - 0.164469
  std::vector<Claim> off;
  for (int i = 0; i < 50; ++i) off.push_back({0.7, i % 5 != 0});
  EXPECT_NEAR(calibration_error(off), 0.035531, 1e-5);
  // calibrated to the last claim: less than nothing is left of it
  for (Claim& c : off) c.probability = 0.8;
  EXPECT_DOUBLE_EQ(calibration_error(off), 0);
  EXPECT_DOUBLE_EQ(calibration_error({}), 0);
}

TEST(CalibrationError, IsTheSameForTiesInAnyOrder) {
  std::vector<Claim> claims;
  for (int i = 0; i < 37; ++i) claims.push_back({i < 23 ? 0.6 : 0.9, i % 3 != 0});
  const double error = calibration_error(claims);
  EXPECT_GT(error, 0);
  std::ranges::reverse(claims);
  EXPECT_DOUBLE_EQ(calibration_error(claims), error);
  std::ranges::stable_sort(claims, {}, &Claim::right);
  EXPECT_DOUBLE_EQ(calibration_error(claims), error);
}

TEST(CalibrationError, OfACalibratedPredictorIsNearNothing) {
  // 1,000 claims, right as often as stated: shares have s = 0.05, so that plain bins are off by 0.80 s = 0.040, these by 0.47 s = 0.023
  std::vector<Claim> claims;
  std::uint64_t state = 3;
  const auto draw = [&] {
    state = state * 6364136223846793005U + 1442695040888963407U;
    return static_cast<double>(state >> 11) * 0x1p-53;
  };
  for (int i = 0; i < 1000; ++i) {
    const double p = 0.3 + 0.4 * draw();
    claims.push_back({p, draw() < p});
  }
  EXPECT_LT(calibration_error(claims), 0.03);
  const ScoreValue s = calibration_score(claims);
  EXPECT_LE(s.low, *s.value);
  EXPECT_GE(s.high, *s.value);
  EXPECT_EQ(s.count, 1000U);
  for (Claim& c : claims) c.probability += 0.2;
  EXPECT_NEAR(calibration_error(claims), 0.2, 0.03);
}

TEST(Score, RightEffectFirstAndRightGroup) {
  std::vector<ScoredCase> cases = {
      judged("singles", {"tether"}, "effect", {"tether"}, 0.9, {fitted({"tether"}, 0.9)}),
      judged("singles", {"tether"}, "effect", {"wind"}, 0.9, {fitted({"wind"}, 0.9), fitted({"tether"}, 0.1)}),
      judged("singles", {"tether"}, "group", {"wind", "tether"}, 0.9, {fitted({"wind"}, 0.5), fitted({"tether"}, 0.4)}),
      judged("singles", {"tether"}, "effect", {"tether", "wind"}, 0.9, {fitted({"tether", "wind"}, 0.9)}),
      judged("singles", {"tether"}, "effect", {"body_drag"}, 0.9, {fitted({"body_drag"}, 0.9)})};
  const ScoreValue first = main_score(cases, "top1_mocap_imu");
  EXPECT_EQ(first.count, 5U);
  EXPECT_DOUBLE_EQ(*first.value, 0.2);
  EXPECT_FALSE(main_score(cases, "top1_current").value);
  // tether and wind are of one group
  const ScoreValue group = main_score(cases, "group_top1");
  EXPECT_EQ(group.count, 5U);
  EXPECT_DOUBLE_EQ(*group.value, 0.6);
  EXPECT_DOUBLE_EQ(*main_score(cases, "top3").value, 0.6);
  cases[2].prediction.effects = {"wind", "mocap_tilt"};
  EXPECT_DOUBLE_EQ(*main_score(cases, "group_top1").value, 0.4) << "a group that does not hold the truth";
  cases[0].truth.part = "singles_current";
  EXPECT_DOUBLE_EQ(*main_score(cases, "top1_current").value, 1);
}

TEST(Score, AmongThreeCountsEveryAnswer) {
  ScoredCase c = judged("singles", {"tether"}, "unknown", {}, 0.4,
                        {fitted({"wind"}, 0.2), fitted({"tether"}, 0.1), fitted({"com_offset"}, 0.05)});
  c.prediction.unknown = 0.4;
  c.prediction.parameters = 0.05;
  EXPECT_DOUBLE_EQ(*main_score({c}, "top3").value, 1) << "unknown, wind, tether";
  c.prediction.none = 0.15;
  EXPECT_DOUBLE_EQ(*main_score({c}, "top3").value, 0) << "unknown, wind, none, tether";
}

TEST(Score, FalseAlarmsAndUnknownTruths) {
  std::vector<ScoredCase> cases = {judged("none", {}, "none", {}, 0.9),
                                   judged("none", {}, "parameters", {}, 0.9),
                                   judged("parameters", {}, "parameters", {}, 0.9),
                                   judged("own_parameters", {}, "unknown", {}, 0.9),
                                   judged("conventions", {}, "remainder", {"wind"}, 0.6),
                                   judged("withheld", {"wind"}, "unknown", {}, 0.9),
                                   judged("withheld", {"wind"}, "effect", {"body_drag"}, 0.79),
                                   judged("outside", {"outside_slosh"}, "group", {"body_drag", "com_offset"}, 0.85),
                                   judged("outside", {"outside_slosh"}, "unknown", {}, 0.95)};
  EXPECT_DOUBLE_EQ(*main_score(cases, "false_alarm_none").value, 0);
  EXPECT_DOUBLE_EQ(*main_score(cases, "false_alarm_parameters").value, 0);
  EXPECT_DOUBLE_EQ(*main_score(cases, "false_alarm_own_parameters").value, 1);
  EXPECT_DOUBLE_EQ(*main_score(cases, "false_alarm_conventions").value, 1);
  EXPECT_DOUBLE_EQ(*main_score(cases, "unknown").value, 0.5);
  EXPECT_DOUBLE_EQ(*main_score(cases, "unknown_wrong").value, 0.25);
  EXPECT_FALSE(*line_of(score(cases).lines, "unknown").meets_must);
  std::string which;
  for (const ScoredCase& c : cases) which += right(c.truth, c.prediction) ? '1' : '0';
  EXPECT_EQ(which, "111001001");
  // of the two called unknown, one is described
  for (ScoredCase& c : cases)
    c.truth.channels = {"specific_force_x", "angular_acceleration_y"}, c.truth.regimes = {"heading"};
  EXPECT_DOUBLE_EQ(*main_score(cases, "unknown_where").value, 0);
  cases[5].prediction.where = {"angular_acceleration_y", "heading"};
  cases[8].prediction.where = {"angular_acceleration_y", "height"};
  EXPECT_DOUBLE_EQ(*main_score(cases, "unknown_where").value, 0.5);
  // makers say "mocap" and "place" of what diagnoses name by channel and regime
  for (ScoredCase& c : cases) c.truth.channels = {"mocap"}, c.truth.regimes = {"place"};
  cases[5].prediction.where = {"path_x", "ceiling"};
  cases[8].prediction.where = {"path_x", "velocity"};
  EXPECT_DOUBLE_EQ(*main_score(cases, "unknown_where").value, 0.5);
  cases[8].prediction.where = {"specific_force_x", "ceiling"};
  EXPECT_DOUBLE_EQ(*main_score(cases, "unknown_where").value, 0.5);
}

TEST(Score, OfAContrast) {
  std::vector<ScoredCase> cases = {judged("changed", {"wind"}, "effect", {"wind"}, 0.9),
                                   judged("changed", {"tether"}, "effect", {"wind"}, 0.9),
                                   judged("changed", {"com_offset"}, "parameters", {}, 0.9),
                                   judged("unchanged", {}, "none", {}, 0.9),
                                   judged("unchanged", {}, "unknown", {}, 0.5),
                                   judged("changed_withheld", {"wind"}, "remainder", {"tether"}, 0.9),
                                   judged("changed_withheld", {"wind"}, "effect", {"tether"}, 0.9),
                                   judged("changed_outside", {"outside_slosh"}, "unknown", {}, 0.9),
                                   judged("changed_pairs", {"wind", "com_offset"}, "effect", {"wind"}, 0.9)};
  cases[1].truth.over_sessions = {kCounts + 1};
  cases[2].truth.over_sessions = {kCounts - 1};  // sessions hide it: unchanged is right
  const std::vector<ScoreLine> lines = score(cases).lines;
  const auto of = [&](const char* key) { return *line_of(lines, key).score.value; };
  EXPECT_DOUBLE_EQ(of("contrast_top1"), 1.0 / 2);
  EXPECT_DOUBLE_EQ(of("false_alarm_contrast"), 1.0 / 2);
  EXPECT_DOUBLE_EQ(of("contrast_unknown"), 2.0 / 3);
  EXPECT_DOUBLE_EQ(of("contrast_unknown_wrong"), 1.0 / 3);
  EXPECT_DOUBLE_EQ(of("contrast_pairs_f1"), 2.0 / 3);
  EXPECT_FALSE(line_of(lines, "contrast_calm_top1").score.value);
  EXPECT_THROW(line_of(lines, "top1_mocap_imu"), std::out_of_range) << "no case is of that benchmark";
  EXPECT_DOUBLE_EQ(of("contrast_all_top1"), 1.0 / 3);
  EXPECT_DOUBLE_EQ(of("contrast_hidden_right"), 1);
  EXPECT_DOUBLE_EQ(of("contrast_hidden_wrong"), 0);
  cases[2].prediction.kind = "effect", cases[2].prediction.effects = {"wind"};
  EXPECT_DOUBLE_EQ(main_score(cases, "contrast_hidden_wrong").value.value(), 1);
  cases[2].prediction.effects = {"com_offset"};  // hidden, and found all the same
  EXPECT_DOUBLE_EQ(main_score(cases, "contrast_hidden_right").value.value(), 1);
}

TEST(Score, ARemainderBesideTheTruthIsRight) {
  ScoredCase c = judged("singles", {"tether"}, "remainder", {"tether"}, 0.9);
  for (const char* key : {"top1_mocap_imu", "group_top1", "top3"})
    EXPECT_DOUBLE_EQ(*main_score({c}, key).value, 1) << key;
  EXPECT_TRUE(right(c.truth, c.prediction));
  c.prediction.effects = {"com_offset"};
  for (const char* key : {"top1_mocap_imu", "group_top1", "top3"})
    EXPECT_DOUBLE_EQ(*main_score({c}, key).value, 0) << key;
}

TEST(Score, RedeclaredRobotsAreHeldAgainstTheirSingles) {
  std::vector<ScoredCase> cases = {
      judged("singles", {"wind"}, "effect", {"wind"}, 0.9), judged("singles", {"wind"}, "effect", {"wind"}, 0.9),
      judged("redeclared", {"wind"}, "effect", {"wind"}, 0.6), judged("redeclared", {"wind"}, "unknown", {}, 0.9),
      judged("redeclared", {"wind"}, "unknown", {}, 0.9)};
  for (std::size_t i = 0; i < cases.size(); ++i) cases[i].truth.seed = 7 + i % 2;
  cases[2].truth.seed = 7, cases[3].truth.seed = 8, cases[4].truth.draw = 1;  // the last drew another robot
  EXPECT_DOUBLE_EQ(*main_score(cases, "redeclared_same").value, 0.5);
  EXPECT_EQ(main_score(cases, "redeclared_same").count, 2U);
}

TEST(Score, ClosureIsMeasuredAgainstTheTrueEffect) {
  ScoredCase c = judged("singles", {"tether"}, "effect", {"wind"}, 0.9,
                        {fitted({"wind"}, 0.9, 0.7, 0.01), fitted({"tether"}, 0.1, 0.5, 0.01)});
  c.prediction.refit = 1.0;
  EXPECT_NEAR(*closure(c), 0.6, 1e-12);
  c.prediction.kind = "unknown";
  EXPECT_DOUBLE_EQ(*closure(c), 0) << "a verdict without effects closes nothing";
  c.prediction.kind = "effect";
  c.prediction.sets[1].loss_gain_sd = 0.26;
  EXPECT_FALSE(closure(c)) << "nothing that is sure to close";
  // the truth was not fitted: a fit made for the purpose
  c.prediction.sets.pop_back();
  EXPECT_TRUE(needs_true_fit(c));
  EXPECT_FALSE(closure(c));
  Answer fit;
  fit.refit = 1.0;
  fit.sets = {fitted({"tether"}, 0.5, 0.6, 0.01)};
  c.true_fit = fit;
  EXPECT_NEAR(*closure(c), 0.75, 1e-12);
  // median of 0.75, 0.75 and 0
  ScoredCase none = c;
  none.prediction.kind = "parameters";
  EXPECT_NEAR(*main_score({c, none, c}, "closure_median").value, 0.75, 1e-12);
  c.prediction.kind = "data";
  EXPECT_DOUBLE_EQ(*closure(c), 0) << "nor does one that refuses the data";
  c.truth.part = "pairs";
  EXPECT_FALSE(needs_true_fit(c));
}

TEST(Score, BarsHaveTheirSides) {
  const ScoredCase c = judged("singles", {"wind"}, "effect", {"wind"}, 0.9, {fitted({"wind"}, 0.9)});
  EXPECT_TRUE(*line_of(score({c}).lines, "group_top1").meets_must);
  EXPECT_TRUE(*line_of(score({judged("none", {}, "none", {}, 0.9)}).lines, "false_alarm_none").meets_must);
}

TEST(Score, PairsAreScoredByTheirNames) {
  const std::vector<ScoredCase> cases = {
      judged("pairs", {"wind", "com_offset"}, "effect", {"com_offset", "wind"}, 0.9),
      judged("pairs", {"wind", "com_offset"}, "effect", {"wind"}, 0.9),
      judged("pairs", {"wind", "com_offset"}, "effect", {"tether", "body_drag"}, 0.9),
      judged("pairs", {"wind", "com_offset"}, "group", {"wind", "tether"}, 0.9,
             {fitted({"mocap_tilt"}, 0.45), fitted({"wind"}, 0.4)}),  // the most probable set is no member of the group
      judged("pairs", {"wind", "com_offset"}, "unknown", {}, 0.9)};
  // hits 2 + 1 + 0 + 1 + 0; names 2 + 1 + 2 + 1 + 0 stated, 10 true
  EXPECT_NEAR(*main_score(cases, "pairs_f1").value, 2 * 4.0 / 16, 1e-12);
}

TEST(Score, HoverAbstains) {
  const std::vector<ScoredCase> cases = {judged("hover", {"tether"}, "group", {"tether", "wind"}, 0.9),
                                         judged("hover", {"tether"}, "effect", {"tether"}, 0.49),
                                         judged("hover", {"tether"}, "effect", {"tether"}, 0.6),
                                         judged("hover", {"tether"}, "parameters", {}, 0.9)};
  EXPECT_DOUBLE_EQ(*main_score(cases, "hover_abstain").value, 0.5);
  EXPECT_DOUBLE_EQ(*main_score(cases, "hover_next").value, 0);
  std::vector<ScoredCase> flown = cases;
  flown[0].after_next = judged("hover", {"tether"}, "effect", {"tether"}, 0.9).prediction;
  flown[1].after_next = judged("hover", {"tether"}, "effect", {"wind"}, 0.9).prediction;
  EXPECT_DOUBLE_EQ(*main_score(flown, "hover_next").value, 0.25);
}

TEST(Score, TheBestRivalStandsBesideEachLine) {
  ScoredCase c = judged("singles", {"tether"}, "effect", {"tether"}, 0.9);
  c.prediction.rivals["best RMSE"] = {{"wind", "tether"}, {"wind", "tether"}, 0.5};
  c.prediction.rivals["largest residual"] = {{"com_offset"}, {"com_offset", "mocap_tilt", "wind"}, 0.5};
  ScoredCase none = judged("none", {}, "none", {}, 0.9);
  none.prediction.rivals["best RMSE"] = {{}, {}, 0};
  none.prediction.rivals["largest residual"] = {{}, {}, 0};
  const Scores s = score({c, none});
  EXPECT_DOUBLE_EQ(*line_of(s.lines, "top1_mocap_imu").rival->value, 0);
  EXPECT_DOUBLE_EQ(*line_of(s.lines, "group_top1").rival->value, 1);
  EXPECT_EQ(line_of(s.lines, "group_top1").rival_name, "best RMSE");
  EXPECT_DOUBLE_EQ(*line_of(s.lines, "top3").rival->value, 1);
  EXPECT_FALSE(line_of(s.lines, "false_alarm_none").rival);
  EXPECT_FALSE(line_of(s.lines, "ece").rival);
  EXPECT_FALSE(line_of(score({c}).lines, "top1_mocap_imu").rival) << "no harmless robot says how often it is wrong";
}

TEST(Rivals, HotellingsStrengthIsUniformWhereNothingChanged) {
  // three references, three tests of four correlated inputs; below 0.5 in half of 2,000 draws, with a sd of 1.1 %
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  const auto draw = [&](double shift) {
    Eigen::MatrixX4d x(3, 4);
    for (Eigen::Index i = 0; i < 3; ++i) {
      const double common = normal(random);
      for (Eigen::Index k = 0; k < 4; ++k) x(i, k) = 9 + common + 0.3 * normal(random) + (k == 1 ? shift : 0);
    }
    return x;
  };
  int below = 0, beyond = 0;
  for (int i = 0; i < 2000; ++i) {
    const double strength = hotelling_strength(draw(0), draw(0));
    below += strength<0.5, beyond += strength> 0.9;
  }
  EXPECT_NEAR(below / 2000.0, 0.5, 0.04);
  EXPECT_NEAR(beyond / 2000.0, 0.1, 0.025);
  EXPECT_GT(hotelling_strength(draw(0), draw(100)), 0.9);
  EXPECT_EQ(hotelling_strength(draw(0), draw(100).topRows(2)), 0) << "five flights say nothing of four inputs";
}

TEST(Calibrate, LearnsWhatAVerdictShouldSay) {
  // 4,000 verdicts that are right as often as half of the logit, less 0.3, says: standard errors of 0.03 and 0.06
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform;
  const gap::VerdictRule::Said truth{0.5, -0.3};
  std::vector<Claim> claims;
  for (int i = 0; i < 4000; ++i) {
    const double p = 0.3 + 0.69 * uniform(random);
    claims.push_back({p, uniform(random) < truth(p)});
  }
  const auto found = learn_said(claims, std::vector<double>(claims.size(), 1));
  EXPECT_NEAR(found.slope, truth.slope, 0.12);
  EXPECT_NEAR(found.offset, truth.offset, 0.2);
  const auto nothing = learn_said({}, {});
  EXPECT_DOUBLE_EQ(nothing.slope, 1);
  EXPECT_DOUBLE_EQ(nothing.offset, 0);
  // confident verdicts that are all wrong are believed less, but more evidence never says less
  const auto wrong = learn_said(std::vector<Claim>(50, {0.99, false}), std::vector<double>(50, 1));
  EXPECT_LT(wrong(0.99), 0.25);
  EXPECT_LT(wrong(0.9), wrong(0.99));
}

TEST(Score, ARivalWithoutANameAndOneWithoutAnAnswerNameNothing) {
  std::vector<ScoredCase> cases = {judged("changed", {"wind"}, "effect", {"wind"}, 0.9),
                                   judged("changed", {"wind"}, "effect", {"wind"}, 0.9),
                                   judged("unchanged", {}, "none", {}, 0.9)};
  cases[0].prediction.rivals["Hotelling"] = {{kSomething}, {}, 0.99};  // the other's logs were faulty
  cases[2].prediction.rivals["Hotelling"] = {{kSomething}, {}, 0.5};
  const Scores s = score(cases);
  EXPECT_DOUBLE_EQ(*line_of(s.lines, "contrast_top1").rival->value, 0);
  EXPECT_DOUBLE_EQ(*line_of(s.lines, "contrast_noticed").rival->value, 0.5);
}

TEST(Score, OfAPairTheEffectCountsThatSessionsDoNotHide) {
  ScoredCase c = judged("changed_pairs", {"wind", "com_offset"}, "effect", {"wind"}, 0.9);
  c.truth.over_sessions = {kCounts + 1, kCounts - 1};
  EXPECT_DOUBLE_EQ(*main_score({c}, "contrast_pairs_f1").value, 1);
  c.prediction.effects = {"wind", "com_offset"};  // the hidden one is there, too
  EXPECT_DOUBLE_EQ(*main_score({c}, "contrast_pairs_f1").value, 1);
  c.prediction.effects = {"tether"};
  EXPECT_DOUBLE_EQ(*main_score({c}, "contrast_pairs_f1").value, 0);
  ScoredCase hover = judged("hover", {"body_drag"}, "group", {"body_drag", "wind"}, 0.9);
  hover.truth.over_sessions = {0.1};  // as hover is meant to
  EXPECT_DOUBLE_EQ(*main_score({hover}, "hover_abstain").value, 1);
}

TEST(Score, ARivalIsComparedAtTheSameShareOfFalseAlarms) {
  // the rival is right about all that has changed, with strengths from 0.5 to 0.59, and raises alarms of 0.505, 0.515, 0.525, ...
  std::vector<ScoredCase> cases;
  for (int i = 0; i < 10; ++i) {
    cases.push_back(judged("singles", {"tether"}, i < 6 ? "effect" : "unknown", {"tether"}, 0.9));
    cases.back().prediction.rivals["best RMSE"] = {{"tether"}, {"tether"}, 0.5 + 0.01 * i};
    cases.push_back(judged("none", {}, i < 2 ? "unknown" : "none", {}, 0.9));
    cases.back().prediction.rivals["best RMSE"] = {{i < 4 ? Names{"wind"} : Names{}}, {"wind"}, 0.505 + 0.01 * i};
  }
  // two alarms are allowed: the third largest has 0.515
  Scores s = score(cases);
  EXPECT_DOUBLE_EQ(*line_of(s.lines, "top1_mocap_imu").rival->value, 0.8);
  EXPECT_EQ(std::ranges::count(s.beaten_on, "top1_mocap_imu"), 1);
  EXPECT_DOUBLE_EQ(*s.unbounded_alarms.at("best RMSE").value, 0.4);
  for (ScoredCase& c : cases)
    if (c.truth.part == "none") c.prediction.kind = "none";  // none is allowed now
  s = score(cases);
  EXPECT_DOUBLE_EQ(*line_of(s.lines, "top1_mocap_imu").rival->value, 0.6);
  EXPECT_EQ(std::ranges::count(s.beaten_on, "top1_mocap_imu"), 0) << "as good is not better";
}

}  // namespace
}  // namespace flappy::benchmark
