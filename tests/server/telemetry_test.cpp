// What is shown of a training and of flights, and that it changes nothing of them.
#include "server/telemetry/telemetry.hpp"

#include <gtest/gtest.h>

#include "learn/trainer.hpp"
#include "learn/training.hpp"
#include "rollout/fly.hpp"
#include "rollout/fly_fixture.hpp"
#include "server/dds_fixture.hpp"

namespace flappy::server {
namespace {

struct Seen : rollout::Watch {
  explicit Seen(const std::vector<std::uint32_t>& flappers) : Watch(flappers) {}
  void see(const rollout::FlightSample& s) override { samples.push_back(s); }
  std::vector<rollout::FlightSample> samples;
};

rollout::FlyConfig hover(double duration_s) {
  return rollout::read_fly_config(flight::source_path("configs/fly/hover.toml"),
                                  {"flight.duration_s=" + std::to_string(duration_s), "flight.settle_s=0"});
}

TEST(Watch, SeesEveryControlPeriodOfWhomItWatches) {
  rollout::FlyConfig config = hover(0.1);
  const auto seen = std::make_shared<Seen>(std::vector<std::uint32_t>{2, 0, 9});
  config.watch = seen;
  rollout::FlyOptions options;
  options.count = 3;
  const std::uint64_t hash = fly(config, options).hash;
  ASSERT_EQ(seen->samples.size(), 2 * 50U) << "of the two that fly";
  std::uint64_t next[2] = {1, 1};
  for (const rollout::FlightSample& s : seen->samples) {
    ASSERT_LT(s.slot, 2U);
    EXPECT_EQ(s.flapper, s.slot == 0 ? 2U : 0U);
    EXPECT_EQ(s.tick, next[s.slot]++);
    EXPECT_NEAR(s.t_s, 0.002 * static_cast<double>(s.tick), 1e-12);
    EXPECT_GT(s.input.amplitude_V, 0);
  }
  EXPECT_EQ(fly(hover(0.1), options).hash, hash) << "to be watched changes nothing";
}

TEST(Telemetry, LeavesTheBytesOfATraining) {
  const auto train = [](const std::string& name, const std::shared_ptr<rollout::Watch>& watch) {
    learn::TrainConfig config = learn::small_training();
    config.fly.watch = watch;
    learn::TrainOptions options;
    options.folder = std::filesystem::path(testing::TempDir()) / ("telemetry_test_" + name);
    std::filesystem::remove_all(options.folder);
    options.commit = "test";
    const learn::TrainSummary s = learn::train(config, options);
    return s.payload_sha256 + io::read_text(options.folder / "metrics.jsonl") +
           io::read_text(options.folder / "best.json");
  };
  const std::string alone = train("alone", nullptr);
  const auto telemetry = std::make_shared<Telemetry>(loopback(own_domain()), flight::Sensors{});
  EXPECT_TRUE(train("shown", telemetry) == alone);
  EXPECT_GT(telemetry->shown() + telemetry->dropped(), 0U) << "or nothing was tried";
}

TEST(Telemetry, ShowsTrainingAndTakesWhomToWatch) {
  io::DdsConfig config = loopback(own_domain());
  config.commands = true;
  Telemetry telemetry(config, {});
  const Participant other(config);
  const Reader<TrainingMetrics> metrics(other, "/flappy/training", kLatched);
  const Reader<DiagnosticArray> diagnostics(other, "/diagnostics", kReliable);
  const Writer<server::Watch> watch(other, "/flappy/watch", kReliable);
  TrainingSample sample;
  sample.run = "escape";
  sample.update = 7, sample.updates = 70, sample.success = 0.5;
  telemetry.show(sample);
  bool told = false, diagnosed = false;
  for (int i = 0; i < 500 && !(told && diagnosed && telemetry.flapper(0) == 42); ++i) {
    if (watch.readers() > 0) watch.write({42});
    metrics.take([&](const TrainingMetrics& m, const dds_sample_info_t&) {
      told = std::string(m.run) == "escape" && m.update == 7 && m.success == 0.5;
    });
    diagnostics.take([&](const DiagnosticArray& m, const dds_sample_info_t&) {
      diagnosed = m.status._length == 1 && m.status._buffer[0].level == 0 && m.status._buffer[0].values._length == 2;
    });
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_TRUE(told);
  EXPECT_TRUE(diagnosed);
  EXPECT_EQ(telemetry.flapper(0), 42U);
}

TEST(Telemetry, TakesNoWatchWithoutCommands) {
  const io::DdsConfig config = loopback(own_domain());
  const Telemetry telemetry(config, {});
  const Participant other(config);
  const Writer<server::Watch> watch(other, "/flappy/watch", kReliable);
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_EQ(watch.readers(), 0U);
}

}  // namespace
}  // namespace flappy::server
