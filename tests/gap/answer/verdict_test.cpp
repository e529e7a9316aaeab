#include "gap/answer/verdict.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "gap/answer/result.hpp"
#include "gap/diagnose/diagnose.hpp"
#include "gap/question/alone.hpp"
#include "gap/question/contrast.hpp"
#include "io/config.hpp"
#include "io/files.hpp"
#include "refusal.hpp"
#include "rollout/fly_fixture.hpp"
#include "vehicles.hpp"

namespace flappy::gap::verdict_test {
namespace {

const std::string kConfigs = FLAPPY_SOURCE_DIR "/configs/";

ScoredHypothesis hypothesis(double probability, std::vector<std::string> effects) {
  ScoredHypothesis a;
  a.kind = HypothesisKind::effect;
  a.effects = std::move(effects);
  a.probability = probability;
  return a;
}

ScoredHypothesis hypothesis(double probability, HypothesisKind kind) {
  ScoredHypothesis a;
  a.kind = kind;
  a.probability = probability;
  return a;
}

std::string pool_in_contrast(const ScoredHypothesis& a) { return Contrast(0).pool(a); }

Inference conclude(std::vector<ScoredHypothesis> hypotheses) {
  Inference d;
  d.hypotheses = std::move(hypotheses);
  gap::conclude(read_verdict_rule(), pool_of, d);
  return d;
}

TEST(Verdict, IsNotUnchangedWhereAQuantityChangedPlainly) {
  Inference d;
  d.hypotheses = {hypothesis(0.6, HypothesisKind::parameters), hypothesis(0.2, HypothesisKind::none),
                  hypothesis(0.05, {"wind"}), hypothesis(0.15, HypothesisKind::unknown)};
  d.seen = {{"mean force along z", "m/s^2", 0, -1.4, 0.21}, {"battery", "V", 0, 0.1, 1}};
  EXPECT_FALSE(changed_plainly(d.seen)) << "6.7 times";
  d.seen[0].scatter = 0.19;
  EXPECT_TRUE(changed_plainly(d.seen)) << "7.4 times";
  exclude_unchanged(d.hypotheses);
  EXPECT_EQ(d.hypotheses[0].kind, HypothesisKind::unknown);
  EXPECT_NEAR(d.hypotheses[0].probability, 0.75, 1e-12);
  EXPECT_NEAR(d.hypotheses[1].probability, 0.25, 1e-12) << "wind";
  EXPECT_EQ(d.hypotheses[3].probability, 0);
}

TEST(Verdict, CountsNatsBeyondChanceByStudentsT) {
  const auto weighed = [](double log_evidence, double prior, ScoredHypothesis a) {
    a.log_prior = std::log(prior);
    a.log_evidence = log_evidence + a.log_prior;
    return a;
  };
  VerdictRule rule = read_verdict_rule();
  rule.gain.by_chance_nats = 10;
  rule.gain.outside = {"wind"}, rule.gain.outside_by_chance_nats = 4;
  rule.tempering = {2, 4};
  std::vector<ScoredHypothesis> all = {weighed(-1000, 0.2, hypothesis(0, HypothesisKind::parameters)),
                                       weighed(-980, 0.2, hypothesis(0, HypothesisKind::unknown)),
                                       weighed(-885, 0.3, hypothesis(0, {"wind", "body_drag"})),
                                       weighed(-960, 0.1, hypothesis(0, {"body_drag"})),
                                       weighed(-880, 0.2, hypothesis(0, {"wind"}))};
  set_probabilities(all, rule);
  // gains beyond chance: 116 of wind, 101 of the pair, 30 of body_drag, 10 of what is unknown
  const auto share = [](double prior, double behind) { return prior * std::pow(1 + behind / 4, -2); };
  const double sum = 0.2 + share(0.3, 15) + share(0.1, 86) + share(0.2, 106) + share(0.2, 116);
  EXPECT_EQ(all[0].effects, std::vector<std::string>{"wind"});
  EXPECT_NEAR(all[0].probability, 0.2 / sum, 1e-12);
  EXPECT_EQ(all[1].effects.size(), 2u);
  EXPECT_NEAR(all[1].probability, share(0.3, 15) / sum, 1e-12);
  EXPECT_EQ(all[2].kind, HypothesisKind::unknown);
  EXPECT_NEAR(all[2].probability, share(0.2, 106) / sum, 1e-12);
  EXPECT_NEAR(all[3].probability, share(0.2, 116) / sum, 1e-12);
  EXPECT_NEAR(all[4].probability, share(0.1, 86) / sum, 1e-12);
  // what loses against the parameters has lost all of it
  all = {weighed(-1000, 0.5, hypothesis(0, HypothesisKind::parameters)), weighed(-1004, 0.5, hypothesis(0, {"wind"}))};
  set_probabilities(all, rule);
  EXPECT_NEAR(all[1].probability, 0.25 / 1.25, 1e-12);
}

// A first effect gains 1000 nats, a second one 60 more, and a remainder 150 more.
TEST(Verdict, OfWhatAnotherLawLeavesOnlyMoreThanAShareCounts) {
  const auto gains = [](double nats, std::vector<std::string> effects, bool remainder = false) {
    ScoredHypothesis a = hypothesis(0, std::move(effects));
    if (remainder) a.unexplained.emplace_back();
    a.log_evidence = nats;
    return a;
  };
  std::vector<ScoredHypothesis> all = {hypothesis(0, HypothesisKind::parameters), gains(1000, {"wind"}),
                                       gains(1060, {"wind", "com_offset"}), gains(1150, {"wind"}, true)};
  VerdictRule rule = read_verdict_rule();
  rule.gain.by_chance_nats = 0, rule.gain.outside = {};
  EXPECT_DOUBLE_EQ(beyond_chance(all[2], all, rule), 1060);
  rule.gain.further_share = 0.05, rule.gain.remainder_share = 0.1;
  EXPECT_DOUBLE_EQ(beyond_chance(all[1], all, rule), 1000);
  EXPECT_DOUBLE_EQ(beyond_chance(all[2], all, rule), 1060 - 0.05 * 1000);
  EXPECT_DOUBLE_EQ(beyond_chance(all[3], all, rule), 1150 - 0.1 * 1000);
}

TEST(Verdict, NamesTheLargestMass) {
  const Inference d = conclude({hypothesis(0.6, {"wind"}), hypothesis(0.3, HypothesisKind::parameters),
                                hypothesis(0.06, HypothesisKind::none), hypothesis(0.04, HypothesisKind::unknown)});
  EXPECT_EQ(d.verdict.kind, VerdictKind::effect);
  EXPECT_EQ(d.verdict.effects, std::vector<std::string>{"wind"});
  EXPECT_EQ(d.verdict.probability, 0.6);
  EXPECT_EQ(d.concluded, 0u);
  EXPECT_EQ(conclude({hypothesis(0.4, {"wind"}), hypothesis(0.6, HypothesisKind::none)}).verdict.kind,
            VerdictKind::none);
  EXPECT_EQ(conclude({hypothesis(0.4, {"wind"}), hypothesis(0.6, HypothesisKind::unknown)}).verdict.kind,
            VerdictKind::unknown);
  EXPECT_EQ(conclude({hypothesis(0.4, {"wind"}), hypothesis(0.6, HypothesisKind::parameters)}).concluded, 1u);
}

TEST(Verdict, PoolsWhatIsHarmlessInAContrast) {
  Inference d;
  d.hypotheses = {hypothesis(0.4, {"wind"}), hypothesis(0.25, HypothesisKind::parameters),
                  hypothesis(0.2, HypothesisKind::none), hypothesis(0.15, HypothesisKind::unknown)};
  gap::conclude(read_verdict_rule(), pool_of, d);
  EXPECT_EQ(d.verdict.kind, VerdictKind::effect);
  gap::conclude(read_verdict_rule(), pool_in_contrast, d);
  EXPECT_EQ(d.verdict.kind, VerdictKind::parameters);
  EXPECT_DOUBLE_EQ(d.verdict.probability, 0.45);
}

TEST(Verdict, SaysAProbabilityThatRobotsWithKnownFaultsTaught) {
  VerdictRule rule = read_verdict_rule();
  rule.said = {0.5, 0};
  Inference d;
  d.hypotheses = {hypothesis(0.9, {"wind"}), hypothesis(0.1, HypothesisKind::parameters)};
  gap::conclude(rule, pool_in_contrast, d);
  EXPECT_NEAR(d.verdict.probability, 0.75, 1e-12) << "the odds of 9 become 3";
  rule.said = {1, std::log(2.0)};
  gap::conclude(rule, pool_in_contrast, d);
  EXPECT_NEAR(d.verdict.probability, 18.0 / 19, 1e-12) << "odds are doubled";
  EXPECT_DOUBLE_EQ(d.hypotheses[0].probability, 0.9) << "evidence stays";
  EXPECT_EQ(rule.said(0), 0);
  EXPECT_EQ(rule.said(1), 1);
}

TEST(Verdict, NamesOfAContrastWhatIsMoreProbableThanNot) {
  VerdictRule rule = read_verdict_rule();
  rule.naming.least = 0.5;
  Inference d;
  d.hypotheses = {hypothesis(0.45, {"wind"}), hypothesis(0.3, HypothesisKind::parameters),
                  hypothesis(0.25, HypothesisKind::unknown)};
  gap::conclude(rule, pool_in_contrast, d);
  EXPECT_EQ(d.verdict.kind, VerdictKind::parameters);
  EXPECT_DOUBLE_EQ(d.verdict.probability, 0.3);
  // with another effect or without it
  d.hypotheses = {hypothesis(0.3, {"wind"}), hypothesis(0.25, {"wind", "com_offset"}),
                  hypothesis(0.29, HypothesisKind::parameters), hypothesis(0.16, {"com_offset"})};
  gap::conclude(rule, pool_in_contrast, d);
  EXPECT_EQ(d.verdict.effects, std::vector<std::string>{"wind"});
  // where the change is plain, the likeliest cause is named, and its probability tells how sure that is
  d.hypotheses = {hypothesis(0.4, {"wind"}), hypothesis(0.35, {"com_offset"}),
                  hypothesis(0.25, HypothesisKind::unknown), hypothesis(0, HypothesisKind::parameters),
                  hypothesis(0, HypothesisKind::none)};
  d.seen = {{"mean force along z", "m/s^2", 0, -1.4, 0.19}};
  gap::conclude(rule, pool_in_contrast, d);
  EXPECT_EQ(d.verdict.effects, std::vector<std::string>{"wind"});
  EXPECT_DOUBLE_EQ(d.verdict.probability, 0.4);
}

TEST(Verdict, PoolsRivals) {
  // together they outweigh the parameters, and neither is clear
  const Inference d = conclude({hypothesis(0.4, HypothesisKind::parameters), hypothesis(0.3, {"rotational_lift"}),
                                hypothesis(0.25, {"wake_capture"}), hypothesis(0.05, HypothesisKind::none)});
  EXPECT_EQ(d.verdict.kind, VerdictKind::group);
  EXPECT_EQ(d.verdict.effects, (std::vector<std::string>{"rotational_lift", "wake_capture"}));
  EXPECT_DOUBLE_EQ(d.verdict.probability, 0.55);
  EXPECT_EQ(d.concluded, 1u);
  // effects without a group are no rivals of each other
  EXPECT_EQ(conclude({hypothesis(0.4, HypothesisKind::parameters), hypothesis(0.3, {"body_drag"}),
                      hypothesis(0.3, {"clap_and_fling"})})
                .verdict.kind,
            VerdictKind::parameters);
}

TEST(Verdict, NamesAMemberThatIsClear) {
  // half of everything
  Inference d = conclude({hypothesis(0.51, {"rotational_lift"}), hypothesis(0.49, {"wake_capture"})});
  EXPECT_EQ(d.verdict.kind, VerdictKind::effect);
  EXPECT_EQ(d.verdict.probability, 0.51);
  // four fifths of its pool
  d = conclude({hypothesis(0.41, {"rotational_lift"}), hypothesis(0.09, {"wake_capture"}),
                hypothesis(0.3, {"body_drag"}), hypothesis(0.2, {"clap_and_fling"})});
  EXPECT_EQ(d.verdict.kind, VerdictKind::effect);
  EXPECT_EQ(d.verdict.effects, std::vector<std::string>{"rotational_lift"});
  // what holds less than a twentieth of a pool is no member
  d = conclude({hypothesis(0.3, {"ground_effect"}), hypothesis(0.28, {"battery_sag"}),
                hypothesis(0.02, {"ceiling_effect"}), hypothesis(0.4, HypothesisKind::none)});
  EXPECT_EQ(d.verdict.effects, (std::vector<std::string>{"ground_effect", "battery_sag"}));
}

TEST(Verdict, PoolsSetsByTheGroupsOfTheirEffects) {
  EXPECT_EQ(pool_name({"wind", "body_drag"}), pool_name({"body_drag", "tether"}));
  EXPECT_NE(pool_name({"wind"}), pool_name({"wind", "tether"}));
  const Inference d = conclude(
      {hypothesis(0.3, {"wind", "body_drag"}), hypothesis(0.28, {"body_drag", "tether"}), hypothesis(0.42, {"wind"})});
  EXPECT_EQ(d.verdict.kind, VerdictKind::group);
  EXPECT_EQ(d.verdict.effects, (std::vector<std::string>{"wind", "body_drag", "tether"}));
}

// Of coordinates with sd 0.2 and covariance 0.01: 1.4 times as wide, and a magnitude of 2 by a tenth of itself besides.
TEST(Verdict, WidensMagnitudesAndShapeParameters) {
  const auto uncertain =
      sim::read_randomisation(test::nominal(), io::Config::load(test::source_path("configs/gap/priors.toml")).root());
  const Hypothesis h(uncertain, {"ground_effect"});  // one magnitude, one shape parameter
  Fit fit;
  fit.directions = Fitter::axes(h);
  fit.at = h.start();
  fit.posterior.mean = Eigen::VectorXd::Zero(h.size());
  const Eigen::Index magnitude = h.shared(), shape = magnitude + 1;
  ASSERT_EQ(h.size(), shape + 1);
  fit.posterior.mean[magnitude] = 2;
  fit.posterior.covariance = 0.04 * Eigen::MatrixXd::Identity(h.size(), h.size());
  fit.posterior.covariance(magnitude, shape) = fit.posterior.covariance(shape, magnitude) = 0.01;
  widen(fit, h, read_verdict_rule());
  EXPECT_NEAR(fit.covariance()(magnitude, magnitude), 1.96 * 0.04 + 0.04, 1e-12);
  EXPECT_NEAR(fit.covariance()(shape, shape), 1.96 * 0.04, 1e-12);
  EXPECT_NEAR(fit.covariance()(magnitude, shape), 1.96 * 0.01, 1e-12);
  EXPECT_NEAR(fit.covariance()(0, 0), 0.04, 1e-12) << "parameters stay";
  ScoredHypothesis a = hypothesis(1, {"ground_effect"});
  a.fit = fit;
  const Estimate gain = estimates_of(a, uncertain)[0];  // 90 % of the prior up to 0.45
  EXPECT_NEAR(gain.value, 2 * 0.45 / 1.645, 1e-12);
  EXPECT_NEAR(gain.high - gain.low, 2 * 0.45 * std::sqrt(0.1184), 1e-12);
}

// What is concluded is predicted by the fit that explains most of it, with all its effects in force.
TEST(Verdict, PredictsWithABackground) {
  Inference d;
  d.hypotheses = {hypothesis(0.5, HypothesisKind::parameters), hypothesis(0.2, {"wind", "tether"}),
                  hypothesis(0.2, {"wind", "tether"}), hypothesis(0.1, {"wind"})};
  d.hypotheses[1].unexplained.emplace_back();
  for (std::size_t i = 1; i < 4; ++i) d.hypotheses[i].fit.residual.emplace_back();
  EXPECT_EQ(&d.predicting(), &d.hypotheses[0]);
  d.hypotheses[0].predicted_with = {"wind", "tether"};
  EXPECT_EQ(&d.predicting(), &d.hypotheses[2]) << "the one with a remainder is another";
  d.concluded = 3;
  d.hypotheses[3].predicted_with = {"wind", "tether"};
  EXPECT_EQ(&d.predicting(), &d.hypotheses[2]);
}

// An effect that chance forbids to name takes part in the prediction where it explains more.
TEST(Verdict, PredictsWithWhatExplainsMost) {
  const auto concluded_of = [](std::size_t concluded) {
    Inference d;
    d.hypotheses = {hypothesis(0.5, HypothesisKind::parameters), hypothesis(0.2, {"wind"}),
                    hypothesis(0.2, {"wind", "tether"}), hypothesis(0.05, {"gyro_bias"}),
                    hypothesis(0.05, HypothesisKind::none)};
    const double nats[] = {-10, -8, -9, -7, -20};
    for (std::size_t i = 0; i < 5; ++i) d.hypotheses[i].log_evidence = nats[i];
    for (const std::size_t i : {1, 2}) d.hypotheses[i].fit.residual.emplace_back();
    d.concluded = concluded;
    predict_with_the_likeliest(d);
    return d.hypotheses[concluded].predicted_with;
  };
  using Names = std::vector<std::string>;
  EXPECT_EQ(concluded_of(0), Names{"wind"}) << "gyro_bias was not fitted";
  EXPECT_EQ(concluded_of(1), Names{}) << "more effects explain less";
  EXPECT_EQ(concluded_of(2), Names{}) << "what was named stays";
  EXPECT_EQ(concluded_of(4), Names{}) << "no gap";
}

// Of the files of constants every key is asked for, and none is let pass that nobody asks for.
TEST(Request, TakesSetsOfReferences) {
  DiagnosisSettings s;
  s.vehicle = kConfigs + "vehicles/hummingbird_nominal.toml";
  s.flights = {"flight"};
  s.reference = {"full=a", "b", "empty=c", "full=d"};
  const DiagnosisRequest request = read_request(s);
  EXPECT_EQ(request.settings.reference, (std::vector<std::string>{"a", "b", "d"}));
  ASSERT_EQ(request.others.size(), 1u);
  EXPECT_EQ(request.others[0].name, "empty");
  EXPECT_EQ(request.others[0].flights, std::vector<std::string>{"c"});
  EXPECT_GT(request.options.rule.gain.further_share, 0) << "constants of a contrast";
  s.reference = {"=a"};
  EXPECT_EQ(test::refusal([&] { read_request(s); }),
            "--reference =a: no name before \"=\"; accepted: LOG, or NAME=LOG as far=LOG");
}

TEST(Request, TakesWhatDiffersOnABenchWhereAllLogsAreOfOne) {
  const flight::Folder folder;
  DiagnosisSettings s;
  s.vehicle = kConfigs + "vehicles/hummingbird_nominal.toml";
  for (const char* name : {"before", "after"}) {
    std::filesystem::create_directories(folder / name);
    io::write_atomically(folder / name / "flight.toml", "");
    io::write_atomically(folder / name / "forces.csv", "");
  }
  s.reference = {folder / "before"};
  s.flights = {folder / "after"};
  const auto scale_sd = [&] { return read_request(s).options.discrepancy.session.scale_sd; };
  const auto of_file = [](const char* name) { return read_session_variation(kConfigs + "gap/" + name).scale_sd; };
  EXPECT_EQ(scale_sd(), of_file("bench_session_variation.toml"));
  std::filesystem::remove(folder / "after" / "forces.csv");
  EXPECT_EQ(scale_sd(), of_file("session_variation.toml")) << "one log is of a flight";
}

TEST(VerdictRule, IsReadStrictly) {
  const flight::Folder folder;
  const std::string path = (folder / "constants.toml").string();
  const auto refusal = [&](const std::string& text, const auto& read) {
    std::ofstream(path) << text;
    return test::refusal([&] { read(path); });
  };
  const auto verdict = [&](const std::string& text) { return refusal(text, read_verdict_rule); };
  const auto discrepancy = [&](const std::string& text) { return refusal(text, read_model_discrepancy); };
  const auto with = [](std::string text, const std::string& from, const std::string& to) {
    return text.replace(text.find(from), from.size(), to);
  };
  const std::string rule = io::read_text(kConfigs + "gap/verdict.toml");
  EXPECT_EQ(verdict(rule), "accepted");
  EXPECT_NE(verdict("priors = 1\n" + rule).find(path + ":1:1: priors: "), std::string::npos)
      << verdict("priors = 1\n" + rule);
  EXPECT_NE(verdict(with(rule, "none = 0.1", "none = 0.2")).find("do not add up to 1"), std::string::npos);
  EXPECT_NE(verdict(with(rule, "freedom = ", "free = ")).find("tempering.freedom"), std::string::npos);
  EXPECT_NE(verdict(with(rule, "\"gyro_bias\"", "\"gyro_bais\"")).find("no effect \"gyro_bais\""), std::string::npos);
  const std::string model = io::read_text(kConfigs + "gap/model_discrepancy.toml");
  EXPECT_EQ(discrepancy(model), "accepted");
  EXPECT_NE(discrepancy(with(model, "\"added_mass\"", "\"added_masses\"")).find("no effect \"added_masses\""),
            std::string::npos);
  EXPECT_NE(discrepancy(with(model, "body_drag = ", "body_dragg = ")).find("background_sd.body_dragg"),
            std::string::npos);
  EXPECT_NE(discrepancy(with(model, "block_freedom = ", "block_freedoms = ")).find("spread.block_freedom"),
            std::string::npos);
  EXPECT_NE(discrepancy(with(model, "[share.path_x]", "[share.paths_x]")).find("share.path_x"), std::string::npos);
}

}  // namespace
}  // namespace flappy::gap::verdict_test
