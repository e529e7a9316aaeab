#include "gap/evidence/model_discrepancy.hpp"

#include <gtest/gtest.h>

#include "io/files.hpp"

namespace flappy::gap::model_discrepancy_test {
namespace {

TEST(ModelDiscrepancy, HasAShareForEachFunctionOfEachChannel) {
  const ModelDiscrepancy d = read_model_discrepancy();
  for (int channel = 0; channel < kChannels; ++channel)
    for (int h = 0; h <= kHarmonics; ++h)
      for (int k = 0; k < static_cast<int>(BasisFunction::count); ++k)
        EXPECT_GT(d.share(channel, h, static_cast<BasisFunction>(k)), 0)
            << channel_name(channel) << " " << h << " " << k;
}

TEST(ModelDiscrepancy, KnowsBackgroundsByEffect) {
  ModelDiscrepancy d = read_model_discrepancy();
  d.background = {{"other", 0.1}, {"wind", 0.3}, {"wing_damage", 0.2}};
  EXPECT_EQ(d.background_sd("wind"), 0.3);
  EXPECT_EQ(d.background_sd("tether"), 0.1);
  EXPECT_EQ(d.background_sd("wing_damage_of_both"), 0.2) << "as each wing's, unless it is named";
  d.background["wing_damage_of_both"] = 0.05;
  EXPECT_EQ(d.background_sd("wing_damage_of_both"), 0.05);
}

TEST(ModelDiscrepancy, LetsEffectsOfModelsFollowTheRobot) {
  ModelDiscrepancy d = read_model_discrepancy();
  d.of_models = {"wing_damage"};
  d.spread.model_freedom = 3;
  d.spread.effect_freedom = 9;
  EXPECT_TRUE(d.scale_prior("wing_damage").follows_robot);
  EXPECT_EQ(d.scale_prior("wing_damage_of_both").freedom, 3);
  EXPECT_FALSE(d.scale_prior("wind").follows_robot);
  EXPECT_EQ(d.scale_prior("wind").freedom, 9);
  d.beat_averaged = true;
  EXPECT_TRUE(d.scale_prior("wind").follows_robot);
  EXPECT_EQ(d.freedom_of(Regimes::place), d.spread.place_freedom);
  EXPECT_EQ(d.freedom_of(Regimes::inputs), d.spread.block_freedom);
}

TEST(ModelDiscrepancy, SortsFunctionsByClass) {
  EXPECT_EQ(regimes_of(BasisFunction::constant), Regimes::always);
  EXPECT_EQ(regimes_of(BasisFunction::flight), Regimes::always);
  EXPECT_EQ(regimes_of(BasisFunction::rate), Regimes::inputs);
  EXPECT_EQ(regimes_of(BasisFunction::place), Regimes::place);
  EXPECT_EQ(regimes_of(BasisFunction::drag_z), Regimes::velocity);
}

TEST(ModelDiscrepancy, IsWrittenAsItIsRead) {
  const ModelDiscrepancy d = read_model_discrepancy();
  const std::string text = discrepancy_text(d, "somebody");
  const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "discrepancy.toml";
  io::write_atomically(file, text);
  EXPECT_EQ(discrepancy_text(read_model_discrepancy(file), "somebody"), text);
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace flappy::gap::model_discrepancy_test
