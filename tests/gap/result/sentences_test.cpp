#include "gap/result/sentences.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace flappy::gap::sentences_test {
namespace {

std::string spoken(std::string name) {
  std::ranges::replace(name, '_', ' ');
  return name;
}

TEST(Sentences, SayAVerdictAloneAndInAContrast) {
  const Verdict two{VerdictKind::effect, {"body_drag", "wind"}, true, 0.9};
  EXPECT_EQ(verdict_words(two, false, as_it_is), "Missing in the model: body_drag and wind, and something more");
  const Verdict unchanged{VerdictKind::parameters, {}, false, 0.9};
  EXPECT_EQ(verdict_words(unchanged, true, spoken, true), "What is seen may be no more than sessions differ by");
  EXPECT_EQ(verdict_words(unchanged, true, spoken, false), "Changed by no more than sessions differ by");
  EXPECT_EQ(verdict_words(two, true, spoken), "Changed since the reference: body drag and wind, and something more");
  EXPECT_EQ(verdict_words({VerdictKind::group, {"a", "b", "c"}, false, 0.9}, false, spoken),
            "Missing in the model: one of a, b or c, which these flights cannot tell apart");
  for (const VerdictKind kind : {VerdictKind::parameters, VerdictKind::none, VerdictKind::unknown}) {
    const Verdict v{kind, {}, false, 0.9};
    EXPECT_NE(verdict_words(v, false, spoken), verdict_words(v, true, spoken));
  }
  EXPECT_EQ(probability_words(0.5), "probability 0.50");
  EXPECT_EQ(probability_words(0.494), "probability 0.49, no more than a guess");
}

TEST(Sentences, SayAHypothesisAsItsNameDoes) {
  RankedHypothesis h;
  h.effects = {"body_drag", "wind"};
  EXPECT_EQ(hypothesis_words(h, spoken), "body drag and wind");
  EXPECT_EQ(hypothesis_words("body_drag+wind", spoken), "body drag and wind");
  h.remainder = true;
  EXPECT_EQ(hypothesis_words(h, as_it_is), "body_drag and wind and more");
  for (const auto& [kind, words] : {std::pair{HypothesisKind::none, "no gap"},
                                    {HypothesisKind::parameters, "parameters alone"},
                                    {HypothesisKind::unknown, "something unknown"}}) {
    RankedHypothesis alone;
    alone.kind = kind;
    EXPECT_EQ(hypothesis_words(alone, spoken), words);
    EXPECT_EQ(hypothesis_words(name_of(kind), spoken), words);
  }
}

TEST(Sentences, SaySuspectsAndHarmonics) {
  EXPECT_EQ(suspects_words({{"body_drag", 0.4, Closure{0.3, 0.2, 0.4}}, {"wind", 0.2, {}}}, spoken),
            "if an effect is missing, then most probably body drag 0.40 (closes 30 %) or wind 0.20");
  EXPECT_EQ(harmonic_words(0), "mean of the beat");
  EXPECT_EQ(harmonic_words(2), "harmonic 2 of the beat");
  EXPECT_EQ(capitalised("mend the logs"), "Mend the logs");
}

}  // namespace
}  // namespace flappy::gap::sentences_test
