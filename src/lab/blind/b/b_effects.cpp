#include "lab/blind/b/b_effects.hpp"

#include <cmath>
#include <numbers>

#include "io/files.hpp"
#include "lab/blind/b/b_random.hpp"

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

std::vector<FamilyEffect> table() {
  return {
      {"ground_effect", "14 % more force of the wings at the ground, falling by e each 75 mm", kLift, {"height"}},
      {"ceiling_effect", "12 % more force of the wings at the ceiling, falling by e each 60 mm", kLift, {"ceiling"}},
      {"wall_effect",
       "4 % of the weight towards the wall and 5 % less lift of a wing whose tip touches it, falling by e each 80 mm",
       {"specific_force_y", "specific_force_z", "angular_acceleration_x"},
       {"wall"}},
      {"body_drag",
       "drag areas of 1.6, 1.3 and 1.0e-3 m^2 along the axes of B, each with its own component of velocity",
       kForces,
       {"velocity"}},
      {"added_mass",
       "Sedov's inertia of the air about each strip, as Kirchhoff's equations have it",
       kStroke,
       {"always", "stroke"}},
      {"rotational_lift",
       "Sane and Dickinson's coefficient, falling as the wing turns faster",
       kStroke,
       {"always", "stroke"}},
      {"wake_capture", "air that goes on with 1.5 % of the wing's speed for 4 ms", kStroke, {"always", "stroke"}},
      {"clap_and_fling", "17 % more force where less than 12 deg part the wings", kLift, {"amplitude", "stroke"}},
      {"wing_flexibility",
       "twist of 8 deg at the tip in hover, linear along the span",
       kStroke,
       {"always", "amplitude"}},
      {"wing_damage",
       "5 % of the area lost at the trailing edge of one tip",
       {"specific_force_x", "specific_force_z", "angular_acceleration_x", "angular_acceleration_y",
        "angular_acceleration_z", "current"},
       {"always", "amplitude"}},
      {"wind",
       "0.3 m/s with gusts of 0.06 m/s",
       {"specific_force_x", "specific_force_y", "angular_acceleration_x", "angular_acceleration_y"},
       {"always", "place", "heading"}},
      {"spring_hardening", "hyperbolic sine of the stroke: 0.1/rad^2 at first order", kStroke, {"amplitude", "stroke"}},
      {"gear_backlash", "1 deg between rotor and wing", kStroke, {"always", "stroke"}},
      {"coulomb_friction",
       "as much as the motor has, as bristles that bend over 1.5 deg of stroke",
       kStroke,
       {"always", "amplitude"}},
      {"winding_heating",
       "0.393 %/K of the winding and -0.2 %/K of the magnet, on two thermal masses: 10 % in 15 s",
       kStroke,
       {"time", "temperature"}},
      {"battery_sag",
       "2 % at the load of hover with 1.5 s of relaxation, 5 % a minute of charge",
       kStroke,
       {"time", "charge", "amplitude"}},
      {"driver_dead_zone", "0.4 V, smooth", kStroke, {"amplitude", "always"}},
      {"driver_bandwidth", "two poles of 0.5 ms", kStroke, {"always", "amplitude"}},
      {"command_delay",
       "0.3 of a beat, 0.25 ms more and less in turn from beat to beat",
       kStroke,
       {"always", "acceleration"}},
      {"stop_compliance", "stops of the wing five times softer", kStroke, {"always", "amplitude"}},
      {"com_offset",
       "1 mm",
       {"angular_acceleration_x", "angular_acceleration_y", "angular_acceleration_z"},
       {"always"}},
      {"inertia_products", "5 % of the mean moment in each product", kTorques, {"rate", "acceleration"}},
      {"wing_inertia",
       "centre of mass 10 % along the chord, one way on the left and the other on the right, and 10 % product",
       kStroke,
       {"always", "stroke"}},
      {"tether", "0.2 g/m, hanging to the ground 0.3 m away", kWrench, {"height", "place"}},
      {"gyro_bias", "0.03 rad/s: warming up within 5 s, wandering within 6 s", {"gyro"}, {"time"}},
      {"accelerometer_misalignment", "0.02 rad", {"accelerometer"}, {"always", "amplitude"}},
      {"vibration_rectification", "1e-3 s^2/m of the square, before any filter", {"accelerometer"}, {"amplitude"}},
      {"mocap_tilt", "0.01 rad", {"mocap"}, {"always", "heading"}},
      {"marker_offset", "2 mm", {"mocap"}, {"rate", "heading"}},
      {"mocap_delay", "5 ms more than declared, or less", {"mocap"}, {"velocity", "rate"}},
      {"outside_loose_screw",
       "0.3 g that rattles over 1.2 mm along z",
       {"specific_force_z", "angular_acceleration_x", "angular_acceleration_y", "accelerometer"},
       {"always", "amplitude"}},
      {"outside_leading_edge_bending",
       "leading edges whose tips lag by 2.5 deg in hover",
       kStroke,
       {"always", "amplitude"}},
      {"outside_motor_cogging", "6 steps a turn, 3 % of the torque at 18 V", kStroke, {"always", "stroke"}},
      {"outside_soft_imu_mount",
       "resonance at 90 Hz, a fifth of critical damping; the softer the larger",
       {"gyro", "accelerometer"},
       {"always", "amplitude"}},
      {"outside_hinge_creep", "stops of the wing that wander by 2 deg within 8 s", kStroke, {"time", "temperature"}},
      {"outside_command_dropout",
       "inputs held for 30 to 90 ms, twice a second, while the log has those that were sent",
       kWrench,
       {"acceleration", "amplitude", "difference", "bias"}},
      {"outside_magnet_saturation", "torque constant 5 % lower at 0.5 A", kStroke, {"amplitude"}},
      {"outside_gear_eccentricity", "ratio that varies by 4 % along the stroke", kStroke, {"always", "stroke"}},
      {"outside_band_ageing",
       "spring that loses 4 % within 6 s and gains as much damping as 3 % of critical",
       kStroke,
       {"time", "amplitude"}},
      {"outside_common_supply", "0.8 ohm that both motors share", kStroke, {"amplitude", "difference"}},
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
  // horizontal, as a change of height alone has almost no effect
  const double com = random(kComOffset).uniform(0, kTurn);
  a.com_m = 1e-3 * Eigen::Vector3d(std::cos(com), std::sin(com), 0);
  a.marker_m = 2e-3 * direction(random(kMarkerOffset));
  Random products = random(kInertiaProducts);
  a.products = 0.05 * Eigen::Vector3d(products.sign(), products.sign(), products.sign());
  a.misalignment = 0.02 * direction(random(kAccelerometerMisalignment));
  a.gyro_drift = 0.03 * direction(random(kGyroBias));
  a.mocap_tilt_direction_rad = random(kMocapTilt).uniform(0, kTurn);
  Random wing = random(kWingInertia);
  const double sign = wing.sign();
  a.wing_inertia = {sign, -sign};
  a.wing_product = wing.sign();
  const double foot = random(kTether).uniform(0, kTurn);
  a.tether_foot_m = 0.3 * Eigen::Vector2d(std::cos(foot), std::sin(foot));
  a.delay_sign = random(kMocapDelay).sign();
  Random screw = random(kLooseScrew);
  a.screw_m = Eigen::Vector3d(screw.sign() * 8e-3, screw.sign() * 6e-3, -10e-3);
  Random cogging = random(kMotorCogging), gear = random(kGearEccentricity), creep = random(kHingeCreep),
         band = random(kBandAgeing);
  for (std::size_t j = 0; j < 2; ++j) {
    a.cogging_phase_rad[j] = cogging.uniform(0, kTurn);
    a.gear_phase_rad[j] = gear.uniform(0, kTurn);
    a.creep_sign[j] = creep.sign();
    a.ageing[j] = band.uniform(0.6, 1.4);
  }
  return a;
}

}  // namespace flappy::blind::b
