// Effects on a robot that is known by the beat (model/beat_averaged.hpp). Beside its stages within the beat (effect.hpp), or instead of them,
// an effect has one or more for the mean over beats:
//   mean_drive(parameters, MeanDrive&)          how actuators follow their inputs
//   mean_wind(parameters, state, Vec3&)         velocity of the air, in B
//   mean_load(parameters, state, MeanLoads&)    force and moment besides those of the vehicle's file
//   mean_seen(parameters, state, Vec3&)         specific force as motion capture shows it
// and `vehicle` of effect.hpp. Where its figures are others there, it has kMeanParameters, and kMeanSizes of them are sizes.
#pragma once

#include "model/effects/effect.hpp"
#include "model/math.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

/// What changes between inputs and wings.
template <class T>
struct MeanDrive {
  T delay_s{0}, lag_s{0};
  T battery_gain{0};  ///< flapping actuators are times 1 + gain (battery / nominal - 1)
};

/// What a robot does at an instant, averaged over beats.
template <class T>
struct MeanState {
  Matrix3<T> attitude;     ///< R_WB
  Vec3<T> position_m;      ///< of the torso's origin, in W
  Vec3<T> velocity_B_m_s;  ///< of it
  Vec3<T> rate_rad_s, turning_rad_s2;
  Vec3<T> com_m;
  T mass_kg, gravity_m_s2, air_density_kg_m3, ground_z_m;
  T beat_share;                      ///< mean of the flapping actuators over the nominal frequency
  T stroke_plane, stroke_plane_1_s;  ///< sum of the actuators that tilt it, and its rate
  Vec3<T> wind_B_m_s;                ///< known from mean_load() on, as the next
  T thrust_N;                        ///< of the vehicle's file, along z of B
};

/// Force and moment about the centre of mass, in B.
template <class T>
struct MeanLoads {
  Vec3<T> force_N, moment_Nm;
  FLAPPY_INLINE void add(const Vec3<T>& force, const Vec3<T>& from_com_m) {
    force_N = force_N + force;
    moment_Nm = moment_Nm + cross(from_com_m, force);
  }
};

}  // namespace FLAPPY_ISA

/// An effect's parameters as a mean over beats: its own, where a robot of another size or kind needs others.
template <class Effect>
constexpr const auto& mean_parameters() {
  if constexpr (requires { Effect::kMeanParameters; }) return Effect::kMeanParameters;
  else return Effect::kParameters;
}

/// An effect's stages with its parameters; null where it has none.
struct MeanStages {
  void (*drive)(const double*, MeanDrive<double>&) = nullptr;
  void (*wind)(const double*, const MeanState<double>&, Vec3<double>&) = nullptr;
  void (*load)(const double*, const MeanState<double>&, MeanLoads<double>&) = nullptr;
  void (*seen)(const double*, const MeanState<double>&, Vec3<double>&) = nullptr;
};

}  // namespace flappy::model
