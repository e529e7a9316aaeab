// The vehicle in DART: articulated bodies, hard stops by impulse, the rotor's inertia from the previous
// step's acceleration as in the published simulator. Built with -march=native, Debian's library segfaults.
#pragma once

#include <memory>

#include "peer.hpp"

namespace flappy::reference {

struct DartSettings {
  /// DART's own stroke spring, as published; it is implicit, which damps the stroke.
  bool implicit_spring = false;
};

class DartPeer {
 public:
  /// At rest at the origin, level, all joints at zero.
  DartPeer(const model::Vehicle& vehicle, const PeerOptions& options, const DartSettings& settings = {});
  ~DartPeer();

  /// Advances by one step with these voltages at the motors.
  void step(double left_V, double right_V);

  PeerState state() const;
  /// A welded torso stays where it is; the step that follows knows no rotor inertia.
  void set_state(const PeerState& state);
  double time_s() const;

  /// Of the last step, at the state from which it started.
  const Loads& loads() const;
  Wrench wrench() const;

 private:
  struct Engine;  // keeps DART and Eigen out of programs built for newer processors
  model::Vehicle vehicle_;
  PeerOptions options_;
  DartSettings settings_;
  std::unique_ptr<Engine> engine_;
  PeerState start_;
  Loads loads_;
};

}  // namespace flappy::reference
