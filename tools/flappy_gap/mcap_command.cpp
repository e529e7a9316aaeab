#include "mcap_command.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "flappy/vehicle_file.hpp"
#include "flightlog/ros/flight_mcap.hpp"
#include "gap/replay/reset_prediction.hpp"
#include "gap/replay/residuals.hpp"
#include "gap/result/diagnosis_json.hpp"
#include "io/files.hpp"
#include "io/installation.hpp"
#include "io/refuse.hpp"

namespace flappy::gap {
namespace {

using Json = nlohmann::ordered_json;
using flightlog::ros::VehicleTopics;
namespace fs = std::filesystem;

struct DiagnosedVehicles {
  Diagnosis result;
  model::Vehicle declared, corrected;
};

DiagnosedVehicles read_diagnosis(const McapCommand& command) {
  const fs::path file = command.diagnosis / kDiagnosisFile, vehicle = command.diagnosis / kVehicleFile;
  const char* const accepted = "the folder of a finished flappy-gap diagnose --out";
  if (!fs::exists(file)) io::refuse(command.diagnosis, std::string("has no ") + kDiagnosisFile, accepted);
  if (!fs::exists(vehicle))
    io::refuse(command.diagnosis, std::string("has no ") + kVehicleFile + ": its data are faulty, or it was stopped",
               accepted);
  Json json = Json::parse(io::read_text(file), nullptr, false);
  if (json.is_discarded()) io::refuse(file, "is no JSON", "what flappy-gap diagnose wrote");
  DiagnosedVehicles d{diagnosis_from(json, file), model::read_vehicle(command.vehicle), model::read_vehicle(vehicle)};
  if (d.corrected.name != d.declared.name + "_corrected")
    io::refuse(command.vehicle, "is " + d.declared.name + ", but " + vehicle.string() + " is " + d.corrected.name,
               "the vehicle file that was diagnosed");
  return d;
}

bool same_folder(const fs::path& one, const fs::path& other) {
  return fs::weakly_canonical(one / "flight.toml") == fs::weakly_canonical(other / "flight.toml");
}

bool is_among(const fs::path& flight, const std::vector<std::string>& flights) {
  return std::ranges::any_of(flights, [&](const std::string& f) { return same_folder(flight, f); });
}

/// The errors of sensors that a diagnosis states: those that its flights do not show are 0.
void add_sensors(const Diagnosis& diagnosis, VehicleHypothesis& h) {
  for (const Estimate& e : diagnosis.sensors) {
    const std::size_t dot = e.name.find('.');
    const std::string id = e.name.substr(0, dot), value = e.name.substr(dot + 1);
    if (id == "imu") {  // imu.latency_s
      h.lag_s = e.value;
      continue;
    }
    if (value.starts_with("x_") || value.starts_with("y_") || value.starts_with("z_"))
      for (const char* axis : {"x", "y", "z"}) h.sensors[id].try_emplace(axis + value.substr(1), 0);
    h.sensors[id][value] = e.value;
  }
}

std::array<double, 3> array_of(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

VehicleTopics topics_of(const std::string& name, const std::shared_ptr<const PredictedFlight>& flight,
                        const VehicleHypothesis& h, const fs::path& file) {
  EffectValues sensors = sensor_effects(h.vehicle.effects);
  sensors.insert(h.sensors.begin(), h.sensors.end());
  const auto seen =
      std::dynamic_pointer_cast<const ResetPrediction>(sensors.empty() ? flight : flight->corrected(sensors));
  VehicleTopics topics;
  topics.name = name;
  for (const ImuResidual& r : seen->imu_residuals(h))
    topics.imu.push_back({r.sample, array_of(r.force_m_s2), array_of(r.rate_rad_s)});
  const Residuals left = residuals({{}, {flight}}, {h}, 1).front();
  if (topics.imu.empty() || left.empty())
    io::refuse(file, "its simulation of this flight diverges, or no part of the flight can be replayed",
               "a vehicle that flies what was flown");
  for (std::size_t j = 0; j < seen->beats(); ++j) {
    if (!seen->covers(j, kSpecificForceX) || !seen->covers(j, kAngularAccelerationX)) continue;
    const auto mean = [&](int channel) {
      return left.front()[j * kRowsPerBeat + static_cast<std::size_t>(channel) * kCoefficients];
    };
    topics.beats.push_back({seen->recording()->regimes[j].t_s,
                            {mean(kSpecificForceX), mean(kSpecificForceY), mean(kSpecificForceZ)},
                            {mean(kAngularAccelerationX), mean(kAngularAccelerationY), mean(kAngularAccelerationZ)}});
  }
  return topics;
}

/// Specific forces, then angular accelerations, in the order of the axes.
std::array<double, 6> rms_of(const std::vector<VehicleTopics::Beat>& beats) {
  std::array<double, 6> rms{};
  for (const VehicleTopics::Beat& b : beats)
    for (std::size_t k = 0; k < 3; ++k) {
      rms[k] += b.force_m_s2[k] * b.force_m_s2[k];
      rms[3 + k] += b.turning_rad_s2[k] * b.turning_rad_s2[k];
    }
  for (double& x : rms) x = std::sqrt(x / static_cast<double>(std::max<std::size_t>(1, beats.size())));
  return rms;
}

}  // namespace

Json run_mcap(const McapCommand& command) {
  if (command.out.extension() != ".mcap")
    io::refuse(command.out, "is no name of an MCAP file", "a name that ends with .mcap");
  const auto file_of = [&](const char* extension) { return fs::path(command.out).replace_extension(extension); };
  const std::array<std::pair<fs::path, const char*>, 2> layouts = {
      {{file_of(".foxglove.json"), "viewers/foxglove.json"}, {file_of(".plotjuggler.xml"), "viewers/plotjuggler.xml"}}};
  for (const fs::path& file : {command.out, layouts[0].first, layouts[1].first}) {
    if (fs::exists(file)) io::refuse(file, "exists", "a name that is not in use");
    io::check_output(file);
  }
  const DiagnosedVehicles d = read_diagnosis(command);
  const bool reference = is_among(command.flight, d.result.reference);
  if (!reference && !is_among(command.flight, d.result.flights)) {
    std::vector<std::string> all = d.result.flights;
    all.insert(all.end(), d.result.reference.begin(), d.result.reference.end());
    io::refuse(command.flight, "is no flight of " + command.diagnosis.string(), io::joined(all));
  }
  const flightlog::FlightLog log = flightlog::read_flight_log(command.flight);
  flightlog::require_flown(log, command.flight);
  const auto flight = std::make_shared<const ResetPrediction>(Recording(command.flight, log, d.declared));
  VehicleHypothesis declared{d.declared, 0}, corrected{d.corrected, 0};
  if (reference)  // the verdict's effects appeared after the reference flights
    for (const std::string& effect : d.result.verdict.effects) corrected.vehicle.effects.erase(effect);
  add_sensors(d.result, corrected);
  const std::vector<VehicleTopics> vehicles = {
      topics_of("declared", flight, declared, command.vehicle),
      topics_of("corrected", flight, corrected, command.diagnosis / kVehicleFile)};
  const std::uint64_t messages = flightlog::ros::write_flight_mcap(command.out, log, vehicles);
  for (const auto& [file, name] : layouts) io::write_atomically(file, io::read_text(io::config_path(name)));

  std::printf("%s: %llu messages\n", command.out.c_str(), static_cast<unsigned long long>(messages));
  std::printf("rms of measured less predicted, means of beats:\n  %-22s %10s %10s\n", "", "declared", "corrected");
  const std::array<double, 6> before = rms_of(vehicles[0].beats), after = rms_of(vehicles[1].beats);
  constexpr std::array<int, 6> kShown = {kSpecificForceX,       kSpecificForceY,       kSpecificForceZ,
                                         kAngularAccelerationX, kAngularAccelerationY, kAngularAccelerationZ};
  Json rms = Json::object();
  for (std::size_t k = 0; k < kShown.size(); ++k) {
    std::printf("  %-22s %10.3g %10.3g %s\n", channel_name(kShown[k]), before[k], after[k], channel_unit(kShown[k]));
    rms[channel_name(kShown[k])] = {
        {"declared", before[k]}, {"corrected", after[k]}, {"unit", channel_unit(kShown[k])}};
  }
  std::printf("layouts: %s, %s\n", layouts[0].first.c_str(), layouts[1].first.c_str());
  return {{"mcap", command.out.string()},
          {"messages", messages},
          {"layouts", {layouts[0].first.string(), layouts[1].first.string()}},
          {"rms", rms}};
}

}  // namespace flappy::gap
