// Aerodynamics of a wing: blade strips with measured lift and drag, and circulation that lags behind the quasi-steady
// value. A strip at r from the shoulder, chord c, whose point on the hinge moves with (u_x, u_z) through the air (wing
// frame: x its normal, z from trailing to leading edge), U^2 = u_x^2 + u_z^2, alpha = atan(|u_x| / |u_z|):
//
//   lift across (u_x, u_z), drag against it:  1/2 rho U^2 c dr C   C_L = 0.225 + 1.58 sin(2.13 alpha - 7.2 deg)
//                                                                  C_D = 1.92 - 1.55 cos(2.04 alpha - 9.82 deg)  [1, 2]
//   centre of pressure behind the edge that leads:  c (0.82 alpha / pi + 0.05)                                    [3]
//   circulation  g = U C_L at the radius of the second moment; its lagging part,
//              d = (A1 + A2) g - z1 - z2,   dz_i/dt = (2 U / c) b_i (A_i g - z_i), subtracted in proportion to r [4, 5]
//   rotation about the hinge with w_y:  1/2 rho C_D(90 deg) w_y |w_y| (c^3 / 3 normal, c^4 / 4 on the hinge) dr
//
// Chords follow a beta density over the span, as Ellington described insects' wings [6], c = c_mean x^(p-1) (1-x)^(q-1)
// / B(p, q); p and q are this family's choice: mean 0.46, mean square 0.53^2.
// Coefficients were measured at a Reynolds number of 10^2; at 10^4 lift over drag is higher [8]. kScale on lift makes
// the nominal robot carry its weight at about 10 V. Rotational circulation [2], added mass [7], wake, twist and
// surfaces are effects. Assumed: independent strips, no force by spanwise flow, one lag for a wing. Valid while wings
// beat: there is no downwash of a gliding robot.
//
// 1 Dickinson, Lehmann, Sane, Wing rotation and the aerodynamic basis of insect flight, Science 284 (1999): both fits
// 2 Sane, Dickinson, The aerodynamic effects of wing rotation and a revised quasi-steady model of flapping flight, J.
// Exp. Biol. 205 (2002): fits in strips; the rotational coefficient, pi (0.75 - x0) in theory, falls with rate
// 3 Ke, Zhang, Shi, Chen, The numerical solution for flapping wing hovering wingbeat dynamics, Aerosp. Sci. Technol.
// 110 (2021), its code
// 4 Taha and others, A state-space formulation for the aerodynamics of flapping flight, Aerosp. Sci. Technol. 34
// (2014): Duhamel's principle on lift curves with a leading-edge vortex
// 5 R. T. Jones's two exponentials of Wagner's function: A = 0.165, 0.335; b = 0.0455, 0.3
// 6 Ellington, The aerodynamics of hovering insect flight (1984), as in Usherwood, Ellington, J. Exp. Biol. 205, II
// (2002)
// 7 Sedov, Planar problems of hydrodynamics and aerodynamics (1966): pi/4 rho c^2 per length at mid-chord, pi/128 rho
// c^4 about it
// 8 Altshuler, Dudley, Ellington, Aerodynamic forces of revolving hummingbird wings and wing models, J. Zool. (2004)
#pragma once

#include <Eigen/Dense>
#include <array>

#include "lab/blind/b/b_effects.hpp"
#include "lab/blind/b/b_robot_parameters.hpp"

namespace flappy::blind::b {

inline constexpr std::size_t kStrips = 8;
inline constexpr double kScale = 1.5;  ///< factor on lift, see above

/// Table of coefficients over |u_x| / (|u_x| + |u_z|), a variable that needs no arctangent.
struct Polar {
  static constexpr int kCells = 512;
  struct Row {
    double normal, chordwise, lift, centre;
  };
  std::array<Row, kCells + 1> row;

  /// `lift`, `drag`: factors on C_L and C_D.
  Polar(double lift, double drag);
  Row at(double share) const {
    const double x = share * kCells;
    const int i = x < kCells ? static_cast<int>(x) : kCells - 1;
    const double k = x - i;
    const Row &a = row[static_cast<std::size_t>(i)], &b = row[static_cast<std::size_t>(i) + 1];
    return {a.normal + k * (b.normal - a.normal), a.chordwise + k * (b.chordwise - a.chordwise),
            a.lift + k * (b.lift - a.lift), a.centre + k * (b.centre - a.centre)};
  }
};

/// C_L and C_D at an angle of attack from 0 to pi/2.
double lift_coefficient(double alpha_rad);
double drag_coefficient(double alpha_rad);

/// Air of one wing. Its sign is 1 on the left, -1 on the right; the span runs along sign y of the wing's frame.
class WingAir {
 public:
  WingAir(const RobotParameters& parameters, const EffectMagnitudes& effect_magnitudes, std::size_t side);

  /// Instantaneous flow: velocities relative to the air, in the wing's frame.
  struct Flow {
    Vector3d shoulder_m_s, rate_rad_s;
    double rotation_rate_rad_s = 0;  ///< rate of the rotation hinge
    double wake_rad_s = 0;           ///< rotation of the wake air about the stroke axis
    double bend_rad = 0;             ///< of the membrane, where the chord is longest
    double bending_rate_rad_s = 0;   ///< at the tip
    double sin_rotation = 0, cos_rotation = 1;
    double gain = 1;  ///< factor on the force, by nearby surfaces and by clap and fling
    std::array<double, 2> lag{};
  };
  struct Load {
    Vector3d force_N, torque_Nm;  ///< about the shoulder, in the wing's frame
    std::array<double, 2> lag_rate{};
  };
  Load load(const Flow& flow) const;
  /// Lags of a circulation that has long been what this flow makes it.
  std::array<double, 2> settled(const Flow& flow) const;

  /// Sedov's inertia of the air for (w_y, w_z, v_x at the shoulder); zero if added_mass has magnitude 0.
  const Eigen::Matrix3d& added() const { return added_; }
  double area_m2() const;
  double length_m() const { return length_; }
  /// Change of the chord's angle at a station (r/R) over that where the chord is longest, which is cubed: b_laws.hpp.
  static double bend_share(double station);

 private:
  struct Strip {
    double r, pressure, chord, share;  ///< pressure: 1/2 rho c dr; share: weight of the lag
    double bend, flap;                 ///< bend_share(); whether a torn flap is in it
  };
  double circulation_of(double x_m_s, double z_m_s) const;

  Polar polar_;
  std::array<Strip, kStrips> strips_;
  double sign_, length_, density_;
  double reference_r_, reference_chord_, turning_force_, turning_torque_, rotational_lift_;
  double flap_side_, flap_;  ///< side of the air that opens the flap (1: from behind, -1: from before); magnitude
  bool twists_, bends_;
  Eigen::Matrix3d added_;
};

}  // namespace flappy::blind::b
