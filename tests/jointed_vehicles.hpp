// Vehicles with four angles a wing that several tests fly.
#pragma once

#include "flappy/vehicle.hpp"
#include "flappy/vehicle_file.hpp"
#include "vehicles.hpp"

namespace flappy::test {

/// Wings of the nominal flapper, as far as the air goes.
inline void put_plain_planform(model::Vehicle& v) {
  const model::Vehicle plain = nominal();
  v.left.planform = plain.left.planform;
  v.right.planform = plain.right.planform;
}

/// The shipped robot with driven wings, single-point.
inline model::Vehicle driven_hummingbird() {
  return model::read_any_vehicle(source_path("configs/vehicles/hummingbird_driven.toml"));
}

/// The same with strips, rotational lift and added mass; `free`: and rotation on an elastic hinge.
inline model::Vehicle insect(bool free, int strips = 20) {
  model::Vehicle v = driven_hummingbird();
  for (model::Jointed::Wing* w : {&v.jointed->left, &v.jointed->right}) {
    for (int i = 0; i < strips; ++i) {
      const double r = (i + 0.5) / strips, chord = 0.024 * (1 - 0.5 * r * r);
      w->strips.push_back({0.07 * r, 0.07 / strips, chord, 0.2 * chord});
    }
    w->rotational_lift = 1, w->added_mass = 0.5, w->rotational_damping_coefficient = 2;
    w->normal_sin = {3.4}, w->tangential_cos = {0.2, 0, 0.1};
    if (!free) continue;
    w->angles[3] = {};
    w->angles[3].mode = model::Jointed::Mode::free;
    w->angles[3].stiffness_Nm_rad = 2e-3, w->angles[3].damping_Nm_s = 1e-6;
  }
  v.jointed->inputs[0].neutral = 9.8;
  return v;
}

}  // namespace flappy::test
