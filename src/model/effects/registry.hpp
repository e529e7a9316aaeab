// Every effect beyond the base model. A new one is added here, and nowhere else.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "model/effects/accelerometer_misalignment.hpp"
#include "model/effects/added_mass.hpp"
#include "model/effects/battery_sag.hpp"
#include "model/effects/battery_thrust.hpp"
#include "model/effects/body_drag.hpp"
#include "model/effects/ceiling_effect.hpp"
#include "model/effects/clap_and_fling.hpp"
#include "model/effects/com_offset.hpp"
#include "model/effects/command_delay.hpp"
#include "model/effects/coulomb_friction.hpp"
#include "model/effects/driver_bandwidth.hpp"
#include "model/effects/driver_dead_zone.hpp"
#include "model/effects/flapping_counter_force.hpp"
#include "model/effects/gear_backlash.hpp"
#include "model/effects/ground_effect.hpp"
#include "model/effects/gyro_bias.hpp"
#include "model/effects/inertia_products.hpp"
#include "model/effects/marker_offset.hpp"
#include "model/effects/mean_effect.hpp"
#include "model/effects/mocap_delay.hpp"
#include "model/effects/mocap_tilt.hpp"
#include "model/effects/rotational_lift.hpp"
#include "model/effects/spring_hardening.hpp"
#include "model/effects/stop_compliance.hpp"
#include "model/effects/stroke_plane_actuation.hpp"
#include "model/effects/tether.hpp"
#include "model/effects/thrust_axis_tilt.hpp"
#include "model/effects/translational_lift.hpp"
#include "model/effects/vibration_rectification.hpp"
#include "model/effects/wake_capture.hpp"
#include "model/effects/wall_effect.hpp"
#include "model/effects/wind.hpp"
#include "model/effects/winding_heating.hpp"
#include "model/effects/wing_damage.hpp"
#include "model/effects/wing_flexibility.hpp"
#include "model/effects/wing_inertia.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

/// Within a stage they act in this order: the vehicle; the voltage from the command to the motor; stroke and stops; the air,
/// first what makes the wing's force, then what scales it; loads on the body. Sensors last.
using Effects = std::tuple<ComOffset, InertiaProducts, WingInertiaShape, WingDamage, CommandDelay, DriverDeadZone,
                           DriverBandwidth, WindingHeating, BatterySag, CoulombFriction, SpringHardening,
                           StopCompliance, GearBacklash, Wind, WingFlexibility, RotationalLift, WakeCapture,
                           ClapAndFling, GroundEffect, CeilingEffect, AddedMass, WallEffect, BodyDrag, Tether, GyroBias,
                           AccelerometerMisalignment, VibrationRectification, MocapTilt, MarkerOffset, MocapDelay>;

/// Those that have a stage for the mean of a beat, in the order in which they act.
using MeanEffects = std::tuple<ComOffset, InertiaProducts, CommandDelay, DriverBandwidth, BatteryThrust, Wind,
                               GroundEffect, BodyDrag, Tether, FlappingCounterForce, TranslationalLift,
                               StrokePlaneActuation, ThrustAxisTilt, MocapTilt, MarkerOffset>;

inline constexpr int kEffects = std::tuple_size_v<Effects>;
static_assert(kEffects <= 64, "a set of effects is a word");

template <int I>
using EffectAt = std::tuple_element_t<I, Effects>;

template <class Effect>
constexpr int states_of() {
  if constexpr (requires { Effect::kStates; }) return Effect::kStates;
  else return 0;
}

/// Rows of parameters before those of effect `I`; of all effects for I = kEffects.
template <int I>
constexpr int effect_rows_before() {
  if constexpr (I == 0) return 0;
  else return effect_rows_before<I - 1>() + static_cast<int>(EffectAt<I - 1>::kParameters.size());
}
inline constexpr int kEffectParameterRows = effect_rows_before<kEffects>();
/// Rows that effects read: their parameters, then the figures of the left and of the right side.
inline constexpr int kEffectRows = kEffectParameterRows + 2 * kRows<SideFigures>;

/// Rows of memory of the effects in `set`.
template <int I = 0>
constexpr int state_rows(std::uint64_t set) {
  if constexpr (I == kEffects) return 0;
  else return (set >> I & 1 ? states_of<EffectAt<I>>() : 0) + state_rows<I + 1>(set);
}

}  // namespace FLAPPY_ISA

/// What the rest of the project knows of an effect, within the beat or as a mean over beats.
struct EffectEntry {
  EffectInfo info;
  std::vector<EffectParameter> parameters;
  int first_row;                                       ///< of its parameters in a block's effect rows
  int states;                                          ///< rows of memory
  void (*change)(const double* parameters, Vehicle&);  ///< its stage `vehicle`, or null
  MeanStages mean;                                     ///< of a robot that is known by the beat

  /// Its parameters: those given, typical ones for the others.
  std::vector<double> values(const std::map<std::string, double>& given) const;
  /// Those of a vehicle; its sizes are 0 where the vehicle has no such effect.
  std::vector<double> values_of(const Vehicle& vehicle) const;
  /// Whether it does anything with these parameters.
  bool acts(const std::vector<double>& values) const;
};

/// Those that act within the beat, by index, which is also the bit of an effect in a block's set.
const std::vector<EffectEntry>& effects();
/// Those that a vehicle may have: the former, or, of one that is known by the beat, those with a stage for its mean.
const std::vector<EffectEntry>& catalogue_of(const Vehicle& vehicle);
/// Null where the vehicle's catalogue has no such entry.
const EffectEntry* find_effect(const Vehicle& vehicle, const std::string& id);
/// Bits of those that act on sensors alone.
std::uint64_t sensor_effects();
/// Index of `id`, or -1.
int effect_index(const char* id);
/// Whether any kind of vehicle has such an entry.
bool is_effect(const std::string& id);
/// What an effect is grouped with (EffectInfo::group): its group's name, or its own where it has none.
std::string group_of(const std::string& id);
/// All entries of an effect's group in a catalogue, in its order.
std::vector<std::string> whole_group(const std::vector<EffectEntry>& catalogue, const std::string& id);

}  // namespace flappy::model
