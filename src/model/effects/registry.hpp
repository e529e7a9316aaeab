// All effects beyond the base model. A new effect is added here, and nowhere else.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "model/effects/accelerometer_misalignment.hpp"
#include "model/effects/actuator_loss.hpp"
#include "model/effects/added_mass.hpp"
#include "model/effects/battery_sag.hpp"
#include "model/effects/battery_thrust.hpp"
#include "model/effects/beat_averaged_effect.hpp"
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
#include "model/effects/mocap_delay.hpp"
#include "model/effects/mocap_tilt.hpp"
#include "model/effects/payload.hpp"
#include "model/effects/rotational_lift.hpp"
#include "model/effects/slung_load.hpp"
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

/// Order within a stage: changes of the vehicle; the voltage from the command to the motor; stroke and stops; the air,
/// first what causes the wing's force, then what scales it; loads on the body; sensors.
using Effects = std::tuple<ComOffset, InertiaProducts, WingInertiaShape, WingDamage, CommandDelay, DriverDeadZone,
                           DriverBandwidth, WindingHeating, BatterySag, CoulombFriction, SpringHardening,
                           StopCompliance, GearBacklash, Wind, WingFlexibility, RotationalLift, WakeCapture,
                           ClapAndFling, GroundEffect, CeilingEffect, AddedMass, WallEffect, BodyDrag, Tether, GyroBias,
                           AccelerometerMisalignment, VibrationRectification, MocapTilt, MarkerOffset, MocapDelay>;

using BeatAveragedEffects =
    std::tuple<ComOffset, InertiaProducts, Payload, ActuatorLoss, CommandDelay, DriverBandwidth, BatteryThrust, Wind,
               GroundEffect, BodyDrag, Tether, SlungLoad, FlappingCounterForce, TranslationalLift, StrokePlaneActuation,
               ThrustAxisTilt, MocapTilt, MarkerOffset>;

inline constexpr int kEffects = std::tuple_size_v<Effects>;
static_assert(kEffects <= 64, "a set of effects is a word");

template <int I>
using EffectAt = std::tuple_element_t<I, Effects>;

template <class Effect>
constexpr int states_of() {
  if constexpr (requires { Effect::kStates; }) return Effect::kStates;
  else return 0;
}

template <int I>
constexpr int effect_rows_before() {
  if constexpr (I == 0) return 0;
  else return effect_rows_before<I - 1>() + static_cast<int>(EffectAt<I - 1>::kParameters.size());
}
inline constexpr int kEffectParameterRows = effect_rows_before<kEffects>();
/// Number of rows that effects read: their parameters, then the SideConstants of the left and of the right side.
inline constexpr int kEffectRows = kEffectParameterRows + 2 * kRows<SideConstants>;

template <int I = 0>
constexpr int state_rows(std::uint64_t set) {
  if constexpr (I == kEffects) return 0;
  else return (set >> I & 1 ? states_of<EffectAt<I>>() : 0) + state_rows<I + 1>(set);
}

}  // namespace FLAPPY_ISA

/// Description of an effect for the rest of the project, within the beat or as a mean over beats.
struct CatalogueEffect {
  EffectInfo info;
  std::vector<EffectParameter> parameters;
  int first_row;                                       ///< first row of its parameters among a block's effect rows
  int states;                                          ///< rows of memory
  void (*change)(const double* parameters, Vehicle&);  ///< its stage `vehicle`, or null
  BeatAveragedStages averaged;                         ///< for beat-averaged robots

  /// Values of all parameters: those in `given`, and typical values for the others.
  std::vector<double> values(const std::map<std::string, double>& given) const;
  /// Values of all parameters in a vehicle; the magnitudes are 0 if the vehicle does not have the effect.
  std::vector<double> values_of(const Vehicle& vehicle) const;
  bool acts(const std::vector<double>& values) const;
};

/// The effects within the beat. The index of an effect is also its bit in a block's set.
const std::vector<CatalogueEffect>& effects();
/// Effects that a vehicle may have: effects(); if beat-averaged, those with such a stage; if jointed, those of sensors.
const std::vector<CatalogueEffect>& catalogue_of(const Vehicle& vehicle);
/// Null if the vehicle's catalogue does not have the effect.
const CatalogueEffect* find_effect(const Vehicle& vehicle, const std::string& id);
std::uint64_t sensor_effects();
/// Index of `id` in effects(), or -1.
int effect_index(const char* id);
/// The entry of effects() with this id, which has to exist.
const CatalogueEffect& effect_within_beat(const std::string& id);
bool is_effect(const std::string& id);
/// Of an effect of any catalogue, which has to exist.
Stage stage_of(const std::string& id);
/// The group of an effect (EffectInfo::group), or its own id if it has no group.
std::string group_of(const std::string& id);
std::vector<std::string> whole_group(const std::vector<CatalogueEffect>& catalogue, const std::string& id);

}  // namespace flappy::model
