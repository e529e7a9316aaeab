// What a vehicle looks like: the one shape that pages and the Python package draw. SI, in B, each wing at stroke and rotation 0.
//
//   {"name", "mass_kg", "profile_m": [[height, radius], ...], "left": wing, "right": wing}
//   wing  {"shoulder_m": [x, y, z], "outline_m": [[span, chord], ...]}   the trailing edge from root to tip; the leading edge is straight
// or, of one whose wings are not modelled,
//   {"name", "mass_kg", "body_m": [x, y, z]}                             semi-axes of an ellipsoid
//
// A file knows moments of a wing's planform, not its outline: the chord is the quadratic function of span that has them, exact of a straight
// taper, with a rounded tip. The body's profile is free, for files have none; it is as large as the wings want it. The ellipsoid is of
// even density and has the torso's mass and moments of inertia.
#pragma once

#include <nlohmann/json.hpp>

#include "flappy/vehicle.hpp"

namespace flappy::view {

nlohmann::ordered_json shape_of(const model::Vehicle& vehicle);

/// Chord over its mean at a share of the span.
double chord_at(const model::Planform& planform, double share);

}  // namespace flappy::view
