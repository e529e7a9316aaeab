#include "blind/effects.hpp"

#include <algorithm>

#include "io/files.hpp"

namespace flappy::blind {

const std::array<std::string, kEffects>& effect_names() {
  static const std::array<std::string, kEffects> kNames = {"ground_effect",
                                                           "ceiling_effect",
                                                           "wall_effect",
                                                           "body_drag",
                                                           "added_mass",
                                                           "rotational_lift",
                                                           "wake_capture",
                                                           "clap_and_fling",
                                                           "wing_flexibility",
                                                           "wing_damage",
                                                           "wind",
                                                           "spring_hardening",
                                                           "gear_backlash",
                                                           "coulomb_friction",
                                                           "winding_heating",
                                                           "battery_sag",
                                                           "driver_dead_zone",
                                                           "driver_bandwidth",
                                                           "command_delay",
                                                           "stop_compliance",
                                                           "com_offset",
                                                           "inertia_products",
                                                           "wing_inertia",
                                                           "tether",
                                                           "gyro_bias",
                                                           "accelerometer_misalignment",
                                                           "vibration_rectification",
                                                           "mocap_tilt",
                                                           "marker_offset",
                                                           "mocap_delay",
                                                           "outside_magnetic_torque",
                                                           "outside_vortex_shedding",
                                                           "outside_slosh",
                                                           "outside_yaw_thrust_loss",
                                                           "outside_wing_interference",
                                                           "outside_brush_contact",
                                                           "outside_amplitude_hysteresis",
                                                           "outside_vortex_ring",
                                                           "outside_humidity_front",
                                                           "outside_mocap_lens"};
  return kNames;
}

Sizes::Sizes(const std::vector<BlindEffect>& effects) {
  const auto& names = effect_names();
  std::array<bool, kEffects> given{};
  for (const BlindEffect& e : effects) {
    const auto k = static_cast<std::size_t>(std::ranges::find(names, e.id) - names.begin());
    if (k == kEffects)
      throw io::InputError("--effect " + e.id + ": no such effect; accepted: what `flappy-blind-robot effects` lists" +
                           io::did_you_mean(e.id, {names.begin(), names.end()}));
    if (given[k]) throw io::InputError("--effect " + e.id + ": given twice; accepted: each effect once");
    if (!(e.size >= 0 && e.size <= 4))
      throw io::InputError("--effect " + e.id + ": size " + io::shortest_digits(e.size) +
                           " is out of range; accepted: 0 to 4, 1 is typical");
    given[k] = true;
    size_[k] = e.size;
  }
}

}  // namespace flappy::blind
