// The drawn form of a vehicle, for pages and the Python package. SI units, in B, each wing at stroke and rotation 0.
//
//   {"name", "mass_kg", "profile_m": [[height, radius], ...], "left": wing, "right": wing}
//   wing  {"shoulder_m": [x, y, z], "outline_m": [[span, chord], ...]}   trailing edge, root to tip (leading: straight)
//   Span points outward along y of B, chord down along -z from the leading edge; both begin at the shoulder.
// or, for a beat-averaged vehicle,
//   {"name", "mass_kg", "body_m": [x, y, z]}                             semi-axes of an ellipsoid
//
// A vehicle file has moments of a planform, not an outline. The drawn chord is the quadratic function of span with
// these moments, exact for a straight taper, with a rounded tip; an articulated wing follows its strips. The body's
// profile is fixed, scaled with the wing length. The ellipsoid has uniform density and the torso's mass and inertia.
#pragma once

#include <nlohmann/json.hpp>

#include "flappy/vehicle.hpp"

namespace flappy::view {

nlohmann::ordered_json shape_of(const model::Vehicle& vehicle);

/// Chord over the mean chord at a share of the span.
double chord_at(const model::Planform& planform, double share);

}  // namespace flappy::view
