// Laws of effects that a few numbers state, each once: the flights call them, law_of() shows them, and effect_table() lists
// their constants. Laws of MuJoCo's bodies stand in mechanism.hpp and mjcf.hpp. All at magnitude 1, in SI units, unless a
// law is handed its magnitude. "Choice": no source has the number.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace flappy::blind::c::laws {

/// 1 for x well above 0, -1 well below, over a width.
inline double soft_sign(double x, double width) { return x / std::sqrt(x * x + width * width); }

// --- Room ---------------------------------------------------------------------------------------------------------
// Ground: share of lift added to a wing whose stroke plane is h above the ground,
//   G exp(-(h/a)^2) - D exp(-((h - b)/w)^2)
// Wings in hover have three regimes with the clearance: more force, less, recovery (Gao, Lu, Phys. Fluids 20, 087101, 2008,
// in 2D; Lu, Lua, Lee, Lim, Yeo, Bioinspir. Biomim., 2016, weaker in 3D). The wing-wake interaction adds or takes up to 6 %
// (Kolomenskiy et al., PLoS ONE 11, e0152072, 2016). The form and the numbers are ours, of that order. Valid above 10 mm.
inline constexpr double kGround = 0.113, kGroundNear_m = 0.071, kGroundDip = 0.043, kGroundDip_m = 0.137,
                        kGroundDipWidth_m = 0.045;
inline double ground_share(double height_m) {
  const double near = std::max(0.0, height_m) / kGroundNear_m, dip = (height_m - kGroundDip_m) / kGroundDipWidth_m;
  return kGround * std::exp(-near * near) - kGroundDip * std::exp(-dip * dip);
}

// Ceiling: share of lift added at a clearance c of the stroke plane, C / (1 + (c/c0)^p). A ceiling only adds force, and more
// the closer it is (Meng, Phys. Fluids 31, 2019, doi 10.1063/1.5094661: a mirrored leading-edge vortex); small rotors
// have markedly more thrust near one, too (Hsiao, Chirarattananon, IEEE/ASME Trans. Mechatronics, 2019). Numbers: choice.
inline constexpr double kCeiling = 0.187, kCeiling_m = 0.031, kCeilingPower = 1.71;
inline double ceiling_share(double clearance_m) {
  return kCeiling / (1 + std::pow(std::max(0.0, clearance_m) / kCeiling_m, kCeilingPower));
}

// Wall: through the clearance g of a wing's tip at its stroke angle, n = 1 / (1 + (g/g0)^2), as the flow of a tip vortex and
// its mirror image, 2 g away. The wing loses the share L n of its lift and pulls the torso to the wall by P n of the weight.
// A rotor 1.5 radii from two walls and 2.5 above the ground lost 7 % ("Thrust variations in small rotors due to corner and vertex effects on the
// ground side", Aeronaut. J., 2025). L within this; P and g0: choice.
inline constexpr double kWallLoss = 0.065, kWallPull = 0.031, kWall_m = 0.045;
inline double wall_nearness(double clearance_m) {
  const double of = std::max(0.0, clearance_m) / kWall_m;
  return 1 / (1 + of * of);
}

// --- The wings' own wake ------------------------------------------------------------------------------------------
// Wake capture: share of force added after s chords from the reversal, with b(x) = x exp(1 - x), W b(s/s1) - D b(s/s2): the wake
// first adds force, then takes a little by its downwash (Birch, Dickinson, J. Exp. Biol. 206, 2257, 2003). Numbers: choice.
inline constexpr double kWake = 0.294, kWakeChords = 0.47, kWakeWash = 0.0107, kWashChords = 2.9;
inline double wake_share(double chords) {
  const auto bump = [](double x) { return x * std::exp(1 - x); };
  return kWake * bump(chords / kWakeChords) - kWakeWash * bump(chords / kWashChords);
}

// Clap and fling: share of force added, K exp(-g/g0) exp(-(o/o0)^2) exp(-s/s0), with g the angle between the wings where they
// turned, o the angle by which they opened since, s the chords travelled. The share falls with the distance of the wings
// (Lehmann, Sane, Dickinson, J. Exp. Biol. 208, 3075, 2005: up to 17 % over a beat); half a beat has it, so K is more.
inline constexpr double kFling = 0.31, kFlingMeeting_rad = 0.45, kFlingOpening_rad = 0.83, kFlingChords = 2.6;
inline double fling_share(double met_rad, double opened_rad, double chords) {
  const double of = opened_rad / kFlingOpening_rad;
  return kFling * std::exp(-met_rad / kFlingMeeting_rad - of * of - chords / kFlingChords);
}

/// Radius of the wing, over its length, whose path counts as travelled.
inline constexpr double kTravelRadius = 0.72;

// Flexible wing: the outer part turns about a hinge line along the span by limit tanh(k M / limit), with M the air's moment
// about the rotation hinge, and follows with a time constant. Distal parts of fly wings are far softer than the root
// (Lehmann, Gorb, Nasir, Schuetzner, J. Exp. Biol. 214, 2949, 2011). Numbers: choice.
inline constexpr double kFlex_rad_Nm = 118, kFlexLimit_rad = 0.41, kFlexTime_s = 0.83e-3;
inline double flex_rad(double moment_Nm, double magnitude) {
  return kFlexLimit_rad * std::tanh(magnitude * kFlex_rad_Nm * moment_Nm / kFlexLimit_rad);
}

// Virtual mass: each ellipsoid of a wing carries air along its normal, and the more the faster it goes. In oscillating flow
// plates have a mass coefficient that is larger for larger U T / c, U the largest speed, T the period, c the width (Keulegan,
// Carpenter, J. Res. Natl. Bur. Stand. 60, 423, 1958). Here the momentum, over the mass m at small speeds, is
//   P(v) = v (1 + G (1 - 1/s)),  s = sqrt(1 + (v/v0)^2),  v0 = K c / T, with T the beat,
// so the mass is dP/dv = 1 + G (1 - 1/s^3), from 1 to 1 + G, and the air's energy, the integral of v dP, is
//   (1 + G) v^2/2 - G v0^2 (1 - 1/s).
// It depends on the speed alone, so no cycle gains energy. Where the flow separates from a sharp edge, its suction is lost
// (Polhamus, NASA TN D-3767, 1966); with it goes a share 1 - S of w x p and of Munk's moment v x p, which together do no work.
// m and the moments of inertia: the engine's, of ellipsoids in potential flow. Form, G, K, S: choice. In hover U T / c is
// about 18 at 0.75 of the wing's length. The law holds on average over a beat; it lacks the wake's history.
inline constexpr double kGrowth = 0.84, kGrowthPeriods = 7.4, kSuction = 0.79;
struct CarriedAir {
  double momentum_m_s, mass, energy_m2_s2;  ///< over the mass at small speeds
};
inline CarriedAir carried_air(double speed_m_s, double growth_m_s) {
  const double of = speed_m_s / growth_m_s, less = 1 / std::sqrt(1 + of * of);
  return {speed_m_s * (1 + kGrowth * (1 - less)), 1 + kGrowth * (1 - less * less * less),
          (1 + kGrowth) * speed_m_s * speed_m_s / 2 - kGrowth * growth_m_s * growth_m_s * (1 - less)};
}

// Film that snaps: a wing's slack film keeps the camber of the last half stroke until the air's moment about the rotation
// hinge has the other sign and exceeds a threshold; the force is smaller by a share till then. Choice.
inline constexpr double kSnapLoss = 0.34, kSnap_Nm = 4.6e-4, kSnapTime_s = 0.9e-3;

// --- Wind ---------------------------------------------------------------------------------------------------------
// Level mean, the same at every height. Gusts: pulses (1 - cos(2 pi t/T))/2 (EASA CS-25.341, discrete gust) of random size,
// one begun each T/2. Their spectrum is that of the pulse, W(f) = (T/2) sin(pi f T) / (pi f T (1 - (f T)^2)):
// over its integral, one-sided, 2 |W|^2 / (3 T/8). Speeds and T: choice.
inline constexpr double kWind_m_s = 0.27, kGust_m_s = 0.103, kGust_s = 0.61;
inline double gust_pulse(double part) { return 0.5 * (1 - std::cos(2 * M_PI * part)); }
/// Mean square of the sum of pulses of unit variance.
inline constexpr double kGustSquare = 0.75;
inline double gust_spectrum(double frequency_Hz) {
  const double x = frequency_Hz * kGust_s, off = 1 - x * x;
  const double sine = x < 1e-9 ? 1 : std::sin(M_PI * x) / (M_PI * x);
  const double shape = std::abs(off) < 1e-6 ? 0.5 : sine / off;
  return 4.0 / 3 * kGust_s * shape * shape;
}

// --- Drive --------------------------------------------------------------------------------------------------------
// Second spring, of the share e of the first one's stiffness, beyond an angle a, rounded over w (bilinear: Shaw, Holmes,
// J. Sound Vib. 90, 129, 1983): equivalent angle e w (ln(1 + exp((x - a)/w)) - ln(1 + exp((-x - a)/w))). Numbers: choice.
inline constexpr double kSecondSpring = 0.38, kSecondSpring_rad = 0.78, kSecondSpringWidth_rad = 0.071;
inline double second_spring_rad(double angle_rad) {
  const auto beyond = [](double x) { return std::log1p(std::exp((x - kSecondSpring_rad) / kSecondSpringWidth_rad)); };
  return kSecondSpring * kSecondSpringWidth_rad * (beyond(angle_rad) - beyond(-angle_rad));
}

// Friction above Coulomb's falls as exp(-|w|/w0) (Tustin, J. IEE 94 IIA, 143, 1947; Olsson et al., Eur. J. Control 4, 176,
// 1998). Numbers: choice.
inline constexpr double kTustin = 1.62, kTustin_rad_s = 53;
inline double tustin_share(double rate_rad_s) { return kTustin * std::exp(-std::abs(rate_rad_s) / kTustin_rad_s); }

// Winding: one thermal mass C, heated by the loss, which grows with the resistance. To the air Rw + Rh / (1 + sqrt(u/u0)), the
// housing's part halved by the wash of hover. Faulhaber's 0816 SR, 4.5 g: Rw 20 K/W, Rh 48 K/W, time constant of the winding
// 4.2 s, hence C = 4.2/20 J/K; its diagrams halve Rh for a cooled housing. u0: the wash of hover by momentum theory,
// sqrt(W / (2 rho A)), A the 0.017 m^2 that the wings sweep. The magnet keeps its temperature, and so its strength.
inline constexpr double kWinding_K_W = 20, kHousing_K_W = 48, kWinding_J_K = 0.21, kWash_m_s = 1.75;
inline double to_air_K_W(double airspeed_m_s) {
  return kWinding_K_W + kHousing_K_W / (1 + std::sqrt(airspeed_m_s / kWash_m_s));
}
/// Warmth after a time with a constant loss.
inline double warmed_K(double warmth_K, double loss_W, double airspeed_m_s, double time_s) {
  const double to_air = to_air_K_W(airspeed_m_s), end_K = loss_W * to_air;
  return end_K + (warmth_K - end_K) * std::exp(-time_s / (to_air * kWinding_J_K));
}

// Battery: Shepherd's curve with an exponential zone (Tremblay, Dessaint, Dekkiche, IEEE VPPC 2007), voltage lost at a charge q
// taken and a current i: K (Q/(Q - q) - 1) + A (1 - exp(-q/B)) + R i. Five small cells of 25 mAh; numbers: choice.
inline constexpr double kPolarisation_V = 0.87, kCapacity_As = 90, kZone_V = 0.55, kZone_As = 7.3, kInternal_ohm = 0.98,
                        kBuffer_s = 6.2e-3;
inline double sag_V(double charge_As, double load_A) {
  const double q = std::clamp(charge_As, 0.0, 0.95 * kCapacity_As);
  return kPolarisation_V * (kCapacity_As / (kCapacity_As - q) - 1) + kZone_V * (1 - std::exp(-q / kZone_As)) +
         kInternal_ohm * load_A;
}

// Bridge: switches of resistance R, and between pulses, for the share 1 - |V|/Vb of the time, a diode of Vd that fades
// below i0: the motor lacks R i + Vd (1 - |V|/Vb) i / sqrt(i^2 + i0^2). R of TI's DRV8801-Q1 (SLVSAS7D: 0.48 + 0.35 ohm at
// 25 degC), which also states 1.4 V of its diodes at 2.8 A; Vd and i0, at a tenth of this current: choice.
inline constexpr double kBridge_ohm = 0.83, kDiode_V = 0.39, kDiode_A = 0.027;
inline double bridge_loss_V(double command_V, double current_A, double battery_V) {
  const double between = 1 - std::min(1.0, std::abs(command_V) / battery_V);
  return kBridge_ohm * current_A + kDiode_V * between * soft_sign(current_A, kDiode_A);
}

// Slow driver: v' = S tanh((u - v)/(S T)), the slew of an amplifier whose differential input saturates (Solomon, IEEE J. Solid-
// State Circuits 9, 314, 1974). For a constant u, sinh((u - v)/(S T)) falls as exp(-t/T). Numbers: choice. A magnitude m
// divides S and multiplies T.
inline constexpr double kSlew_V_s = 8.3e3, kSlewTime_s = 0.74e-3;
inline double slewed_V(double from_V, double to_V, double time_s, double magnitude) {
  const double scale_V = kSlew_V_s * kSlewTime_s, left = std::sinh((to_V - from_V) / scale_V);
  return to_V - scale_V * std::asinh(left * std::exp(-time_s / (magnitude * kSlewTime_s)));
}

// Slow task: a command comes to its door late, and waits for the task's next start, once in T and not in step with the
// commands: a sawtooth (asynchronous sampling: Wittenmark, Nilsson, Toerngren, ACC 1995). Numbers: choice.
inline constexpr double kDoor_s = 5.9e-3, kTask_s = 3.3e-3;
/// `phase`: of the task at t = 0, from 0 to 1.
inline double task_delay_s(double now_s, double phase, double magnitude) {
  const double door_s = kDoor_s * magnitude, task_s = kTask_s * magnitude;
  const double starts = (now_s + door_s) / task_s - phase;
  return door_s + (std::ceil(starts - 1e-9) - starts) * task_s;
}

// Supply whose converter hunts: a limit cycle, V (1 + a sin(2 pi f t + phase)), not in step with the beat. Choice.
inline constexpr double kHunting = 0.037, kHunting_Hz = 27.7;

// --- Sensors ------------------------------------------------------------------------------------------------------
// Gyro bias: warmth of the motors reaches the board after a dead time, then b (1 - exp(-(t - t0)/T)); besides it walks, sd
// w sqrt(t). t since the motors started. b: 1.35 deg/s, as of 29 K at 0.047 deg/s per K; TDK's MPU-6050 states +-20 deg/s
// over 125 K. The rest: choice.
inline constexpr double kGyroWarm_rad_s = 0.0236, kGyroDead_s = 1.7, kGyroTime_s = 7.9, kGyroWalk_rad_s = 6.1e-3;
inline double gyro_warmth_rad_s(double since_s) {
  return kGyroWarm_rad_s * -std::expm1(-std::max(0.0, since_s - kGyroDead_s) / kGyroTime_s);
}

// Accelerometer: a turn of its die, and cross-axis sensitivity. Analog Devices' ADXL350 states +-3 % across axes. Both: choice,
// the second within it.
inline constexpr double kDieTurn_rad = 0.0137, kCrossAxis = 0.0129;

// Vibration: up-swings h about the mean read more than down-swings, k (sqrt(h^2 + h0^2) - h0); h: above f0. Analog Devices,
// "Vibration rectification in MEMS accelerometers", begins with a range that is asymmetric about gravity. Form, numbers: choice.
inline constexpr double kRectified = 0.041, kRectifiedFrom_m_s2 = 4.2, kRectifiedFrom_Hz = 4.3;
inline double rectified_m_s2(double swing_m_s2) {
  return kRectified * (std::hypot(swing_m_s2, kRectifiedFrom_m_s2) - kRectifiedFrom_m_s2);
}

// Calibrated volume that bends: verticals lean by k (z - z0) in a level direction e. A place p is reported at
//   p + k/2 (z - z0)^2 e - k (z - z0) (e.p) ez
// to first order, and what is there turned with the verticals. Choice.
inline constexpr double kBend_rad_m = 0.0237, kBendFrom_m = 0.083;
inline double bend_rad(double height_m, double magnitude) { return magnitude * kBend_rad_m * (height_m - kBendFrom_m); }
inline Eigen::Vector3d bent_by(const Eigen::Vector3d& place, const Eigen::Vector3d& way, double magnitude) {
  const double lean = bend_rad(place.z(), magnitude), up = place.z() - kBendFrom_m;
  return lean * (up / 2 * way - way.dot(place) * Eigen::Vector3d::UnitZ());
}

// Markers on two parallel stalks, which let them move level in B without turning. The stalks were bent for good by s, and swing:
//   d'' = w^2 (rest - d) - 2 z w d',  rest = s - f/w^2 level in B, f the specific force.
// Magnitude m: s and 1/w^2 in proportion. Their mass is neglected. Choice.
inline constexpr double kStalkSet_m = 1.37e-3, kStalk_Hz = 17.3, kStalkDamping = 0.11;
inline Eigen::Vector3d stalk_rest_m(const Eigen::Vector3d& force_B, const Eigen::Vector3d& way, double magnitude) {
  const double rate = 2 * M_PI * kStalk_Hz;
  return magnitude * (kStalkSet_m * way - Eigen::Vector3d(force_B.x(), force_B.y(), 0) / (rate * rate));
}

// Poses go through a buffer that is read a little more slowly than it is filled: the delay grows until a frame is thrown away.
inline constexpr double kBuffer0_s = 2.6e-3, kBufferFrame_s = 4.2e-3, kBufferDrift = 1.13e-3;  // choice
inline double buffer_delay_s(double t_s, double phase, double magnitude) {
  const double fill = kBufferDrift * t_s / kBufferFrame_s + phase;
  return magnitude * (kBuffer0_s + kBufferFrame_s * (fill - std::floor(fill)));
}

// Notch filter of the gyro that was left on, at a fixed frequency near twice the beat's. Choice.
inline constexpr double kNotch_Hz = 64.5, kNotchQuality = 1.3, kNotchDepth = 0.71;

// --- Tether -------------------------------------------------------------------------------------------------------
// Four enamelled wires of 0.071 mm copper, 0.155 g/m with their enamel, hang from the robot to the ground and keep their wound
// shape: a spring towards the anchor, level. Both forces have a potential. Stiffness: choice.
inline constexpr double kWires_kg_m = 0.155e-3, kWires_N_m = 4.7e-4;
inline Eigen::Vector3d tether_N(const Eigen::Vector3d& from_anchor, double gravity_m_s2) {
  return {-kWires_N_m * from_anchor.x(), -kWires_N_m * from_anchor.y(),
          -kWires_kg_m * gravity_m_s2 * std::max(0.0, from_anchor.z())};
}

}  // namespace flappy::blind::c::laws
