// Thrust gained near the ground, as a factor on the lift of the wings:
//   k = 1 + gain exp(-h / length)      h: height of the stroke plane over the ground, 0 below it
// Finite when standing, unlike 1 / (1 - (R / 4h)^2) (Cheeseman and Bennett 1955), from which it differs by at most 0.4
// % for h > R with gain 0.27, length 0.7 R. The lift is larger for the same power, and so the same drag: the force in
// the plane of the strokes is unchanged. Assumes a level attitude and a flat ground.
// [1] He, Kou, Calaf, Leang, In-ground-effect modeling and nonlinear-disturbance observer for multirotor unmanned
// aerial vehicle control, J. Dyn. Syst. Meas. Control 141(7), 071013, 2019: k = 1 + C_a exp(-C_b h / R), fitted to
// small rotors.
#pragma once

#include "model/effects/beat_averaged_effect.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct GroundEffect {
  static constexpr EffectInfo kInfo{"ground_effect", Stage::air, 1, "thrust_loss", "He et al. 2019"};
  static constexpr std::array<EffectParameter, 2> kParameters{
      {{"gain", 0, 1, 0.15, 0, 0.45}, {"length_m", 0.005, 0.5, 0.06, 0.03, 0.09}}};

  template <int side, class T>
  static FLAPPY_INLINE void air(const T (&q)[2], const Surroundings<T>& s, const StateRows<T>&, WingWrench<T>& air) {
    const T height = max(T(stroke_plane_z(s) - s.ground_z_m), T(0));
    air = with_lift(air, T(T(1) + q[0] * exp_negative(T(height / q[1]))));
  }

  static constexpr std::array<EffectParameter, 2> kBeatAveragedParameters{
      {{"gain", 0, 1, 0.15, 0, 0.45}, {"length_m", 0.005, 2, 0.1, 0.03, 0.3}}};
  template <class T>
  static FLAPPY_INLINE void beat_averaged_load(const T (&q)[2], const BeatAveragedState<T>& s,
                                               BeatAveragedLoads<T>& load) {
    const T height = max(T(s.position_m.z - s.ground_z_m), T(0));
    load.force_N.z += T(q[0] * exp_negative(T(height / q[1]))) * s.thrust_N;
  }
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
