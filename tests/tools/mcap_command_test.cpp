#include "mcap_command.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "flappy/vehicle_file.hpp"
#include "flightlog/ros/bag.hpp"
#include "flightlog/ros/cdr.hpp"
#include "gap/result/diagnosis_json.hpp"
#include "io/files.hpp"
#include "refusal.hpp"
#include "rollout/fly.hpp"
#include "rollout/fly_fixture.hpp"

namespace flappy::gap::mcap_command_test {
namespace {

using flightlog::ros::Members;
const std::string kConfigs = FLAPPY_SOURCE_DIR "/configs/";
const std::string kNominal = kConfigs + "vehicles/hummingbird_nominal.toml";

model::Vehicle with_drag() {
  model::Vehicle vehicle = model::read_vehicle(kNominal);
  vehicle.effects["body_drag"] = {{"drag_area_m2", 0.006}, {"centre_z_m", 0}};
  vehicle.name += "_corrected";
  return vehicle;
}

/// A flight of four seconds with an effect, and a diagnosis that knows it.
class RunMcap : public testing::Test {
 protected:
  void SetUp() override {
    io::write_atomically(robot_, model::vehicle_text(with_drag()));
    rollout::FlyOptions options;
    options.log_folder = command_.flight;
    rollout::fly(rollout::read_fly_config(kConfigs + "fly/identify_multisine.toml",
                                          {"vehicle=" + robot_.string(), "flight.duration_s=4"}),
                 options);
    diagnosis_.flights = {command_.flight.string()};
    write();
  }
  void write() {
    io::make_folder(command_.diagnosis);
    write_diagnosis(command_.diagnosis, diagnosis_);
    io::write_atomically(command_.diagnosis / kVehicleFile, model::vehicle_text(with_drag()));
  }
  std::string refusal() const {
    return test::refusal([&] { run_mcap(command_); });
  }
  flight::Folder folder_;
  std::filesystem::path robot_ = folder_ / "robot.toml";
  McapCommand command_{folder_ / "flight", kNominal, folder_ / "diagnosis", folder_ / "f.mcap"};
  Diagnosis diagnosis_;
};

/// [topic][log time, ns] messages.
std::map<std::string, std::map<std::int64_t, Members>> read(const std::filesystem::path& file) {
  const auto bag = flightlog::ros::Bag::open(file);
  std::map<std::string, std::map<std::int64_t, Members>> seen;
  while (const auto m = bag->next())
    seen[m->topic->name][m->received_ns] = flightlog::ros::decode(*layout_of(*m->topic), m->bytes);
  return seen;
}

double mean(const std::map<std::int64_t, Members>& messages, const std::string& member) {
  double sum = 0;
  for (const auto& [t, m] : messages) sum += std::get<double>(m.at(member));
  return sum / static_cast<double>(messages.size());
}

double rms(const std::map<std::int64_t, Members>& messages, const std::string& member) {
  double sum = 0;
  for (const auto& [t, m] : messages) sum += std::pow(std::get<double>(m.at(member)), 2);
  return std::sqrt(sum / static_cast<double>(messages.size()));
}

TEST_F(RunMcap, WritesWhatBothVehiclesPredict) {
  const nlohmann::ordered_json json = run_mcap(command_);
  auto seen = read(command_.out);
  std::size_t messages = 0;
  for (const auto& [topic, all] : seen) messages += all.size();
  EXPECT_EQ(json["messages"], messages);
  const auto& imu = seen.at("/imu");
  for (const std::string vehicle : {"/declared", "/corrected"}) {
    const auto& predicted = seen.at(vehicle + "/imu");
    const auto& residual = seen.at(vehicle + "/residual");
    // at 500 Hz, all but the margins of the replay, 0.05 s each, and six beats to spin up, 0.18 s, with a beat to spare
    EXPECT_GT(predicted.size(), imu.size() - 500 * 4 / 10);
    EXPECT_EQ(predicted.size(), residual.size());
    EXPECT_GT(seen.at(vehicle + "/beat_residual").size(), 34u * 3);
    for (const auto& [t, left] : residual)
      for (const char* member : {"linear_acceleration.x", "linear_acceleration.y", "linear_acceleration.z",
                                 "angular_velocity.x", "angular_velocity.y", "angular_velocity.z"}) {
        const auto number = [&](const Members& m) { return std::get<double>(m.at(member)); };
        ASSERT_NEAR(number(left), number(imu.at(t)) - number(predicted.at(t)), 1e-12) << vehicle << " " << member;
      }
    EXPECT_NEAR(json["rms"]["specific_force_x"][vehicle.substr(1)],
                rms(seen.at(vehicle + "/beat_residual"), "accel.linear.x"), 1e-9);
  }
  // the robot's own model leaves the noise of the sensors: 0.5 m/s^2 and 0.0524 rad/s in configs/sensors
  EXPECT_LT(rms(seen.at("/corrected/residual"), "linear_acceleration.z"), 1.0);
  EXPECT_LT(rms(seen.at("/corrected/residual"), "angular_velocity.y"), 0.15);
  EXPECT_LT(rms(seen.at("/corrected/residual"), "linear_acceleration.z"), 0.5 * rms(imu, "linear_acceleration.z"));
  // the drag, which acts in the climb; what remains is the noise of the sensors
  EXPECT_LT(rms(seen.at("/corrected/beat_residual"), "accel.linear.z"),
            0.6 * rms(seen.at("/declared/beat_residual"), "accel.linear.z"));
  for (const char* layout : {"f.foxglove.json", "f.plotjuggler.xml"})
    EXPECT_GT(io::read_text(folder_ / layout).size(), 1000u);
}

TEST_F(RunMcap, UndoesTheErrorsOfSensorsThatWereFound) {
  run_mcap(command_);
  const auto level = read(command_.out);
  diagnosis_.sensors = {{"imu_mounting.y_rad", 0.01, 0, 0, "rad"}};  // 9.81 m/s^2 along z show as 0.098 along x
  write();
  command_.out = folder_ / "tilted.mcap";
  run_mcap(command_);
  const auto tilted = read(command_.out);
  const auto x = [](const auto& seen, const std::string& topic) {
    return mean(seen.at(topic), "linear_acceleration.x");
  };
  EXPECT_NEAR(x(tilted, "/declared/residual"), x(level, "/declared/residual"), 1e-9);
  EXPECT_NEAR(x(tilted, "/corrected/residual") - x(level, "/corrected/residual"), -0.098, 0.02);
}

// A spring of one wing that rests elsewhere turns the vehicle in each interval as it does in the mean of a beat.
TEST_F(RunMcap, RatesAddUpToTheTurningOfBeats) {
  model::Vehicle uneven = with_drag();
  uneven.left.spring.rest_angle_rad += 0.1;
  io::write_atomically(command_.diagnosis / kVehicleFile, model::vehicle_text(uneven));
  run_mcap(command_);
  const auto seen = read(command_.out);
  std::size_t clear = 0;
  for (const std::string axis : {"x", "y", "z"}) {
    const double beats = mean(seen.at("/corrected/beat_residual"), "accel.angular." + axis),
                 rates = 500 * mean(seen.at("/corrected/residual"), "angular_velocity." + axis);
    if (std::abs(beats) < 1) continue;
    EXPECT_NEAR(rates, beats, 0.1 * std::abs(beats)) << axis;
    ++clear;
  }
  EXPECT_GT(clear, 0u);
}

TEST_F(RunMcap, KnowsThatTheEffectCameAfterTheReference) {
  diagnosis_.reference = diagnosis_.flights;
  diagnosis_.flights.clear();
  diagnosis_.verdict = {VerdictKind::effect, {"body_drag"}, false, 0.9};
  write();
  const nlohmann::ordered_json rms = run_mcap(command_)["rms"]["specific_force_x"];
  EXPECT_EQ(rms["declared"], rms["corrected"]);
}

TEST_F(RunMcap, RefusesWhatItCannotCompare) {
  const std::string folder = command_.diagnosis.string(), flight = command_.flight.string();
  const auto with = [&](auto member, const std::filesystem::path& value) {
    McapCommand other = command_;
    other.*member = value;
    return test::refusal([&] { run_mcap(other); });
  };
  EXPECT_EQ(with(&McapCommand::out, folder_ / "f.bag"),
            (folder_ / "f.bag").string() + ": is no name of an MCAP file; accepted: a name that ends with .mcap");
  EXPECT_EQ(with(&McapCommand::diagnosis, flight),
            flight + ": has no diagnosis.json; accepted: the folder of a finished flappy-gap diagnose --out");
  EXPECT_EQ(with(&McapCommand::flight, folder), folder + ": is no flight of " + folder + "; accepted: " + flight);
  const std::string other = kConfigs + "vehicles/hummingbird_identified.toml";
  EXPECT_NE(with(&McapCommand::vehicle, other).find("; accepted: the vehicle file that was diagnosed"),
            std::string::npos);
  for (const char* name : {"f.mcap", "f.foxglove.json", "f.plotjuggler.xml"}) {
    io::write_atomically(folder_ / name, "mine");
    EXPECT_EQ(refusal(), (folder_ / name).string() + ": exists; accepted: a name that is not in use");
    EXPECT_EQ(io::read_text(folder_ / name), "mine");
    std::filesystem::remove(folder_ / name);
  }
  io::write_atomically(command_.diagnosis / kDiagnosisFile, "{");
  EXPECT_EQ(refusal(), folder + "/diagnosis.json: is no JSON; accepted: what flappy-gap diagnose wrote");
  std::filesystem::remove(command_.diagnosis / kVehicleFile);
  EXPECT_EQ(refusal(), folder +
                           ": has no vehicle_corrected.toml: its data are faulty, or it was stopped; accepted: the "
                           "folder of a finished flappy-gap diagnose --out");
  EXPECT_FALSE(std::filesystem::exists(command_.out));
}

}  // namespace
}  // namespace flappy::gap::mcap_command_test
