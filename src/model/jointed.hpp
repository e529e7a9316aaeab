// A vehicle with articulated wings: every angle of a wing is fixed, driven along a gait, or free. For animals, and
// robots whose wings are driven by position or hang on elastic hinges. Its file:
//
//   model = "jointed"
//   symmetric = true                 # [right] is the mirror image of [left], and left out
//   [air] [extent] [torso]           # as for any vehicle
//   [gait]
//   frequency_Hz = 120.0             # beats, while no input changes it
//   muscle_mass_kg = 2e-5            # of all muscles that drive the wings, if it is known
//   [input.flap]                     # at most four. low, high, neutral, amplitude, difference, bias, split_cycle as in
//                                    #   beat_averaged.hpp; lag_s of its filter (gait.hpp). A unit of it changes:
//   frequency = 0.1                  #   the factor 1 on the base frequency
//   timing = 0.1                     #   d: the phase runs 1 + d sin(2 pi t) times as fast
//   timing_opposed = 0.1             #   d: added on the left, subtracted on the right
//   scale.stroke = 1.0               #   the factor 1 on the harmonics of an angle; scale_opposed accordingly
//   offset_rad.stroke_plane = 0.2    #   the mean of an angle; offset_opposed_rad accordingly
//   [left]
//   shoulder_m                       # intersection of all four axes, in B
//   [left.leading_edge]              # mass_kg, com_m, inertia_kg_m2 in the frame E of stroke and deviation; optional
//   [left.wing]                      # mass_kg, com_m, inertia_kg_m2 in the frame of the wing, which also rotates
//   [left.stroke_plane] [left.stroke] [left.deviation] [left.rotation]      # each with one mode:
//   mode = "fixed"                   #   angle_rad
//   mode = "driven"                  #   mean_rad; cos_rad, sin_rad = [...] of the harmonics 1, 2, ...; optionally, a
//                                    #   parallel spring and damper relieve the muscle
//   mode = "free"                    #   stiffness_Nm_rad, rest_rad, damping_Nm_s, and, if it has stops, lower_rad,
//                                    #   upper_rad, stop_stiffness_Nm_rad, stop_damping_Nm_s
//   [left.planform]                  # the single-point blade element of wing_aerodynamics.hpp
//   [left.aerodynamics]              # or strips (strip_aerodynamics.hpp); defaults of 0 but for normal_sin:
//   strips_m = [[0.001, 0.001, 0.004, 0.001], ...]  # middle along the span, width, chord, leading edge above the axis
//   rotational_lift = 1.0            #   factor on theory
//   added_mass = 1.0                 #   factor on theory
//   rotational_damping_coefficient = 5.0     # C_rd, drag of a plate that turns about the axis: moment and force
//   normal_sin = [3.4]               #   C_N = sum of b_k sin(k a), k = 1, ..., 4; default: the published C_N
//   tangential_cos = [0.4]           #   C_T = sum of a_k cos(k a), k = 1, ..., 4, to the trailing edge if a < pi/2
//
// E is R_y(-Phi) R_z(s psi) R_x(s phi) from B, s = +1 left, -1 right, and the wing is R_y(theta) from E, so mirrored
// sides have the same four angles (the published Phi has the other sign on the right). Phi > 0 tilts the lift of the
// strokes backward. Every fixed or driven angle stays within kLargestAngle_rad for all inputs.
#pragma once

#include <string>
#include <vector>

#include "flappy/vehicle.hpp"
#include "io/config.hpp"

namespace flappy::model {

inline constexpr std::array<const char*, 4> kAngles = {"stroke_plane", "stroke", "deviation", "rotation"};
inline constexpr std::size_t kMaxHarmonics = 16, kMaxStrips = 40;
inline constexpr std::size_t kMaxTerms = 4;
/// Largest timing d that all inputs together may reach, so that the phase never stops.
inline constexpr double kLargestTiming = 0.8;

/// Reads what parameters() does not list: modes, harmonics, strips, series, inputs.
Jointed read_jointed(const io::Table& root);
bool is_symmetric(const io::Table& root);
void mirror_left(Vehicle& vehicle);
/// Refuses inputs that could stop the phase or the beat, and gaits that could leave kLargestAngle_rad.
void check_gait(const io::Table& root, const Jointed& vehicle);
std::vector<BeatAveraged::Input> mixed_inputs(const Vehicle& vehicle);
/// Text that reads back as the same, together with parameters().
std::string jointed_text(const Jointed& vehicle);

}  // namespace flappy::model
