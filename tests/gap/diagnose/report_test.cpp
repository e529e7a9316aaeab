// What a diagnosis reports, and that it reads no truth.
#include "gap/diagnose/report.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "full.hpp"
#include "gap/diagnose/diagnose_command.hpp"
#include "gap/diagnose/summary.hpp"
#include "io/config.hpp"
#include "io/progress.hpp"
#include "model/effects/registry.hpp"
#include "refusal.hpp"
#include "rollout/fly.hpp"
#include "rollout/fly_fixture.hpp"
#include "vehicles.hpp"

namespace flappy::gap {
namespace {

const std::string kConfigs = FLAPPY_SOURCE_DIR "/configs/";

ScoredHypothesis hypothesis(double probability, std::vector<std::string> effects) {
  ScoredHypothesis a;
  a.kind = ScoredHypothesis::Kind::effect;
  a.effects = std::move(effects);
  a.probability = probability;
  return a;
}

ScoredHypothesis hypothesis(double probability, ScoredHypothesis::Kind kind) {
  ScoredHypothesis a;
  a.kind = kind;
  a.probability = probability;
  return a;
}

// ---- verdict

Conclusion conclude(const std::vector<ScoredHypothesis>& hypotheses) {
  return gap::conclude(hypotheses, read_verdict_rule());
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
  rule.doubt = {2, 4};
  std::vector<ScoredHypothesis> all = {weighed(-1000, 0.2, hypothesis(0, ScoredHypothesis::Kind::parameters)),
                                       weighed(-980, 0.2, hypothesis(0, ScoredHypothesis::Kind::unknown)),
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
  EXPECT_EQ(all[2].kind, ScoredHypothesis::Kind::unknown);
  EXPECT_NEAR(all[2].probability, share(0.2, 106) / sum, 1e-12);
  EXPECT_NEAR(all[3].probability, share(0.2, 116) / sum, 1e-12);
  EXPECT_NEAR(all[4].probability, share(0.1, 86) / sum, 1e-12);
  // what loses against the parameters has lost all of it
  all = {weighed(-1000, 0.5, hypothesis(0, ScoredHypothesis::Kind::parameters)),
         weighed(-1004, 0.5, hypothesis(0, {"wind"}))};
  set_probabilities(all, rule);
  EXPECT_NEAR(all[1].probability, 0.25 / 1.25, 1e-12);
}

TEST(Verdict, NamesTheLargestMass) {
  const Conclusion c =
      conclude({hypothesis(0.6, {"wind"}), hypothesis(0.3, ScoredHypothesis::Kind::parameters),
                hypothesis(0.06, ScoredHypothesis::Kind::none), hypothesis(0.04, ScoredHypothesis::Kind::unknown)});
  EXPECT_EQ(c.kind, Conclusion::Kind::effect);
  EXPECT_EQ(c.effects, std::vector<std::string>{"wind"});
  EXPECT_EQ(c.probability, 0.6);
  EXPECT_EQ(c.hypothesis, 0u);
  EXPECT_EQ(conclude({hypothesis(0.4, {"wind"}), hypothesis(0.6, ScoredHypothesis::Kind::none)}).kind,
            Conclusion::Kind::none);
  EXPECT_EQ(conclude({hypothesis(0.4, {"wind"}), hypothesis(0.6, ScoredHypothesis::Kind::unknown)}).kind,
            Conclusion::Kind::unknown);
  EXPECT_EQ(conclude({hypothesis(0.4, {"wind"}), hypothesis(0.6, ScoredHypothesis::Kind::parameters)}).hypothesis, 1u);
}

TEST(Verdict, PoolsRivals) {
  // together they outweigh the parameters, and neither is clear
  const Conclusion c =
      conclude({hypothesis(0.4, ScoredHypothesis::Kind::parameters), hypothesis(0.3, {"rotational_lift"}),
                hypothesis(0.25, {"wake_capture"}), hypothesis(0.05, ScoredHypothesis::Kind::none)});
  EXPECT_EQ(c.kind, Conclusion::Kind::group);
  EXPECT_EQ(c.effects, (std::vector<std::string>{"rotational_lift", "wake_capture"}));
  EXPECT_DOUBLE_EQ(c.probability, 0.55);
  EXPECT_EQ(c.hypothesis, 1u);
  // effects without a group are no rivals of each other
  EXPECT_EQ(conclude({hypothesis(0.4, ScoredHypothesis::Kind::parameters), hypothesis(0.3, {"body_drag"}),
                      hypothesis(0.3, {"clap_and_fling"})})
                .kind,
            Conclusion::Kind::parameters);
}

TEST(Verdict, NamesAMemberThatIsClear) {
  // half of everything
  Conclusion c = conclude({hypothesis(0.51, {"rotational_lift"}), hypothesis(0.49, {"wake_capture"})});
  EXPECT_EQ(c.kind, Conclusion::Kind::effect);
  EXPECT_EQ(c.probability, 0.51);
  // four fifths of its pool
  c = conclude({hypothesis(0.41, {"rotational_lift"}), hypothesis(0.09, {"wake_capture"}),
                hypothesis(0.3, {"body_drag"}), hypothesis(0.2, {"clap_and_fling"})});
  EXPECT_EQ(c.kind, Conclusion::Kind::effect);
  EXPECT_EQ(c.effects, std::vector<std::string>{"rotational_lift"});
  // what holds less than a twentieth of a pool is no member
  c = conclude({hypothesis(0.3, {"ground_effect"}), hypothesis(0.28, {"battery_sag"}),
                hypothesis(0.02, {"ceiling_effect"}), hypothesis(0.4, ScoredHypothesis::Kind::none)});
  EXPECT_EQ(c.effects, (std::vector<std::string>{"ground_effect", "battery_sag"}));
}

TEST(Verdict, PoolsSetsByTheGroupsOfTheirEffects) {
  EXPECT_EQ(pool_name({"wind", "body_drag"}), pool_name({"body_drag", "tether"}));
  EXPECT_NE(pool_name({"wind"}), pool_name({"wind", "tether"}));
  const Conclusion c = conclude(
      {hypothesis(0.3, {"wind", "body_drag"}), hypothesis(0.28, {"body_drag", "tether"}), hypothesis(0.42, {"wind"})});
  EXPECT_EQ(c.kind, Conclusion::Kind::group);
  EXPECT_EQ(c.effects, (std::vector<std::string>{"wind", "body_drag", "tether"}));
}

// Of coordinates with sd 0.2 and covariance 0.01: 1.4 times as wide, and a size of 2 by a tenth of itself besides.
TEST(Verdict, WidensSizesAndShapes) {
  const auto uncertain =
      sim::read_randomisation(test::nominal(), io::Config::load(test::source_path("configs/gap/priors.toml")).root());
  const Hypothesis h(uncertain, {"ground_effect"});  // one size, one shape
  Fit fit;
  fit.point.directions = Fitter::axes(h);
  fit.point.at = h.start();
  fit.posterior.mean = Eigen::VectorXd::Zero(h.size());
  const Eigen::Index size = h.shared(), shape = size + 1;
  ASSERT_EQ(h.size(), shape + 1);
  fit.posterior.mean[size] = 2;
  fit.posterior.covariance = 0.04 * Eigen::MatrixXd::Identity(h.size(), h.size());
  fit.posterior.covariance(size, shape) = fit.posterior.covariance(shape, size) = 0.01;
  widen(fit, h, read_verdict_rule());
  EXPECT_NEAR(fit.covariance()(size, size), 1.96 * 0.04 + 0.04, 1e-12);
  EXPECT_NEAR(fit.covariance()(shape, shape), 1.96 * 0.04, 1e-12);
  EXPECT_NEAR(fit.covariance()(size, shape), 1.96 * 0.01, 1e-12);
  EXPECT_NEAR(fit.covariance()(0, 0), 0.04, 1e-12) << "parameters stay";
  ScoredHypothesis a = hypothesis(1, {"ground_effect"});
  a.fit = fit;
  const SizeEstimate gain = sizes_of(a, uncertain)[0];  // 90 % of the prior up to 0.45
  EXPECT_NEAR(gain.value, 2 * 0.45 / 1.645, 1e-12);
  EXPECT_NEAR(gain.high - gain.low, 2 * 0.45 * std::sqrt(0.1184), 1e-12);
}

// ---- what is written

// What was concluded is flown as the fit that explains most of it, with all that this one has in force.
TEST(Verdict, FliesABackgroundBesideItsEffects) {
  Diagnosis d;
  d.hypotheses = {hypothesis(0.5, ScoredHypothesis::Kind::parameters), hypothesis(0.2, {"wind", "tether"}),
                  hypothesis(0.2, {"wind", "tether"}), hypothesis(0.1, {"wind"})};
  d.hypotheses[1].terms.emplace_back();
  for (std::size_t i = 1; i < 4; ++i) d.hypotheses[i].fit.point.residual.emplace_back();
  EXPECT_EQ(&flown(d), &d.hypotheses[0]);
  d.hypotheses[0].flown_with = {"wind", "tether"};
  EXPECT_EQ(&flown(d), &d.hypotheses[2]) << "the one with something more is another";
  d.conclusion.hypothesis = 3;
  d.hypotheses[3].flown_with = {"wind", "tether"};
  EXPECT_EQ(&flown(d), &d.hypotheses[2]);
}

// What chance forbids to name is flown where it explains more than what was concluded.
TEST(Verdict, FliesWhatExplainsMost) {
  const auto concluded_of = [](std::size_t concluded) {
    Diagnosis d;
    d.hypotheses = {hypothesis(0.5, ScoredHypothesis::Kind::parameters), hypothesis(0.2, {"wind"}),
                    hypothesis(0.2, {"wind", "tether"}), hypothesis(0.05, {"gyro_bias"}),
                    hypothesis(0.05, ScoredHypothesis::Kind::none)};
    const double nats[] = {-10, -8, -9, -7, -20};
    for (std::size_t i = 0; i < 5; ++i) d.hypotheses[i].log_evidence = nats[i];
    for (const std::size_t i : {1, 2}) d.hypotheses[i].fit.point.residual.emplace_back();
    d.conclusion.hypothesis = concluded;
    fly_the_likeliest(d.hypotheses, d.conclusion);
    return d.hypotheses[concluded].flown_with;
  };
  using Names = std::vector<std::string>;
  EXPECT_EQ(concluded_of(0), Names{"wind"}) << "gyro_bias was not fitted";
  EXPECT_EQ(concluded_of(1), Names{}) << "more effects explain less";
  EXPECT_EQ(concluded_of(2), Names{}) << "what was named stays";
  EXPECT_EQ(concluded_of(4), Names{}) << "no gap";
}

TEST(Report, UnitsAreThoseOfTheNames) {
  const std::pair<const char*, const char*> kExpected[] = {{"x_m", "m"},
                                                           {"delay_s", "s"},
                                                           {"dead_V", "V"},
                                                           {"rise_K_W", "K/W"},
                                                           {"fade_V_C", "V/C"},
                                                           {"source_ohm", "ohm"},
                                                           {"per_rad2", "1/rad^2"},
                                                           {"compliance_rad_Nm", "rad/Nm"},
                                                           {"x_m_s", "m/s"},
                                                           {"twist_rad_N", "rad/N"},
                                                           {"drag_area_m2", "m^2"},
                                                           {"line_kg_m", "kg/m"},
                                                           {"stiffness_N_m", "N/m"},
                                                           {"gain_s2_m", "s^2/m"},
                                                           {"stribeck_rad_s", "rad/s"},
                                                           {"factor", ""},
                                                           {"side_gain", ""},
                                                           {"xy", ""},
                                                           {"damping_ratio", ""}};
  for (const auto& [name, unit] : kExpected) EXPECT_EQ(unit_of(name), unit) << name;
}

TEST(Report, SaysWhatToDoInThirtyLines) {
  Report r;
  r.conclusion = {Conclusion::Kind::group, {"wind", "tether"}, 0.9, 0};
  for (const char* e : {"wind", "tether", "body_drag", "added_mass", "battery_sag"}) {
    Reported c;
    c.effects = {e};
    c.group = pool_name(c.effects);
    c.probability = 0.2;
    for (int i = 0; i < 20; ++i) c.sizes.push_back({std::string(e) + ".x_m_s", 0.3, 0.1, 0.5, "m/s"});
    r.candidates.push_back(c);
  }
  for (int i = 0; i < 50; ++i) {
    r.places.push_back({"refit", i % 2 == 0 ? "regime" : "phase", i % kChannels, "somewhere", 2, 1, 1e-3, true});
    r.moved.push_back({"torso.mass_kg", 1.5});
  }
  r.places.push_back({"refit", "frequency", 0, "0 to 0.5 Hz", 2, 1, 1e-3, true});
  r.sensors = {{"imu.latency_s", 3.6e-4, 3e-4, 4.2e-4, "s"},
               {"power_delay.delay_s", -1e-3, -1.2e-3, -8e-4, "s"},
               {"imu_mounting.y_rad", -0.02, -0.03, -0.01, "rad"}};
  for (int i = 0; i < 9; ++i) r.background.push_back({"spring_hardening.per_rad2", -0.02, -0.03, -0.01, "1/rad^2"});
  r.closed_loop = {{"flight", "mean_bias_V", 1, 0, 0.9}};
  r.next = NextExperiment{"dash", {"wind", "tether"}, 3};
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
  r.sensors = {{"imu_clock.rate", -4e-5, -5e-5, -3e-5, ""}};
  EXPECT_NE(all().find("\n  the clock of imu.csv is 40 ppm slow (30 to 50)\n"), std::string::npos);
  r.conclusion = {Conclusion::Kind::effect, {"wind"}, 0.3, 0};
  EXPECT_NE(all().find("(probability 0.30, no more than a guess)"), std::string::npos);
  EXPECT_NE(all().find("--set vehicle=/out/vehicle_corrected.toml"), std::string::npos);
  EXPECT_NE(all().find("wind and tether differ most in configs/gap/experiments/dash.toml"), std::string::npos);
  EXPECT_NE(all().find("mean_bias_V recorded 1, by the vehicle's file 0, by the corrected one 0.9"), std::string::npos);
  for (const auto& [kind, begin] : {std::pair{Conclusion::Kind::none, "No gap beyond noise"},
                                    {Conclusion::Kind::parameters, "Nothing is missing"},
                                    {Conclusion::Kind::unknown, "Something is missing in the model that no entry"}}) {
    r.conclusion = {kind, {}, 0.9, 0};
    EXPECT_TRUE(all().starts_with(begin)) << all();
  }
  r.complete = false;
  EXPECT_TRUE(all().starts_with("Stopped before every effect was weighed")) << all();
  EXPECT_EQ(all().find("vehicle_corrected.toml"), std::string::npos);
  r.complete = true;
  r.conclusion.kind = Conclusion::Kind::data;
  r.faults = std::vector<flightlog::DataFault>(40, {"imu.csv", 7, "degrees"});
  EXPECT_NE(all().find("imu.csv:7: degrees"), std::string::npos);
}

TEST(Report, JsonTellsNoGapByNull) {
  Report r;
  r.flights = {"a"};
  r.faults = {{"imu.csv", 3, "degrees"}};
  r.conclusion = {Conclusion::Kind::data, {}, 1, 0};
  r.refit = 0.6;
  Reported c;
  c.effects = {"wind"};
  c.group = "world_force";
  c.sizes = {{"wind.x_m_s", 0.3, 0.1, 0.5, "m/s"}};
  r.candidates = {c};
  for (int i = 0; i < 30; ++i)
    r.places.push_back({i < 2 ? "effect" : "refit", i == 2 ? "input" : "regime", kForceZ, "height below 1 m",
                        static_cast<double>(i), 1, 0.01, i != 29});
  nlohmann::ordered_json j = diagnosis_json(r);
  EXPECT_EQ(j["data_faults"].dump(), R"([{"file":"imu.csv","line":3,"what":"degrees"}])");
  EXPECT_EQ(j["verdict"].dump(), R"({"kind":"data","effects":[],"remainder":false,"probability":1.0})");
  EXPECT_EQ(
      j["candidates"].dump(),
      R"([{"effects":["wind"],"group":"world_force","remainder":false,"probability":0.0,"log_evidence":0.0,"parameters":{"wind.x_m_s":{"value":0.3,"low":0.1,"high":0.5,"unit":"m/s"}},"closure":null}])");
  EXPECT_TRUE(j["gap"]["nominal"].is_null());
  EXPECT_EQ(j["gap"]["refit"], 0.6);
  EXPECT_TRUE(j["gap"]["closure_low"].is_null());
  ASSERT_EQ(j["where"].size(), 20u);
  EXPECT_EQ(j["where"][0].dump(),
            R"({"channel":"force_z","regime":"height below 1 m","gap":28.0,"noise_floor":1.0,"p_value":0.01})");
  r.closure = Closure{0.9, 0.8, 0.95};
  r.candidates[0].closure = r.closure;
  j = diagnosis_json(r);
  EXPECT_EQ(j["gap"]["closure_high"], 0.95);
  EXPECT_EQ(j["candidates"][0]["closure"], 0.9);
}

std::string contents(const std::filesystem::path& path) { return io::read_text(path); }

/// `kind` and numbers of the types that the schema has.
void expect_schema(const nlohmann::ordered_json& j) {
  std::vector<std::string> keys;
  for (const auto& [key, value] : j.items()) keys.push_back(key);
  EXPECT_EQ(keys, (std::vector<std::string>{"schema", "flights", "data_faults", "verdict", "background", "sensors",
                                            "where", "candidates", "otherwise", "unexplained", "gap", "closed_loop",
                                            "next_experiment"}));
  double sum = 0;
  for (const auto& c : j["candidates"]) {
    sum += c["probability"].get<double>();
    for (const auto& [name, p] : c["parameters"].items()) {
      EXPECT_LE(p["low"], p["value"]) << name;
      EXPECT_GE(p["high"], p["value"]) << name;
      EXPECT_TRUE(p["unit"].is_string());
    }
  }
  EXPECT_NEAR(sum, 1, 1e-12);
  EXPECT_GT(j["gap"]["nominal"].get<double>(), j["gap"]["refit"].get<double>());
  EXPECT_LE(j["where"].size(), 20u);
}

TEST(RunDiagnose, ReadsNoTruth) {
  if (!test::full()) GTEST_SKIP() << "takes seconds: with --full";
  const flight::Folder folder;
  rollout::FlyOptions options;
  options.log_folder = folder / "flight";
  rollout::fly(rollout::read_fly_config(kConfigs + "fly/identify_multisine.toml",
                                        {"vehicle=../vehicles/hummingbird_identified.toml", "flight.duration_s=4"}),
               options);
  DiagnoseCommand command;
  command.vehicle = kConfigs + "vehicles/hummingbird_nominal.toml";
  command.priors = kConfigs + "gap/priors.toml";
  command.flights = {options.log_folder.string()};
  command.out = folder / "out";
  for (const model::EffectEntry& e : model::effects())
    if (std::string(e.info.id) != "clap_and_fling") command.withheld.push_back(e.info.id);
  const std::filesystem::path truth = options.log_folder / "truth.csv";
  const std::string honest = contents(truth);
  const auto result = [&] {
    std::string bytes = run_diagnose(command).dump();
    for (const char* file : {"diagnosis.json", "vehicle_corrected.toml", "residuals.csv", "candidates.csv"})
      bytes += contents(folder / "out" / file);
    return bytes;
  };
  const std::string with_truth = result();
  // the identified one flew: believed 0, flew 0.04 rad, and by so little off is the middle of the stroke seen
  const model::Vehicle fixed = model::read_vehicle(folder / "out/vehicle_corrected.toml"), flew = test::identified();
  EXPECT_NEAR(fixed.left.spring.rest_angle_rad, flew.left.spring.rest_angle_rad, 0.02);
  EXPECT_NEAR(fixed.right.spring.rest_angle_rad, flew.right.spring.rest_angle_rad, 0.02);
  EXPECT_TRUE(fixed.posterior);
  expect_schema(nlohmann::ordered_json::parse(contents(folder / "out/diagnosis.json")));
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

// Where `run_diagnose` complains before it reads a flight; of the vehicle with the place in its file.
TEST(RunDiagnose, RefusesWhatItCannotAnswer) {
  const flight::Folder folder;
  DiagnoseCommand command;
  command.vehicle = kConfigs + "vehicles/hummingbird_nominal.toml";
  command.priors = kConfigs + "gap/priors.toml";
  command.flights = {(folder / "").string(), (folder / ".").string()};
  const auto refusal = [&] { return test::refusal([&] { run_diagnose(command); }); };
  EXPECT_EQ(refusal(), command.flights[1] + ": is given twice; accepted: each flight once");
  command.flights.pop_back();
  const std::string nominal = contents(command.vehicle);
  command.vehicle = (folder / "v.toml").string();
  const auto with = [&](const std::string& text) { std::ofstream(command.vehicle) << text; };
  with(nominal + "\n[effects.wind]\nx_m_s = 0.1\n");
  EXPECT_TRUE(refusal().ends_with(
      ": effects: what is missing is asked of the vehicle as it was believed; accepted: a vehicle without effects"))
      << refusal();
  EXPECT_TRUE(refusal().starts_with(command.vehicle + ":")) << refusal();
  std::string fast = nominal;
  with(fast.replace(fast.find("hold_s = 1e-3"), 13, "hold_s = 5e-5"));
  EXPECT_TRUE(
      refusal().ends_with(": driver.hold_s: physics goes by steps of 1e-04 s here; accepted: a multiple of that"))
      << refusal();
}

// Of the files of constants every key is asked for, and none is let pass that nobody asks for.
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
  const std::string rule = contents(kConfigs + "gap/verdict.toml");
  EXPECT_EQ(verdict(rule), "accepted");
  EXPECT_NE(verdict("priors = 1\n" + rule).find(path + ":1:1: priors: "), std::string::npos)
      << verdict("priors = 1\n" + rule);
  EXPECT_NE(verdict(with(rule, "none = 0.1", "none = 0.2")).find("do not add up to 1"), std::string::npos);
  EXPECT_NE(verdict(with(rule, "freedom = ", "free = ")).find("doubt.freedom"), std::string::npos);
  EXPECT_NE(verdict(with(rule, "\"gyro_bias\"", "\"gyro_bais\"")).find("no effect \"gyro_bais\""), std::string::npos);
  const std::string model = contents(kConfigs + "gap/model_discrepancy.toml");
  EXPECT_EQ(discrepancy(model), "accepted");
  EXPECT_NE(discrepancy(with(model, "\"added_mass\"", "\"added_masses\"")).find("no effect \"added_masses\""),
            std::string::npos);
  EXPECT_NE(discrepancy(with(model, "body_drag = ", "body_dragg = ")).find("background_sd.body_dragg"),
            std::string::npos);
  EXPECT_NE(discrepancy(with(model, "block_freedom = ", "block_freedoms = ")).find("spread.block_freedom"),
            std::string::npos);
  EXPECT_NE(discrepancy(with(model, "[share.path_x]", "[share.paths_x]")).find("share.path_x"), std::string::npos);
  // and is written as it is read
  const std::string again = discrepancy_text(read_model_discrepancy(), "somebody");
  EXPECT_EQ(discrepancy(again), "accepted");
  EXPECT_EQ(discrepancy_text(read_model_discrepancy(path), "somebody"), again);
}

}  // namespace
}  // namespace flappy::gap
