// That no two families of blind robots, and no family and the catalogue, share a law or a number of an effect.
#include "lab/benchmark/laws.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>

#include "io/files.hpp"
#include "lab/benchmark/families.hpp"
#include "lab/benchmark/stub_family.hpp"
#include "model/effects/registry.hpp"

namespace flappy::benchmark {
namespace {

using Points = std::vector<std::vector<double>>;

/// A family whose effects and laws are given.
class Written final : public StubFamily {
 public:
  using Law = std::vector<double> (*)(std::span<const double>);
  Written(std::string name, std::vector<blind::FamilyEffect> effects, std::map<std::string, Law> laws)
      : StubFamily(std::move(name), std::move(effects)), laws_(std::move(laws)) {}
  std::vector<double> law(const std::string& effect, std::span<const double> at) const override {
    const auto found = laws_.find(effect);
    return found == laws_.end() ? std::vector<double>{} : found->second(at);
  }

 private:
  std::map<std::string, Law> laws_;
};

blind::FamilyEffect effect(const std::string& id, std::vector<double> numbers) {
  return {id, "words", {}, {}, "an equation", "a source", std::move(numbers)};
}

TEST(LawDistance, SeesNoScaleAndNoUnit) {
  const Points a = {{1, 10}, {2, 30}, {3, -20}};
  Points scaled = a, other = a;
  for (auto& row : scaled) row[0] *= 7, row[1] *= 7;
  EXPECT_NEAR(law_distance(a, scaled), 0, 1e-7);
  other[1][0] = -2;
  EXPECT_GT(law_distance(a, other), 0.3);
  Points milli = a, other_milli = other;  // the second outcome in another unit
  for (Points* law : {&milli, &other_milli})
    for (auto& row : *law) row[1] *= 1000;
  EXPECT_NEAR(law_distance(milli, other_milli), law_distance(a, other), 1e-12);
  EXPECT_DOUBLE_EQ(law_distance({{1}, {0}}, {{0}, {1}}), 1);
  // an angle of 3 % between the laws is a distance of 3 %
  EXPECT_NEAR(law_distance({{1}, {0}}, {{1}, {0.03}}), 0.03, 2e-5);
}

TEST(Laws, AreRefusedWhereTheyAreSharedOrNotWrittenDown) {
  using At = std::span<const double>;
  const auto exponential = [](At at) { return std::vector<double>{0.2 * std::exp(-at[0] / 0.05)}; };
  const auto rational = [](At at) { return std::vector<double>{0.3 / (1 + at[0] * at[0] / 0.01)}; };
  const Written first("x", {effect("ground_effect", {0.2, 0.05})}, {{"ground_effect", exponential}});
  const Written second("y", {effect("ground_effect", {0.3, 0.1})}, {{"ground_effect", rational}});
  const auto pair = [](const std::vector<const blind::Family*>& of, const std::string& a, const std::string& b) {
    for (const LawPair& p : compare_laws(of))
      if (p.first == a && p.second == b) return p;
    ADD_FAILURE() << a << " and " << b << " are not compared";
    return LawPair{};
  };
  EXPECT_FALSE(pair({&first, &second}, "x", "y").refused());
  EXPECT_GT(*pair({&first, &second}, "x", "y").distance, kMinDistance);
  // the same law in other words, 2^-h/0.035 and a factor
  const Written same("y", {effect("ground_effect", {0.5, 0.035})},
                     {{"ground_effect", [](At at) { return std::vector<double>{0.5 * std::exp2(-at[0] / 0.0346)}; }}});
  EXPECT_LT(*pair({&first, &same}, "x", "y").distance, 1e-3);
  EXPECT_TRUE(pair({&first, &same}, "x", "y").refused());
  // the catalogue's decay is over 60 mm
  const Written ours("x", {effect("ground_effect", {0.2, 0.061})},
                     {{"ground_effect", [](At at) { return std::vector<double>{0.2 * std::exp(-at[0] / 0.061)}; }}});
  EXPECT_TRUE(pair({&ours}, "x", "catalogue").refused());
  // equal numbers, of whatever they are
  const Written number("y", {effect("ground_effect", {0.2, 0.1})}, {{"ground_effect", rational}});
  EXPECT_DOUBLE_EQ(pair({&first, &number}, "x", "y").equal_number.value_or(0), 0.2);
  const Written silent("y", {effect("ground_effect", {0.31})}, {});
  EXPECT_EQ(pair({&silent}, "y", "catalogue").missing, "law");
}

TEST(Laws, OfTurnsDoNotDependOnTheDrawnDirection) {
  const Written along("x", {effect("accelerometer_misalignment", {0.011})},
                      {{"accelerometer_misalignment", [](std::span<const double> at) {
                          return std::vector<double>{0, -0.011 * at[2], 0.011 * at[1]};
                        }}});
  const Written across("y", {effect("accelerometer_misalignment", {0.012})},
                       {{"accelerometer_misalignment", [](std::span<const double> at) {
                           return std::vector<double>{0.012 * at[2], 0, -0.012 * at[0]};
                         }}});
  for (const LawPair& p : compare_laws({&along, &across}))
    EXPECT_LT(p.distance.value_or(1), 1e-6) << p.first << p.second;
}

TEST(CatalogueLaws, AreWrittenDownForEveryEffectButGeometry) {
  std::size_t asked = 0;
  for (const model::CatalogueEffect& e : model::effects()) {
    const std::string id = e.info.id;
    const auto at = std::ranges::find(law_questions(), id, [](const LawQuestion& q) { return std::string(q.effect); });
    const bool geometry = id == "com_offset" || id == "inertia_products" || id == "wing_inertia";
    ASSERT_EQ(at == law_questions().end(), geometry) << id;
    if (geometry) continue;
    ++asked;
    for (const std::vector<double>& point : grid_of(*at)) {
      const std::vector<double> outcome = catalogue_law(id, point);
      ASSERT_EQ(outcome.size(), at->outcomes.size()) << id;
      for (const double x : outcome) ASSERT_TRUE(std::isfinite(x)) << id;
    }
  }
  EXPECT_EQ(asked, law_questions().size());
}

#if defined(FLAPPY_FAMILIES) && defined(FLAPPY_HAVE_MUJOCO)
TEST(Families, ShareNoLawAndNoNumber) {
  const std::vector<const blind::Family*> all = {&family_named("a"), &family_named("b"), &family_named("c")};
  for (const LawPair& p : compare_laws(all)) {
    SCOPED_TRACE(p.effect + ": " + p.first + " and " + p.second);
    EXPECT_EQ(p.missing, "");
    EXPECT_FALSE(p.equal_number) << *p.equal_number;
    if (p.distance) EXPECT_GE(*p.distance, kMinDistance);
  }
}
#endif

}  // namespace
}  // namespace flappy::benchmark
