// Effects on a beat-averaged robot (model/beat_averaged.hpp): stages for the mean over beats, besides or instead of
// those within the beat (effect.hpp):
//   beat_averaged_drive(parameters, BeatAveragedDrive&)          how actuators follow their inputs
//   beat_averaged_wind(parameters, state, Vec3&)                 velocity of the air, in B
//   beat_averaged_load(parameters, state, BeatAveragedLoads&)    force and moment in addition to those of the file
//   beat_averaged_seen(parameters, state, Vec3&)                 specific force as motion capture shows it
//   beat_averaged_hang(parameters, state, Hanging&)              where a weight on a line hangs at rest
//   beat_averaged_swing(parameters, state, step_s, Hanging&)     how it swings in a step
// and `vehicle` of effect.hpp. If these stages need other parameters, the effect has kBeatAveragedParameters, of which
// the first kBeatAveragedMagnitudes are magnitudes.
#pragma once

#include "model/effects/effect.hpp"
#include "model/math.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

template <class T>
struct BeatAveragedDrive {
  T delay_s{0}, lag_s{0};
  T battery_gain{0};  ///< flapping actuators are multiplied by 1 + gain (battery / nominal - 1)
};

/// A weight on a line: its horizontal place and velocity in W, and the line's tension over its mass.
template <class T>
struct Hanging {
  T x_m, y_m, velocity_x_m_s, velocity_y_m_s, tension_m_s2;
};

template <class T>
struct BeatAveragedState {
  Matrix3<T> attitude;     ///< R_WB
  Vec3<T> position_m;      ///< torso origin, in W
  Vec3<T> velocity_B_m_s;  ///< velocity of the torso origin, in B
  Vec3<T> rate_rad_s, turning_rad_s2;
  Vec3<T> com_m;
  T mass_kg, gravity_m_s2, air_density_kg_m3, ground_z_m;
  T beat_share;                      ///< mean of the flapping actuators over the nominal frequency
  T stroke_plane, stroke_plane_1_s;  ///< sum of the actuators that tilt the stroke plane, and its rate
  Vec3<T> wind_B_m_s;                ///< known from beat_averaged_load() on, like thrust_N
  T thrust_N;                        ///< force of the vehicle's expressions along z of B
  Hanging<T> weight;                 ///< known from beat_averaged_load() on
  /// Specific force of the torso origin, in B, all loads included; known in beat_averaged_swing(), where mass_kg is
  /// infinite if the robot flies as recorded, whatever pulls at it.
  Vec3<T> force_m_s2;
};

/// Force and moment about the centre of mass, in B.
template <class T>
struct BeatAveragedLoads {
  Vec3<T> force_N, moment_Nm;
  FLAPPY_INLINE void add(const Vec3<T>& force, const Vec3<T>& from_com_m) {
    force_N = force_N + force;
    moment_Nm = moment_Nm + cross(from_com_m, force);
  }
};

}  // namespace FLAPPY_ISA

/// Parameters of an effect's beat-averaged stages: kBeatAveragedParameters if it has them, because a larger or
/// different robot needs other ranges, else kParameters.
template <class Effect>
constexpr const auto& beat_averaged_parameters() {
  if constexpr (requires { Effect::kBeatAveragedParameters; }) return Effect::kBeatAveragedParameters;
  else return Effect::kParameters;
}

/// Beat-averaged stages of an effect; null where it has no such stage.
struct BeatAveragedStages {
  void (*drive)(const double*, BeatAveragedDrive<double>&) = nullptr;
  void (*wind)(const double*, const BeatAveragedState<double>&, Vec3<double>&) = nullptr;
  void (*load)(const double*, const BeatAveragedState<double>&, BeatAveragedLoads<double>&) = nullptr;
  void (*seen)(const double*, const BeatAveragedState<double>&, Vec3<double>&) = nullptr;
  void (*hang)(const double*, const BeatAveragedState<double>&, Hanging<double>&) = nullptr;
  void (*swing)(const double*, const BeatAveragedState<double>&, const double&, Hanging<double>&) = nullptr;
};

}  // namespace flappy::model
