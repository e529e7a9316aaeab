// The drawn form of a vehicle, which pages and the Python package share. SI units, in B, each wing at stroke and rotation 0.
//
//   {"name", "mass_kg", "profile_m": [[height, radius], ...], "left": wing, "right": wing}
//   wing  {"shoulder_m": [x, y, z], "outline_m": [[span, chord], ...]}   the trailing edge from root to tip; the leading edge is straight
// or, for a beat-averaged vehicle,
//   {"name", "mass_kg", "body_m": [x, y, z]}                             semi-axes of an ellipsoid
//
// A vehicle file has the moments of a wing's planform, not its outline. The drawn chord is the quadratic function of span that has these moments,
// which is exact for a straight taper, with a rounded tip; the outline of an articulated wing follows its strips. The body's profile is not
// in the file; it is a fixed profile, scaled with the wing length. The ellipsoid has uniform density and the torso's mass and moments of inertia.
#pragma once

#include <nlohmann/json.hpp>

#include "flappy/vehicle.hpp"

namespace flappy::view {

nlohmann::ordered_json shape_of(const model::Vehicle& vehicle);

/// Chord over the mean chord at a share of the span.
double chord_at(const model::Planform& planform, double share);

}  // namespace flappy::view
