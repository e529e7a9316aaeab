// What is recognised, what its page says, and what is refused.
#include "view/compose.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "flappy/vehicle_file.hpp"
#include "flightlog/flight_log.hpp"
#include "io/files.hpp"
#include "io/temporary_folder.hpp"
#include "refusal.hpp"
#include "view/results.hpp"
#include "view/sections.hpp"

namespace flappy::view {
namespace {

namespace fs = std::filesystem;
using test::refusal;

const fs::path kData = FLAPPY_SOURCE_DIR "/tests/data/report";

/// A second of hover with wings that beat.
flightlog::FlightLog hover() {
  flightlog::FlightLog log;
  flightlog::FlightHeader& h = log.header;
  h.vehicle = "hummingbird_nominal.toml";
  h.flapping_Hz = 34;
  h.mocap = {200, 0.01, 1e-4, 2e-3};
  h.imu = {500, 1e-3, 200, {0, 0, 0}, 0.01, {0, 0, 0}, 0.3};
  for (int i = 0; i < 1000; ++i) {
    const double t = 1e-3 * i, v = 9.5 * std::cos(2 * M_PI * 34 * t);
    log.command.t_s.push_back(t);
    log.command.left_voltage_V.push_back(v);
    log.command.right_voltage_V.push_back(v);
    if (i % 5 == 0) {
      flightlog::MocapStream& m = log.mocap;
      m.t_s.push_back(t);
      m.x_m.push_back(0.1 * t), m.y_m.push_back(0), m.z_m.push_back(0.5);
      m.qw.push_back(1), m.qx.push_back(0), m.qy.push_back(0), m.qz.push_back(0);
    }
    if (i % 2 == 0) {
      flightlog::ImuStream& u = log.imu;
      u.t_s.push_back(t);
      for (flightlog::Column* c : {&u.gyro_x_rad_s, &u.gyro_y_rad_s, &u.gyro_z_rad_s, &u.accel_x_m_s2, &u.accel_y_m_s2})
        c->push_back(0);
      u.accel_z_m_s2.push_back(9.81);
    }
  }
  return log;
}

/// All cells of tables that say where in the results they stand are those results.
void expect_cells_of(const Section& section, const Json& results, std::size_t least) {
  std::size_t cells = 0;
  const Json shown_section = section.json();
  for (const Json& block : shown_section.at("blocks"))
    if (block.at("kind") == "table")
      for (const Json& row : block.at("rows"))
        for (const Json& c : row)
          if (c.is_object() && c.contains("at")) {
            const Json& there = results.at(Json::json_pointer(c.at("at").get<std::string>()));
            const std::string shown = c.at("text");
            ++cells;
            if (there.is_null()) EXPECT_EQ(shown, "–") << c;
            else EXPECT_NEAR(std::stod(shown), there.get<double>(), 0.006 * std::abs(there.get<double>())) << c;
          }
  EXPECT_GE(cells, least);
}

TEST(Recognised, IsWhatItHolds) {
  const io::TemporaryFolder folder;
  flightlog::write_flight_log(folder.path() / "flight", hover());
  EXPECT_EQ(recognised(folder.path() / "flight"), Kind::flight);
  EXPECT_EQ(recognised(kData / "diagnosis"), Kind::diagnosis);
  EXPECT_EQ(recognised(kData / "diagnosis/diagnosis.json"), Kind::diagnosis);
  EXPECT_EQ(recognised(kData / "evaluation.json"), Kind::evaluation);
  EXPECT_EQ(recognised(kData / "effects.json"), Kind::evaluation);
  EXPECT_EQ(recognised(kData / "fit.json"), Kind::identification);
  EXPECT_EQ(recognised(kData / "score.csv"), Kind::benchmark);
  fs::create_directories(folder.path() / "runs/seed_0");
  io::write_atomically(folder.path() / "runs/seed_0/run.json", "{}");
  EXPECT_EQ(recognised(folder.path() / "runs/seed_0"), Kind::run);
  EXPECT_EQ(recognised(folder.path() / "runs"), Kind::run);
}

TEST(Recognised, RefusesTheRestInOneLine) {
  const io::TemporaryFolder folder;
  const auto line = [&](const std::string& name, const std::string& text) {
    const fs::path file = folder.path() / name;
    if (!text.empty()) io::write_atomically(file, text);
    std::string told = refusal([&] { recognised(file); });
    const std::string accepted = "; accepted: a flight log or a folder of them, a run folder";
    if (const std::size_t at = told.find(accepted); at != std::string::npos) told = told.substr(0, at);
    EXPECT_EQ(told.find('\n'), std::string::npos);
    return told.substr(folder.path().string().size() + 1);
  };
  EXPECT_EQ(line("none", ""), "none: there is no such file or folder");
  EXPECT_EQ(line("broken.json", "{\"a\": 1,\n \"b\" 2}"),
            "broken.json:2:6: is no JSON; accepted: results of a program, as --json wrote them");
  EXPECT_EQ(line("other.json", "[1]"), "other.json: is JSON of something else");
  EXPECT_EQ(line("notes.txt", "x"), "notes.txt: is no result");
  EXPECT_EQ(line("table.csv", "a,b\n"), "table.csv: is no result");
  fs::create_directories(folder.path() / "empty");
  EXPECT_EQ(line("empty", ""), "empty: is no folder of results");
  fs::create_directories(folder.path() / "bench");
  EXPECT_EQ(line("bench/manifest.json", "{}"), "bench/manifest.json: is JSON of something else");
  EXPECT_EQ(line("bench", ""), "bench: is a blind benchmark that is not scored yet");
}

TEST(Composed, RefusesWhatDoesNotFit) {
  const io::TemporaryFolder folder;
  const fs::path diagnosis = kData / "diagnosis";
  Packing packing;
  EXPECT_EQ(refusal([&] {
              composed({diagnosis, diagnosis / "../diagnosis"}, {}, packing);
            }),
            (diagnosis / "../diagnosis").string() + ": is given twice; accepted: each path once");
  EXPECT_EQ(refusal([&] {
              FlightOptions options;
              options.goal_m = {0, 0, 0};
              composed({diagnosis}, options, packing);
            }),
            "--goal and --vehicle describe flights, and no flight is given; accepted: a flight log, too");
  io::write_atomically(folder.path() / "half.json",
                       R"({"schema": 3, "verdict": {}, "hypotheses": [], "locations": []})");
  EXPECT_EQ(
      refusal([&] { composed({folder.path() / "half.json"}, {}, packing); }),
      (folder.path() / "half.json").string() + ": key 'flights' not found; accepted: what flappy-gap diagnose wrote");
  std::vector<fs::path> many;
  for (int i = 0; i < 9; ++i) {
    many.push_back(folder.path() / ("f" + std::to_string(i)));
    flightlog::write_flight_log(many.back(), hover());
  }
  EXPECT_EQ(refusal([&] { composed(many, {}, packing); }), "9 flights are more than one page shows; accepted: up to 8");
  const Section first = composed({folder.path()}, {}, packing)[0];
  EXPECT_EQ(first.title(), "Flights f0, f1, f2, f3, f4, f5, f6, f7");
  EXPECT_EQ(first.json().at("blocks").back().at("text"),
            "Of 9 flights in " + folder.path().string() + " the first 8 are shown. ");
}

TEST(Composed, PutsFlightsOnOnePage) {
  const io::TemporaryFolder folder;
  for (const char* name : {"logs/a", "logs/b"}) flightlog::write_flight_log(folder.path() / name, hover());
  Packing packing;
  const std::vector<Section> sections =
      composed({kData / "evaluation.json", folder.path() / "logs", kData / "diagnosis"}, {}, packing);
  ASSERT_EQ(sections.size(), 3u);
  EXPECT_EQ(sections[0].kind(), "evaluation");
  EXPECT_EQ(sections[1].title(), "Flights a, b");
  EXPECT_EQ(sections[2].kind(), "diagnosis");
}

TEST(FlightSection, HasTheStreamsTheVehicleAndTheGoal) {
  const io::TemporaryFolder folder;
  flightlog::FlightLog log = hover();
  flightlog::write_flight_log(folder.path() / "flight", log);
  FlightOptions options;
  options.goal_m = {1, 2, 3};
  Packing packing;
  const Json block = flight_section({folder.path() / "flight"}, options, packing).json().at("blocks")[0];
  EXPECT_EQ(block.at("goal_m").dump(), "[1.0,2.0,3.0]");
  const Json& f = block.at("flights")[0];
  EXPECT_EQ(f.at("vehicle").at("name"), "hummingbird_nominal");
  EXPECT_EQ(f.at("vehicle").at("left").at("outline_m").back()[0], 0.07);
  EXPECT_NEAR(f.at("vehicle").at("mass_kg").get<double>(), 0.0124481, 1e-7);  // torso, two leading edges, two wings
  EXPECT_EQ(f.at("latency_s").dump(), R"({"mocap":0.01,"imu":0.001})");
  EXPECT_EQ(f.at("streams").at("mocap").at("x_m").at("count"), log.mocap.x_m.size());
  EXPECT_EQ(f.at("streams").at("command").at("t_s").at("count"), 1000);
  EXPECT_EQ(f.at("wings"), "derived");
  EXPECT_EQ(f.at("streams").at("wings").at("left_stroke_rad").at("count"), 499);
  EXPECT_TRUE(f.at("notes").empty());
}

TEST(FlightSection, HasTheLoadsOfWingsThatASimulatorWrote) {
  const io::TemporaryFolder folder;
  flightlog::write_flight_log(folder.path() / "flight", hover());
  const fs::path file = folder.path() / "flight" / flightlog::log_file::kWingLoads;
  const auto streams = [&] {
    Packing packing;
    return flight_section({folder.path() / "flight"}, {}, packing)
        .json()
        .at("blocks")[0]
        .at("flights")[0]
        .at("streams");
  };
  EXPECT_FALSE(streams().contains("loads"));
  const std::string names =
      "t_s,left_lift_N,left_drag_N,right_lift_N,right_drag_N,left_mechanical_power_W,right_mechanical_power_W\n";
  io::write_atomically(file, names + "0,0.06,0.04,0.06,0.04,0.5,0.5\n0.001,0.05,0.03,0.06,0.04,0.5,0.4\n");
  EXPECT_EQ(streams().at("loads").at("left_lift_N").at("count"), 2);
  io::write_atomically(file, "t_s,left_lift_N\n0,1\n1,1\n");
  EXPECT_NE(refusal([&] { streams(); }).find("left_drag_N"), std::string::npos);
}

TEST(FlightSection, LeavesOutPosesWhoseMarkersWereTakenForOthers) {
  flightlog::FlightLog log = hover();
  flightlog::MocapStream& m = log.mocap;
  for (const std::size_t i : {60, 61, 62, 120}) m.x_m[i] += 0.5;
  for (flightlog::Column* c : {&m.x_m, &m.y_m, &m.z_m, &m.qw, &m.qx, &m.qy, &m.qz}) (*c)[63] = (*c)[62];  // lost
  Packing packing;
  const Section section = flight_section({{"flight", "", log}}, {}, packing);
  const Json f = section.json().at("blocks")[0].at("flights")[0];
  EXPECT_EQ(f.at("streams").at("mocap").at("x_m").at("count"), 195);
  EXPECT_EQ(f.at("swapped").at("begin_s").at("count"), 2);
  EXPECT_EQ(f.at("notes")[0],
            "5 of 200 poses are left out, whose markers were taken for others: grey in the plots of position and "
            "attitude");
  for (const Series& s : section.figures()[0].series)
    for (const double x : s.y) EXPECT_LT(std::abs(x), 0.51) << s.name;  // on paper neither
  EXPECT_TRUE(flight_section({{"flight", "", hover()}}, {}, packing)
                  .json()
                  .at("blocks")[0]
                  .at("flights")[0]
                  .at("swapped")
                  .is_null());
}

/// Six seconds of hover, of a robot that declares its inputs and has neither IMU nor beat.
flightlog::FlightLog of_inputs() {
  flightlog::FlightLog log;
  flightlog::FlightHeader& h = log.header;
  h.vehicle = "crazyflie.toml";
  h.inputs = {"motor_1", "motor_2", "motor_3", "motor_4"};
  h.mocap = {100, 0.01, 1e-4, 2e-3};
  log.command.declared.resize(4);
  for (int i = 0; i < 600; ++i) {
    const double t = 0.01 * i;
    log.command.t_s.push_back(t);
    for (flightlog::Column& c : log.command.declared) c.push_back(0.5);
    flightlog::MocapStream& m = log.mocap;
    m.t_s.push_back(t);
    m.x_m.push_back(0.1 * t), m.y_m.push_back(0), m.z_m.push_back(1);
    m.qw.push_back(1), m.qx.push_back(0), m.qy.push_back(0), m.qz.push_back(0);
  }
  return log;
}

TEST(FlightSection, DrawsWhatDeclaredInputsLeave) {
  const io::TemporaryFolder folder;
  flightlog::FlightLog log = of_inputs();
  flightlog::write_flight_log(folder.path() / "flight", log);
  Packing packing;
  const Section section = flight_section({folder.path() / "flight"}, {}, packing);
  const Json f = section.json().at("blocks")[0].at("flights")[0];
  EXPECT_EQ(f.at("wings"), "none");
  const Json& streams = f.at("streams");
  for (const char* absent : {"imu", "command", "wings", "power"}) EXPECT_FALSE(streams.contains(absent)) << absent;
  EXPECT_EQ(streams.at("declared").at("motor_4").at("count"), 600);
  EXPECT_GT(streams.at("path").at("accel_z_m_s2").at("count").get<int>(), 100);
  // the ellipsoid has the moments of inertia of the file: m / 5 (b^2 + c^2), and so on
  const model::Vehicle v = model::read_any_vehicle(FLAPPY_SOURCE_DIR "/configs/vehicles/crazyflie.toml");
  const std::vector<double> body_m = f.at("vehicle").at("body_m");
  EXPECT_NEAR(v.torso.mass_kg / 5 * (body_m[1] * body_m[1] + body_m[2] * body_m[2]), v.torso.inertia_kg_m2.xx, 1e-9);
  EXPECT_NEAR(v.torso.mass_kg / 5 * (body_m[0] * body_m[0] + body_m[1] * body_m[1]), v.torso.inertia_kg_m2.zz, 1e-9);
  ASSERT_EQ(section.figures().back().id, "declared");
  EXPECT_EQ(section.figures().back().series[3].name, "motor 4");

  // wings of the file, but no voltages that would move them
  log.header.vehicle = "hummingbird_nominal.toml";
  flightlog::write_flight_log(folder.path() / "still", log);
  EXPECT_EQ(flight_section({folder.path() / "still"}, {}, packing).json().at("blocks")[0].at("flights")[0].at("wings"),
            "still");
}

TEST(FlightSection, RefusesAFlightWithoutItsVehicle) {
  const io::TemporaryFolder folder;
  flightlog::FlightLog log = hover();
  log.header.vehicle = "bird.toml";
  flightlog::write_flight_log(folder.path() / "flight", log);
  Packing packing;
  EXPECT_EQ(refusal([&] { flight_section({folder.path() / "flight"}, {}, packing); }),
            (folder.path() / "flight/flight.toml").string() +
                ": vehicle: there is no bird.toml in the folder; accepted: --vehicle FILE, in Python vehicle=FILE");
  FlightOptions options;
  options.vehicle = FLAPPY_SOURCE_DIR "/configs/vehicles/hummingbird_nominal.toml";
  EXPECT_EQ(refusal([&] { flight_section({folder.path() / "flight"}, options, packing); }), "accepted");
}

TEST(DiagnosisSection, TellsWhatTheJsonHas) {
  const Json json = read_results(kData / "diagnosis/diagnosis.json");
  const Section section = diagnosis_section(kData / "diagnosis/diagnosis.json");
  expect_cells_of(section, json, 20);
  std::vector<std::string> questions;
  const Json blocks = section.json().at("blocks");
  for (const Json& block : blocks)
    if (block.at("kind") == "heading") questions.push_back(block.at("text"));
  EXPECT_EQ(io::joined(questions),
            "Where is the gap?, Which effect causes it?, How far does the gap shrink?, What to fly next?");
  EXPECT_EQ(blocks[0].at("text"), "Missing in the model: accelerometer misalignment and vibration rectification.");
  for (const Figure& f : section.figures())
    if (f.id == "loss") {
      ASSERT_EQ(f.series[0].x.size(), 4u);
      EXPECT_EQ(f.series[0].x[1], json.at("gap").at("refit").get<double>());
      EXPECT_EQ(f.series[0].x[3], json.at("gap").at("noise_floor").get<double>());
    }
}

TEST(DiagnosisSection, ShowsHowRivalsWouldFlyNext) {
  const io::TemporaryFolder folder;
  Json json = read_results(kData / "diagnosis/diagnosis.json");
  const auto told = [&] {
    io::write_atomically(folder.path() / "diagnosis.json", json.dump());
    return diagnosis_section(folder.path() / "diagnosis.json");
  };
  const std::size_t before = told().figures().size();
  json["next_experiment"] = {
      {"manoeuvre", "dash"},   {"separates", {"body_drag+wind", "none"}},
      {"expected_nats", 12.3}, {"information", 0.4},
      {"course_step_s", 0.1},  {"courses", {{{"quantity", "x_m"}, {"first", {0.0, 1.0}}, {"second", {0.5, 0.25}}}}}};
  const Section section = told();
  ASSERT_EQ(section.figures().size(), before + 1);
  const Figure& f = section.figures().back();
  EXPECT_EQ(f.y.title, "x (m)");
  EXPECT_EQ(f.series[0].name, "if it is body drag and wind");
  EXPECT_EQ(f.series[1].name, "if it is no gap");
  EXPECT_EQ(f.series[1].x, (std::vector<double>{0.05, 0.1 * 1.5}));
  EXPECT_EQ(f.series[1].y, (std::vector<double>{0.5, 0.25}));
}

/// A beat-averaged robot: two flights, one effect with two magnitudes that explains them and one that does not.
Json by_the_beat() {
  const auto error = [](double rms, double by_type) {
    return Json{{"rms", rms}, {"low", 0.9 * rms}, {"high", 1.1 * rms}, {"by_type", by_type}};
  };
  const auto rung = [&](const char* added, double x, double z) {
    return Json{{"added", added},
                {"held_out", {{"specific_force_x", error(x, 1.5 * x)}, {"specific_force_z", error(z, z)}}}};
  };
  const auto size = [](double value, const char* unit) {
    return Json{{"value", value}, {"low", value - 0.1}, {"high", value + 0.1}, {"unit", unit}};
  };
  Json json = read_results(kData / "diagnosis/diagnosis.json");
  json["flights"] = {"logs/one_1", "logs/one_2"};
  json["verdict"] = {
      {"kind", "effect"}, {"effects", {"flapping_counter_force"}}, {"remainder", false}, {"probability", 0.99}};
  json["locations"] = {
      {{"fitted", "refit"},
       {"test", "regime"},
       {"channel", "specific_force_x"},
       {"unit", "m/s^2"},
       {"regime", {{"quantity", "speed"}, {"third", "high"}, {"low", 1.0}, {"high", nullptr}, {"unit", "m/s"}}},
       {"gap", 2.0},
       {"noise_floor", 0.5},
       {"p_value", 0.001},
       {"discovered", true}}};
  const auto hypothesis = [](const char* group, Json effects, double probability, double evidence, Json magnitudes) {
    const char* kind = effects.empty() ? "parameters" : "effect";
    return Json{{"kind", kind},
                {"effects", std::move(effects)},
                {"group", group},
                {"remainder", false},
                {"probability", probability},
                {"log_evidence", evidence},
                {"log_prior", 0.0},
                {"parameters", std::move(magnitudes)},
                {"loss", nullptr},
                {"loss_gain_sd", 0.0},
                {"closure", nullptr}};
  };
  json["hypotheses"] = {hypothesis("flapping_counter_force", {"flapping_counter_force"}, 0.99, -10,
                                   {{"flapping_counter_force.x_per_s", size(3.0, "1/s")},
                                    {"flapping_counter_force.z_per_s", size(0.5, "1/s")}}),
                        hypothesis("parameters", Json::array(), 0.01, -1e9, Json::object())};
  json["unexplained"] = {{"jointly_with", {"flapping_counter_force"}},
                         {"terms",
                          {{{"channel", "specific_force_x"},
                            {"harmonic", 0},
                            {"function", "right_flap velocity_y"},
                            {"regime", "velocity"},
                            {"times_prior_scale", 3.0},
                            {"gain_nats", 7.0}}}}};
  json["closed_loop"] = Json::array();
  json["next_experiment"] = nullptr;
  const auto agreement = [](const char* name, double one, double other, double p) {
    return Json{{"name", name}, {"value", {one, other}}, {"sd", {0.1, 0.2}}, {"p_value", p}};
  };
  json["validation"] = {
      {"ladder", {rung("file", 2.0, 1.0), rung("parameters", 1.5, 0.9), rung("flapping_counter_force", 0.5, 0.25)}},
      {"controls",
       {{{"effect", "flapping_counter_force"},
         {"channel", "specific_force_x"},
         {"gain", 0.75},
         {"best_of_shifted", 0.01}}}},
      {"agreements",
       {agreement("flapping_counter_force.x_per_s", 2.9, 3.2, 0.4),
        agreement("flapping_counter_force.z_per_s", 0.1, 0.9, 1e-4)}}};
  return json;
}

std::string words_of(const Section& section) {
  std::string words;
  const Json json = section.json();
  for (const Json& block : json.at("blocks"))
    if (block.at("kind") == "words") words += block.at("text").get<std::string>() + "\n";
  return words;
}

TEST(DiagnosisSection, TellsWhatALaboratoryAsks) {
  const io::TemporaryFolder folder;
  Json json = by_the_beat();
  const auto told = [&] {
    io::write_atomically(folder.path() / "diagnosis.json", json.dump());
    return diagnosis_section(folder.path() / "diagnosis.json");
  };
  const Section section = told();
  expect_cells_of(section, json, 24 + 6 + 8);
  std::map<std::string, Figure> figures;
  for (const Figure& f : section.figures()) figures[f.id] = f;
  const Figure &ladder = figures.at("ladder_specific_force"), &kinds = figures.at("ladder_kinds_specific_force");
  EXPECT_EQ(io::joined(ladder.categories), "vehicle's file, parameters refitted, + flapping counter force");
  ASSERT_EQ(ladder.series.size(), 2u);
  EXPECT_EQ(ladder.series[0].name, "forward specific force");
  EXPECT_EQ(ladder.series[0].x, (std::vector<double>{2.0, 1.5, 0.5}));
  EXPECT_EQ(ladder.series[0].low, (std::vector<double>{0.9 * 2.0, 0.9 * 1.5, 0.9 * 0.5}));
  EXPECT_EQ(kinds.series[0].x, (std::vector<double>{3.0, 2.25, 0.75}));
  EXPECT_EQ(kinds.x.high, ladder.x.high);  // side by side
  EXPECT_EQ(*kinds.x.high, 1.05 * 3.0);
  EXPECT_EQ(figures.at("controls").series[0].x[0], 75);
  EXPECT_EQ(figures.at("controls").series[1].x[0], 1);
  const Figure& agreement = figures.at("agreement_1");
  EXPECT_EQ(io::joined(agreement.categories), "one_1, one_2");
  ASSERT_EQ(agreement.series.size(), 4u);  // each size, and its fit to all flights
  EXPECT_EQ(agreement.x.title, "magnitude (1/s)");
  EXPECT_EQ(agreement.series[0].name, "x");
  EXPECT_EQ(agreement.series[0].x, (std::vector<double>{2.9, 3.2}));
  EXPECT_NEAR(agreement.series[0].high[1], 3.2 + 1.645 * 0.2, 1e-12);
  EXPECT_EQ(agreement.series[3].x, (std::vector<double>{0.5, 0.5}));

  const std::string words = words_of(section);
  const auto says = [&](const std::string& text) { return words.find(text) != std::string::npos; };
  EXPECT_TRUE(
      says("forward specific force from 2 to 0.5 m/s² (90 %: 0.45 to 0.55; 0.75 where all flights of a type are held "
           "out)"))
      << words;
  EXPECT_TRUE(says("each takes 75 % or more off the rms where it takes most, its shifted copies 1 % at best")) << words;
  EXPECT_TRUE(
      says("1 of 2 magnitudes are one number, as far as their errors tell. By more than that flapping counter force "
           "(z) differs"))
      << words;
  EXPECT_TRUE(says("Predict with vehicle_corrected.toml")) << words;
  EXPECT_FALSE(says("flappy-train")) << words;  // nothing flies such a vehicle

  json["validation"]["controls"][0]["best_of_shifted"] = 0.8;
  EXPECT_NE(words_of(told()).find("Shifted in time flapping counter force explains as much as at its own: do not "
                                  "believe it."),
            std::string::npos);
}

TEST(DiagnosisSection, DrawsNoBeatWhereNoneIsKnown) {
  const io::TemporaryFolder folder;
  io::write_atomically(folder.path() / "diagnosis.json", by_the_beat().dump());
  const std::string text = diagnosis_section(folder.path() / "diagnosis.json").json().dump();
  EXPECT_NE(text.find(R"("wings":false)"), std::string::npos);
  EXPECT_EQ(text.find("When in the beat"), std::string::npos);
  EXPECT_EQ(text.find("part of the beat"), std::string::npos);
  EXPECT_NE(text.find("right flap × velocity y"), std::string::npos);
  EXPECT_NE(text.find("rules out parameters alone"), std::string::npos);
  EXPECT_NE(text.find(R"("the air at the wings")"), std::string::npos);
  EXPECT_NE(diagnosis_section(kData / "diagnosis/diagnosis.json").json().dump().find(R"("wings":true)"),
            std::string::npos);
}

TEST(Words, AreWithoutUnits) {
  EXPECT_EQ(magnitude_words("stroke_plane_actuation.shift_m_s2", "m/s^2"), "stroke plane actuation (shift)");
  EXPECT_EQ(magnitude_words("translational_lift.gain_per_m", "1/m"), "translational lift (gain)");
  EXPECT_EQ(magnitude_words("battery_thrust.gain", ""), "battery thrust (gain)");
}

TEST(EvaluationSection, TellsWhatTheJsonHas) {
  expect_cells_of(evaluation_section(kData / "evaluation.json"), read_results(kData / "evaluation.json"), 27);
  EXPECT_EQ(evaluation_section(kData / "effects.json").json().at("blocks")[1].at("texts")[0][0], "96.0");
}

TEST(IdentificationSection, TellsWhatTheJsonHas) {
  const Section section = identification_section(kData / "fit.json");
  expect_cells_of(section, read_results(kData / "fit.json"), 60);
  EXPECT_EQ(std::ranges::count_if(section.figures(), [](const Figure& f) { return f.id.starts_with("map_"); }), 6);
}

TEST(BenchmarkSection, HasEveryCase) {
  const Section section = benchmark_section(kData / "score.csv");
  const Json cases = section.json().at("blocks").back().at("cases");
  ASSERT_EQ(cases.size(), 60u);
  EXPECT_EQ(cases[3].at("truth"), "vibration rectification");
  EXPECT_EQ(cases[3].at("named"), "accelerometer misalignment");
  EXPECT_EQ(cases[3].at("right"), false);
  EXPECT_EQ(cases[3].at("probability"), 0.882);
}

/// A study of two objectives with one chosen design, and the files that its page reads.
Json study_in(const fs::path& folder) {
  const auto figures = [](double power_W, double share, double mass_kg) {
    return Json{{"mass_kg", mass_kg}, {"hover_power_W", power_W}, {"endurance_s", 0.0}, {"escape_success", share}};
  };
  const auto design = [&](const char* name, const Json& values, const Json& searched, const Json& verified) {
    return Json{{"name", name},
                {"folder", std::string("designs/") + name},
                {"values", values},
                {"figures", searched},
                {"verified", verified},
                {"fine", verified},
                {"tuned_cost", nullptr},
                {"rod_m", 0.0008},
                {"limited_by", Json::array()},
                {"sensitivity", {{0.02, -0.01}, {nullptr, nullptr}}}};
  };
  const auto info = [](const char* name, const char* words, const char* unit) {
    return Json{{"name", name}, {"words", words}, {"unit", unit}};
  };
  const Json was{{"wing_length_m", 0.07}, {"motor", "published"}}, is{{"wing_length_m", 0.08}, {"motor", "large"}},
      other{{"wing_length_m", 0.075}, {"motor", "published"}};
  const Json published = figures(5, 0.5, 0.0124);
  Json json{
      {"objectives",
       {{{"figure", "hover_power_W"}, {"words", "power"}, {"unit", "W"}, {"more_is_better", false}},
        {{"figure", "escape_success"}, {"words", "escapes"}, {"unit", "1"}, {"more_is_better", true}}}},
      {"variables", {{{"name", "wing_length_m"}, {"words", "wing length"}}, {{"name", "motor"}, {"words", "motor"}}}},
      {"figures",
       {info("mass_kg", "mass", "kg"), info("hover_power_W", "power", "W"), info("endurance_s", "hover", "s"),
        info("escape_success", "escapes", "1")}},
      {"published", published},
      {"front",
       {{{"values", is}, {"figures", figures(4, 0.5, 0.013)}},
        {{"values", other}, {"figures", figures(6, 0.75, 0.012)}}}},
      {"search", {{"designs", 40}}},
      {"given_away", {0.2, nullptr}},
      {"designs",
       {design("00", was, published, figures(5.25, 0.25, 0.0124)),
        design("01", is, figures(4, 0.5, 0.013), figures(4.5, 0.625, 0.013))}}};
  json["designs"][1]["limited_by"] = {"wing_length_m is at its most, 0.08", "hover_power_W is at its limit, at most 4"};
  json["designs"][1]["sensitivity"] = {{-0.04, 0.001}, {nullptr, nullptr}};
  model::Vehicle v = model::read_any_vehicle(FLAPPY_SOURCE_DIR "/configs/vehicles/hummingbird_nominal.toml");
  fs::create_directories(folder / "designs/00");
  fs::create_directories(folder / "designs/01");
  io::write_atomically(folder / "designs/00/vehicle.toml", model::vehicle_text(v));
  v.left.planform.wing_length_m = v.right.planform.wing_length_m = 0.08;
  io::write_atomically(folder / "designs/01/vehicle.toml", model::vehicle_text(v));
  io::write_atomically(folder / "design.json", json.dump());
  return json;
}

TEST(DesignSection, ShowsDesignsBesideThePublishedRobot) {
  const io::TemporaryFolder folder;
  const Json json = study_in(folder.path());
  EXPECT_EQ(recognised(folder.path()), Kind::design);
  EXPECT_EQ(recognised(folder.path() / "design.json"), Kind::design);
  Packing packing;
  const Section section = composed({folder.path()}, {}, packing)[0];
  EXPECT_EQ(section.kind(), "design");
  // a row for the mass, three for each figure that flights change, none for the hover on no battery; two designs
  expect_cells_of(section, json, 2 + 2 * (1 + 3 + 3));
  const Json blocks = section.json().at("blocks");
  EXPECT_EQ(blocks[0].at("text"),
            "40 designs were judged; nothing beats 2 of them. Without loss elsewhere the published robot could have: "
            "power lower by 20 %.");
  std::map<std::string, std::vector<Json>> by_kind;
  for (const Json& b : blocks) by_kind[b.at("kind")].push_back(b);

  ASSERT_EQ(section.figures().size(), 1u);
  const Figure& f = section.figures()[0];
  EXPECT_EQ(f.x.title, "power (W)");
  EXPECT_EQ(f.y.title, "escapes (-)");
  EXPECT_EQ(f.note, "Better: to the left, and up. As searched.");
  const std::vector<std::pair<Colour, double>> expected = {
      {Colour::vermillion, 5}, {Colour::blue, 4}, {Colour::grey, 6}};
  for (std::size_t k = 0; k < expected.size(); ++k) {
    EXPECT_EQ(f.series[k].colour, expected[k].first);
    EXPECT_EQ(f.series[k].x, std::vector<double>{expected[k].second});
  }
  EXPECT_EQ(f.series[1].labels, std::vector<std::string>{"01"});

  ASSERT_EQ(by_kind["robots"].size(), 1u);
  const Json& robots = by_kind["robots"][0].at("robots");
  ASSERT_EQ(robots.size(), 2u);
  EXPECT_EQ(robots[0].at("name"), "published");
  EXPECT_EQ(robots[0].at("limits").size(), 0u);
  EXPECT_EQ(robots[1].at("name"), "design 01");
  EXPECT_EQ(robots[1].at("shape").at("left").at("outline_m").back(), Json({0.08, 0.0}));
  EXPECT_EQ(robots[1].at("limits"), Json({"wing length is at its most, 80 mm", "power is at its limit, at most 4 W"}));
  EXPECT_EQ(robots[1].at("worth").dump(), R"([["power","4.5 W"],["escapes","62.5 %"],["mass","13 g"]])");
  EXPECT_EQ(robots[1].at("built").dump(),
            R"([["wing length","80 mm"],["motor","large"],["rod of the leading edge, diameter","0.8 mm"]])");

  ASSERT_EQ(by_kind["matrix"].size(), 2u);
  EXPECT_EQ(by_kind["matrix"][0].at("columns"), Json({"power (%)", "escapes (percentage points)"}));
  EXPECT_EQ(by_kind["matrix"][0].at("texts").dump(), R"([["+2.00","−1.00"],["–","–"]])");
  EXPECT_EQ(by_kind["matrix"][1].at("texts").dump(), R"([["−4.00","+0.10"],["–","–"]])");
  EXPECT_EQ(by_kind["matrix"][0].at("most"), 4.0);  // one shade means the same in all

  ASSERT_EQ(by_kind["table"].size(), 2u);
  const Json& given = by_kind["table"][0].at("rows");
  EXPECT_EQ(given[0][2], "4");
  EXPECT_EQ(given[0][3], "20 %");
  EXPECT_EQ(given[1][3], "nothing");
  const Json& rows = by_kind["table"][1].at("rows");
  ASSERT_EQ(rows.size(), 7u);
  EXPECT_EQ(rows[0][0].dump(), R"x({"text":"power (W)","strong":true})x");
  EXPECT_EQ(rows[1][1], "verified");
  EXPECT_EQ(rows[1][3].dump(), R"({"text":"4.5","at":"/designs/1/verified/hover_power_W"})");
  EXPECT_EQ(rows[1][0], "");
  EXPECT_EQ(rows[6][0], "mass (kg)");
}

TEST(DesignSection, SaysSoWhereNothingIsGivenAway) {
  const io::TemporaryFolder folder;
  Json json = study_in(folder.path());
  json["given_away"] = {nullptr, nullptr};
  io::write_atomically(folder / "design.json", json.dump());
  EXPECT_EQ(design_section(folder / "design.json").json().at("blocks")[0].at("text"),
            "40 designs were judged; nothing beats 2 of them. The published robot gives away nothing: each gain in one "
            "objective costs another.");
}

TEST(DesignSection, ShowsTheFirstOfManyDesigns) {
  const io::TemporaryFolder folder;
  Json json = study_in(folder.path());
  for (int i = 2; i < 11; ++i) json["designs"].push_back(json["designs"][1]);
  io::write_atomically(folder / "design.json", json.dump());
  const Json shown = design_section(folder / "design.json").json();
  std::size_t robots = 0, notes = 0;
  for (const Json& b : shown.at("blocks")) {
    if (b.at("kind") == "robots") robots = b.at("robots").size();
    if (b.at("kind") == "words") notes += b.at("text") == "Of 10 chosen designs the first 8 are shown.";
  }
  EXPECT_EQ(robots, 9u);
  EXPECT_EQ(notes, 1u);
}

TEST(DesignSection, RefusesWhatIsNoStudy) {
  const io::TemporaryFolder folder;
  const Json json = study_in(folder.path());
  const std::string file = folder / "design.json";
  const auto line = [&](const Json& changed) {
    io::write_atomically(file, changed.dump());
    const std::string told = refusal([&] { design_section(file); });
    EXPECT_EQ(told.find('\n'), std::string::npos);
    return told;
  };
  const auto without = [&](const char* pointer, const char* key) {
    Json changed = json;
    changed.at(Json::json_pointer(pointer)).erase(key);
    return changed;
  };
  const std::string wrote = "; accepted: what flappy-design wrote";
  EXPECT_EQ(line(json), "accepted");
  EXPECT_EQ(line(without("", "search")), file + ": key 'search' not found" + wrote);
  EXPECT_EQ(line(without("/designs/1/verified", "hover_power_W")), file + ": key 'hover_power_W' not found" + wrote);
  EXPECT_EQ(line(without("/designs/1", "sensitivity")), file + ": key 'sensitivity' not found" + wrote);
  Json changed = json;
  changed["designs"][1]["sensitivity"].erase(1);
  EXPECT_EQ(line(changed), file + ": array index 1 is out of range" + wrote);
  changed = json;
  changed["designs"][1]["verified"]["mass_kg"] = "light";
  EXPECT_EQ(line(changed), file + ": type must be number, but is string" + wrote);
  for (const Json& designs : {Json{json.at("designs")[1]}, Json{json.at("designs")[0], json.at("designs")[0]}}) {
    changed["designs"] = designs;
    EXPECT_EQ(line(changed), file + ": its designs do not begin with 00, the published robot" + wrote);
  }
  changed["designs"] = Json::array();
  EXPECT_EQ(line(changed), file + ": has no verified design yet" + wrote);
  io::write_atomically(file, "{\"designs\": 1,\n");
  EXPECT_EQ(refusal([&] { recognised(file); }),
            file + ":2:0: is no JSON; accepted: results of a program, as --json wrote them");
  fs::remove(folder.path() / "designs/01/vehicle.toml");
  EXPECT_NE(line(json).find((folder.path() / "designs/01/vehicle.toml").string()), std::string::npos);
}

TEST(Figure, HasItsLabelsOnPaper) {
  Figure f{.id = "f", .title = "t", .x = {.title = "x"}, .y = {.title = "y"}};
  f.series.push_back({.name = "a", .draw = Draw::points, .x = {0, 1}, .y = {1, 2}, .labels = {"it \"is", "`this`"}});
  EXPECT_EQ(json_of(f).at("series")[0].at("labels").dump(), R"(["it \"is","`this`"])");
  const io::TemporaryFolder folder;
  draw_on_paper(folder.path(), f, Paper::svg);
  const std::string svg = io::read_text(folder.path() / "f.svg");
  EXPECT_NE(svg.find("it is"), std::string::npos);
  EXPECT_NE(svg.find("`this`"), std::string::npos);
}

TEST(Figure, IsTheSameOnPaper) {
  Figure f{.id = "f",
           .title = "t",
           .note = "",
           .x = {.title = "it's `touch stolen` (m)"},
           .y = {.title = "y"},
           .categories = {},
           .series = {}};
  f.series.push_back({.name = "a $(touch stolen) \"b\"",
                      .colour = Colour::vermillion,
                      .x = {0, 1, 2},
                      .y = {1, NAN, 3},
                      .low = {},
                      .high = {}});
  const io::TemporaryFolder folder;
  draw_on_paper(folder.path(), f, Paper::svg);
  draw_on_paper(folder.path(), f, Paper::pdf);
  const std::string svg = io::read_text(folder.path() / "f.svg");
  EXPECT_NE(svg.find("it's `touch stolen` (m)"), std::string::npos);
  EXPECT_NE(svg.find("rgb(213,  94,   0)"), std::string::npos);
  EXPECT_TRUE(io::read_text(folder.path() / "f.pdf").starts_with("%PDF"));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), 2);
  const Json json = json_of(f);
  EXPECT_EQ(json.at("series")[0].at("y").dump(), "[1.0,null,3.0]");
  EXPECT_EQ(json.at("series")[0].at("colour"), "#d55e00");
}

TEST(SpeedSection, DrawsFiguresOverCommits) {
  const io::TemporaryFolder folder;
  const auto line = [](const char* commit, const char* date, const char* machine, double value) {
    return Json{{"figure", "speed.steps_per_s"},  {"value", value},   {"machine", machine}, {"processors", 2},
                {"instruction_set", "x86-64-v3"}, {"commit", commit}, {"date", date}}
               .dump() +
           "\n";
  };
  const std::string file = folder / "f.jsonl";
  io::write_atomically(file, line("newer", "2026-11-28", "one", 3) + line("older", "2026-11-27", "one", 2) +
                                 line("newer", "2026-11-29", "other", 5));
  EXPECT_EQ(recognised(file), Kind::speed);
  const Section section = speed_section(file);
  ASSERT_EQ(section.figures().size(), 1u);
  const Figure& f = section.figures()[0];
  EXPECT_EQ(f.title, "speed.steps_per_s");
  ASSERT_EQ(f.series.size(), 2u);
  EXPECT_EQ(f.series[0].name, "one, 2 processors, x86-64-v3");
  EXPECT_EQ(f.series[0].x, (std::vector<double>{1, 0}));  // by date, not in the order of the file
  EXPECT_EQ(f.series[0].y, (std::vector<double>{3, 2}));
  EXPECT_EQ(f.series[1].x, (std::vector<double>{1}));
  io::write_atomically(file, line("newer", "2026-11-28", "one", 3) + "{\"a\":1}\n");
  EXPECT_EQ(test::refusal([&] { speed_section(file); }),
            file + ":2: is no figure of a benchmark; accepted: lines that flappy-bench --figures wrote");
}

}  // namespace
}  // namespace flappy::view
