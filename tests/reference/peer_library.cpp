// The loads and the MJCF of a vehicle for scripts that drive engines in Python (scripts/results/peers.py).
#include <string>

#include "flappy/vehicle_file.hpp"
#include "mujoco_peer.hpp"

namespace {

using namespace flappy;

/// A vehicle file, and its MJCF.
struct Opened {
  model::Vehicle vehicle;
  std::string mjcf;
};

}  // namespace

extern "C" {

/// Lives as long as the program. A fault of the file ends the program with its message.
void* peer_open(const char* vehicle_file, double step_s) noexcept {
  auto* o = new Opened{model::read_vehicle(vehicle_file), {}};
  o->mjcf = reference::mujoco_xml(o->vehicle, {.step_s = step_s});
  return o;
}

const char* peer_mjcf(const void* opened) { return static_cast<const Opened*>(opened)->mjcf.c_str(); }

/// `state`: position, attitude w x y z, velocity in W, rate in B, strokes, rotations, stroke and rotation rates; left before right.
/// `loads`, of the left wing, then of the right one: normal force, its span and depth, damping moment, torque at the stroke, at the rotation.
void peer_loads(const void* opened, const double state[21], double left_V, double right_V, double loads[12]) {
  const model::Vehicle& vehicle = static_cast<const Opened*>(opened)->vehicle;
  reference::PeerState s;
  const double* from = state;
  const auto take = [&](auto& to) {
    for (double& value : to) value = *from++;
  };
  take(s.p_WB_W_m), take(s.q_WB), take(s.v_WB_W_m_s), take(s.w_WB_B_rad_s);
  take(s.stroke_rad), take(s.rotation_rad), take(s.stroke_rate_rad_s), take(s.rotation_rate_rad_s);
  const reference::Loads found = reference::loads_at(vehicle, {}, s, {left_V, right_V});
  for (std::size_t i : {0u, 1u}) {
    const reference::WingLoad& wing = found.wing[i];
    for (const double value : {wing.normal_force_N, wing.span_m, wing.depth_m, wing.damping_moment_Nm,
                               found.stroke_Nm[i] + found.spring_Nm[i], found.rotation_Nm[i]})
      *loads++ = value;
  }
}
}
