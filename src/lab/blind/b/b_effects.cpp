#include "lab/blind/b/b_effects.hpp"

#include <cmath>
#include <numbers>

#include "io/files.hpp"
#include "lab/blind/b/b_laws.hpp"
#include "lab/blind/b/b_random.hpp"
#include "lab/blind/b/b_sensors.hpp"
#include "lab/blind/b/plant.hpp"

namespace flappy::blind::b {
namespace {

using Words = std::vector<std::string>;

const Words kForces = {"specific_force_x", "specific_force_y", "specific_force_z"};
const Words kTorques = {"angular_acceleration_x", "angular_acceleration_y", "angular_acceleration_z"};
const Words kWrench = {"specific_force_x",       "specific_force_y",       "specific_force_z",
                       "angular_acceleration_x", "angular_acceleration_y", "angular_acceleration_z"};
const Words kLift = {"specific_force_z", "angular_acceleration_y", "current"};
const Words kStroke = {"specific_force_x",       "specific_force_z",       "angular_acceleration_x",
                       "angular_acceleration_y", "angular_acceleration_z", "current"};

EffectMagnitudes effect_magnitudes_of_one(Effect effect) {
  EffectMagnitudes a;
  a.magnitude[effect] = 1;
  return a;
}

std::vector<FamilyEffect> table() {
  const std::string choice = "choice";
  const Plant nominal(nominal_parameters(), effect_magnitudes_of_one(kAddedMass));
  const Plant worn(nominal_parameters(), effect_magnitudes_of_one(kWingDamage));
  const Eigen::Matrix3d& added = nominal.wing(0).added();
  return {
      {"ground_effect",
       "14 % more force of the wings at the ground, 6 % at 0.09 m",
       kLift,
       {"height"},
       "share added = (1 + s (2R)^2 / (h^2 + h0^2))^(2/3) - 1 at constant power",
       "form: Hayden, The effect of the ground on helicopter hovering power required, AHS Forum 32, 1976; finite at "
       "the ground and numbers: choice",
       {kGroundShare, kGroundReach_m}},
      {"ceiling_effect",
       "15 % more force of the wings at the ceiling, 6 % at 0.05 m",
       kLift,
       {"ceiling"},
       "share added = 1 / (1 - (R / (h + h0))^2 / a) - 1",
       "form: Jimenez-Cano and others, Contact-based bridge inspection multirotors, IEEE Robot. Autom. Lett., 2019; "
       "numbers: choice",
       {kCeilingFit, kCeilingReach_m}},
      {"wall_effect",
       "3.7 % of the weight towards the wall and 3.4 % less lift of a wing whose tip touches it",
       {"specific_force_y", "specific_force_z", "angular_acceleration_x"},
       {"wall"},
       "pull / weight = p (1 + (s / l)^2)^(-3/2) of the rim's clearance s; lift lost = q exp(-(s / g)^2) of the tip's",
       "pull: field on the axis of an image vortex ring (Lamb, Hydrodynamics); numbers: choice",
       {kWallPull, kWallRing_m, kWallLoss, kWallFades_m}},
      {"body_drag",
       "drag areas of 1.47, 1.85 and 0.93e-3 m^2 along the axes of B, each with its own component of velocity",
       kForces,
       {"velocity"},
       "F_i = -1/2 rho A_i v_i |v_i|",
       "cross-flow principle: Hoerner, Fluid-Dynamic Drag, 1965; areas: choice",
       {kDragArea_m2[0], kDragArea_m2[1], kDragArea_m2[2]}},
      {"added_mass",
       "Sedov's inertia of the air about each strip, as Kirchhoff's equations have it",
       kStroke,
       {"always", "stroke"},
       "momentum A v of the air with A = sum of pi/4 rho c^2 dr at mid-chord and pi/128 rho c^4 dr about it; force -dA "
       "v/dt "
       "- v x* A v",
       "Sedov, Two-dimensional problems in hydrodynamics and aerodynamics, 1965; numbers: inertia about the hinge, "
       "about "
       "the wing's normal, and mass, of this planform",
       {added(0, 0), added(1, 1), added(2, 2)}},
      {"rotational_lift",
       "Sane and Dickinson's coefficient, falling as the wing turns faster",
       kStroke,
       {"always", "stroke"},
       "dF_N = rho U c^2 dr C(w c / U) w, C = C0 / (1 + (w c / U) / w0), C0 = pi (0.75 - x0)",
       "C0, and that C falls with the rate: Sane, Dickinson, J. Exp. Biol. 205, 2002; w0: choice",
       {kTurningCoefficient, kTurningFalls}},
      {"wake_capture",
       "air that goes on with 1.6 % of the wing's speed for 4 ms",
       kStroke,
       {"always", "stroke"},
       "the air turns about the stroke axis with s z, dz/dt = (stroke rate - z) / tau; the wing meets it",
       choice,
       {kWakeShare, kWakeStays_s}},
      {"clap_and_fling",
       "17.4 % more force where the wings meet, none beyond 60 deg",
       kLift,
       {"amplitude", "stroke"},
       "share added = p (a + (1 - a) [opening]) max(0, 1 - gap / g)",
       "p: largest vertical force augmentation of Lehmann, Pick, J. Exp. Biol. 210, 2007; g, a: choice",
       {kClapShare, kClapReach_rad, kClapApproach}},
      {"wing_flexibility",
       "membrane that bends back by 6.4 deg where the chord is longest, in hover",
       kStroke,
       {"always", "amplitude"},
       "change of angle = a (c(r) / c_max)^3 load / mean load, which it follows within tau",
       "cantilever under even pressure: Timoshenko, Strength of materials; numbers: choice",
       {kBendHover_rad, kBendFollows_s}},
      {"wing_damage",
       "4.1 % of the area of one wing worn off its tip",
       {"specific_force_x", "specific_force_z", "angular_acceleration_x", "angular_acceleration_y",
        "angular_acceleration_z", "current"},
       {"always", "amplitude"},
       "share of the chord lost = 1 - sqrt(1 - ((x - x0) / (1 - x0))^2) beyond x0",
       "wear begins at the tip: Rajabi, Dirks, Gorb, J. Exp. Biol. 223, 2020; shape and size: choice",
       {kWornFrom, 1 - worn.wing(0).area_m2() / nominal.wing(0).area_m2()}},
      {"wind",
       "0.28 m/s at 0.6 m with gusts of 0.053 m/s",
       {"specific_force_x", "specific_force_y", "angular_acceleration_x", "angular_acceleration_y"},
       {"always", "place", "heading"},
       "U (z / 0.6 m)^n; S(f) / var = 4 (L / U) / (1 + 6 f L / U)^(5/3)",
       "spectrum: Kaimal in the form of IEC 61400-1, lengths as in Burton and others, Wind Energy Handbook; numbers: "
       "choice for a room",
       {kWind_m_s, kGust_m_s, kEddy_m, kWindPower}},
      {"spring_hardening",
       "9 % more torque at 0.8 rad, 23 % at 1.3 rad",
       kStroke,
       {"amplitude", "stroke"},
       "torque added = -k a (w sinh(d / w) - d)",
       "exponential stiffening: Fung, Am. J. Physiol. 213, 1967; numbers: choice",
       {kStiffShare, kStiffens_rad}},
      {"gear_backlash",
       "0.0144 rad between rotor and wing, 0.13 mm on a pitch radius of 9 mm",
       kStroke,
       {"always", "stroke"},
       "torque = k (d -+ g/2) + c d' beyond the gap, never pulling",
       "Nordin, Galic, Gutman, Int. J. Adapt. Control Signal Process. 11, 1997; numbers: choice, of the size of "
       "plastic "
       "spur gears of module 0.3 to 0.5",
       {kPlay_rad, kShaft_Nm_rad, kShaftDamping_Nm_s}},
      {"coulomb_friction",
       "nine tenths of what the motor has, as bristles, half as much more at rest",
       kStroke,
       {"always", "amplitude"},
       "F z, dz/dt = (v - |v| z / g(v)) / b, g = 1 + m exp(-(v / vs)^2)",
       "LuGre and ratio of static to dry friction: Canudas de Wit and others, IEEE Trans. Autom. Control 40, 1995; "
       "others: choice",
       {kDry_Nm, kStribeck_rad_s, kBristle_rad}},
      {"winding_heating",
       "0.393 %/K of the winding and -0.117 %/K of the magnet, on two thermal masses: 10 % in 15 s",
       kStroke,
       {"time", "temperature"},
       "c1 T1' = P - (T1 - T2) / r1, c2 T2' = (T1 - T2) / r1 - T2 / r2; R (1 + 0.00393 T1), K (1 - b T2)",
       "copper: IEC 60028; b: of the size that makers of NdFeB state; others: choice, for a motor of 8 mm",
       {kWinding_J_K, kHousing_J_K, kInside_K_W, kOutside_K_W, kMagnet_K}},
      {"battery_sag",
       "2 % at the load of hover with 1.8 s of relaxation, 4.5 % a minute of charge",
       kStroke,
       {"time", "charge", "amplitude"},
       "loss = R0 i + R1 i1 + s q, di1/dt = (i - i1) / tau, dq/dt = i",
       "Thevenin circuit: Suti, Di Rito, Mattei, Energies 15, 2022; numbers: choice",
       {kCell_ohm, kRelaxing_ohm, kRelaxes_s, kDischarge_V_As}},
      {"driver_dead_zone",
       "0.35 V of dead time at 82 kHz, smooth over 1.7 V",
       kStroke,
       {"amplitude", "always"},
       "loss = f td (Vm + 2 Vd) v / sqrt(v^2 + w^2)",
       "td 220 ns and Vd 0.8 V: Texas Instruments, data sheet DRV8870; f, w: choice",
       {kDeadTime_s, kBridge_hz, kRipple_V}},
      {"driver_bandwidth",
       "mean of the last 1.84 ms",
       kStroke,
       {"always", "amplitude"},
       "voltage = mean of the commanded one over the last T, which is T / 2 late",
       choice,
       {kMean_s, kMean_s / 2}},
      {"command_delay",
       "7.3 ms, 0.86 ms more and less in turn from beat to beat",
       kStroke,
       {"always", "acceleration"},
       "delay of beat n = D + (-1)^n d",
       choice,
       {kDelay_s, kDelayTurns_s}},
      {"stop_compliance",
       "pads of 0.131 Nm/rad under the stops of the wing",
       kStroke,
       {"always", "amplitude"},
       "T = k s^(3/2) = kp p, s + p = depth; T (1 + 3/2 c d')",
       "damping: Hunt, Crossley, J. Appl. Mech. 42, 1975; numbers: choice",
       {kPad_Nm_rad, kPadLoss}},
      {"com_offset",
       "0.84 mm level and 0.31 mm up or down",
       {"angular_acceleration_x", "angular_acceleration_y", "angular_acceleration_z"},
       {"always"},
       "centre of mass of the torso moved",
       choice,
       {kComLevel_m, kComUp_m}},
      {"inertia_products",
       "4.3, 5.7 and 3.6 % of the mean moment in xy, xz and yz",
       kTorques,
       {"rate", "acceleration"},
       "products of inertia of the torso added",
       choice,
       {kProducts[0], kProducts[1], kProducts[2]}},
      {"wing_inertia",
       "centres of mass 1.13 mm along the chord, the same on both wings, and 0.56 g mm^2 more or less of product",
       kStroke,
       {"always", "stroke"},
       "centre of mass and product yz of both wings moved; moments about the centre of mass kept",
       choice,
       {kWingCom_m, kWingProduct_kg_m2}},
      {"tether",
       "0.172 g/m, hanging to the ground 0.36 m away",
       kWrench,
       {"height", "place"},
       "down: w (h + h1); level: w d^2 / (8 f (h + h2)), a shallow catenary",
       "parabola of a shallow catenary: Irvine, Cable Structures, 1981; numbers: choice",
       {kCable_kg_m, kSagShare, kSagMore_m, kHangsMore_m, kAnchor_m}},
      {"gyro_bias",
       "0.0257 rad/s: warming up within 7.3 s, wandering within 4.6 s by 0.0094 rad/s",
       {"gyro"},
       {"time"},
       "B (1 - exp(-t / t1)) + Markov process of sd s and time t2 from 0",
       "choice, within what a data sheet allows: InvenSense MPU-6050, 20 deg/s over the range of temperature",
       {kGyroWarm_rad_s, kGyroWarms_s, kGyroWanders_rad_s, kGyroForgets_s}},
      {"accelerometer_misalignment",
       "axis x out of square to y by 0.0131, and both to z by 0.0206 in all",
       {"accelerometer"},
       {"always", "amplitude"},
       "x = fx + a fy + b fz, y = fy + c fz, z = fz",
       "form: Tedaldi, Pretto, Menegatti, A robust and easy to implement method for IMU calibration, ICRA, 2014; size: "
       "choice, within the cross-axis sensitivity of 2 % of a data sheet, InvenSense MPU-6050",
       {kSkewLevel, kSkewUp}},
      {"vibration_rectification",
       "8.3e-4 s^2/m of the square, after the sensor's low-pass",
       {"accelerometer"},
       {"amplitude"},
       "reading = y + K2 y^2, y the low-passed specific force",
       "K2: IEEE Std 1293; size: choice",
       {kSquare_s2_m, SensorTruth{}.bandwidth_hz}},
      {"mocap_tilt",
       "0.0083 rad, and a wand that is off by 0.37 % of its length",
       {"mocap"},
       {"always", "heading"},
       "place = (1 + e) R p",
       choice,
       {kTilt_rad, kWand}},
      {"marker_offset",
       "one of four markers moved by 4.1 mm",
       {"mocap"},
       {"rate", "heading"},
       "shift d / 4 - w x c, turn w = J^-1 (r x d), J = sum of (r^2 - r r^T)",
       "least squares: Horn, J. Opt. Soc. Am. A 4, 1987; size: choice",
       {kMarkerMoved_m, kMarkers_m[0].norm()}},
      {"mocap_delay",
       "a clock that gains or loses 0.87 ms a second on the frames' stamps",
       {"mocap"},
       {"velocity", "rate", "time"},
       "stamp less true time of arrival = e (t + t0), t0 since the clocks were set",
       "choice, as of an RC oscillator",
       {kClockRuns, kClockSet_s}},
      {"outside_loose_screw",
       "0.3 g that rattles over 1.2 mm along z",
       {"specific_force_z", "angular_acceleration_x", "angular_acceleration_y", "accelerometer"},
       {"always", "amplitude"},
       "free between two stops with damping",
       choice,
       {kScrewMass_kg, kScrewGap_m}},
      {"outside_leading_edge_bending",
       "leading edges whose tips lag by 2.5 deg in hover",
       kStroke,
       {"always", "amplitude"},
       "tip angle b F / F0, followed within tau; strips move with (r / R)^2 of its rate",
       choice,
       {kEdgeBend_rad, kEdgeFollows_s}},
      {"outside_motor_cogging",
       "6 steps a turn, 3 % of the torque at 18 V",
       kStroke,
       {"always", "stroke"},
       "rotor torque -T sin(6 rotor angle + phase)",
       choice,
       {kCogging_Nm, kCoggingSteps}},
      {"outside_soft_imu_mount",
       "resonance at 90 Hz, a fifth of critical damping; the softer the larger",
       {"gyro", "accelerometer"},
       {"always", "amplitude"},
       "x'' + 2 z w x' + w^2 x = w^2 u on each axis",
       choice,
       {90, 0.2}},
      {"outside_hinge_creep",
       "stops of the wing that wander by 2 deg within 8 s",
       kStroke,
       {"time", "temperature"},
       "shift = a (1 - exp(-t / tau))",
       choice,
       {kCreep_rad, kCreeps_s}},
      {"outside_command_dropout",
       "inputs held for 30 to 90 ms, twice a second, while the log has those that were sent",
       kWrench,
       {"acceleration", "amplitude", "difference", "bias"},
       "the last packet stays while the link is down, at random times",
       choice,
       {0.06, 0.45}},
      {"outside_magnet_saturation",
       "torque constant 5 % lower at 0.5 A",
       kStroke,
       {"amplitude"},
       "K / (1 + a (i / i0)^2)",
       choice,
       {kSaturation, kSaturates_A}},
      {"outside_torn_flap",
       "a tear in one wing whose flap opens as a valve in one half stroke: 13 % of the load from 0.6 to 0.9 of the "
       "span",
       kStroke,
       {"always", "amplitude"},
       "share of the load lost = a (1 + tanh(s u / u0)) / 2, u: velocity along the normal",
       "hinged flaps that flip open in each beat: the alula of Walker, Thomas, Taylor, J. R. Soc. Interface 7, 2010; "
       "numbers: choice",
       {kFlapShare, kFlapOpens_m_s, kFlapFrom, kFlapTo}},
      {"outside_band_ageing",
       "spring that loses 4 % within 6 s and gains as much damping as 3 % of critical",
       kStroke,
       {"time", "amplitude"},
       "k (1 - a (1 - exp(-t / tau))) and damping z",
       choice,
       {kAgeing, kAges_s, kAgedDamping}},
      {"outside_spring_slip",
       "12 % of the spring held by a clamp that slips at 0.34 rad",
       kStroke,
       {"amplitude", "stroke"},
       "torque -k ((1 - a) d + a e), e' = d' (1 - sign(d' e) |e / e0|^3)",
       "hysteresis: Bouc, 1967; Wen, J. Eng. Mech. Div. ASCE 102, 1976; numbers: choice",
       {kSlipShare, kSlips_rad}},
  };
}

}  // namespace

const std::vector<FamilyEffect>& family_effects() {
  static const std::vector<FamilyEffect> all = table();
  return all;
}

std::size_t effect_number(const std::string& id) {
  const std::vector<FamilyEffect>& all = family_effects();
  std::vector<std::string> names;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i].id == id) return i;
    names.push_back(all[i].id);
  }
  throw io::InputError("effect " + id + ": robots of family b have none of this name; accepted: " + io::joined(names) +
                       io::did_you_mean(id, names));
}

EffectMagnitudes effect_magnitudes_of(const std::vector<std::pair<std::string, double>>& effects, std::uint64_t seed) {
  EffectMagnitudes a;
  std::array<bool, kEffects> named{};
  for (const auto& [id, magnitude] : effects) {
    const std::size_t number = effect_number(id);
    if (named[number]) throw io::InputError("effect " + id + ": named twice; accepted: each once");
    if (!(magnitude >= 0 && magnitude <= 4))
      throw io::InputError("effect " + id + ": magnitude " + io::shortest_digits(magnitude) +
                           " is out of range; accepted: from 0 to 4");
    named[number] = true;
    a.magnitude[number] = magnitude;
  }
  const auto random = [&](Effect e) { return Random(seed, 0, Stream::kEffect, e); };
  const auto direction = [](Random r) {
    Eigen::Vector3d d(r.normal(), r.normal(), r.normal());
    return Eigen::Vector3d(d.normalized());
  };
  constexpr double kTurn = 2 * std::numbers::pi;
  a.damaged_side = random(kWingDamage).uniform() < 0.5 ? 0 : 1;
  a.wind_direction_rad = random(kWind).uniform(0, kTurn);
  // mostly level, as a change of height alone has almost no effect
  Random com = random(kComOffset);
  const double way = com.uniform(0, kTurn), up = com.sign();
  a.com_m = {kComLevel_m * std::cos(way), kComLevel_m * std::sin(way), kComUp_m * up};
  Random marker = random(kMarkerOffset);
  a.marker = marker.below(kMarkers_m.size());
  a.marker_m = kMarkerMoved_m * direction(marker);
  Random products = random(kInertiaProducts);
  for (Eigen::Index i = 0; i < 3; ++i) a.products[i] = kProducts[static_cast<std::size_t>(i)] * products.sign();
  Random skew = random(kAccelerometerMisalignment);
  const double split = skew.uniform(0, kTurn);
  a.skew = {kSkewLevel * skew.sign(), kSkewUp * std::cos(split), kSkewUp * std::sin(split)};
  a.gyro_drift = direction(random(kGyroBias));
  Random tilt = random(kMocapTilt);
  a.mocap_tilt_direction_rad = tilt.uniform(0, kTurn);
  a.mocap_scale_sign = tilt.sign();
  Random wing = random(kWingInertia);
  a.wing_com_m = kWingCom_m * wing.sign();
  a.wing_product_kg_m2 = kWingProduct_kg_m2 * wing.sign();
  const double foot = random(kTether).uniform(0, kTurn);
  a.tether_foot_m = kAnchor_m * Eigen::Vector2d(std::cos(foot), std::sin(foot));
  a.delay_sign = random(kMocapDelay).sign();
  Random screw = random(kLooseScrew);
  a.screw_m = Eigen::Vector3d(screw.sign() * 8e-3, screw.sign() * 6e-3, -10e-3);
  Random cogging = random(kMotorCogging), creep = random(kHingeCreep), band = random(kBandAgeing),
         flap = random(kTornFlap);
  a.torn_side = flap.uniform() < 0.5 ? 0 : 1;
  a.flap_opens = flap.sign();
  for (std::size_t j = 0; j < 2; ++j) {
    a.cogging_phase_rad[j] = cogging.uniform(0, kTurn);
    a.creep_sign[j] = creep.sign();
    a.ageing[j] = band.uniform(0.6, 1.4);
  }
  return a;
}

}  // namespace flappy::blind::b
