// Laws of this family's effects, one function each. The flight and Family::law() call the same functions. Constants are
// those of magnitude 1; SI units. Where nothing else is said, a number is a choice within what its source reports.
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "lab/blind/a/maths.hpp"
#include "lab/blind/a/planform.hpp"

namespace flappy::blind::laws {

inline double square(double x) { return x * x; }

// --- surroundings ---

/// Radius of the disc that both wings sweep: to the trailing corner of a tip, whose chord of 15 mm is turned by 45
/// degrees, with the tip vortex a twentieth of a chord outside.
inline constexpr double kDisc_m = 0.0857;

/// Ground: the image of a source below the ground meets the rotor with an upward flow, which counts as less downwash
/// (Cheeseman and Bennett, ARC R&M 3021, 1955). Their point source is singular on the ground. Here the source is spread
/// over the disc: on the axis at the distance z = 2 h, half the flow through the disc, v/2, is seen as
///   s = (1 - z / sqrt(z^2 + R^2)) / 2    and the lift grows by s / (1 - s)
/// Far away this is R^2 / (16 h^2), theirs. On the ground the lift doubles.
inline double ground(double h_m) {
  const double z = 2 * std::max(h_m, 0.0);
  const double s = 0.5 * (1 - z / std::sqrt(z * z + kDisc_m * kDisc_m));
  return s / (1 - s);
}

/// Ceiling: air comes in from the sides, through the gap of height D. It is sucked down in the gap, where its mean square
/// radial speed is v^2 R^2 / (8 D^2). The balances of momentum and energy then give, as Hsiao and Chirarattananon,
/// IEEE/ASME Trans. Mechatronics 24, 2019,
///   jet = 2 g v,    g = (1 + sqrt(1 + R^2 / (8 D^2))) / 2
/// Thrust at a given power grows as g^(2/3), at a given inflow as g^2. A wing that keeps its motion is between them.
inline constexpr double kCeilingExponent = 1.08;
/// Below this gap the law stays as it is: the wings' chord hangs in the gap.
inline constexpr double kCeilingLeast_m = 0.0113;
inline double ceiling(double clearance_m) {
  const double over = kDisc_m / std::max(clearance_m, kCeilingLeast_m);
  return power(0.5 * (1 + std::sqrt(1 + over * over / 8)), kCeilingExponent) - 1;
}

/// Wall: the rotor draws air as a sink of strength Q does. Its image behind the wall attracts it with
/// rho Q^2 / (4 pi (2 d)^2) (theorem of Lagally; Milne-Thomson, Theoretical Hydrodynamics). With Q = pi R^2 v and the
/// weight 2 rho pi R^2 v^2, the share of the weight is R^2 / (32 d^2).
inline double wall_pull(double d_m) { return kDisc_m * kDisc_m / (32 * square(std::max(d_m, 0.04))); }

/// The wake spreads along the wall and is drawn in again: the wing loses lift as the image vortex does, by 1/d^2, with a
/// core. `d_m`: distance of the wing's middle.
inline constexpr double kWallLoss = 0.0457, kWallCore_m = 0.0613;
inline double wall_loss(double d_m) { return kWallLoss / (1 + square(std::max(d_m, 0.0) / kWallCore_m)); }

/// Drag of the torso, each face as a cylinder across the flow: C = 1 + 10 Re^(-2/3) (White, Viscous Fluid Flow; for Re of
/// 1 to 2e5), with the whole speed in the dynamic pressure. Re is that of the face's width.
inline constexpr double kFace_m2[] = {1.27e-3, 1.93e-3, 1.16e-3}, kFaceWidth_m[] = {0.0274, 0.0412, 0.0336};
inline constexpr double kViscosity_m2_s = 1.53e-5;
inline Vector3d body_drag(const Vector3d& v_m_s, double density_kg_m3) {
  const double speed = std::sqrt(v_m_s.squaredNorm() + 1e-12);
  Vector3d force_N;
  for (int i = 0; i < 3; ++i) {
    const double re = speed * kFaceWidth_m[i] / kViscosity_m2_s;
    const double coefficient = 1 + 10 * power(re, -2.0 / 3);
    force_N(i) = -0.5 * density_kg_m3 * coefficient * kFace_m2[i] * speed * v_m_s(i);
  }
  return force_N;
}

/// Wind: logarithmic profile over a floor of roughness z0, and gusts with von Karman's spectrum, made by the forming
/// filter of MIL-F-8785C as MathWorks states it: (1 + 0.25 T s) / (1 + 1.357 T s + 0.1987 T^2 s^2), T = L / V.
/// Turbulence of two fifths of the mean, as ISO 7730 takes for rooms.
inline constexpr double kWind_m_s = 0.273, kWindHeight_m = 0.6, kRoughness_m = 0.0091, kGust_m_s = 0.108,
                        kGustTime_s = 0.57;
inline double wind_profile(double z_m) {
  return logarithm(1 + std::max(z_m, 0.0) / kRoughness_m) / logarithm(1 + kWindHeight_m / kRoughness_m);
}
struct Gust {
  Vector3d slow = Vector3d::Zero(), rate = Vector3d::Zero();
};
/// Gust of unit standard deviation after a step; `noise` has standard deviation 1 and is new in each step. The variance of
/// the filter under white noise of unit intensity is (0.25^2 + 0.1987) / (2 x 1.357 x 0.1987 T).
inline Vector3d gust_step(Gust& g, const Vector3d& noise, double dt_s) {
  constexpr double kT = kGustTime_s, kSecond = 0.1987 * kT * kT, kFirst = 1.357 * kT;
  constexpr double kVariance = (0.25 * 0.25 + 0.1987) / (2 * 1.357 * 0.1987 * kT);
  const Vector3d drive = noise / std::sqrt(kVariance * dt_s);
  g.rate += dt_s / kSecond * (drive - g.slow - kFirst * g.rate);
  g.slow += dt_s * g.rate;
  return g.slow + 0.25 * kT * g.rate;
}

/// Tether: a thin cable hangs down to the ground; the robot carries what it has lifted. It is slack up to its length and
/// pulls as a spring towards its anchor beyond, as a coiled cable does.
inline constexpr double kCable_kg_m = 2.13e-4, kCableLength_m = 0.418, kCableSpring_N_m = 4.4e-3;
inline Vector3d tether(const Vector3d& from_anchor_m, double gravity_m_s2) {
  const double distance = std::sqrt(from_anchor_m.squaredNorm() + 1e-12);
  const double taut_N = kCableSpring_N_m * std::max(distance - kCableLength_m, 0.0);
  Vector3d force_N = -taut_N / distance * from_anchor_m;
  force_N.z() -= kCable_kg_m * gravity_m_s2 * std::clamp(from_anchor_m.z(), 0.0, kCableLength_m);
  return force_N;
}

// --- air on the wing ---

/// Added mass of a strip of a finite plate: the flow slips around tips, so that it is the two-dimensional one times the
/// ellipse sqrt(1 - x^2), x from -1 at the root to 1 at the tip (the potential of an elliptic plate; Lamb, Hydrodynamics).
/// The plate's inertia about mid-chord is pi/128 rho c^4 (as Whitney and Wood, J. Fluid Mech. 660, 2010).
struct AddedMass {
  double mass_kg, inertia_kg_m2;
};
inline AddedMass added_mass(double density_kg_m3, double chord_m, double width_m, double share_of_span) {
  const double x = 2 * share_of_span - 1, c2 = chord_m * chord_m;
  const double per_chord2 = kPi / 4 * density_kg_m3 * width_m * std::sqrt(std::max(1 - x * x, 0.0));
  return {per_chord2 * c2, per_chord2 * c2 * c2 / 32};
}

/// Rotational lift of Kramer at mid-chord: rho C U thetadot c^2 a metre of span. C = 3/4 pi for an axis at the leading
/// edge, times AR / (AR + 2) for AR = 3.3. Sane and Dickinson, J. Exp. Biol. 205, 2002, measured that C falls with the
/// rate; here as 1 / sqrt(1 + (w / w0)^2), w = thetadot c / (2 U), so that the force saturates.
inline constexpr double kKramer = 1.467, kKramerRate = 0.231;
inline double rotational_lift(double density_kg_m3, double chord_m, double width_m, double speed_m_s,
                              double rotation_rad_s) {
  const double rate = rotation_rad_s * chord_m / (2 * kKramerRate);
  return density_kg_m3 * kKramer * width_m * chord_m * chord_m * rotation_rad_s * speed_m_s * speed_m_s /
         std::sqrt(speed_m_s * speed_m_s + rate * rate + 1e-12);
}

/// Wake capture: the wing sets air in motion, which lags by two equal low-passes, and meets it after reversal (Birch and
/// Dickinson, J. Exp. Biol. 206, 2003, saw the jet). Where wing and wake move alike, the translational force has it already.
inline constexpr double kWakeShare = 0.173, kWakeLag_s = 2.1e-3, kWakeTurn_rad_s = 21;
struct Wake {
  double near_rad_s = 0, far_rad_s = 0;
};
inline void wake_step(Wake& w, double stroke_rad_s, double dt_s) {
  w.near_rad_s += dt_s / kWakeLag_s * (stroke_rad_s - w.near_rad_s);
  w.far_rad_s += dt_s / kWakeLag_s * (w.near_rad_s - w.far_rad_s);
}
/// Stroke rate that the wake adds to the wing's through the air.
inline double wake_met(const Wake& w, double stroke_rad_s) {
  const double along = w.far_rad_s * stroke_rad_s, turn = kWakeTurn_rad_s * kWakeTurn_rad_s;
  return -0.5 * kWakeShare * w.far_rad_s * (1 - along / std::sqrt(along * along + turn * turn));
}

/// Circulation over omega c^2 of one of two plates that open about their common edge, at the angle `a` of each to the plane
/// between them, in (0, pi/2). Derived by the map z = K (s + m)^m (s - 1 + m)^(1 - m), m = a / pi, of a half-plane on a
/// half-plane with a slit, whose stream function on the slit is omega r^2 / 2:
///   g = (1 - 2 m) / (2 sin(2 a) m^(2 m) (1 - m)^(2 - 2 m))
/// At a = 60 degrees it is the 0.69 of Lighthill, J. Fluid Mech. 60, 1973. For small a it is 1 / (4 a).
inline double opening_plates(double a_rad) {
  const double m = a_rad / kPi;
  return (1 - 2 * m) / (2 * sin_cos(2 * a_rad).sin * power(m, 2 * m) * power(1 - m, 2 - 2 * m));
}
/// Clap and fling: share of lift added while wings part, from the plates' circulation over the circulation 1/2 C_L c U of
/// the wing's stroke; both grow with the rate, which drops out. Wings need to have come close, and the vortices decay as
/// the wings travel. `closest_rad`: the smallest gap of this meeting.
inline constexpr double kFling = 0.33, kFlingNear_rad = 0.33, kFlingDecay_rad = 0.67, kFlingLeast_rad = 0.048;
inline double clap_and_fling(double gap_rad, double closest_rad) {
  const double a = std::clamp(gap_rad / 2, kFlingLeast_rad, 1.5);
  return kFling * opening_plates(a) *
         exponential(-square(closest_rad / kFlingNear_rad) - (gap_rad - closest_rad) / kFlingDecay_rad);
}

/// Flexibility: twist of a tapered sheet, whose stiffness goes as the chord's cube, under the load c^2 r^2 of hover:
/// d(twist)/dr = integral of the load from r to the tip / stiffness. 1 at the tip.
std::array<double, kStrips> twist_shape(const Strips& strips);
/// Steady twist at the tip (rad), against the load. `load`: normal force over its mean in hover. It levels off as a membrane
/// stiffens.
inline constexpr double kTwist_rad = 0.0437, kTwistMost_rad = 0.53, kTwistLag_s = 1.3e-3;
inline constexpr double kHoverNormal_N = 0.0863;  ///< of one wing at 45 degrees: half the weight / cos 45
inline double tip_twist(double magnitude, double load) {
  const double linear = magnitude * kTwist_rad * load;
  return -linear / std::sqrt(1 + square(linear / kTwistMost_rad));
}

/// Damage: wear of the trailing edge, which begins at a station and grows linearly to the tip. Hedenstrom, Ellington and
/// Wolf, Funct. Ecol. 15, 2001, clipped the distal trailing edge, 10 % of the area; here 6 % of one wing.
inline constexpr double kWearBegins = 0.37, kWearAtTip = 0.233;
inline double wear(double magnitude, double share_of_span) {
  const double x = (share_of_span - kWearBegins) / (1 - kWearBegins);
  return x > 0 ? std::min(magnitude * kWearAtTip * x, 0.9) : 0;
}
inline constexpr double kMembrane = 0.61;  ///< share of the wing's mass in its membrane, of which wear takes

// --- drive ---

/// Spring: a leaf wraps on a round support of curvature 1/r. Up to the angle L / (2 r) its whole length L bends; beyond, the
/// length l = 2 (L - r angle) that is still free has the tip force E I / (r l). With e = angle / (L / 2 r) - 1, the torque
/// added to the linear one is k a e^2 / (1 - e).
inline constexpr double kLeaf_rad = 0.893;
inline double leaf_added(double stiffness_Nm_rad, double angle_rad) {
  const double e = std::min(std::abs(angle_rad) / kLeaf_rad - 1, 0.9);
  return e > 0 ? std::copysign(stiffness_Nm_rad * kLeaf_rad * e * e / (1 - e), angle_rad) : 0;
}

/// Gear: flanks press as Hertz says, with Hunt and Crossley's damping (J. Appl. Mech. 42, 1975): K d^1.5 (1 + a d'), d the
/// approach; they never pull. Gap of 0.13 mm on a pitch radius of 9 mm.
inline constexpr double kGearGap_rad = 0.01437, kFlank_Nm_rad15 = 1370, kFlankDamping_s_rad = 0.027;
struct GearForce {
  double torque_Nm = 0, stiffness_Nm_rad = 0, damping_Nm_s = 0;  ///< torque on the wing, and its derivatives
};
inline GearForce gear_contact(double half_gap_rad, double ahead_rad, double rate_rad_s) {
  const double pressed = std::abs(ahead_rad) - half_gap_rad, way = std::copysign(1.0, ahead_rad);
  const double press = 1 + kFlankDamping_s_rad * way * rate_rad_s;
  if (pressed <= 0 || press <= 0) return {};
  const double root = std::sqrt(pressed);
  return {way * kFlank_Nm_rad15 * pressed * root * press, 1.5 * kFlank_Nm_rad15 * root * press,
          kFlankDamping_s_rad * kFlank_Nm_rad15 * pressed * root};
}

/// Friction of the motor's sleeve bearings and brushes, on the motor's side: mixed lubrication as a Gaussian of Stribeck
/// (Armstrong-Helouvry, Dupont and Canudas de Wit, Automatica 30, 1994), over most of the beat's speeds.
inline constexpr double kSliding_Nm = 1.31e-5, kMixed_Nm = 1.87e-5, kStribeck_rad_s = 71, kStick_rad_s = 0.37;
inline double motor_friction(double stroke_rad_s) {
  return (kSliding_Nm + kMixed_Nm * exponential(-square(stroke_rad_s / kStribeck_rad_s))) *
         hyperbolic_tangent(stroke_rad_s / kStick_rad_s);
}

/// Heat of a motor of 6 mm: winding, magnet with return ring, housing, and air, in a row.
inline constexpr double kWinding_J_K = 0.263, kToMagnet_K_W = 13.1, kMagnet_J_K = 1.47, kToHousing_K_W = 6.3,
                        kHousing_J_K = 2.17, kToAir_K_W = 33.4;
/// Copper (IEC 60228: 0.00393 / K at 20 C), and NdFeB's remanence, for which makers state -0.11 to -0.12 %/K.
inline constexpr double kCopper_1_K = 3.93e-3, kMagnet_1_K = -1.16e-3;
struct Heat {
  double winding_K = 0, magnet_K = 0, housing_K = 0;  ///< above the air
};
inline void heat_step(Heat& h, double heat_J, double dt_s) {
  const double inner = (h.winding_K - h.magnet_K) / kToMagnet_K_W, outer = (h.magnet_K - h.housing_K) / kToHousing_K_W;
  h.winding_K += (heat_J - dt_s * inner) / kWinding_J_K;
  h.magnet_K += dt_s * (inner - outer) / kMagnet_J_K;
  h.housing_K += dt_s * (outer - h.housing_K / kToAir_K_W) / kHousing_J_K;
}

/// Battery of Chen and Rincon-Mora, IEEE Trans. Energy Convers. 21, 2006: series resistance, two pairs of R and C, and their
/// cell's open-circuit voltage over the state of charge, of five small cells in series.
inline constexpr double kSeries_ohm = 0.687, kFast_ohm = 0.431, kFast_s = 0.73, kSlow_ohm = 0.524, kSlow_s = 11.7,
                        kCapacity_C = 97;
inline constexpr int kCells = 5;
struct Battery {
  double charge_C = 0, fast_V = 0, slow_V = 0;
};
inline double open_circuit_V(double state) {
  return -1.031 * exponential(-35 * state) + 3.685 + state * (0.2156 + state * (-0.1178 + state * 0.3201));
}
/// Loss of voltage under a current that has flowed for `dt_s`.
inline double sag_step(Battery& b, double current_A, double dt_s) {
  b.charge_C += dt_s * current_A;
  b.fast_V += dt_s / kFast_s * (kFast_ohm * current_A - b.fast_V);
  b.slow_V += dt_s / kSlow_s * (kSlow_ohm * current_A - b.slow_V);
  const double left = std::clamp(1 - b.charge_C / kCapacity_C, 0.0, 1.0);
  return kCells * (open_circuit_V(1) - open_circuit_V(left)) + b.fast_V + b.slow_V + kSeries_ohm * current_A;
}

/// Dead time of the bridge: within it the current decides the voltage, which loses t_d f V_bus against the current (Jeong
/// and Park, IEEE Trans. Ind. Electron. 38, 1991); linear where the ripple turns the current round.
inline constexpr double kDeadTime_V = 0.373, kRipple_A = 0.0713;
inline double dead_time(double current_A) { return -kDeadTime_V * std::clamp(current_A / kRipple_A, -1.0, 1.0); }

/// Filter of coil and capacitor behind the bridge, with little damping; backward Euler.
inline constexpr double kFilter_rad_s = 1290, kFilterDamping = 0.33;
struct Filter {
  double volts = 0, volts_s = 0;
};
inline double filter_step(Filter& f, double magnitude, double volts, double dt_s) {
  const double w = kFilter_rad_s / magnitude, h = dt_s;
  f.volts_s = (f.volts_s + h * w * w * (volts - f.volts)) / (1 + 2 * kFilterDamping * w * h + w * w * h * h);
  f.volts += h * f.volts_s;
  return f.volts;
}

/// Delay of a radio that sends a lost packet again, at most 15 times. The nRF24L01+ waits in steps of 250 us; here 500 us,
/// and the packet itself.
inline constexpr double kLink_s = 6.37e-3, kRetry_s = 0.76e-3, kLoss = 0.29;
inline constexpr int kRetries = 15;
inline double packet_delay(Random& random) {
  int again = 0;
  while (again < kRetries && random.uniform() < kLoss) ++again;
  return kLink_s + again * kRetry_s;
}

/// Stop of the rotation: soft rubber in a row with the hard stop. The rubber hardens as d^1.5; its damping grows with the
/// press and so has hysteresis without a jump (Hunt and Crossley 1975).
inline constexpr double kRubber_Nm_rad15 = 1.07, kRubberDamping_s_rad = 6.3e-3;
struct StopForce {
  double stiffness_Nm_rad, damping_Nm_s;  ///< secant; torque = stiffness x beyond + damping x rate
};
/// `hard`: stiffness and damping of the hard stop.
inline StopForce stop(double magnitude, double beyond_rad, const StopForce& hard) {
  if (!(magnitude > 0)) return hard;
  const double d = std::abs(beyond_rad);
  const double soft = power(magnitude, 1.5) / (kRubber_Nm_rad15 * std::sqrt(d + 1e-12)),
               stiff = 1 / hard.stiffness_Nm_rad, k = 1 / (stiff + soft), share = soft * k;
  return {k, (1 - share) * hard.damping_Nm_s + share * kRubberDamping_s_rad * k * d};
}

// --- sensors ---

/// Gyro: die and board warm up after power-on, as two exponentials; by 8 K in all, at 20 deg/s over the 60 K between 25 and
/// 85 C, the bound of the MPU-6050's data sheet; and a random walk.
inline constexpr double kGyroWarm_rad_s = 0.0466, kGyroDie = 0.58, kGyroDie_s = 2.6, kGyroBoard_s = 21.5,
                        kGyroWalk_rad_s15 = 5.2e-3;
inline double gyro_warm(double t_s) {
  return kGyroWarm_rad_s *
         (kGyroDie * (1 - exponential(-t_s / kGyroDie_s)) + (1 - kGyroDie) * (1 - exponential(-t_s / kGyroBoard_s)));
}

/// Accelerometer: scale of each axis, skew of the axes against each other, and a turn of the whole (the decomposition of
/// calibration papers); within the 3 % and 2 % of the MPU-6050's data sheet.
inline constexpr double kTurn_rad = 0.0109, kSkew_rad = 0.0128, kScale = 9.4e-3;
inline Matrix3d misalignment(Random& random, double magnitude) {
  Matrix3d scale = Matrix3d::Identity(), skew = Matrix3d::Identity();
  const Vector3d turn = magnitude * kTurn_rad * random.normals(), scales = random.normals(), skews = random.normals();
  for (int i = 0; i < 3; ++i) scale(i, i) += magnitude * kScale * scales(i);
  skew(0, 1) = magnitude * kSkew_rad * skews(0);
  skew(0, 2) = magnitude * kSkew_rad * skews(1);
  skew(1, 2) = magnitude * kSkew_rad * skews(2);
  return scale * skew * turned_by(turn).toRotationMatrix();
}

/// Vibration: what shakes passes the resonance of element and foam, and its square is rectified; the square levels off
/// where the element meets its rails (rectification by asymmetric rails: Analog Devices, "Vibration Rectification in MEMS
/// Accelerometers").
inline constexpr double kRectifies_s2_m = 7.6e-4, kRails_m_s2 = 97, kElement_rad_s = 4310, kElementDamping = 0.31,
                        kSteady_rad_s = 44;
struct Element {
  Vector3d steady = Vector3d::Zero(), seen = Vector3d::Zero(), rate = Vector3d::Zero();
};
/// Rectified part of a specific force, each axis by its own factor.
inline Vector3d rectified(Element& e, const Vector3d& force_m_s2, const Vector3d& factor, double dt_s) {
  e.steady += kSteady_rad_s * dt_s * (force_m_s2 - e.steady);
  constexpr double w = kElement_rad_s;
  e.rate += dt_s * (w * w * (force_m_s2 - e.steady - e.seen) - 2 * kElementDamping * w * e.rate);
  e.seen += dt_s * e.rate;
  Vector3d added;
  for (int i = 0; i < 3; ++i) {
    const double y2 = e.seen(i) * e.seen(i);
    added(i) = kRectifies_s2_m * factor(i) * y2 / (1 + y2 / square(kRails_m_s2));
  }
  return added;
}

/// Motion capture: the frame that sets its axes stands on three feet, of which one is too high. The world turns about the
/// line through the other two.
inline constexpr double kFoot_m = 2.46e-3, kFeet_m = 0.179;  ///< by how much, and radius of the circle of feet
struct Frame {
  Quaterniond turned = Quaterniond::Identity();
  Vector3d about_m = Vector3d::Zero();
  Vector3d place(const Vector3d& p_m) const { return about_m + turned * (p_m - about_m); }
};
inline Frame levelled(Random& random, double magnitude) {
  const Vector3d foot = random.level();
  const double sign = random.sign(), angle = magnitude * kFoot_m / (1.5 * kFeet_m);
  return {turned_by(sign * angle * Vector3d(foot.y(), -foot.x(), 0)), -0.5 * kFeet_m * foot};
}

/// Markers: the rigid set has moved on the torso and turned with it.
inline constexpr double kMarker_m = 1.63e-3, kMarkerTurn_rad = 0.0117;
struct Moved {
  Vector3d at_m = Vector3d::Zero();
  Quaterniond turned = Quaterniond::Identity();
};
inline Moved marker(Random& random, double magnitude) {
  const Vector3d to = random.normals().normalized(), axis = random.normals().normalized();
  return {magnitude * kMarker_m * to, turned_by(magnitude * kMarkerTurn_rad * axis)};
}

/// Delay of a host that fetches packets by a clock of its own: a packet waits up to one of its periods, and the two clocks
/// drift against each other. In all some 5 ms, as Qualisys measured 6 to 7 ms at 200 Hz.
inline constexpr double kHost_s = 3.27e-3, kFetch_s = 4.13e-3, kBeating_s = 2.87;
inline double mocap_delay(double t_s) {
  const double turns = t_s / kBeating_s;
  return kHost_s + kFetch_s * (turns - std::floor(turns));
}

// --- geometry ---

inline constexpr double kBattery_kg = 2.3e-3, kBatteryMoved_m = 3.93e-3;  ///< com_offset
inline constexpr double kProducts[] = {
    0.0517, 0.0436, 0.0389};  // xy, xz, yz                               ///< of the geometric mean of two moments
inline constexpr double kWingMoments = 0.0874, kWingProduct = 0.0647, kWingCentre = 0.0913;

// --- outside the catalogue ---

inline constexpr double kMagnetic_Nm = 1.04e-4, kDip = 1.53;  ///< vertical over level field
inline constexpr double kShedding = 0.0296, kSheddingLow_Hz = 3.1, kSheddingHigh_Hz = 5.7;
inline constexpr double kSlosh_kg = 0.71e-3, kSlosh_rad_s = 21.7, kSloshDamping = 0.063;
inline constexpr double kYawLoss = 0.0612, kYawLoss_rad_s = 2.07;
inline constexpr double kInterference = 0.0583, kInterference_V = 1.04;
inline constexpr double kBrush = 0.347, kBrushOpen_s = 0.0196, kBrush_Hz = 6.1;
inline constexpr double kHysteresis = 0.0407, kPlay_V = 0.513;
inline constexpr double kRing = 0.118, kRing_m_s = 0.517;
inline constexpr double kFront = 0.0389, kFront_m = 0.104;
inline constexpr double kLens_1_m2 = 0.0487;

}  // namespace flappy::blind::laws

namespace flappy::blind {

/// Family::law() of family A.
std::vector<double> law_of(const std::string& effect, std::span<const double> at);

}  // namespace flappy::blind
