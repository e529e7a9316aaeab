// Laws of a membrane wing. At share x = r/R of the wing length the chord is
//   c(x) = c (1 + a1 (2x - 1) + a2 (6x^2 - 6x + 1))     a1 = (tip - root)/2     a2 = (root + tip)/2 - 1
// with mean chord c, and root and tip chord over the mean chord. (2x - 1) and (6x^2 - 6x + 1) are Legendre's
// polynomials, whose mean is 0. The moments of the planform follow (Ellington, Phil. Trans. R. Soc. B 305, 1984, II):
//   r_kk = <c x^k>/c     z_cpk = <c^2 x^k>/c^2     z_rd = <c^4>/c^4
// The published wing is of this form: its moments are those of root = 1.293, tip = 0.706.
// Panel: film and battens of one areal density from the hub to the tip, and a sleeve around the leading edge, where the
// film lies double. Leading edge: a round rod of carbon from the shoulder to the tip.
#pragma once

#include <string>

#include "design/mass.hpp"

namespace flappy::design {

struct WingShape {
  double length_m = 0, mean_chord_m = 0;
  double root_chord = 1, tip_chord = 1;  ///< over the mean chord
};

/// Chord over the mean chord at share x of the length.
double chord_at(const WingShape& shape, double x);
double least_chord(const WingShape& shape);  ///< over the mean chord

model::Planform planform_of(const WingShape& shape, double rotational_damping_coefficient);
/// The shape with the first moments of a planform.
WingShape shape_of(const model::Planform& planform);

struct Panel {
  double hub_m = 0;     ///< from the shoulder to where the panel begins
  double sleeve_m = 0;  ///< width of the sleeve
  double kg_m2 = 0;     ///< areal density of film and battens
};

/// Mass of the panel in the frame of the wing: leading edge along +y for side = +1, chord along -z.
Mass panel_of(const WingShape& shape, const Panel& panel, int side);
/// Mass of the rod in the frame of the leading edge.
Mass rod_of(double length_m, double diameter_m, double density_kg_m3, int side);

/// Mass of a gear's wheel about the stroke's axis: a rim at the pitch radius, as heavy per length as one of the known
/// radius and inertia, so that its inertia grows with the cube of the radius.
Mass wheel_of(double radius_m, double known_radius_m, double known_inertia_kg_m2);

/// Diameter of a rod that bends no more, in shares of its length, than one of diameter d0 and length R0 under the same
/// load F: a cantilever's tip moves by F R^3/(8 E I), I = pi d^4/64, so that d = d0 sqrt(R/R0).
double stiff_diameter_m(double length_m, double known_length_m, double known_diameter_m);

}  // namespace flappy::design
