// What is flown, as configs/fly/*.toml state it: a vehicle, a task, sensors and a controller, each a file of its own.
//
//   schema = 1
//   vehicle, task, sensors, controller = "file"     relative to the folder of the configuration, as the next
//   actor, randomisation = "file"                   optional
//   precision = "float" | "double"
//   [flight]          duration_s, seed; first_flapper (0: number of the first flight), settle_s (3), control_hz (500),
//                     step_s (250e-6), threads (0: all), support ("task", or "welded": on a stand)
//   [world]           gravity_m_s2, ground_z_m, ceiling_z_m, walls = [[x_m, y_m, normal_x, normal_y], ...]
//   [[world.sphere]]  centre_m = [x, y, z], radius_m
//   [[world.box]]     centre_m, edges_m, rotation_rad = [x, y, z] (a rotation vector, optional)
//   [[world.cylinder]] from_m, to_m (ends of its axis), radius_m
//   [constant_input]  and [[excitation]]: excitation.hpp
//   [log.power]       battery_nominal_V, rate_hz, latency_s, voltage_noise_V, current_noise_A
//   [log.wings]       rate_hz, noise_rad
//   [dds]             io/dds_config.hpp; no part of what is flown, so `resolved` leaves it out
//
// An override "controller.attitude.pitch.p=4" belongs to the file of that name; "controller=other.toml" replaces it.
#pragma once

#include <map>
#include <memory>
#include <optional>

#include "flight/excitation.hpp"
#include "flight/fleet.hpp"
#include "flightlog/flight_log.hpp"
#include "io/dds_config.hpp"
#include "rollout/watch.hpp"
#include "sim/randomise.hpp"

namespace flappy::rollout {

/// What a log has beyond the streams that every log has.
struct LogOptions {
  std::optional<flightlog::PowerHeader> power;
  std::optional<flightlog::WingsHeader> wings;
};

struct FlyConfig {
  std::string vehicle_file_name;  ///< without folder
  std::string vehicle_sha256;     ///< of that file; empty where an override made another vehicle of it
  std::string vehicle_text;       ///< of that file; of the vehicle that overrides made of it
  model::Vehicle vehicle;
  std::optional<sim::Randomisation> randomisation;
  /// What every vehicle has besides, randomised or not: as model::Vehicle::effects.
  std::map<std::string, std::map<std::string, double>> added_effects;
  flight::FleetOptions fleet;
  std::string precision;
  double duration_s = 0, settle_s = 0;
  bool welded = false;
  flight::Excitation excitation;
  LogOptions log;
  std::shared_ptr<const policy::Actor> actor;
  io::DdsConfig dds;
  std::shared_ptr<Watch> watch;  ///< is shown flappers as they fly
  /// Texts of the files that were read, overrides applied and defaults filled in, by name; fly.toml names the others.
  /// Actors and scripts stay where they are.
  std::map<std::string, std::string> resolved;

  /// The vehicle of a flapper: another one each, in each of its episodes, where they are randomised.
  model::Vehicle vehicle_of(std::uint32_t flapper, std::uint32_t episode = 0) const;
};

/// The same, shown to nobody.
FlyConfig unwatched(FlyConfig config);

/// io::InputError for whatever is missing, unknown, out of range or does not fit together.
FlyConfig read_fly_config(const std::filesystem::path& path, const std::vector<std::string>& overrides = {});

}  // namespace flappy::rollout
