// A vehicle with four angles a wing, each fixed, driven along a gait, or free: animals, and robots whose wings are driven by position or hang on
// elastic hinges. Its file says how:
//
//   model = "jointed"
//   symmetric = true                         # [right] is [left] in a mirror, and left out
//   [air] [extent] [torso]                   # as of any vehicle
//   [gait]
//   frequency_Hz = 120.0                     # beats, while no input adds to it
//   muscle_mass_kg = 2e-5                    # of all that drives the wings, where it is known
//   [input.flap]                             # at most four. low, high, neutral, and what it makes of a controller's outputs: amplitude, difference,
//                                            #   bias, split_cycle (beat_averaged.hpp); lag_s of its filter (gait.hpp). What 1 of it adds:
//   frequency = 0.1                          #   to the factor 1 on the base frequency
//   timing = 0.1                             #   to d: the phase runs 1 + d sin(2 pi t) times as fast; d > 0 shortens the first half of the beat
//   timing_opposed = 0.1                     #   the same on the left, the opposite on the right
//   scale.stroke = 1.0                       #   to the factor 1 on the harmonics of an angle; scale_opposed as above
//   offset_rad.stroke_plane = 0.2            #   to the mean of an angle; offset_opposed_rad as above
//   [left]
//   shoulder_m                               # where all four axes cross, in B
//   [left.leading_edge]                      # mass_kg, com_m, inertia_kg_m2 in the frame E of stroke and deviation; may be left out
//   [left.wing]                              # the same in the frame of the wing, which rotates besides
//   [left.stroke_plane] [left.stroke] [left.deviation] [left.rotation]      # each with one mode:
//   mode = "fixed"                           #   angle_rad
//   mode = "driven"                          #   mean_rad, cos_rad = [...], sin_rad = [...] of the harmonics 1, 2, ... of a beat; a parallel spring
//                                            #   and damper, where there is one, take their part of the muscle's torque
//   mode = "free"                            #   stiffness_Nm_rad, rest_rad, damping_Nm_s, and, where it has stops, lower_rad, upper_rad,
//                                            #   stop_stiffness_Nm_rad, stop_damping_Nm_s
//   [left.planform]                          # the single-point blade element of wing_aerodynamics.hpp
//   [left.aerodynamics]                      # or strips (strip_aerodynamics.hpp):
//   strips_m = [[0.001, 0.001, 0.004, 0.001], ...]  # of each its middle along the span, width, chord, leading edge above the axis of rotation
//   rotational_lift = 1.0                    #   factor on theory; 0 unless it is there
//   added_mass = 1.0                         #   the same
//   rotational_damping_coefficient = 5.0     #   C_rd, of a plate's drag as it turns about the axis: moment and force; 0 unless it is there
//   normal_sin = [3.4]                       #   C_N = sum of b_k sin(k a), k = 1, ..., 4; unless it is there, the published one
//   tangential_cos = [0.4]                   #   C_T = sum of a_k cos(k a), k = 1, ..., 4, towards the trailing edge where a < pi/2; none unless there
//
// E is R_y(-Phi) R_z(s psi) R_x(s phi) from B, s = +1 left, -1 right, and the wing R_y(theta) from E: a side in a mirror has the same four angles (the
// published Phi has the other sign on the right). Phi > 0 tilts the lift of the strokes backward. Every angle stays within
// kLargestAngle_rad, whatever the inputs add.
#pragma once

#include <string>
#include <vector>

#include "flappy/vehicle.hpp"
#include "io/config.hpp"

namespace flappy::model {

inline constexpr std::array<const char*, 4> kAngles = {"stroke_plane", "stroke", "deviation", "rotation"};
/// Harmonics of a gait, and strips of a wing, at most.
inline constexpr std::size_t kMostHarmonics = 16, kMostStrips = 40;
/// Terms of a force coefficient's series.
inline constexpr std::size_t kMostTerms = 4;
/// Largest amount of timing d that all inputs together may reach: the phase never stands still.
inline constexpr double kLargestTiming = 0.8;

/// Reads all that is no plain number of parameters(): modes, harmonics, strips, series, inputs.
Jointed read_jointed(const io::Table& root);
/// Whether [right] is left out.
bool is_symmetric(const io::Table& root);
/// The other side of a symmetric vehicle.
void mirror_left(Vehicle& vehicle);
/// Refuses a gait that goes beyond kLargestAngle_rad, and inputs that take it there.
void check_gait(const io::Table& root, const Jointed& vehicle);
/// The inputs of a vehicle without motors, which its file mixes of a controller's outputs; none of one with motors.
std::vector<BeatAveraged::Input> mixed_inputs(const Vehicle& vehicle);
/// Reads back the same, together with parameters().
std::string jointed_text(const Jointed& vehicle);

}  // namespace flappy::model
