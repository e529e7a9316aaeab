#include "gap/question/question.hpp"

#include <gtest/gtest.h>

#include "gap/question/alone.hpp"
#include "gap/synthetic_flight.hpp"

namespace flappy::gap::question_test {
namespace {

using Which = std::vector<std::size_t>;

ScoredHypothesis of_kind(HypothesisKind kind) {
  ScoredHypothesis a;
  a.kind = kind;
  return a;
}

TEST(Question, AloneAsksWhatIsMissing) {
  const Flights flights = as_flights(synthetic_flights(3, synthetic_law));
  const Question& q = question_of(flights);
  EXPECT_EQ(q.offsets(flights), (Which{1, 2}));
  EXPECT_EQ(q.apart(flights), Which{});
  EXPECT_NE(q.pool(of_kind(HypothesisKind::none)), q.pool(of_kind(HypothesisKind::parameters)));
  EXPECT_EQ(&question_beside({}), &q);
}

// By how much an effect multiplies the residual of flights and of the bench.
TEST(Question, RefutesAnEffectThatHelpsNeitherInFlightNorOnABench) {
  const auto made = synthetic_flights(4, synthetic_law);
  made[2]->on_bench = made[3]->on_bench = true;
  const Flights flights = as_flights(made);
  Inference d;
  d.noise_sd.assign(kGroups, 1);
  for (std::size_t f = 0; f < made.size(); ++f) d.refit.push_back(made[f]->noise(f));
  const auto effect = [&](const char* id, double in_flight, double on_bench) {
    ScoredHypothesis a = of_kind(HypothesisKind::effect);
    a.effects = {id};
    a.fit.residual = a.held_out = d.refit;
    for (std::size_t f = 0; f < made.size(); ++f)
      for (double& r : a.held_out[f]) r *= made[f]->on_bench ? on_bench : in_flight;
    return a;
  };
  d.hypotheses = {effect("spring_hardening", 1.1, 0.9), effect("wind", 0.9, 1.1),
                  effect("tether", 1.1, 1.1),           effect("wall_effect", 1, 1),
                  of_kind(HypothesisKind::parameters),  effect("accelerometer_misalignment", 1.1, 0.9)};
  refute_idle_effects(
      flights.tests, [](const std::string& id) { return id == "spring_hardening"; }, d);
  EXPECT_EQ(d.hypotheses[0].log_evidence, 0);
  EXPECT_EQ(d.hypotheses[1].log_evidence, 0);
  EXPECT_EQ(d.hypotheses[2].log_evidence, kRefuted);
  EXPECT_EQ(d.hypotheses[3].log_evidence, kRefuted);
  EXPECT_EQ(d.hypotheses[4].log_evidence, 0);
  EXPECT_EQ(d.hypotheses[5].log_evidence, kRefuted) << "it does not act on a bench";
}

TEST(Question, ReferencesWithoutTestsAreFittedAsFlightsAlone) {
  const auto made = synthetic_flights(2, synthetic_law);
  EXPECT_EQ(&question_of(as_flights(made, 2)), &question_of(as_flights(made)));
}

// Each session has a first flight, which has no offset; all functions follow a second time for the tests.
TEST(Question, AContrastAsksWhatChanged) {
  const auto made = synthetic_flights(5, synthetic_law);
  const Flights flights = as_flights(made, 2);
  const Question& q = question_of(flights);
  EXPECT_EQ(q.offsets(flights), (Which{1, 3, 4}));
  EXPECT_EQ(q.apart(flights), (Which{2, 3, 4}));
  EXPECT_EQ(q.pool(of_kind(HypothesisKind::none)), q.pool(of_kind(HypothesisKind::parameters)));
  EXPECT_NE(q.pool(of_kind(HypothesisKind::none)), q.pool(of_kind(HypothesisKind::unknown)));
  EXPECT_EQ(&question_beside(flights.references), &q);
}

// An unknown cause of a contrast is free in blocks of the tests alone, where references show what cancels.
// Two hills of evidence, of height 1 at the given scales and of 5 at 64 times these, and a valley between.
TEST(Question, FindsTheHigherOfTwoHillsOfScales) {
  const auto made = synthetic_flights(4, synthetic_law);
  const Flights flights = as_flights(made, 2);
  const auto hill = [](double at, double centre) { return std::exp(-std::pow(std::log2(at / centre), 2)); };
  Scales given;
  given.session = 0.5;
  given.blocks.assign(kBlocks, 1);
  given.free.assign(kBlocks, 0);
  const Scales best = question_of(flights).first_scales(
      given, [&](const Scales& s) { return hill(s.session, 0.5) + 5 * hill(s.session, 32); });
  EXPECT_EQ(best.session, 32);
  for (std::size_t b = 0; b < kBlocks; ++b) EXPECT_EQ(best.blocks[b], block_of_tests(b) ? 64 : 1);
}

TEST(Question, FreesOtherBlocksInAContrast) {
  const auto made = synthetic_flights(4, synthetic_law);
  const Flights alone = as_flights(made), pair = as_flights(made, 2);
  const ModelDiscrepancy d = read_model_discrepancy();
  const auto free = [&](const Flights& flights, Regimes regimes, bool of_tests) {
    const Question& q = question_of(flights);
    const std::size_t block = static_cast<std::size_t>(regimes) + (of_tests ? kRegimes : 0);
    return q.may_be_free(block, RegimeBasis(q, flights), d);
  };
  EXPECT_TRUE(free(alone, Regimes::place, false));
  EXPECT_FALSE(free(alone, Regimes::inputs, false));
  EXPECT_TRUE(free(pair, Regimes::inputs, true));
  EXPECT_FALSE(free(pair, Regimes::place, false));
}

}  // namespace
}  // namespace flappy::gap::question_test
