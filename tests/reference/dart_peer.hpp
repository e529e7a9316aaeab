// The vehicle in DART: articulated bodies, hard stops by impulse. DART's joints have no rotor: its inertia
// stands in the leading edge, where stops feel it, too; what the torso feels of it besides is taken back, by the previous
// step's accelerations.
// Built with -march=native, Debian's library segfaults.
#pragma once

#include <memory>
#include <string>

#include "peer.hpp"

namespace flappy::reference {

/// "6.12.1"
std::string dart_version();

struct DartSettings {
  /// DART's own stroke spring, as published; it is implicit, which damps the stroke.
  bool implicit_spring = false;
  bool joint_damping = false;  ///< linear damping of motors and hinges as the joints' own, which DART takes implicitly
  bool rotor_lags = false;     ///< all of the rotor's torque from the previous step's acceleration, as published
};

class DartPeer {
 public:
  /// At rest at the origin, level, all joints at zero.
  DartPeer(const model::Vehicle& vehicle, const PeerOptions& options, const DartSettings& settings = {});
  ~DartPeer();

  /// Advances by one step with these voltages at the motors.
  void step(double left_V, double right_V);

  PeerState state() const;
  /// A welded torso stays where it is; the step that follows knows no accelerations.
  void set_state(const PeerState& state);
  double time_s() const;

  /// Of the last step, at the state from which it started.
  const Loads& loads() const;
  Wrench wrench() const;

 private:
  void relieve_torso();

  struct Engine;  // keeps DART and Eigen out of programs built for newer processors
  model::Vehicle vehicle_;
  PeerOptions options_;
  DartSettings settings_;
  std::unique_ptr<Engine> engine_;
  PeerState start_;
  Loads loads_;
};

}  // namespace flappy::reference
