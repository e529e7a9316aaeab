// Which manoeuvre is proposed where physics leaves no choice.
#include "gap/next/next_experiment.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "full.hpp"
#include "gap/replay/reset_prediction.hpp"
#include "rollout/fly_fixture.hpp"
#include "rollout/simulated_flight.hpp"

namespace flappy::gap {
namespace {

using flight::source_path;

const std::string kLibrary = source_path("configs/gap/experiments");

sim::Randomisation uncertain() {
  const auto v = model::read_vehicle(source_path("configs/vehicles/hummingbird_nominal.toml"));
  return sim::read_randomisation(v, io::Config::load(source_path("configs/gap/priors.toml"), {}).root());
}

/// A set of effects at the coordinates of its sizes, everything known to `sd`.
ScoredHypothesis hypothesis(const sim::Randomisation& prior, const std::vector<std::string>& effects,
                            const std::vector<double>& sizes, double probability, double sd = 0.1) {
  const Hypothesis h(prior, effects);
  ScoredHypothesis a;
  a.kind = effects.empty() ? HypothesisKind::parameters : HypothesisKind::effect;
  a.effects = effects;
  a.probability = probability;
  a.fit.at = h.start();
  for (std::size_t i = 0; i < sizes.size(); ++i) a.fit.at[h.shared() + static_cast<Eigen::Index>(i)] = sizes[i];
  a.fit.directions = Fitter::axes(h);
  a.fit.residual.resize(1);
  a.fit.posterior.mean = Eigen::VectorXd::Zero(h.size());
  a.fit.posterior.covariance = sd * sd * Eigen::MatrixXd::Identity(h.size(), h.size());
  return a;
}

ScoredHypothesis unchanged(double probability) {
  ScoredHypothesis a;
  a.kind = HypothesisKind::none;
  a.probability = probability;
  return a;
}

Inference diagnosis(const sim::Randomisation& prior, std::vector<ScoredHypothesis> hypotheses) {
  Inference d;
  d.hypotheses = std::move(hypotheses);
  d.parameters = hypothesis(prior, {}, {}, 0).fit;
  return d;
}

std::vector<Manoeuvre> library(const std::vector<std::string>& names) {
  std::vector<Manoeuvre> list;
  for (Manoeuvre& m : read_manoeuvres(kLibrary))
    if (std::ranges::count(names, m.name)) list.push_back(std::move(m));
  EXPECT_EQ(list.size(), names.size());
  return list;
}

NextOptions shipped() {
  NextOptions options;
  options.discrepancy = read_model_discrepancy();
  options.rule = read_verdict_rule();
  return options;
}

std::vector<NextExperiment> rank_experiments(const Inference& d, const sim::Randomisation& prior,
                                             const std::vector<Manoeuvre>& choice) {
  return gap::rank_experiments(d, prior, choice, shipped());
}

TEST(NextExperiment, FliesWhereTheRivalsDiffer) {
  const sim::Randomisation prior = uncertain();
  const auto choice = library({"ceiling_steps", "dash", "ground_steps", "wall_approach"});
  const auto best_for = [&](const char* effect, const char* manoeuvre) {
    const auto ranked = rank_experiments(
        diagnosis(prior, {hypothesis(prior, {effect}, {1}, 0.6), hypothesis(prior, {}, {}, 0.4)}), prior, choice);
    ASSERT_EQ(ranked.size(), choice.size());
    EXPECT_EQ(ranked[0].manoeuvre, manoeuvre);
    EXPECT_GT(ranked[0].expected_nats, 2) << effect;
    EXPECT_GT(ranked[0].expected_nats, 2 * ranked[1].expected_nats) << effect;
    EXPECT_EQ(ranked[0].separates, (std::vector<std::string>{effect, "parameters"}));
    ASSERT_EQ(ranked[0].courses.size(), 7u);
    std::size_t different = 0;
    for (std::size_t n = 0; n < ranked[0].courses[0].first.size(); ++n)
      different += ranked[0].courses[0].first[n] != ranked[0].courses[0].second[n];
    EXPECT_GT(different, 10u) << effect;
  };
  best_for("ground_effect", "ground_steps");
  if (!test::full()) return;
  best_for("ceiling_effect", "ceiling_steps");
  best_for("wall_effect", "wall_approach");
  best_for("body_drag", "dash");
}

TEST(NextExperiment, NatsGrowWithTheSquareOfADifferenceAndShrinkWithWhatIsUncertain) {
  const sim::Randomisation prior = uncertain();
  const auto of = [&](const char* effect, const char* manoeuvre, double size, double sd) {
    return rank_experiments(
               diagnosis(prior, {hypothesis(prior, {effect}, {size}, 0.5, sd), hypothesis(prior, {}, {}, 0.5, sd)}),
               prior, library({manoeuvre}))[0]
        .expected_nats;
  };
  // the entry's own law, along a path that is flown a little differently, differs by a few parts in a hundred
  const double small = of("body_drag", "dash", 0.013, 0.02), twice = of("body_drag", "dash", 0.026, 0.02);
  EXPECT_GT(twice, 3.6 * small);
  EXPECT_LT(twice, 4.4 * small);
  EXPECT_LT(of("body_drag", "dash", 0.026, 0.5), 0.8 * twice);
  if (!test::full()) return;
  EXPECT_LT(std::abs(of("body_drag", "dash", 0, 0.02)), 0.01 * small);
  // but what acts by the place may act by another law, the more the larger it is
  const double near = of("ground_effect", "ground_steps", 0.013, 0.02);
  EXPECT_LT(of("ground_effect", "ground_steps", 0.026, 0.02), 3.6 * near);
}

TEST(NextExperiment, PairsCountByTheirProbabilities) {
  const sim::Randomisation prior = uncertain();
  const auto choice = library({"ceiling_steps", "ground_steps"});
  const auto rank = [&](double ground, double ceiling) {
    ScoredHypothesis unknown;
    unknown.kind = HypothesisKind::unknown;
    unknown.probability = 0.5;
    return rank_experiments(
        diagnosis(prior, {unknown, hypothesis(prior, {}, {}, 0.4), hypothesis(prior, {"ground_effect"}, {1}, ground),
                          hypothesis(prior, {"ceiling_effect"}, {1}, ceiling)}),
        prior, choice);
  };
  const auto ranked = rank(0.09, 0.01);
  EXPECT_EQ(ranked[0].manoeuvre, "ground_steps");
  EXPECT_EQ(ranked[0].separates, (std::vector<std::string>{"parameters", "ground_effect"}));
  EXPECT_EQ(rank(0.01, 0.09)[0].manoeuvre, "ceiling_steps");
}

// The flights so far say nothing of any of these; each has a size of 0.5, give or take, and a manoeuvre of its own. What shows all of them is worth more
// than what shows the most probable one best, and brings less than what is not known yet.
TEST(NextExperiment, PrefersWhatShowsManyRivals) {
  const sim::Randomisation prior = uncertain();
  const auto open = [&](const char* effect, double probability) {
    ScoredHypothesis a = hypothesis(prior, {effect}, {}, probability, 0.01);
    const Hypothesis h(prior, {effect});
    for (Eigen::Index i = h.shared(); i < h.size(); ++i) a.fit.posterior.covariance(i, i) = 0.25;
    a.fit.residual.clear();
    return a;
  };
  const Inference d = diagnosis(prior, {hypothesis(prior, {}, {}, 0.4, 0.01), open("ground_effect", 0.22),
                                        open("ceiling_effect", 0.2), open("wall_effect", 0.18)});
  const auto ranked = rank_experiments(d, prior, library({"ceiling_steps", "dash", "ground_steps", "tour"}));
  ASSERT_EQ(ranked.size(), 4u);
  EXPECT_EQ(ranked[0].manoeuvre, "tour");
  EXPECT_EQ(ranked[1].manoeuvre, "ground_steps");
  double entropy = 0;
  for (const ScoredHypothesis& a : d.hypotheses) entropy -= a.probability * std::log(a.probability);
  for (const NextExperiment& e : ranked) {
    EXPECT_GT(e.information, 0) << e.manoeuvre;
    EXPECT_LT(e.information, entropy) << e.manoeuvre;
  }
}

TEST(NextExperiment, ProposesNothingWithoutRivalsOrWhereOneIsLost) {
  const sim::Randomisation prior = uncertain();
  auto choice = library({"ground_steps"});
  EXPECT_TRUE(rank_experiments(diagnosis(prior, {hypothesis(prior, {}, {}, 1)}), prior, choice).empty());
  const Inference d =
      diagnosis(prior, {hypothesis(prior, {"ground_effect"}, {1}, 0.6), hypothesis(prior, {}, {}, 0.4)});
  choice[0].config.fleet.task.path.back().coefficients[0][0] = 2;  // metres, at once
  EXPECT_TRUE(rank_experiments(d, prior, choice).empty());
}

/// Expected nats of a dash for a little drag over none, where reference flights of `manoeuvre` are at hand.
double expected_with_reference(const sim::Randomisation& prior, const char* manoeuvre) {
  const model::Vehicle& vehicle = prior.nominal();
  const rollout::FlyConfig flown = library({manoeuvre})[0].config;
  const auto reference = std::make_shared<ResetPrediction>(
      Recording(manoeuvre, std::move(*simulate(flown, vehicle, 1, flown.settle_s)[0].log), vehicle));
  NextOptions options = shipped();
  options.references = {reference};
  return gap::rank_experiments(diagnosis(prior, {hypothesis(prior, {"body_drag"}, {0.05}, 0.5, 0.01),
                                                 hypothesis(prior, {}, {}, 0.4, 0.01), unchanged(0.1)}),
                               prior, library({"dash"}), options)[0]
      .expected_nats;
}

TEST(NextExperiment, ReferencesOfTheSameRegimesCancelWhatModelsGetWrong) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  const sim::Randomisation prior = uncertain();
  const double alone =
      rank_experiments(
          diagnosis(prior, {hypothesis(prior, {"body_drag"}, {0.05}, 0.5, 0.01), hypothesis(prior, {}, {}, 0.4, 0.01)}),
          prior, library({"dash"}))[0]
          .expected_nats;
  const double after_dash = expected_with_reference(prior, "dash");
  EXPECT_GT(after_dash, 2 * alone);
  EXPECT_GT(after_dash, 1.5 * expected_with_reference(prior, "long_hover"));
}

// Without the cable, a robot with it and one without it fly alike.
TEST(NextExperiment, ForeseesWhatAnInterventionChanges) {
  const sim::Randomisation prior = uncertain();
  const auto ranked =
      rank_experiments(diagnosis(prior, {hypothesis(prior, {"tether"}, {1}, 0.6), hypothesis(prior, {}, {}, 0.4)}),
                       prior, library({"tour", "cable_off", "added_weight"}));
  ASSERT_EQ(ranked.size(), 3u);
  EXPECT_EQ(ranked.back().manoeuvre, "cable_off");
  EXPECT_EQ(ranked.back().change, "take off tether, marker_offset");
  EXPECT_FALSE(ranked.back().cost.empty());
  EXPECT_NEAR(ranked.back().expected_nats, 0, 1e-6);
  for (const NextExperiment& n : {ranked[0], ranked[1]}) EXPECT_GT(n.expected_nats, 1) << n.manoeuvre;
}

TEST(NextExperiment, ProposesARunOnABenchWhereThereIsOne) {
  const sim::Randomisation prior = uncertain();
  const Inference d =
      diagnosis(prior, {hypothesis(prior, {"gear_backlash"}, {1}, 0.6), hypothesis(prior, {"tether"}, {1}, 0.4)});
  const auto choice = library({"bench", "dash"});
  NextOptions options = shipped();
  const auto named = [&](bool in_flight, bool on_bench) {
    options.in_flight = in_flight, options.on_bench = on_bench;
    std::vector<std::string> names;
    for (const NextExperiment& n : gap::rank_experiments(d, prior, choice, options)) names.push_back(n.manoeuvre);
    return names;
  };
  EXPECT_EQ(named(true, false), std::vector<std::string>{"dash"});
  EXPECT_EQ(named(false, true), std::vector<std::string>{"bench"});
  const auto ranked = gap::rank_experiments(d, prior, choice, options);
  EXPECT_GT(ranked[0].expected_nats, 2) << "a clamped robot shows a backlash, and no tether";
  ASSERT_EQ(ranked[0].courses.size(), 4u) << "inputs, no path";
  for (const Course& c : ranked[0].courses) EXPECT_EQ(c.first, c.second) << c.quantity;
}

TEST(NextExperiment, RefusesInterventionsThatAreNone) {
  const flight::Folder folder;
  std::filesystem::copy(source_path("configs"), folder / "configs", std::filesystem::copy_options::recursive);
  const std::filesystem::path library = folder / "configs/gap/experiments", file = library / kInterventions;
  const auto refused = [&](const std::string& lines) {
    io::write_atomically(file, "schema = 1\n[[intervention]]\nname = \"x\"\ncost = \"nothing\"\n" + lines);
    return flight::message([&] { read_manoeuvres(library); });
  };
  EXPECT_NE(refused("manoeuvre = \"tuor\"\n").find(".toml:5"), std::string::npos);
  EXPECT_NE(refused("manoeuvre = \"tuor\"\n").find("did you mean \"tour\"?"), std::string::npos);
  EXPECT_NE(refused("manoeuvre = \"tour\"\n").find("changes nothing"), std::string::npos);
}

TEST(NextExperiment, ALibraryWithoutManoeuvresIsRefused) {
  flight::Folder folder;
  EXPECT_NE(flight::message([&] { read_manoeuvres(folder / "none"); }).find("holds no manoeuvre"), std::string::npos);
}

}  // namespace
}  // namespace flappy::gap
