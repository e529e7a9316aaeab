// What a configuration of a flight may say, and what is added to the inputs.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "io/sha256.hpp"
#include "model/effects/registry.hpp"
#include "rollout/fly.hpp"
#include "rollout/fly_fixture.hpp"

namespace flappy::flight {
namespace {

TEST(FlyConfig, ShippedOnesAreRead) {
  int count = 0;
  for (const auto& entry : fs::directory_iterator(source_path("configs/fly"))) {
    EXPECT_EQ(refusal({}, entry.path()), "accepted") << entry.path();
    ++count;
  }
  EXPECT_GE(count, 8);
  const rollout::FlyConfig c = rollout::read_fly_config(kHover);
  EXPECT_EQ(c.vehicle_file_name, "hummingbird_identified.toml");
  EXPECT_EQ(c.vehicle_sha256, io::sha256(io::read_text(source_path("configs/vehicles/hummingbird_identified.toml"))));
  EXPECT_EQ(c.fleet.control_hz, 500);
  EXPECT_EQ(c.fleet.batch.world.ground_z_m, 0);
  EXPECT_EQ(c.settle_s, 3);
  EXPECT_FALSE(c.excitation.changes());
}

TEST(FlyConfig, OverridesReachTheFileTheyName) {
  const rollout::FlyConfig c =
      rollout::read_fly_config(kHover, {"vehicle.left.motor.resistance_ohm=14", "sensors.mocap.loss_probability = 0.1",
                                        "controller.attitude.pitch.p=4.25", "task.end.time_s=7", "flight.seed=9",
                                        "world.walls=[[1.0, 0, -1, 0]]"});
  EXPECT_EQ(c.vehicle.left.motor.resistance_ohm, 14);
  EXPECT_EQ(c.vehicle_sha256, "");
  EXPECT_EQ(c.fleet.sensors.mocap.loss_probability, 0.1);
  EXPECT_EQ(c.fleet.controller.constants.of<PidController>().pitch.p, 4.25);
  EXPECT_EQ(c.fleet.task.constants.limits.time_s, 7);
  EXPECT_EQ(c.fleet.seed, 9u);
  ASSERT_EQ(c.fleet.batch.world.walls.size(), 1u);
  EXPECT_EQ(c.fleet.batch.world.walls[0].normal_x, -1);

  const rollout::FlyConfig arc =
      rollout::read_fly_config(kHover, {"controller=../controllers/arc.toml", "controller.heading.k_1_s=3"});
  EXPECT_EQ(arc.fleet.controller.kind, kind_of<ArcController>());
  EXPECT_EQ(arc.fleet.controller.constants.of<ArcController>().heading.k_1_s, 3);

  const rollout::FlyConfig random = rollout::read_fly_config(kHover, {"randomisation=../randomisation/published.toml"});
  EXPECT_EQ(random.vehicle_sha256, "");
  EXPECT_NE(random.vehicle_of(0).torso.mass_kg, random.vehicle_of(1).torso.mass_kg);
  EXPECT_EQ(c.vehicle_of(0).torso.mass_kg, c.vehicle_of(1).torso.mass_kg);
}

TEST(FlyConfig, LimitsDrawnDelays) {
  const Folder folder;
  folder.write("random.toml",
               "schema = 1\n[[randomise]]\nparameters = [\"effects.mocap_delay.delay_s\"]\nlaw = \"replace_normal\"\n"
               "mean = -0.005\nsd = 0.004\n[[randomise]]\nparameters = [\"effects.command_delay.delay_s\"]\n"
               "law = \"replace_normal\"\nmean = 0.012\nsd = 0.002\n");
  const rollout::FlyConfig c = rollout::read_fly_config(
      kHover, {"vehicle.effects.mocap_delay.delay_s=0.0", "vehicle.effects.command_delay.delay_s=0.0",
               "randomisation=" + (folder / "random.toml").string(), "sensors.mocap.latency_s=0.006",
               "flight.step_s=5e-5", "flight.duration_s=0.01"});
  double least_s = 0, most_s = 0;
  for (std::uint32_t i = 0; i < 64; ++i) {
    const auto effects = c.vehicle_of(i).effects;
    least_s = std::min(least_s, effects.at("mocap_delay").at("delay_s"));
    most_s = std::max(most_s, effects.at("command_delay").at("delay_s"));
  }
  EXPECT_EQ(least_s, -0.006);
  EXPECT_EQ(most_s, 254 * 5e-5);
  EXPECT_EQ(rollout::fly(c, {.count = 64}).summary.flights, 64u);
}

TEST(FlyConfig, DrawsEffectsOfTheCatalogue) {
  const std::vector<std::string> drawn = {"drawn_effects.none=0.3",
                                          "drawn_effects.most=3",
                                          "drawn_effects.magnitude=2",
                                          "drawn_effects.weights.command_delay=20",
                                          "drawn_effects.weights.com_offset=0",
                                          "randomisation=../randomisation/published.toml"};
  const auto with = [&](const std::string& more) {
    std::vector<std::string> all = drawn;
    all.push_back(more);
    return rollout::read_fly_config(kHover, all);
  };
  const rollout::FlyConfig c = with("flight.duration_s=0.01"), as_filed = with("drawn_effects.none=1"),
                           own = with("vehicle.effects.command_delay.delay_s=0.001");
  EXPECT_EQ(c.vehicle_sha256, "");
  constexpr std::uint32_t kVehicles = 2000;
  std::map<std::size_t, double> of_count;
  std::map<std::string, double> share;
  double lowest = 0, highest = 0, left = 0, right = 0, longest_s = 0;
  for (std::uint32_t i = 0; i < kVehicles; ++i) {
    const model::Vehicle v = c.vehicle_of(i);
    of_count[v.effects.size()] += 1.0 / kVehicles;
    EXPECT_EQ(v.torso.mass_kg, as_filed.vehicle_of(i).torso.mass_kg) << "the rest is randomised as without";
    for (const auto& [id, values] : v.effects) {
      share[id] += 1.0 / kVehicles;
      const model::CatalogueEffect& effect = model::effect_within_beat(id);
      EXPECT_EQ(values.size(), static_cast<std::size_t>(effect.info.magnitudes)) << id;
      for (const model::EffectParameter& p : effect.parameters)
        if (values.contains(p.name)) {
          EXPECT_GE(values.at(p.name), p.low) << id;
          EXPECT_LE(values.at(p.name), p.high) << id;
        }
    }
    const auto value = [&](const char* id, const char* name) {
      return v.effects.contains(id) ? v.effects.at(id).at(name) : 0;
    };
    lowest = std::min(lowest, value("wind", "x_m_s"));
    highest = std::max(highest, value("wind", "x_m_s"));
    left = std::max(left, value("wing_damage", "left_area"));
    right = std::max(right, value("wing_damage", "right_area"));
    longest_s = std::max(longest_s, value("command_delay", "delay_s"));
    if (own.vehicle_of(i).effects.contains("command_delay")) continue;
    ADD_FAILURE() << "an effect of the file is gone";
  }
  EXPECT_NEAR(of_count[0], 0.3, 0.04);
  for (const std::size_t count : {1U, 2U, 3U}) EXPECT_NEAR(of_count[count], 0.7 / 3, 0.04) << count;
  EXPECT_FALSE(share.contains("com_offset"));
  EXPECT_EQ(share.size(), model::effects().size() - 1);
  EXPECT_GT(share["command_delay"], 0.3);
  EXPECT_LT(lowest, -0.4) << "of twice 0.3 m/s, both ways";
  EXPECT_GT(highest, 0.4);
  EXPECT_GT(left, 0.05) << "of twice 0.05";
  EXPECT_GT(right, 0.05) << "either wing";
  EXPECT_GT(longest_s, 0.0175);
  EXPECT_LE(longest_s, 0.018);
  for (std::uint32_t i = 0; i < 50; ++i) {
    EXPECT_EQ(own.vehicle_of(i).effects.at("command_delay").at("delay_s"), 0.001) << "that of the file stays";
    EXPECT_EQ(c.vehicle_of(i).effects, c.vehicle_of(i).effects);
  }
  EXPECT_EQ(as_filed.vehicle_of(3).effects.size(), 0U);

  Folder folder;
  for (const auto& [file, text] : c.resolved) folder.write(file, text);
  EXPECT_EQ(rollout::fly(rollout::read_fly_config(folder / "fly.toml"), {.count = 40}).hash,
            rollout::fly(c, {.count = 40}).hash);
}

TEST(FlyConfig, RefusesEffectsThatCannotBeDrawn) {
  const auto refused = [](std::vector<std::string> with) {
    for (const char* needed : {"none=0", "most=1", "magnitude=2"}) {
      const std::string key = std::string("drawn_effects.") + needed;
      const std::string name = key.substr(0, key.find('='));
      if (std::ranges::none_of(with, [&](const std::string& w) { return w.starts_with(name + "="); }))
        with.insert(with.begin(), key);
    }
    return refusal(with);
  };
  EXPECT_EQ(refused({}), "accepted");
  EXPECT_EQ(refused({"drawn_effects.none=1.5"}),
            "--set drawn_effects.none=1.5: drawn_effects.none: 1.5 is out of range; accepted: a number from 0 to 1");
  EXPECT_EQ(refused({"drawn_effects.weights.wing_damge=1"}),
            "--set drawn_effects.weights.wing_damge=1: drawn_effects.weights.wing_damge: is no effect of this vehicle; "
            "accepted: those that docs/reference/effects.md lists for it; did you mean \"wing_damage\"?");
  EXPECT_EQ(refused({"drawn_effects.weights.tether=1", "world.ground_z_m=-1e3"}),
            "--set drawn_effects.weights.tether=1: drawn_effects.weights.tether: has no ground that it hangs down to; "
            "accepted: 0, or world.ground_z_m");
  std::vector<std::string> none;
  for (const model::CatalogueEffect& e : model::effects())
    none.push_back(std::string("drawn_effects.weights.") + e.info.id + "=0");
  EXPECT_NE(refused(none).find("drawn_effects.weights: are all 0; accepted: one above 0"), std::string::npos)
      << refused(none);
}

TEST(FlyConfig, DrawsFromThePosteriorOfTheVehicle) {
  const Folder folder;
  model::Vehicle v = test::identified();
  v.posterior = {{"torso.mass_kg"}, {0.012}, {{1e-8}}};
  folder.write("v.toml", model::vehicle_text(v));
  const std::string vehicle = "vehicle=" + (folder / "v.toml").string();
  const rollout::FlyConfig c =
      rollout::read_fly_config(kHover, {vehicle, "randomisation=posterior", "flight.duration_s=0.1"});
  EXPECT_NE(c.vehicle_of(0).torso.mass_kg, c.vehicle_of(1).torso.mass_kg);
  EXPECT_NEAR(c.vehicle_of(0).torso.mass_kg, 0.012, 6e-4);  // six of its sd
  EXPECT_EQ(c.vehicle_sha256, "");
  for (const auto& [file, text] : c.resolved) folder.write(file, text);
  EXPECT_EQ(rollout::fly(rollout::read_fly_config(folder / "fly.toml"), {.count = 2}).hash,
            rollout::fly(c, {.count = 2}).hash);
  EXPECT_EQ(refusal({"randomisation=posterior"}),
            "--set randomisation=posterior: randomisation: the vehicle has no [posterior]; accepted: a file of "
            "[[randomise]] tables, or a vehicle that flappy-gap corrected");
  EXPECT_EQ(refusal({vehicle, "randomisation=posterior", "randomisation.schema=1"}),
            "--set randomisation=posterior: randomisation: is \"posterior\", but overridden; accepted: a file of "
            "[[randomise]] tables");
}

TEST(FlyConfig, RefusesInOneLine) {
  const std::string pid = source_path("configs/fly/../controllers/pid.toml");
  EXPECT_EQ(
      refusal({"flight.duration_s=0"}),
      "--set flight.duration_s=0: flight.duration_s: 0 is out of range; accepted: a number above 0, at most 1e+05");
  EXPECT_EQ(
      refusal({"controller.attitude.pitch.p=-1"}),
      "--set controller.attitude.pitch.p=-1: attitude.pitch.p: -1 is out of range; accepted: a number from 0 to 1000");
  EXPECT_EQ(refusal({"controller=3"}), "--set controller=3: controller: is an integer; accepted: the name of a file");
  EXPECT_EQ(refusal({"controller=none_such.toml"}),
            source_path("configs/fly/none_such.toml") + ": cannot be read: No such file or directory");
  EXPECT_EQ(refusal({"vehicle.torso.mass_g=12"}),
            "--set vehicle.torso.mass_g=12: torso.mass_g: unknown key; accepted here with another unit: \"mass_kg\"");
  EXPECT_EQ(refusal({"flight.control_hz=300"}),
            "--set flight.control_hz=300: flight.control_hz: its period is no whole number of steps; accepted: 1 / (n "
            "step_s)");
  EXPECT_EQ(
      refusal({"flight.step_s=4e-4"}),
      "--set flight.step_s=4e-4: flight.step_s: does not divide the driver's hold of 0.001 s; accepted: hold_s / n");
  // a step that divides the control period and the driver's hold: 2 ms / 34 for 120 Hz, as 30 steps to a beat of 8.3 ms
  EXPECT_EQ(refusal({"flight.step_s=1e-3", "vehicle.driver.flapping_Hz=150"}),
            "--set flight.step_s=1e-3: flight.step_s: is 6.67 steps per beat of 150 Hz, whose wings need 16 (vehicle "
            "\"hummingbird_identified\"); accepted: at most 0.000333333");
  EXPECT_EQ(refusal({"vehicle.gait.frequency_Hz=717"}, source_path("configs/fly/hummingbird_driven.toml")),
            source_path("configs/fly/hummingbird_driven.toml") +
                ":9:1: flight.step_s: is 5.58 steps per beat of 717 Hz, whose wings need 16 (vehicle "
                "\"hummingbird_driven\"); accepted: at most 8.69565e-05");
  EXPECT_EQ(refusal({"flight.step_s=5e-5", "vehicle.effects.command_delay.delay_s=0.02"}),
            "--set flight.step_s=5e-5: flight.step_s: is too short for a command_delay of 0.02 s, of which 254 steps "
            "are kept; accepted: a longer step, or a shorter delay");
  EXPECT_EQ(
      refusal({"flight.step_s=5e-4", "sensors.imu.rate_hz=4000"}),
      "--set flight.step_s=5e-4: flight.step_s: is longer than the 0.00025 s between samples of a sensor; accepted: a "
      "shorter step, or a slower sensor");
  EXPECT_EQ(refusal({"flight.support=glued"}),
            "--set flight.support=glued: flight.support: \"glued\" is not known; accepted: \"task\", \"welded\"");
  EXPECT_EQ(
      message([] { rollout::read_fly_config(source_path("configs/fly/escape.toml"), {"flight.support=welded"}); }),
      "--set flight.support=welded: flight.support: is \"welded\", but task \"escape\" starts from hover; accepted: "
      "\"task\"");
  EXPECT_EQ(refusal({"world.walls=[[0, 0, 1, 1]]"}),
            "--set world.walls=[[0, 0, 1, 1]]: world.walls: normal of wall 0 has length 1.4142135623730951; accepted: "
            "[x_m, y_m, normal_x, normal_y], the normal of length 1");
  EXPECT_EQ(refusal({"world.cylinder=[{from_m=[0, 0, 1], to_m=[0, 0, 1], radius_m=0.1}]"}),
            "--set world.cylinder=[{from_m=[0, 0, 1], to_m=[0, 0, 1], radius_m=0.1}]: world.cylinder[0].to_m: is where "
            "from_m is; accepted: the other end of the axis");
  EXPECT_EQ(refusal({"world.sphere=[{centre_m=[0, 0, 1], radius_m=0}]"}),
            "--set world.sphere=[{centre_m=[0, 0, 1], radius_m=0}]: world.sphere[0].radius_m: 0 is out of range; "
            "accepted: a number above 0, at most 10000");
  EXPECT_EQ(refusal({"randomisation.schema=1"}),
            kHover + ": randomisation: is missing, but overridden; accepted: a file of [[randomise]] tables");
  EXPECT_EQ(refusal({"log.power={battery_nominal_V=8, rate_hz=600, latency_s=0, voltage_noise_V=0, current_noise_A=0}"})
                .substr(0, 10),
            "--set log.");
  EXPECT_EQ(refusal({"actor=none_such.json"}),
            source_path("configs/fly/none_such.json") + ": cannot be read: No such file or directory");
  EXPECT_EQ(refusal({"fligth.seed=1"}).substr(0, 60), "--set fligth.seed=1: fligth: unknown key; accepted: actor, c");
  EXPECT_EQ(message([&] { rollout::read_fly_config(pid); }).find(": flight"), std::string::npos);
}

TEST(FlyConfig, RefusesJitterThatCannotBeRemembered) {
  EXPECT_EQ(refusal({"sensors.mocap.jitter_s=0.02"}), "accepted");
  EXPECT_EQ(refusal({"sensors.mocap.jitter_law=normal"}),
            "--set sensors.mocap.jitter_law=normal: mocap.jitter_law: \"normal\" is not known; accepted: \"uniform\", "
            "\"exponential\"");
  EXPECT_EQ(
      refusal({"sensors.mocap.jitter_s=0.02", "sensors.mocap.jitter_law=exponential"}),
      "--set sensors.mocap.jitter_s=0.02: mocap.jitter_s: lets poses be 0.16 s late, and the motion is remembered for "
      "64 control periods; accepted: at most 0.0118");
}

TEST(FlyConfig, DrawsAJitterOfEachFlight) {
  const rollout::FlyConfig c = rollout::read_fly_config(source_path("configs/fly/escape_robust.toml"));
  EXPECT_TRUE(c.fleet.sensors.mocap.jitter_drawn && c.fleet.task.action_late_drawn);
  EXPECT_EQ(c.fleet.sensors.mocap.jitter_s, 0.01);
  EXPECT_EQ(c.fleet.task.action_late_most, 3U);
  const auto refused = [](const std::vector<std::string>& o) {
    return message([&] { rollout::read_fly_config(source_path("configs/fly/escape_robust.toml"), o); });
  };
  EXPECT_EQ(refused({"sensors.mocap.jitter_s=0.01"}),
            source_path("configs/fly/escape_robust.toml") +
                ":27:11: drawn_jitter.mocap_s: is drawn, but mocap.jitter_s of the sensors is fixed; accepted: one of "
                "both");
  EXPECT_NE(
      refused({"task.action.jitter_s=0.002"}).find("action_s: is drawn, but action.jitter_s of the task is fixed"),
      std::string::npos);
  EXPECT_NE(refused({"drawn_jitter.action_s=0.003"}).find("is no whole number of control periods"), std::string::npos);
  EXPECT_EQ(refused({"drawn_jitter.action_s=0.01"}),
            "--set drawn_jitter.action_s=0.01: drawn_jitter.action_s: is no whole number of control periods below "
            "action.repeat_s of the task; accepted: n x 0.002 s, less than 0.01 s");
  EXPECT_EQ(refused({"drawn_jitter.mocap_s=0.1"}),
            "--set drawn_jitter.mocap_s=0.1: drawn_jitter.mocap_s: lets poses be 0.1 s late, and the motion is "
            "remembered for 64 control periods; accepted: at most 0.094");
  EXPECT_EQ(refused({"drawn_jitter.mocap_s=0", "drawn_jitter.action_s=0"}), "accepted");
}

TEST(FlyConfig, ReadsShapesAndLetsVehiclesWithPointsTouch) {
  const auto read = [](const std::vector<std::string>& o) {
    return rollout::read_fly_config(source_path("configs/fly/landing.toml"), o);
  };
  const rollout::FlyConfig c = read({"world.sphere=[{centre_m=[1, 2, 3], radius_m=0.5}]",
                                     "world.cylinder=[{from_m=[0, 0, 0], to_m=[0, 2, 0], radius_m=0.1}]"});
  const std::vector<sim::Shape>& shapes = c.fleet.batch.world.shapes;
  ASSERT_EQ(shapes.size(), 3u);
  EXPECT_EQ(shapes[0].kind, sim::Shape::Kind::sphere);
  EXPECT_EQ(shapes[0].centre_m[2], 3);
  EXPECT_EQ(shapes[1].half_m[2], 0.05);
  EXPECT_EQ(shapes[2].centre_m[1], 1);
  EXPECT_EQ(shapes[2].half_m[2], 1);
  EXPECT_NEAR(shapes[2].attitude[1], -std::sqrt(0.5), 1e-15) << "its z is y of the world";
  EXPECT_EQ(c.fleet.task.constants.contact_ends, 0) << "it has points of contact, and its task does not say";
  EXPECT_EQ(read({"task.end.contact=true"}).fleet.task.constants.contact_ends, 1);
  const std::string nominal = "vehicle=" + source_path("configs/vehicles/hummingbird_nominal.toml");
  EXPECT_EQ(read({nominal}).fleet.task.constants.contact_ends, 1);
  const auto refused = [&](const std::string& o) { return message([&] { read({o}); }); };
  EXPECT_EQ(
      refused("vehicle.contact.left_wing_tip.stiffness_N_m=2000"),
      "--set vehicle.contact.left_wing_tip.stiffness_N_m=2000: contact.left_wing_tip.stiffness_N_m: the points of "
      "this body are too stiff for its mass in steps of 0.00025 s; accepted: up to 286.932 N/m where all its points "
      "are softer by as much, or shorter steps");
  EXPECT_EQ(refused("vehicle.contact.top.on=nose"),
            "--set vehicle.contact.top.on=nose: contact.top.on: \"nose\" is not known; accepted: \"torso\", "
            "\"left.leading_edge\", \"left.wing\", \"right.leading_edge\", \"right.wing\"");
  EXPECT_EQ(refused("vehicle.contact.top.friction=-1"),
            "--set vehicle.contact.top.friction=-1: contact.top.friction: -1 is out of range; accepted: a number from "
            "0 to 10");
  EXPECT_EQ(refused("vehicle.contact.top.frictoin=1").substr(0, 72),
            "--set vehicle.contact.top.frictoin=1: contact.top.frictoin: unknown key;");
}

TEST(FlyConfig, RefusesWhatCannotBeMeant) {
  const fs::path escape = source_path("configs/fly/escape.toml");
  const auto refused = [&](const std::vector<std::string>& overrides, const fs::path& file) {
    const std::string what = refusal(overrides, file);
    return what.substr(what.find(": ") + 2);
  };
  EXPECT_EQ(refusal({"vehicle.effects.tether.line_kg_m=2e-4"}, escape), "accepted");
  EXPECT_EQ(
      refused({"vehicle.effects.tether.line_kg_m=2e-4"}, source_path("configs/fly/hover_direct.toml")),
      "world.ground_z_m: is missing, and the vehicle's tether hangs down to it; accepted: the ground's height, m");
  EXPECT_EQ(refused({"changes.swapped_wings=true"}, source_path("configs/fly/flapper_nimble.toml")),
            "changes.swapped_wings: is of a vehicle whose wings are no bodies of their own; accepted: a vehicle with "
            "wings and motors");
  EXPECT_EQ(refused({"controller=../controllers/none.toml"}, escape),
            "task: \"escape\" starts from hover, but there is no controller that hovers; accepted: a controller, or a "
            "task of another start");
  EXPECT_NE(refusal({"task.success.keep.until_s=0.1"}, escape).find("accepted: a number from 0.6 "), std::string::npos);
  EXPECT_NE(refusal({"task.end.distance_m=-1"}, escape).find("accepted: a number from 0 "), std::string::npos);
  EXPECT_NE(refusal({"task.hand_back.distance_m=-1"}, escape).find("accepted: a number from 0 "), std::string::npos);
  EXPECT_NE(refusal({"vehicle.effects.mocap_delay.delay_s=-0.02", "sensors.mocap.latency_s=0.01"}, escape)
                .find("shows poses before they were"),
            std::string::npos);
  EXPECT_NE(refusal({"vehicle.driver.hold_s=0.008"}, escape).find("longer than a quarter of a beat"),
            std::string::npos);
}

TEST(FlyConfig, RefusesAVehicleWhoseForcesStandInFiles) {
  std::string text = io::read_text(source_path("configs/vehicles/flapper_nimble.toml"));
  text.replace(text.find("beat_averaged"), 13, "predicted").erase(text.find("[wrench."));
  const std::string file = testing::TempDir() + "/predicted.toml";
  std::ofstream(file) << text;
  EXPECT_EQ(refusal({"vehicle=" + file}),
            file +
                ":6:9: model: a vehicle whose forces stand in files of recorded flights cannot be flown; accepted: "
                "\"multibody\", \"beat_averaged\" or \"jointed\"; flappy-gap diagnose takes it");
}

TEST(FlyConfig, TellsOfAMisspeltTableOfATaskBeforeAMissingOne) {
  const Folder folder;
  std::string text = io::read_text(source_path("configs/tasks/hover.toml"));
  text.resize(text.find("[end]"));
  folder.write("task.toml", text + "[sucess]\n");
  const std::string file = (folder / "task.toml").string(), line = refusal({"task=" + file});
  EXPECT_TRUE(line.starts_with(file + ":") && line.ends_with("did you mean \"success\"?")) << line;
}

TEST(FlyConfig, RefusesAnActorOfAnotherTask) {
  const Folder folder;
  policy::Actor a;
  a.task = "hover";
  for (const Signal& s : rollout::read_fly_config(kHover).fleet.task.observation()) a.observation.push_back(s.name);
  a.action = {"amplitude", "difference", "bias", "split_cycle"};
  a.widths = {static_cast<int>(a.observation.size()), 4};
  a.mean.assign(a.observation.size(), 0);
  a.scale.assign(a.observation.size(), 1);
  a.weights.assign(policy::weight_count(a.widths), 0);
  write_actor(folder / "good.json", a);
  EXPECT_EQ(refusal({"actor=" + (folder / "good.json").string()}), "accepted");
  std::swap(a.observation[0], a.observation[1]);
  write_actor(folder / "swapped.json", a);
  const std::string line = refusal({"actor=" + (folder / "swapped.json").string()});
  EXPECT_NE(line.find("actor: observes something else than task \"hover\"; accepted: R_xx, R_xy"), std::string::npos)
      << line;
}

TEST(FlyConfig, ResolvedTextsFlyTheSame) {
  for (const char* name : {"hover_randomised", "figure_eight"}) {
    const Folder folder;
    const rollout::FlyConfig c =
        rollout::read_fly_config(source_path(std::string("configs/fly/") + name + ".toml"),
                                 {"flight.duration_s=0.1", "controller.attitude.yaw.p=0.1", "flight.seed=3"});
    for (const auto& [file, text] : c.resolved) folder.write(file, text);
    EXPECT_EQ(rollout::fly(rollout::read_fly_config(folder / "fly.toml"), {.count = 2}).hash,
              rollout::fly(c, {.count = 2}).hash)
        << name;
  }
}

TEST(FlyConfig, LeavesVoltagesToThePolicyAlone) {
  const std::string config = source_path("configs/fly/hover_voltages.toml");
  const rollout::FlyConfig c = rollout::read_fly_config(config);
  EXPECT_EQ(c.fleet.task.constants.action_high[0], c.vehicle.left.motor.voltage_limit_V);
  EXPECT_EQ(c.fleet.task.constants.action_low[1], -c.vehicle.right.motor.voltage_limit_V);
  const std::string sets = ", but the actions of task \"hover_voltages\" are the motors' voltages; accepted: ";
  const std::string pid = source_path("configs/controllers/pid.toml");
  EXPECT_EQ(refusal({"controller=" + pid}, config),
            "--set controller=" + pid + ": controller: is \"pid\"" + sets + "a file of kind = \"none\"");
  EXPECT_EQ(
      refusal({"constant_input={amplitude_V=1}"}, config),
      "--set constant_input={amplitude_V=1}: constant_input: is added to inputs of the wing beat" + sets + "none");
  EXPECT_EQ(refusal({"constant_input={amplitude_V=0}"}, config), "accepted");
  const std::string step = "excitation=[{kind=\"step\", input=\"bias_V\", start_s=0, duration_s=1, height=1}]";
  EXPECT_NE(refusal({step}, config).find("excitation: is added to inputs of the wing beat" + sets), std::string::npos);
}

// ---- excitation

Excitation excitation(const std::string& text, const std::string& name = "e.toml") {
  const io::Table root = io::Config::parse(text, name).root();
  Excitation e = read_excitation(root, 10);
  root.finish();
  return e;
}

TEST(Excitation, StepLastsAsLongAsItSays) {
  const Excitation e = excitation(
      "constant_input = {amplitude_V = 9}\n"
      "[[excitation]]\nkind = \"step\"\ninput = \"amplitude_V\"\nstart_s = 0.3\nduration_s = 0.1\nheight = 2.5\n");
  int ticks = 0;
  for (int tick = 0; tick < 500; ++tick) {
    const double extra = e.at(tick * 0.002).amplitude_V - 9;
    EXPECT_TRUE(extra == 0 || extra == 2.5);
    if (extra != 0) ++ticks;
  }
  EXPECT_EQ(ticks, 50);
  EXPECT_EQ(e.at(150 * 0.002).amplitude_V, 11.5);
  EXPECT_EQ(e.at(200 * 0.002).amplitude_V, 9);
}

TEST(Excitation, SweepGoesThroughItsFrequencies) {
  const Excitation e = excitation(
      "[[excitation]]\nkind = \"sweep\"\ninput = \"bias_V\"\nstart_s = 1\nduration_s = 4\nfrom_hz = 2\nto_hz = "
      "6\namplitude = 0.5\n");
  EXPECT_EQ(e.at(0.999).bias_V, 0);
  EXPECT_EQ(e.at(5).bias_V, 0);
  for (const double t : {0.0, 0.3, 1.7, 3.99})
    EXPECT_NEAR(e.at(1 + t).bias_V, 0.5 * std::sin(2 * kPi * (2 * t + 0.5 * t * t)), 1e-12) << t;
}

std::string multisine(const std::string& input, const std::string& more = "") {
  return "[[excitation]]\nkind = \"multisine\"\ninput = \"" + input +
         "\"\nrms = 0.2\nfrom_hz = 0.5\nto_hz = 12\ncount = 20\nperiod_s = 10\n" + more;
}

TEST(Excitation, MultisinesAreOrthogonalAndAsStrongAsStated) {
  const Excitation e =
      excitation(multisine("amplitude_V") + multisine("difference_V") + multisine("bias_V") + multisine("split_cycle"));
  constexpr int kTicks = 5000;
  std::array<std::vector<double>, 4> u;
  for (int tick = 0; tick < kTicks; ++tick) {
    const sim::Input x = e.at(tick * 0.002);
    u[0].push_back(x.amplitude_V), u[1].push_back(x.difference_V), u[2].push_back(x.bias_V),
        u[3].push_back(x.split_cycle);
  }
  const auto product = [&](int a, int b) {
    double sum = 0;
    for (int k = 0; k < kTicks; ++k) sum += u[a][k] * u[b][k];
    return sum / kTicks;
  };
  for (int a = 0; a < 4; ++a) {
    EXPECT_NEAR(product(a, a), 0.04, 1e-12);
    for (int b = 0; b < a; ++b) EXPECT_NEAR(product(a, b), 0, 1e-12) << a << b;
    const double peak = *std::ranges::max_element(u[a], {}, [](double x) { return std::abs(x); });
    EXPECT_LT(std::abs(peak), 2.5 * 0.2);  // 20 sines in phase would reach 6.3
    const std::vector<int>& h = e.waves[static_cast<std::size_t>(a)].harmonics;
    EXPECT_EQ(h.size(), 20u);
    EXPECT_GE(h.front(), 5);
    EXPECT_LE(h.back(), 120);
  }
}

TEST(Excitation, MultisineRefusals) {
  EXPECT_EQ(message([] { excitation(multisine("bias_V") + multisine("bias_V", "start_s = -1\n")); }),
            "e.toml:17:11: excitation[1].start_s: -1 is out of range; accepted: a number from 0 to 1e+05");
  std::string other = multisine("bias_V");
  other.replace(other.find("period_s = 10"), 13, "period_s = 20");
  EXPECT_EQ(message([&] { excitation(multisine("bias_V") + other); }),
            "e.toml:16:12: excitation[1].period_s: differs from that of another multisine; accepted: one period, so "
            "that they "
            "do not correlate");
  std::string many = multisine("bias_V");
  many.replace(many.find("count = 20"), 10, "count = 117");
  EXPECT_EQ(message([&] { excitation(many); }),
            "e.toml:7:9: excitation[0].count: the band holds 116 harmonics of this multisine's own; accepted: at most "
            "that many; "
            "a longer period_s has more");
  EXPECT_EQ(message([] { excitation("[[excitation]]\nkind = \"noise\"\n"); }),
            "e.toml:2:8: excitation[0].kind: \"noise\" is not known; accepted: \"step\", \"sweep\", \"multisine\", "
            "\"script\"");
}

TEST(Excitation, ScriptHoldsEachRow) {
  const Folder folder;
  folder.write("s.csv", "t_s,amplitude_V,difference_V,bias_V,split_cycle\n0.1,9,0,0,0\n0.3,10,0.5,-1,0.02\n");
  const std::string text = "[[excitation]]\nkind = \"script\"\nfile = \"s.csv\"\n";
  const Excitation e = excitation(text, (folder / "e.toml").string());
  EXPECT_EQ(e.at(0.098).amplitude_V, 0);
  EXPECT_EQ(e.at(50 * 0.002).amplitude_V, 9);
  EXPECT_EQ(e.at(150 * 0.002).amplitude_V, 10);
  EXPECT_EQ(e.at(99).split_cycle, 0.02);
  EXPECT_EQ(e.at(99).bias_V, -1);
  folder.write("s.csv", "t_s,amplitude_V,difference_V,bias_V,split_cycle\n0.3,9,0,0,0\n0.3,10,0,0,0\n");
  EXPECT_EQ(message([&] { excitation(text, (folder / "e.toml").string()); }),
            (folder / "s.csv").string() +
                ":3: t_s does not come after that of the line before; accepted: times that increase");
}

}  // namespace
}  // namespace flappy::flight
