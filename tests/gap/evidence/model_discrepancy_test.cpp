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

TEST(ModelDiscrepancy, HasSharesOfABenchOfItsOwnOrThoseOfTheAir) {
  ModelDiscrepancy d = read_model_discrepancy();
  for (std::size_t c = 0; c < kChannels; ++c) d.shares[c + kChannels] = d.shares[c];
  d.shares[kChannels + kStrokeLeft][1][0] = 0.125;
  const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "bench.toml";
  io::write_atomically(file, discrepancy_text(d, "a test"));
  const Shares read = read_model_discrepancy(file).shares;
  std::filesystem::remove(file);
  EXPECT_EQ(share_of(read, kChannels + kStrokeLeft, 1, BasisFunction::constant), 0.125);
  EXPECT_EQ(read[kChannels + kStrokeRight], read[kStrokeRight]);
  EXPECT_NE(read[kChannels + kStrokeLeft], read[kStrokeLeft]);
}

TEST(ModelDiscrepancy, KnowsBackgroundsByEffect) {
  ModelDiscrepancy d = read_model_discrepancy();
  d.background = {{"other", 0.1}, {"wind", 0.3}, {"wing_damage", 0.2}};
  EXPECT_EQ(d.background_sd("wind"), 0.3);
  EXPECT_EQ(d.background_sd("tether"), 0.1);
  EXPECT_EQ(d.background_sd("wing_damage_of_both"), 0.2) << "as each wing's, unless it is named";
  d.background["wing_damage_of_both"] = 0.05;
  EXPECT_EQ(d.background_sd("wing_damage_of_both"), 0.05);
  EXPECT_EQ(d.background_sd("wing_damage_of_both_on_bench"), 0.05) << "as in flight, unless it is named";
  EXPECT_EQ(d.background_sd("wind_on_bench"), 0.3);
  d.background["wing_damage_of_both_on_bench"] = 0.01;
  EXPECT_EQ(d.background_sd("wing_damage_of_both_on_bench"), 0.01);
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

TEST(SessionVariation, TakesTheRobotsOwnSessionsForMoreTheMoreThereAre) {
  SessionVariation s;
  s.scale_sd = 1, s.own_scale_sd = 0.3, s.own_offset = 0.1, s.own_share = 0.5, s.block_freedom = 30;
  EXPECT_EQ(s.first_scale(), 1);
  EXPECT_EQ(s.sd_of_scale(), 1);
  EXPECT_EQ(s.centre(0), 1);
  s.own = OwnSessions{1e6, std::log(4) - 0.1, {900, 0}, {100, 0}};
  EXPECT_NEAR(s.first_scale(), 4, 1e-3) << "the robot's own";
  EXPECT_NEAR(s.sd_of_scale(), 0.3, 1e-4) << "sessions of one robot differ all the same";
  // half of 900 and of 100 count
  EXPECT_NEAR(s.freedom(0), 30 + 50, 1e-3);
  EXPECT_NEAR(s.centre(0), std::sqrt((30 + 450) / 80.0), 1e-4);
  EXPECT_EQ(s.centre(1), 1) << "nothing is known of this block";
  EXPECT_EQ(s.freedom(1), 30);
  // a magnitude of which one coefficient was found three times as large as the prior
  s.effect_freedom = 4;
  s.own->magnitudes["session of wind"] = {9, 1};
  EXPECT_NEAR(s.of_magnitude("session of wind").centre, std::sqrt(13 / 5.0), 1e-4);
  EXPECT_NEAR(s.of_magnitude("session of wind").freedom, 5, 1e-4);
  EXPECT_EQ(s.of_magnitude("session of tether").centre, 1) << "no session shows it";
  // of two sessions, one contrast: precisions 1/(1 - 0.09) and 1/0.09; a further session against both varies less
  s.own->count = 2;
  const double precision = 1 / 0.91 + 1 / 0.09;
  EXPECT_NEAR(s.log_scale(), (std::log(4) + 0.5 * std::log(0.75)) / (0.09 * precision), 1e-12);
  EXPECT_NEAR(s.sd_of_scale(), std::sqrt(0.09 + 1 / precision), 1e-12);
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
