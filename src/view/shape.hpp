// The drawn form of a vehicle, for pages and the Python package. Metres and kilograms, in B, each wing at stroke and
// rotation 0. mass_kg is the mass of the whole robot.
//
//   {"name", "mass_kg", "profile_m": [[z, radius], ...], "left": wing, "right": wing}
//   wing  {"shoulder_m": [x, y, z], "outline_m": [[span, chord], ...]}   from root to tip
//   The leading edge is the straight line from the shoulder outward along y of B (-y on the right). A point of the
//   outline is a point of the trailing edge: `span` outward and `chord` down along -z from the shoulder. The outline
//   begins at 5 % of the wing length; an articulated wing has one point for the middle of each strip.
// or, for a beat-averaged vehicle,
//   {"name", "mass_kg", "body_m": [x, y, z]}                             semi-axes of an ellipsoid
//
// A vehicle file has moments of a planform, not an outline. The drawn chord is the quadratic function of span that has
// these moments; the tip is rounded. An articulated wing is drawn with the chord of each of its strips. The body is a
// solid of revolution about z, of one fixed profile that is scaled with the wing length. The ellipsoid has uniform
// density and the torso's mass and inertia.
#pragma once

#include <nlohmann/json.hpp>

#include "flappy/vehicle.hpp"

namespace flappy::view {

nlohmann::ordered_json shape_of(const model::Vehicle& vehicle);

/// Chord over the mean chord at share = distance from the shoulder / wing length, 0 to 1; at least 0. The tip is not
/// rounded.
double chord_at(const model::Planform& planform, double share);

}  // namespace flappy::view
