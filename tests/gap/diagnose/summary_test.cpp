#include "gap/diagnose/summary.hpp"

#include <gtest/gtest.h>

namespace flappy::gap::summary_test {
namespace {

TEST(Summary, SaysWhatToDoInThirtyLines) {
  Diagnosis r;
  r.verdict = {VerdictKind::group, {"wind", "tether"}, false, 0.9};
  for (const char* e : {"wind", "tether", "body_drag", "added_mass", "battery_sag"}) {
    RankedHypothesis c;
    c.effects = {e};
    c.group = "group";
    c.probability = 0.2;
    for (int i = 0; i < 20; ++i) c.parameters.push_back({std::string(e) + ".x_m_s", 0.3, 0.1, 0.5, "m/s"});
    r.hypotheses.push_back(c);
  }
  for (int i = 0; i < 50; ++i) {
    r.locations.push_back({Fitted::refit,
                           i % 2 == 0 ? ResidualTest::regime : ResidualTest::phase,
                           "specific_force_x",
                           "m/s^2",
                           {"height", Regime::Third::low, {}, 1, "m"},
                           2,
                           1,
                           1e-3,
                           true});
    r.moved_parameters.emplace_back("torso.mass_kg", 1.5);
  }
  r.locations.push_back({Fitted::refit,
                         ResidualTest::frequency,
                         "angular_acceleration_x",
                         "rad/s^2",
                         {"frequency", Regime::Third::all, 0, 0.5, "Hz"},
                         2,
                         1,
                         1e-3,
                         true});
  r.sensors = {{"imu.latency_s", 3.6e-4, 3e-4, 4.2e-4, "s"},
               {"power_delay.delay_s", -1e-3, -1.2e-3, -8e-4, "s"},
               {"imu_mounting.y_rad", -0.02, -0.03, -0.01, "rad"}};
  for (int i = 0; i < 9; ++i) r.background.push_back({"spring_hardening.per_rad2", -0.02, -0.03, -0.01, "1/rad^2"});
  r.closed_loop = {{"flight", "mean_bias_V", 1, 0, 0.9}};
  r.next = NextExperiment{"dash", "", "", {"wind", "tether"}, 3, 0, 0.1, {}};
  r.closure = Closure{0.9, 0.8, 0.95};
  const auto all = [&] {
    std::string text;
    const std::vector<std::string> lines = summary_of(r, "/out");
    EXPECT_LE(lines.size() + 1, kSummaryLines) << "one more for the files";
    for (const std::string& l : lines) text += l + "\n";
    return text;
  };
  std::string text = all();
  EXPECT_TRUE(text.starts_with(
      "Missing in the model: one of wind or tether, which these flights cannot tell apart (together 0.90)\n"))
      << text;
  EXPECT_NE(text.find("wind.x_m_s"), std::string::npos);
  EXPECT_NE(text.find("height below 1 m"), std::string::npos);
  EXPECT_NE(text.find("0.3 (0.1 to 0.5) m/s\n"), std::string::npos);
  EXPECT_NE(text.find("runners-up: tether 0.2"), std::string::npos) << text;
  EXPECT_NE(text.find("not told from chance:\n  spring_hardening.per_rad2                 -0.02 (-0.03 to "),
            std::string::npos)
      << text;
  EXPECT_NE(
      text.find("the IMU's samples are 0.36 ms older (0.3 to 0.42)\n  those of currents are 1 ms younger (0.8 to 1.2)\n"
                "  the IMU is turned by 1.1 deg about -y (0.57 to 1.7)\n"),
      std::string::npos)
      << text;
  r.sensors = {{"forces_delay.delay_s", -2e-4, -3e-4, -1e-4, "s"}};
  EXPECT_NE(all().find("\n  the samples of forces.csv are 0.2 ms younger (0.1 to 0.3)\n"), std::string::npos);
  r.sensors = {{"imu_clock.rate", -4e-5, -5e-5, -3e-5, ""}};
  EXPECT_NE(all().find("\n  the clock of imu.csv is 40 ppm slow (30 to 50)\n"), std::string::npos);
  r.sensors = {{"command.delay_s", -2e-3, -3e-3, -1e-3, "s"}};  // of a beat-averaged vehicle
  EXPECT_NE(all().find("\n  the inputs act 2 ms earlier (1 to 3)\n"), std::string::npos);
  r.verdict = {VerdictKind::effect, {"wind"}, false, 0.3};
  EXPECT_NE(all().find("(probability 0.30, no more than a guess)"), std::string::npos);
  EXPECT_NE(all().find("flappy-train --adapt /out --init RUN; or fly on with /out/vehicle_corrected.toml\n"),
            std::string::npos);
  EXPECT_NE(all().find("to tell wind from tether, fly configs/gap/experiments/dash.toml ("), std::string::npos);
  r.next->manoeuvre = "swapped_wings";
  r.next->change = "swap the wings";
  EXPECT_NE(all().find("to tell wind from tether, swap the wings, then fly swapped_wings of "
                       "configs/gap/experiments/interventions.toml ("),
            std::string::npos);
  EXPECT_NE(all().find("mean_bias_V recorded 1, by the vehicle's file 0, by the corrected one 0.9"), std::string::npos);
  for (const auto& [kind, begin] : {std::pair{VerdictKind::none, "No gap beyond noise"},
                                    {VerdictKind::parameters, "Nothing is missing"},
                                    {VerdictKind::unknown, "Something is missing in the model that no effect"}}) {
    r.verdict = {kind, {}, false, 0.9};
    EXPECT_TRUE(all().starts_with(begin)) << all();
  }
  r.verdict.kind = VerdictKind::parameters;
  EXPECT_NE(all().find("next: train on what was found"), std::string::npos);
  r.reference = {"before"};
  EXPECT_NE(all().find("next: nothing to correct; more reference sessions"), std::string::npos);
  r.reference.clear();
  r.complete = false;
  EXPECT_TRUE(all().starts_with("Stopped before every effect was weighed")) << all();
  EXPECT_EQ(all().find("vehicle_corrected.toml"), std::string::npos);
  r.complete = true;
  r.verdict.kind = VerdictKind::data;
  r.faults = std::vector<flightlog::DataFault>(40, {"imu.csv", 7, "degrees"});
  EXPECT_NE(all().find("imu.csv:7: degrees"), std::string::npos);
}

}  // namespace
}  // namespace flappy::gap::summary_test
