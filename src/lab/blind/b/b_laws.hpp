// Laws of the effects as pure functions, for magnitude `m`, with the constants of magnitude 1. Flights call them, and so
// does law_of(). Sources are in family_effects(); a constant without one is a choice. SI units.
//
//   ground    share of lift added  (1 + s (2R)^2 / (h^2 + h0^2))^(2/3) - 1     Hayden's form [1], made finite on the ground
//   ceiling   share of lift added  1 / (1 - (R / (h + h0))^2 / a) - 1           form fitted to multirotors [2]
//   wall      pull / weight        p (1 + (s / l)^2)^(-3/2)  s: clearance of the torso's rim. A vortex ring of radius l
//                                  induces this along its axis; the ring is the image of the wings behind the wall.
//             lift lost by a wing  q exp(-(s / g)^2)         s: clearance of its tip
//   body drag F = -1/2 rho A_i v_i |v_i| on each axis of B: cross-flow principle of slender bodies
//   wind      U (z / 0.6 m)^n along the mean; gusts of the spectrum of Kaimal [3] in its normal form [4],
//             S(f) / var = 4 (L/U) / (1 + 6 f L/U)^(5/3), whose integral over f is 1; cross-wind and vertical gusts with
//             L and sd by the ratios of [4]. Sum of cosines with random phases [5]. L is of a room, not of the open.
//   driver    loss of voltage V0 v / sqrt(v^2 + w^2), V0 = f td (Vm + 2 Vd): in the dead time td of each period the
//             current flows through a body diode [6], which costs the pulse td Vm and two drops Vd. In light load the
//             ripple of the current changes sign in each period and losses of both edges cancel: w.
//             Bandwidth: running mean over T, as of a command that is averaged over whole periods of a slow PWM.
//   heating   two thermal nodes, winding and housing (c dT/dt = heat in - heat out); copper +0.393 %/K of the winding,
//             remanence of NdFeB of the housing
//   battery   Thevenin circuit [7]: R0 i + R1 i_1 + s q,  di_1/dt = (i - i_1) / tau,  q the charge drawn
//   spring    linear spring beside a share a of one that stiffens exponentially as tissue and rubber do [8]: torque
//             -k (d + a (w sinh(d / w) - d)); energy k (d^2/2 + a (w^2 (cosh(d / w) - 1) - d^2/2))
//   backlash  a damped elastic shaft behind a gap, which transmits no pull [9]
//   friction  bristles of LuGre [10] whose strength falls with the speed (Stribeck); steady: -F g(v) sign v
//   stop      a pad of linear stiffness in series with the stop's own k d^(3/2); damping of Hunt and Crossley
//   clap      share p (1 - gap / g), less while the wings approach
//   flexible  the membrane behind the spar, of the chord's length c, bends as a cantilever under even pressure: its
//             chord's angle grows with c^3, so it follows the planform, and the narrow tip turns little
//   damage    the tip is worn off along an ellipse from the station x0 on: share lost 1 - sqrt(1 - ((x - x0)/(1 - x0))^2)
//   sensors   gyroscope: warm-up and a first-order Markov process; accelerometer: axes x and y are not square to z, and x
//             not to y (triangular matrix); its output after the low-pass has a quadratic term, so what rectifies of a
//             vibration falls with frequency. Motion capture: a wand whose length is wrong scales the room and a level
//             that is off turns it; one of four markers moved, so the fitted body shifts by a quarter and turns by
//             J^-1 (r x d); the clock that stamps its
//             frames runs fast or slow, which reads as a delay that grows, and changes nothing on board.
//   tether    a cable from below the torso to an anchor: weight of what hangs, and of a shallow catenary
//             w d^2 / (8 sag), horizontal
//
// 1 Hayden, The effect of the ground on helicopter hovering power required, AHS Forum 32 (1976): form
// 2 Jimenez-Cano, Sanchez-Cuevas, Grau, Ollero, Heredia, Contact-based bridge inspection multirotors: design, modeling,
// and control considering the ceiling effect, IEEE Robot. Autom. Lett. 4 (2019): form
// 3 Kaimal and others (1972), as in Kaimal, Finnigan, Atmospheric Boundary Layer Flows (1994)
// 4 IEC 61400-1; the ratios of lengths 1 : 0.333 : 0.0815 as in Burton and others, Wind Energy Handbook, eq. 2.30
// 5 Shinozuka, Jan, Digital simulation of random processes and its applications, J. Sound Vib. 25 (1972)
// 6 Texas Instruments, data sheet DRV8870: output dead time 220 ns, body diode 0.8 V at 1 A
// 7 Suti, Di Rito, Mattei, Energies 15 (2022)
// 8 Fung, Elasticity of soft tissues in simple elongation, Am. J. Physiol. 213 (1967): form
// 9 Nordin, Galic, Gutman, New models for backlash and gear play, Int. J. Adapt. Control Signal Process. 11 (1997)
// 10 Canudas de Wit, Olsson, Astrom, Lischinsky, A new model for control of systems with friction, IEEE Trans. Autom.
// Control 40 (1995)
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <numbers>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace flappy::blind::b {

inline double smooth_sign(double x, double over) { return std::tanh(x / over); }

// Surfaces and air
inline constexpr double kSpan_m = 0.168, kGroundShare = 0.0374, kGroundReach_m = 0.067;
inline double ground_share(double height_m) {
  const double h = std::max(height_m, 0.0);
  return std::pow(1 + kGroundShare * kSpan_m * kSpan_m / (h * h + kGroundReach_m * kGroundReach_m), 2.0 / 3) - 1;
}

inline constexpr double kCeilingFit = 6.9, kCeilingReach_m = 0.0885;
inline double ceiling_share(double clearance_m) {
  const double r = 0.5 * kSpan_m / (std::max(clearance_m, 0.0) + kCeilingReach_m);
  return 1 / (1 - r * r / kCeilingFit) - 1;
}

inline constexpr double kWallPull = 0.0365, kWallRing_m = 0.104, kWallLoss = 0.034, kWallFades_m = 0.121;
inline double wall_pull(double clearance_m) {
  const double s = std::max(clearance_m, 0.0) / kWallRing_m;
  return kWallPull * std::pow(1 + s * s, -1.5);
}
inline double wall_loss(double tip_clearance_m) {
  const double s = std::max(tip_clearance_m, 0.0) / kWallFades_m;
  return kWallLoss * std::exp(-s * s);
}

inline constexpr std::array<double, 3> kDragArea_m2 = {1.47e-3, 1.85e-3, 0.93e-3};
inline Eigen::Vector3d body_drag_N(const Eigen::Vector3d& through_air_m_s, double density_kg_m3) {
  const Eigen::Vector3d area(kDragArea_m2[0], kDragArea_m2[1], kDragArea_m2[2]);
  return -0.5 * density_kg_m3 * area.cwiseProduct(through_air_m_s.cwiseAbs().cwiseProduct(through_air_m_s));
}

inline constexpr double kWind_m_s = 0.28, kGust_m_s = 0.053, kEddy_m = 0.21, kWindPower = 0.155;
inline constexpr double kWindAt_m = 0.6;
/// Mean speed over that at 0.6 m.
inline double wind_profile(double height_m) { return std::pow(std::max(height_m, 0.02) / kWindAt_m, kWindPower); }
/// Of the gusts along an axis (0: along the mean wind, 1: across, 2: vertical), over their variance, 1/Hz.
inline double gust_density(double frequency_hz, std::size_t axis) {
  constexpr std::array<double, 3> kLength = {1, 0.3333, 0.08148};
  const double lasts_s = kEddy_m * kLength[axis] / kWind_m_s;
  return 4 * lasts_s / std::pow(1 + 6 * frequency_hz * lasts_s, 5.0 / 3);
}
inline constexpr std::array<double, 3> kGustShare = {1, 0.8, 0.5};  ///< sd on each axis over that along the wind [4]

inline constexpr double kWakeShare = 0.0163, kWakeStays_s = 3.7e-3;
/// Rate of change of the air's rotation about the stroke axis.
inline double wake_rate(double stroke_rate, double wake) { return (stroke_rate - wake) / kWakeStays_s; }

inline constexpr double kClapShare = 0.174, kClapReach_rad = 1.05, kClapApproach = 0.32;
/// `opens`: sum of the stroke angles times its rate, negative while the gap opens.
inline double clap_share(double gap_rad, double opens) {
  const double parting = 0.5 * (1 - smooth_sign(opens, 40));
  return kClapShare * (kClapApproach + (1 - kClapApproach) * parting) *
         std::clamp(1 - gap_rad / kClapReach_rad, 0.0, 1.0);
}

inline constexpr double kTurningCoefficient = 2.29, kTurningFalls = 0.43;  ///< pi (0.75 - x0), x0 = 2 % of the chord
/// Circulation's coefficient of a turning wing; `reduced`: rotation rate x chord / speed.
inline double turning_coefficient(double reduced) { return kTurningCoefficient / (1 + reduced / kTurningFalls); }

inline constexpr double kBendHover_rad = 0.112, kBendFollows_s = 0.7e-3, kBendMost = 3;
/// Angle where the chord is longest, of the normal load over its mean in hover.
inline double bend_angle(double load) { return kBendHover_rad * std::clamp(load, -kBendMost, kBendMost); }

inline constexpr double kWornFrom = 0.662;
/// Share of the chord that is lost at a station; 0 to 1.
inline double worn_share(double station) {
  const double x = std::clamp((station - kWornFrom) / (1 - kWornFrom), 0.0, 1.0);
  return 1 - std::sqrt(1 - x * x);
}

// Hinges and drives
inline constexpr double kStiffShare = 0.152, kStiffens_rad = 0.55;
/// What hardening adds to the deflection; times the stiffness, to the torque.
inline double hardening(double d, double m) {
  return m * kStiffShare * (kStiffens_rad * std::sinh(d / kStiffens_rad) - d);
}
inline double hardening_energy(double d, double m) {
  return m * kStiffShare * (kStiffens_rad * kStiffens_rad * (std::cosh(d / kStiffens_rad) - 1) - d * d / 2);
}

inline constexpr double kPlay_rad = 0.0144, kShaft_Nm_rad = 0.43, kShaftDamping_Nm_s = 4.6e-5;
inline double backlash_torque(double apart_rad, double closing_rad_s, double m) {
  const double gap = 0.5 * kPlay_rad * m;
  if (apart_rad > gap) return std::max(0.0, kShaft_Nm_rad * (apart_rad - gap) + kShaftDamping_Nm_s * closing_rad_s);
  if (apart_rad < -gap) return std::min(0.0, kShaft_Nm_rad * (apart_rad + gap) + kShaftDamping_Nm_s * closing_rad_s);
  return 0;
}

inline constexpr double kDry_Nm = 1.83e-4;  ///< at the wing
inline constexpr double kStribeckMore = 0.5, kStribeck_rad_s = 46, kBristle_rad = 0.0233;
/// Deflection of a bristle when it slips, over that at high speed.
inline double bristle_strength(double rate) {
  const double v = rate / kStribeck_rad_s;
  return 1 + kStribeckMore * std::exp(-v * v);
}
inline double bristle_rate(double rate, double z) {
  return (rate - std::abs(rate) * z / bristle_strength(rate)) / kBristle_rad;
}
inline double bristle_torque(double z, double m) { return -m * kDry_Nm * z; }

inline constexpr double kPad_Nm_rad = 0.131, kPadLoss = 1.02e-2;
/// Torque of a stop of stiffness k (Nm/rad^1.5) behind a pad, against the rotation.
inline double pad_torque(double k, double beyond_rad, double rate_rad_s, double m) {
  if (beyond_rad <= 0) return 0;
  // s = depth of the stop to the power 1/2; the pad yields k s^3 / pad: Newton's method from above
  const double c = m * k / kPad_Nm_rad;
  double s = std::sqrt(beyond_rad);
  for (int i = 0; i < 8; ++i) s -= (s * s + c * s * s * s - beyond_rad) / (2 * s + 3 * c * s * s);
  return k * s * s * s * std::max(0.0, 1 + 1.5 * kPadLoss * rate_rad_s);
}

inline constexpr double kWinding_J_K = 0.117, kHousing_J_K = 0.92, kInside_K_W = 13.2, kOutside_K_W = 47,
                        kCopper_K = 0.00393, kMagnet_K = 0.00117;
struct Heat {
  double winding_K = 0, housing_K = 0;  ///< above the room
  void take(double loss_J, double h) {
    const double inside = (winding_K - housing_K) / kInside_K_W;
    winding_K += (loss_J - inside * h) / kWinding_J_K;
    housing_K += (inside - housing_K / kOutside_K_W) * h / kHousing_J_K;
  }
  double resistance(double m) const { return m * kCopper_K * winding_K; }        ///< relative change
  double torque_constant(double m) const { return -m * kMagnet_K * housing_K; }  ///< relative change
};

inline constexpr double kCell_ohm = 0.31, kRelaxing_ohm = 0.40, kRelaxes_s = 1.83, kDischarge_V_As = 0.0273;
struct Sag {
  double charge_As = 0, relaxed_A = 0, now_A = 0;
  void take(double current_A, double h) {
    now_A = current_A;
    charge_As += current_A * h;
    relaxed_A += (current_A - relaxed_A) * (1 - std::exp(-h / kRelaxes_s));
  }
  double loss_V(double m) const {
    return m * (kCell_ohm * now_A + kRelaxing_ohm * relaxed_A + kDischarge_V_As * charge_As);
  }
};

inline constexpr double kDeadTime_s = 220e-9, kDiode_V = 0.8;                ///< [6]
inline constexpr double kBridge_hz = 82e3, kBridge_V = 18, kRipple_V = 1.7;  ///< choices; 18 V: the robot's supply
inline double dead_time_V(double v, double m) {
  constexpr double kLoss_V = kBridge_hz * kDeadTime_s * (kBridge_V + 2 * kDiode_V);
  return -m * kLoss_V * v / std::hypot(v, kRipple_V);
}

inline constexpr double kMean_s = 1.84e-3;
/// Mean of a voltage over the last `window_s`; it was 0 before the first.
class RunningMean {
 public:
  double take(double value, double h, double window_s) {
    kept_.emplace_back(value, h);
    sum_ += value * h;
    long_s_ += h;
    while (long_s_ > window_s + 1e-12) {
      auto& [old, lasts] = kept_.front();
      const double less = std::min(lasts, long_s_ - window_s);
      sum_ -= old * less;
      long_s_ -= less;
      lasts -= less;
      if (lasts <= 1e-12) kept_.pop_front();
    }
    return sum_ / window_s;
  }

 private:
  std::deque<std::pair<double, double>> kept_;
  double sum_ = 0, long_s_ = 0;
};

inline constexpr double kDelay_s = 7.3e-3, kDelayTurns_s = 0.86e-3;
/// Delay of the commands of a beat: more and less in turn.
inline double command_delay_s(long beat, double m) { return m * (kDelay_s + (beat % 2 == 0 ? 1 : -1) * kDelayTurns_s); }

// Sensors
inline constexpr double kGyroWarm_rad_s = 0.0257, kGyroWarms_s = 7.3, kGyroWanders_rad_s = 9.4e-3, kGyroForgets_s = 4.6;
inline double gyro_warm_up(double on_s) { return kGyroWarm_rad_s * (1 - std::exp(-on_s / kGyroWarms_s)); }
/// The next value of a first-order Gauss-Markov process of sd 1 after h; its mean square grows as 1 - exp(-2 t / tau).
inline double gyro_keeps(double h) { return std::exp(-h / kGyroForgets_s); }

inline constexpr double kSkewLevel = 0.0131, kSkewUp = 0.0206;  ///< of x to y; of both to z
/// Of axes that are not square to each other: x = fx + a fy + b fz, y = fy + c fz, z = fz.
inline Eigen::Vector3d skewed(const Eigen::Vector3d& f, const Eigen::Vector3d& skew) {
  return {f.x() + skew[0] * f.y() + skew[1] * f.z(), f.y() + skew[2] * f.z(), f.z()};
}

inline constexpr double kSquare_s2_m = 8.3e-4;
/// What a quadratic term adds to the filtered specific force.
inline Eigen::Vector3d rectified(const Eigen::Vector3d& filtered, double m) {
  return m * kSquare_s2_m * filtered.cwiseProduct(filtered);
}
/// First-order low-pass of the means over steps.
inline Eigen::Vector3d low_pass(const Eigen::Vector3d& before, const Eigen::Vector3d& now, double bandwidth_hz,
                                double h) {
  const double keep = std::exp(-h * 2 * std::numbers::pi * bandwidth_hz);
  return keep * before + (1 - keep) * now;
}

inline constexpr double kTilt_rad = 8.3e-3, kWand = 3.7e-3;  ///< the wand is off by as much of its length
/// Where the room's calibration reports a place: turned about a level axis and scaled.
inline Eigen::Vector3d misplaced(const Eigen::Vector3d& place, const Eigen::Quaterniond& tilt, double scale) {
  return (1 + scale) * (tilt * place);
}

/// Markers on the robot, in B; their lever arms are 30 to 40 mm.
inline const std::array<Eigen::Vector3d, 4> kMarkers_m = {
    Eigen::Vector3d(38e-3, 4e-3, 8e-3), Eigen::Vector3d(-17e-3, 31e-3, -6e-3), Eigen::Vector3d(-24e-3, -29e-3, 2e-3),
    Eigen::Vector3d(6e-3, -9e-3, 33e-3)};
inline constexpr double kMarkerMoved_m = 4.1e-3;
struct Misfit {
  Eigen::Vector3d shift_m, turn_rad;  ///< of the reported origin and attitude, in B
};
/// What least squares make of a marker that moved: to first order, the centroid shifts by a quarter, and the body turns
/// about it by J^-1 (r x d), J = sum of (r^2 - r r^T).
inline Misfit misfit(std::size_t marker, const Eigen::Vector3d& moved_m) {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : kMarkers_m) centre += p / 4;
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& p : kMarkers_m) {
    const Eigen::Vector3d r = p - centre;
    inertia += r.squaredNorm() * Eigen::Matrix3d::Identity() - r * r.transpose();
  }
  const Eigen::Vector3d turn = inertia.ldlt().solve((kMarkers_m[marker] - centre).cross(moved_m));
  return {moved_m / 4 - turn.cross(centre), turn};
}

inline constexpr double kClockRuns = 8.7e-4, kClockSet_s = 1.6;  ///< set so long before the log
/// By how much a frame is stamped too late, or too early.
inline double clock_late_s(double log_time_s, double m) {
  return m * kClockRuns * std::max(0.0, log_time_s + kClockSet_s);
}

// World
inline constexpr double kCable_kg_m = 1.72e-4, kSagShare = 0.29, kSagMore_m = 0.34, kHangsMore_m = 0.17,
                        kAnchor_m = 0.36;
/// Pull of the cable in W on a torso at (x, y) from the anchor and `height_m` above the ground.
inline Eigen::Vector3d tether_N(double x, double y, double height_m, double gravity_m_s2) {
  const double weight = kCable_kg_m * gravity_m_s2, h = std::max(height_m, 0.0);
  const double along = weight * std::hypot(x, y) / (8 * kSagShare * (h + kSagMore_m));
  return {-along * x, -along * y, -weight * (h + kHangsMore_m)};
}

// Geometry
inline constexpr double kComLevel_m = 8.4e-4, kComUp_m = 3.1e-4;
inline constexpr std::array<double, 3> kProducts = {0.043, 0.057, 0.036};  ///< xy, xz, yz over the mean moment
inline constexpr double kWingCom_m = 1.13e-3, kWingProduct_kg_m2 = 5.6e-10;

// Outside the catalogue
inline constexpr double kScrewMass_kg = 0.3e-3, kScrewGap_m = 0.6e-3;
inline constexpr double kEdgeBend_rad = 0.044, kEdgeFollows_s = 1e-3;  ///< of the tip in hover
inline constexpr double kCogging_Nm = 7.6e-5, kCoggingSteps = 6;
inline constexpr double kCreep_rad = 2 * std::numbers::pi / 180, kCreeps_s = 8;
inline constexpr double kSaturation = 0.05, kSaturates_A = 0.5;
inline constexpr double kAgeing = 0.04, kAges_s = 6, kAgedDamping = 0.03;
inline constexpr double kFlapShare = 0.13, kFlapFrom = 0.6, kFlapTo = 0.9, kFlapOpens_m_s = 1.1;
/// A tear lets a flap of the membrane open as a valve where air pushes it from one side: share of the load that is lost.
inline double flap_share(double normal_m_s) { return kFlapShare * 0.5 * (1 + std::tanh(normal_m_s / kFlapOpens_m_s)); }

inline constexpr double kSlipShare = 0.12, kSlips_rad = 0.34;
/// Part of the spring is held by a clamp that slips (Bouc 1967, Wen 1976): rate of that part's deflection e,
/// e' = d' (1 - sign(d' e) |e / e_0|^3). It only loses energy: e (d' - e') >= 0.
inline double clamp_rate(double rate, double e) {
  const double full = e / kSlips_rad;
  return rate - std::abs(rate) * full * std::abs(full) * std::abs(full);
}

/// The law of an effect by itself, of the nominal robot at magnitude 1; arguments and outcomes: Family::law.
std::vector<double> law_of(const std::string& effect, std::span<const double> at);

}  // namespace flappy::blind::b
