#include "gap/result/diagnosis.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "gap/result/diagnosis_json.hpp"
#include "refusal.hpp"

namespace flappy::gap::diagnosis_result_test {
namespace {

TEST(Diagnosis, UnitsAreThoseOfTheNames) {
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
                                                           {"moment_x_kg_m", "kg m"},
                                                           {"stiffness_N_m", "N/m"},
                                                           {"gain_s2_m", "s^2/m"},
                                                           {"stribeck_rad_s", "rad/s"},
                                                           {"factor", ""},
                                                           {"side_gain", ""},
                                                           {"xy", ""},
                                                           {"damping_ratio", ""}};
  for (const auto& [name, unit] : kExpected) EXPECT_EQ(unit_of(name), unit) << name;
}

TEST(Diagnosis, SaysRegimesInWords) {
  using Third = Regime::Third;
  EXPECT_EQ(text_of({"height", Third::low, {}, 0.5, "m"}, ResidualTest::regime), "height below 0.5 m");
  EXPECT_EQ(text_of({"height", Third::middle, 0.50294, 0.60741, "m"}, ResidualTest::regime),
            "height 0.5029 to 0.6074 m");
  EXPECT_EQ(text_of({"split cycle", Third::high, -0.25, {}, ""}, ResidualTest::regime), "split cycle above -0.25");
  EXPECT_EQ(text_of({"harmonic", Third::all, 0, 0, ""}, ResidualTest::phase), "mean of the beat");
  EXPECT_EQ(text_of({"harmonic", Third::all, 2, 2, ""}, ResidualTest::phase), "harmonic 2 of the beat");
  EXPECT_EQ(text_of({"frequency", Third::all, 0, 0.5, "Hz"}, ResidualTest::frequency), "0 to 0.5 Hz");
  EXPECT_EQ(text_of({"block", Third::all, {}, 8, "beats"}, ResidualTest::whiteness), "means of 8 beats");
}

ResidualLocation location(Fitted fitted, ResidualTest test, double gap, bool discovered) {
  return {fitted, test, "specific_force_z", "m/s^2", {"height", Regime::Third::low, {}, 1, "m"}, gap,
          1,      0.01, discovered};
}

/// Something in every field.
Diagnosis whole() {
  Diagnosis d;
  d.flights = {"a", "b"};
  d.faults = {{"imu.csv", 3, "degrees"}};
  d.complete = false;
  d.verdict = {VerdictKind::group, {"wind", "tether"}, true, 0.7};
  d.hypotheses = {{HypothesisKind::effect,
                   {"wind"},
                   "world_force",
                   true,
                   0.4,
                   -12.5,
                   -2,
                   {{"wind.x_m_s", 0.3, 0.1, 0.5, "m/s"}},
                   0.55,
                   0.01,
                   Closure{0.9, 0.8, 0.95}},
                  {HypothesisKind::unknown, {}, "unknown", false, 0.1, -30, -1, {}, {}, 0, {}}};
  d.unexplained = {{"angular_acceleration_y", 2, "near ground", "height", 7, 21}};
  d.jointly_with = {"wind"};
  d.other_law = UnexplainedTerm{"specific_force_x", 0, "cos heading", "heading", 4, 3};
  d.background = {{"body_drag.area_m2", 1e-4, 0, 2e-4, "m^2"}};
  d.sensors = {{"imu_clock.rate", 4e-5, 3e-5, 5e-5, ""}};
  d.moved_parameters = {{"torso.mass_kg", -1.5}};
  d.ladder = {{"drive and hinges", 12.5, 3, {}, 0.75}, {"air", {}, {}, {}, 0}};
  d.locations = {location(Fitted::nominal, ResidualTest::channel, 3, false),
                 {Fitted::refit,
                  ResidualTest::phase,
                  "specific_force_x",
                  "m/s^2",
                  {"harmonic", Regime::Third::all, 2, 2, ""},
                  2,
                  1,
                  0.2,
                  true}};
  d.nominal_loss = 2, d.refit_loss = 1;
  d.noise_floor = 0.4;
  d.closure = Closure{0.5, 0.4, 0.6};
  d.untestable = {"added_mass"};
  d.validation = Validation{{{"file", {{"specific_force_x", 1, 0.9, 1.1, 1.2}}}},
                            {{"wind", "specific_force_x", 0.2, 0.01}},
                            {{"wind.x_m_s", {0.2, 0.4}, {0.1, 0.1}, 0.3}}};
  d.closed_loop = {{"a", "mean_bias_V", 1, NAN, 0.9}};
  d.next = NextExperiment{"dash", "swap the wings", "time", {"wind", "tether"}, 3, 0.2, 0.1, {{"x_m", {0, 1}, {0, 2}}}};
  return d;
}

// Written, read and written again: nothing is lost on the way.
TEST(DiagnosisJson, ReadsWhatItWrites) {
  for (const Diagnosis& d : {whole(), Diagnosis()}) {
    const nlohmann::ordered_json json = to_json(d);
    const Diagnosis again = diagnosis_from(nlohmann::ordered_json::parse(json.dump()), "diagnosis.json");
    EXPECT_EQ(to_json(again).dump(1), json.dump(1));
  }
  const Diagnosis d = diagnosis_from(to_json(whole()), "");
  EXPECT_EQ(d.locations[1].regime.low, 2);
  EXPECT_EQ(d.locations[0].regime.third, Regime::Third::low);
  EXPECT_EQ(d.hypotheses[0].parameters[0].name, "wind.x_m_s");
  EXPECT_FALSE(d.effect_loss);
  EXPECT_TRUE(std::isnan(d.closed_loop[0].nominal));
}

TEST(DiagnosisJson, RefusesWhatIsNone) {
  const auto refusal = [](nlohmann::ordered_json json) {
    return test::refusal([&] { diagnosis_from(json, "DIR/diagnosis.json"); });
  };
  nlohmann::ordered_json json = to_json(whole());
  json["schema"] = 1;
  EXPECT_TRUE(refusal(json).starts_with("DIR/diagnosis.json: schema 1 is read by ")) << refusal(json);
  json = to_json(whole());
  json.erase("hypotheses");
  EXPECT_EQ(refusal(json), "DIR/diagnosis.json: key 'hypotheses' not found; accepted: what flappy-gap diagnose wrote");
  json = to_json(whole());
  json["verdict"]["kind"] = "guess";
  EXPECT_NE(refusal(json).find("unknown value \"guess\""), std::string::npos) << refusal(json);
  json = to_json(whole());
  json["locations"][0]["regime"]["third"] = "upper";
  EXPECT_NE(refusal(json).find("unknown third \"upper\""), std::string::npos) << refusal(json);
  json = to_json(whole());
  json["validation"]["ladder"] = nlohmann::ordered_json::array();
  EXPECT_NE(refusal(json).find("\"ladder\" of validation is empty"), std::string::npos) << refusal(json);
  json = to_json(whole());
  json["validation"]["agreements"][0]["value"] = nlohmann::ordered_json::array();
  EXPECT_NE(refusal(json).find("\"value\" of an agreement is empty"), std::string::npos) << refusal(json);
}

TEST(Diagnosis, ListsTheLargestDiscoveries) {
  Diagnosis d;
  for (int i = 0; i < 30; ++i)
    d.locations.push_back(location(i < 2 ? Fitted::effect : Fitted::refit,
                                   i == 2 ? ResidualTest::input : ResidualTest::regime, i, i != 29));
  const std::vector<ResidualLocation> largest = largest_discoveries(d, Fitted::refit, 20);
  ASSERT_EQ(largest.size(), 20u);
  EXPECT_EQ(largest[0].gap, 28) << "what is no discovery does not count";
  EXPECT_EQ(largest[19].gap, 9);
  EXPECT_EQ(largest_discoveries(d, Fitted::refit, 100).size(), 26u) << "inputs do not say where";
  EXPECT_TRUE(largest_discoveries(d, Fitted::nominal, 5).empty());
}

}  // namespace
}  // namespace flappy::gap::diagnosis_result_test
