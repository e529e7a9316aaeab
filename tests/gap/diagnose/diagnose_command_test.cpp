#include "gap/diagnose/diagnose_command.hpp"

#include <gtest/gtest.h>

#include <csignal>
#include <fstream>

#include "full.hpp"
#include "gap/answer/contrast_warnings.hpp"
#include "gap/result/diagnosis_json.hpp"
#include "io/files.hpp"
#include "io/progress.hpp"
#include "model/effects/registry.hpp"
#include "refusal.hpp"
#include "rollout/fly.hpp"
#include "rollout/fly_fixture.hpp"
#include "vehicles.hpp"

namespace flappy::gap::diagnose_command_test {
namespace {

const std::string kConfigs = FLAPPY_SOURCE_DIR "/configs/";

TEST(RunDiagnose, ReadsNoTruth) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  const flight::Folder folder;
  rollout::FlyOptions options;
  options.log_folder = folder / "flight";
  rollout::fly(rollout::read_fly_config(kConfigs + "fly/identify_multisine.toml",
                                        {"vehicle=../vehicles/hummingbird_identified.toml", "flight.duration_s=4"}),
               options);
  DiagnoseCommand command;
  command.settings.vehicle = kConfigs + "vehicles/hummingbird_nominal.toml";
  command.settings.priors = kConfigs + "gap/priors.toml";
  command.settings.flights = {options.log_folder.string()};
  command.out = folder / "out";
  for (const model::CatalogueEffect& e : model::effects())
    if (std::string(e.info.id) != "clap_and_fling") command.settings.withheld.push_back(e.info.id);
  const std::filesystem::path truth = options.log_folder / "truth.csv";
  const std::string honest = io::read_text(truth);
  const auto result = [&] {
    std::string bytes = run_diagnose(command).dump();
    for (const char* file : {"diagnosis.json", "vehicle_corrected.toml"}) bytes += io::read_text(folder / "out" / file);
    return bytes;
  };
  const std::string with_truth = result();
  // the identified one flew: believed 0, flew 0.04 rad, and by so little off is the middle of the stroke seen
  const model::Vehicle fixed = model::read_vehicle(folder / "out/vehicle_corrected.toml"), flew = test::identified();
  EXPECT_NEAR(fixed.left.spring.rest_angle_rad, flew.left.spring.rest_angle_rad, 0.02);
  EXPECT_NEAR(fixed.right.spring.rest_angle_rad, flew.right.spring.rest_angle_rad, 0.02);
  EXPECT_TRUE(fixed.posterior);
  const Diagnosis written =
      diagnosis_from(nlohmann::ordered_json::parse(io::read_text(folder / "out/diagnosis.json")), "diagnosis.json");
  double sum = 0;
  for (const RankedHypothesis& h : written.hypotheses) sum += h.probability;
  EXPECT_NEAR(sum, 1, 1e-12);
  EXPECT_GT(written.nominal_loss, written.refit_loss);
  std::filesystem::remove(truth);
  EXPECT_EQ(result(), with_truth) << "without truth";
  // a lie: another flight's motion, in a file that reads well
  std::string lie = honest.substr(0, honest.find('\n') + 1);
  const std::string line = honest.substr(lie.size(), honest.find('\n', lie.size()) + 1 - lie.size());
  for (int i = 0; i < 100; ++i) lie += std::to_string(i) + line.substr(line.find(','));
  std::ofstream(truth) << lie;
  EXPECT_EQ(result(), with_truth) << "beside a lie";
  // after Ctrl-C, which nothing takes back, so last
  io::stop_on_interrupt();
  std::raise(SIGINT);
  EXPECT_EQ(run_diagnose(command)["complete"], false);
  EXPECT_FALSE(std::filesystem::exists(folder / "out/vehicle_corrected.toml")) << "of a diagnosis that was stopped";
}

// A robot like its file, whose logs declare no ground: a tether would hang a kilometre down.
TEST(RunDiagnose, HasNoTetherWithoutGround) {
  const flight::Folder folder;
  rollout::fly(rollout::read_fly_config(kConfigs + "fly/flapper_nimble.toml", {"flight.duration_s=8"}),
               {.count = 2, .log_folder = folder / "flights"});
  DiagnoseCommand command;
  command.settings.vehicle = kConfigs + "vehicles/flapper_nimble.toml";
  command.settings.flights = {folder / "flights/0000", folder / "flights/0001"};
  command.out = folder / "out";
  run_diagnose(command);
  const Diagnosis written =
      diagnosis_from(nlohmann::ordered_json::parse(io::read_text(folder / "out/diagnosis.json")), "diagnosis.json");
  EXPECT_EQ(written.verdict.kind, VerdictKind::none);
  EXPECT_EQ(std::ranges::count(written.untestable, "tether"), 1);
  for (const RankedHypothesis& h : written.hypotheses) EXPECT_EQ(std::ranges::count(h.effects, "tether"), 0);
}

// Where `run_diagnose` complains before it reads a flight; of the vehicle with the place in its file.
TEST(RunDiagnose, RefusesWhatItCannotAnswer) {
  const flight::Folder folder;
  DiagnoseCommand command;
  command.settings.vehicle = kConfigs + "vehicles/hummingbird_nominal.toml";
  command.settings.priors = kConfigs + "gap/priors.toml";
  command.settings.flights = {(folder / "").string(), (folder / ".").string()};
  const auto refusal = [&] { return test::refusal([&] { run_diagnose(command); }); };
  EXPECT_EQ(refusal(), command.settings.flights[1] + ": is given twice; accepted: each flight once");
  command.settings.flights.pop_back();
  const std::string nominal = io::read_text(command.settings.vehicle);
  command.settings.vehicle = (folder / "v.toml").string();
  const auto with = [&](const std::string& text) { std::ofstream(command.settings.vehicle) << text; };
  with(nominal + "\n[effects.wind]\nx_m_s = 0.1\n");
  EXPECT_TRUE(
      refusal().ends_with(": effects: a diagnosis asks what is missing in the vehicle as it was believed; accepted: a "
                          "vehicle without effects"))
      << refusal();
  EXPECT_TRUE(refusal().starts_with(command.settings.vehicle + ":")) << refusal();
  std::string fast = nominal;
  with(fast.replace(fast.find("hold_s = 1e-3"), 13, "hold_s = 5e-5"));
  EXPECT_TRUE(
      refusal().ends_with(": driver.hold_s: physics goes by steps of 1e-04 s here; accepted: a multiple of that"))
      << refusal();
}

}  // namespace
TEST(SameStreams, AreInSomeFlightsOfBothSets) {
  const auto log = [](bool wings) {
    flightlog::FlightLog l;
    if (wings) l.wings.emplace();
    return l;
  };
  const auto refused = [&](const std::vector<bool>& wings) {
    std::vector<flightlog::FlightLog> logs;
    for (const bool w : wings) logs.push_back(log(w));
    return test::refusal([&] { check_same_streams(logs, {"r1", "r2", "t1", "t2"}, 2); });
  };
  EXPECT_EQ(refused({false, false, false, false}), "accepted");
  EXPECT_EQ(refused({true, false, false, true}), "accepted") << "a camera films some runs";
  EXPECT_EQ(refused({false, false, false, true}),
            "t2: has wings.csv, but no reference has it; accepted: both with the same streams, in some of the flights "
            "at least");
  EXPECT_EQ(refused({false, true, false, false}),
            "r2: has wings.csv, but no flight has it; accepted: both with the same streams, in some of the flights at "
            "least");
}

}  // namespace flappy::gap::diagnose_command_test
