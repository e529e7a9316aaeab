#include "lab/blind/c/c_effects.hpp"

#include "io/files.hpp"

namespace flappy::blind::c {

const std::vector<FamilyEffect>& effect_table() {
  const std::vector<std::string> lift = {"force_z", "current"}, turn = {"torque_x", "torque_z"};
  static const std::vector<FamilyEffect> table = {
      {"ground_effect",
       "15 % more air force at no height, decaying over a wing's length: 3 to 8 % in flights near the ground",
       lift,
       {"height", "place"}},
      {"ceiling_effect",
       "12 % more air force at no clearance, decaying over a wing's length",
       lift,
       {"ceiling", "place"}},
      {"wall_effect",
       "at the wall 6 % less air force on the wing next to it, and a pull of 2 % of the weight; both decay over a "
       "wing's length",
       {"force_y", "torque_x"},
       {"wall", "place"}},
      {"body_drag", "an ellipsoid of C_d A 1.5e-3 m^2 as the torso", {"force_x", "force_y", "force_z"}, {"velocity"}},
      {"added_mass",
       "the whole virtual mass of each wing's ellipsoids",
       {"force_x", "torque_y", "current"},
       {"acceleration", "always"}},
      {"rotational_lift",
       "circulation pi (0.75 - 0.25) thetadot c^2, as a Magnus force",
       {"force_z", "force_x"},
       {"stroke", "rate", "always"}},
      {"wake_capture",
       "30 % more air force at reversal, decaying over a chord travelled: 0.5 % of the weight",
       lift,
       {"stroke", "always"}},
      {"clap_and_fling",
       "25 % more air force on wings that have met: e times less for 20 deg between them, and for 3 chords travelled",
       lift,
       {"stroke", "amplitude"}},
      {"wing_flexibility",
       "outer part turned by 0.07 rad under 4e-4 N m about the hinge",
       {"force_z", "current"},
       {"amplitude", "always"}},
      {"wing_damage",
       "5 % of one wing's outer ellipse, at its tip: some 24 rad/s^2 of roll",
       {"torque_x", "torque_z", "current"},
       {"always", "amplitude"}},
      {"wind", "0.3 m/s level, with gusts of a third", {"force_x", "force_y", "torque_y"}, {"heading", "always"}},
      {"spring_hardening", "stiffness 10 %/rad^2, hyperbolic", {"force_z", "current"}, {"amplitude", "stroke"}},
      {"gear_backlash", "1 deg of play between rotor and wing", {"force_z", "current"}, {"stroke", "amplitude"}},
      {"coulomb_friction",
       "friction doubled at standstill, Stribeck speed 120 rad/s of stroke",
       {"force_z", "current"},
       {"amplitude", "stroke"}},
      {"winding_heating",
       "45 K/W and 0.35 J/K of winding: some 15 % of resistance after 15 s of hover",
       {"force_z", "current"},
       {"temperature", "time"}},
      {"battery_sag",
       "5 %/min of voltage with the charge drawn in hover, and 1.2 ohm",
       {"force_z", "current"},
       {"charge", "time", "amplitude"}},
      {"driver_dead_zone",
       "0.4 V lost in the bridge, smooth about zero",
       {"force_z", "current"},
       {"amplitude", "always"}},
      {"driver_bandwidth", "two poles of 0.5 ms", {"force_z", "torque_z", "current"}, {"split_cycle", "always"}},
      {"command_delay", "0.3 beat", {"force_x", "force_z", "torque_x", "torque_y", "current"}, {"always"}},
      {"stop_compliance",
       "stops of the rotation of a fifth of their stiffness",
       {"force_z", "force_x"},
       {"amplitude", "always"}},
      {"com_offset", "1 mm, level", {"torque_x", "torque_y"}, {"always", "acceleration"}},
      {"inertia_products",
       "Ixy and Ixz of the torso by 5 % of its Ixx",
       {"torque_x", "torque_y", "torque_z"},
       {"acceleration"}},
      {"wing_inertia",
       "centre of mass 10 % of its distance along the chord, inertia turned by 0.1 rad",
       {"force_z", "torque_y"},
       {"always", "acceleration"}},
      {"tether",
       "cable of 0.2 g/m from the ground, pulling back by a third of its weight per metre",
       {"force_z", "force_x", "force_y"},
       {"height", "place"}},
      {"gyro_bias", "0.03 rad/s: warming up over 6 s, and a random walk", {"gyro"}, {"time"}},
      {"accelerometer_misalignment", "0.02 rad", {"accelerometer"}, {"always", "acceleration"}},
      {"vibration_rectification",
       "1e-3 s^2/m times the square of the acceleration of each axis",
       {"accelerometer"},
       {"amplitude", "acceleration"}},
      {"mocap_tilt", "0.01 rad about a level axis", {"mocap"}, {"always", "place", "heading"}},
      {"marker_offset", "2 mm", {"mocap"}, {"rate"}},
      {"mocap_delay", "5 ms more than declared", {"mocap"}, {"velocity", "rate"}},
      {"outside_gear_eccentricity",
       "gear ratio 4 % up and down once in 60 deg of stroke",
       {"force_z", "current"},
       {"stroke"}},
      {"outside_commutator_ripple",
       "torque constant 8 % up and down twice a turn of the rotor",
       {"current", "force_x"},
       {"stroke", "always"}},
      {"outside_spar_bending",
       "leading edge bends up by 0.5 deg under half the weight",
       {"force_z", "force_y"},
       {"amplitude", "always"}},
      {"outside_leg_flexure",
       "0.4 g of the torso on a flexure of 20 Hz below it",
       {"torque_x", "torque_y"},
       {"acceleration", "rate"}},
      {"outside_downwash_on_body",
       "wings' wash presses on the torso: 3 % of the weight, less when it is blown away",
       {"force_z", "force_x"},
       {"amplitude", "velocity"}},
      {"outside_shared_supply",
       "1.5 ohm in the wire that both motors share",
       {"force_z", "torque_x", "current"},
       {"difference", "amplitude"}},
      {"outside_hinge_stiction",
       "6e-5 N m of dry friction in the rotation hinges",
       {"force_z", "force_x"},
       {"always", "amplitude"}},
      {"outside_spring_creep", "rest angle of both springs creeps by 2 deg over 15 s", {"torque_y"}, {"time"}},
      {"outside_imu_mount",
       "IMU on foam: 120 Hz with a damping of 0.2; its compliance grows with the magnitude",
       {"gyro", "accelerometer"},
       {"always", "acceleration"}},
      {"outside_gyro_g_sensitivity", "1e-3 rad/s per m/s^2", {"gyro"}, {"acceleration", "amplitude"}},
      {"outside_driver_jitter", "updates late by up to 0.4 ms, at random", {"force_z", "current"}, {"always"}},
  };
  return table;
}

Magnitudes::Magnitudes(const std::vector<std::pair<std::string, double>>& effects) {
  const std::vector<FamilyEffect>& table = effect_table();
  std::vector<std::string> names;
  for (const FamilyEffect& effect : table) names.push_back(effect.id);
  std::vector<bool> given(table.size());
  for (const auto& [id, magnitude] : effects) {
    std::size_t i = 0;
    while (i < table.size() && table[i].id != id) ++i;
    if (i == table.size())
      throw io::InputError("effect " + id + ": family C has no such effect" + io::did_you_mean(id, names));
    if (given[i]) throw io::InputError("effect " + id + ": given twice");
    if (!(magnitude >= 0 && magnitude <= 4))
      throw io::InputError("effect " + id + ": magnitude " + io::shortest_digits(magnitude) +
                           " is out of range; accepted: a number from 0 to 4");
    given[i] = true;
    magnitudes_[i] = magnitude;
  }
}

}  // namespace flappy::blind::c
