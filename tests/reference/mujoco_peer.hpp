// The vehicle in MuJoCo: joint coordinates, the rotor's inertia in the mass matrix, soft stops.
#pragma once

#include <memory>
#include <string>

#include "peer.hpp"

struct mjModel_;
struct mjData_;

namespace flappy::reference {

/// Defaults are the fastest with the same physics, and the stops of the reference trajectories.
struct MujocoSettings {
  std::string integrator = "Euler";  ///< or "implicit"; MuJoCo's split step has no RK4
  std::string solver = "PGS";        ///< or "Newton", "CG"; they agree within 1e-4 mm after 0.3 s
  /// Time constant of the stops' damping, at least two steps; at 0.2 ms a wing overshoots by 0.025 rad.
  double stop_time_s = 2e-4;
  /// A critically damped stop (1) throws the wing back at 13.5 % of its speed however short its time
  /// constant; 4 with a time constant of two steps tends to the hard stop.
  double stop_damping_ratio = 1;
};

class MujocoPeer {
 public:
  /// At rest at the origin, level, all joints at zero.
  MujocoPeer(const model::Vehicle& vehicle, const PeerOptions& options, const MujocoSettings& settings = {});

  /// Advances by one step with these voltages at the motors.
  void step(double left_V, double right_V);

  PeerState state() const;
  void set_state(const PeerState& state);  ///< a welded torso stays where it is
  double time_s() const;

  /// Of the last step, at the state from which it started.
  const Loads& loads() const { return loads_; }
  Wrench wrench() const { return aerodynamic_wrench(vehicle_, start_, loads_); }

 private:
  model::Vehicle vehicle_;
  PeerOptions options_;
  std::unique_ptr<mjModel_, void (*)(mjModel_*)> model_;
  std::unique_ptr<mjData_, void (*)(mjData_*)> data_;
  PeerState start_;
  Loads loads_;
};

}  // namespace flappy::reference
