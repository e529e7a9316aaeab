// Effects of family A: the catalogue's, by laws of this family's own, and others (outside_*). Each has one parameter,
// its magnitude: 0 switches it off, 1 is typical of a 12 g vehicle.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace flappy::blind {

#define FLAPPY_BLIND_EFFECTS                                                                                           \
  ground_effect, ceiling_effect, wall_effect, body_drag, added_mass, rotational_lift, wake_capture, clap_and_fling,    \
      wing_flexibility, wing_damage, wind, spring_hardening, gear_backlash, coulomb_friction, winding_heating,         \
      battery_sag, driver_dead_zone, driver_bandwidth, command_delay, stop_compliance, com_offset, inertia_products,   \
      wing_inertia, tether, gyro_bias, accelerometer_misalignment, vibration_rectification, mocap_tilt, marker_offset, \
      mocap_delay, outside_magnetic_torque, outside_vortex_shedding, outside_slosh, outside_yaw_thrust_loss,           \
      outside_wing_interference, outside_brush_contact, outside_amplitude_hysteresis, outside_vortex_ring,             \
      outside_humidity_front, outside_mocap_lens
enum class Effect : std::size_t { FLAPPY_BLIND_EFFECTS, count };
inline constexpr std::size_t kBlindEffects = static_cast<std::size_t>(Effect::count);

const std::array<std::string, kBlindEffects>& effect_names();

struct BlindEffect {
  std::string id;
  double magnitude = 1;
};

/// Magnitude of every effect; 0 where the robot does not have it.
class Magnitudes {
 public:
  Magnitudes() = default;
  /// Throws io::InputError for an id unknown or given twice, or a magnitude outside 0 to 4.
  explicit Magnitudes(const std::vector<BlindEffect>& effects);
  double operator[](Effect e) const { return magnitude_[static_cast<std::size_t>(e)]; }
  bool has(Effect e) const { return (*this)[e] > 0; }

 private:
  std::array<double, kBlindEffects> magnitude_{};
};

}  // namespace flappy::blind
