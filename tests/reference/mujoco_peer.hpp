// The vehicle in MuJoCo: joint coordinates, the rotor's inertia in the mass matrix, soft stops.
#pragma once

#include <memory>
#include <string>

#include "peer.hpp"

struct mjModel_;
struct mjData_;

namespace flappy::reference {

/// "2.2.2". Throws std::runtime_error if the library is not that of the headers, whose structs it fills.
std::string mujoco_version();

bool mujoco_has_implicitfast();  ///< from 2.3.5 on

/// A model of an MJCF text; the caller deletes it. Throws std::runtime_error with MuJoCo's own words.
mjModel_* mujoco_model(const std::string& xml);

/// Defaults are the fastest with the same physics, and the stops of the reference trajectories.
struct MujocoSettings {
  std::string integrator = "Euler";  ///< "implicit", "RK4", "implicitfast" where there is one
  std::string solver = "PGS";        ///< or "Newton", "CG"; they agree within 1e-4 mm after 0.3 s
  /// Linear damping of motors and hinges as the joints' own, which all integrators but RK4 take implicitly; else it comes with
  /// the loads.
  bool joint_damping = false;
  /// Time constant of the stops' damping, at least two steps; at 0.2 ms a wing overshoots by 0.025 rad.
  double stop_time_s = 2e-4;
  /// A critically damped stop (1) throws the wing back at 13.5 % of its speed however short its time
  /// constant; 4 with a time constant of two steps tends to the hard stop.
  double stop_damping_ratio = 1;
  double stop_impedance = 0.999;  ///< at 1 mrad beyond the stop
};

/// Stops of MuJoCo's defaults: solref = "0.02 1", solimp = "0.9 0.95 0.001".
inline MujocoSettings with_default_stops(MujocoSettings settings) {
  settings.stop_time_s = 0.02, settings.stop_damping_ratio = 1, settings.stop_impedance = 0.95;
  return settings;
}

/// The vehicle as MJCF, without loads and springs.
std::string mujoco_xml(const model::Vehicle& vehicle, const PeerOptions& options, const MujocoSettings& settings = {});

class MujocoPeer {
 public:
  /// At rest at the origin, level, all joints at zero.
  MujocoPeer(const model::Vehicle& vehicle, const PeerOptions& options, const MujocoSettings& settings = {});

  /// Advances by one step with these voltages at the motors.
  void step(double left_V, double right_V);

  PeerState state() const;
  void set_state(const PeerState& state);  ///< a welded torso stays where it is
  double time_s() const;
  /// Whether MuJoCo met a state beyond its bounds, upon which it starts anew.
  bool diverged() const;

  /// Of the last step, at the state from which it started.
  const Loads& loads() const { return loads_; }
  Wrench wrench() const { return aerodynamic_wrench(vehicle_, start_, loads_); }

 private:
  /// Sets the loads at the state of an integrator's stage.
  static void load_stage(const mjModel_* model, mjData_* data);

  model::Vehicle vehicle_;
  PeerOptions options_;
  bool joint_damping_;
  PerWing voltage_V_{};
  bool first_stage_ = false;
  std::unique_ptr<mjModel_, void (*)(mjModel_*)> model_;
  std::unique_ptr<mjData_, void (*)(mjData_*)> data_;
  PeerState start_;
  Loads loads_;
};

}  // namespace flappy::reference
