// Configuration of flights, as in configs/fly/*.toml.
//
//   schema = 1
//   vehicle, task, sensors, controller = "file"     paths, also those below, are relative to the configuration's folder
//   actor, randomisation = "file"                   optional
//   precision = "float" | "double"
//   [flight]          duration_s, seed; first_flapper (0: number of the first flight), settle_s (3), control_hz (500),
//                     step_s (250e-6), threads (0: all), support ("task", or "welded": on a stand)
//   [world]           gravity_m_s2, ground_z_m, ceiling_z_m, walls = [[x_m, y_m, normal_x, normal_y], ...]
//   [[world.sphere]]  centre_m = [x, y, z], radius_m
//   [[world.box]]     centre_m, edges_m, rotation_rad = [x, y, z] (a rotation vector, optional)
//   [[world.cylinder]] from_m, to_m (ends of its axis), radius_m
//   [constant_input]  and [[excitation]]: excitation.hpp
//   [drawn_effects]   effects of the catalogue that each vehicle draws: drawn_effects.hpp
//   [drawn_jitter]    mocap_s, action_s (0): most jitter of poses and actions; each flight draws its own, uniform from 0
//   [changes]         what was done to the robot on purpose: model/changes.hpp
//   [log.power]       battery_nominal_V, rate_hz, latency_s, voltage_noise_V, current_noise_A
//   [log.wings]       rate_hz, noise_rad
//   [log]             wing_loads = true: wing_loads.csv beside the log, of vehicles with hinged wings (default false)
//   [log.rig]         welded: forces.csv in place of motion capture and IMU. Keys of [rig] in flight.toml, but rate_hz
//   [dds]             io/dds_config.hpp; it does not change the flights, so `resolved` leaves it out
// Override "controller.attitude.pitch.p=4" applies to the controller's file; "controller=other.toml" replaces the file.
#pragma once

#include <map>
#include <memory>
#include <optional>

#include "flight/excitation.hpp"
#include "flight/fleet.hpp"
#include "flightlog/flight_log.hpp"
#include "io/dds_config.hpp"
#include "model/changes.hpp"
#include "rollout/drawn_effects.hpp"
#include "rollout/watch.hpp"
#include "sim/randomise.hpp"

namespace flappy::rollout {

struct LogOptions {
  std::optional<flightlog::PowerHeader> power;
  std::optional<flightlog::WingsHeader> wings;
  std::optional<flightlog::RigHeader> rig;
  bool wing_loads = false;
};

struct FlyConfig {
  std::string vehicle_file_name;  ///< without folder
  std::filesystem::path controller_file;
  std::string vehicle_sha256;  ///< SHA-256 of that file; empty if overrides or randomisation change the vehicle
  std::string vehicle_text;    ///< text of that file; with overrides, the resolved text
  model::Vehicle vehicle;
  std::optional<sim::Randomisation> randomisation;
  std::optional<DrawnEffects> drawn_effects;  ///< added to each vehicle, before added_effects
  /// Effects that are added to every vehicle, randomised or not; same form as model::Vehicle::effects.
  std::map<std::string, std::map<std::string, double>> added_effects;
  model::Changes changes;  ///< made to every vehicle, last
  flight::FleetOptions fleet;
  std::string precision;
  double duration_s = 0, settle_s = 0;
  bool welded = false;
  flight::Excitation excitation;
  LogOptions log;
  std::shared_ptr<const policy::Actor> actor;
  io::DdsConfig dds;
  std::shared_ptr<Watch> watch;  ///< observer of the flights; may be null
  /// Texts by file name, overrides applied, defaults filled in; fly.toml names the others. Without actors and scripts.
  std::map<std::string, std::string> resolved;

  /// The vehicle of a flapper in an episode. With randomisation or drawn effects, every flapper and episode has a
  /// vehicle of its own.
  model::Vehicle vehicle_of(std::uint32_t flapper, std::uint32_t episode = 0) const;
  bool draws_vehicles() const { return randomisation.has_value() || drawn_effects.has_value(); }
  /// From now on every flapper has the nominal vehicle, besides added_effects and changes.
  void draw_no_vehicles();
  /// The vehicle with all effects that may be drawn, without their forces: a fleet of it never has to make room for their
  /// memory, so that checkpoints of it are of one size.
  model::Vehicle roomy_vehicle() const;
};

FlyConfig unwatched(FlyConfig config);

/// Throws io::InputError for anything that is missing, unknown, out of range or inconsistent.
FlyConfig read_fly_config(const std::filesystem::path& path, const std::vector<std::string>& overrides = {});

}  // namespace flappy::rollout
