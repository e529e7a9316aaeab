// Wind, constant and gusting, uniform over the whole vehicle, in W; it acts on the wings and on the drag of the body:
//   (x, y, z) + sqrt(2/3) gust sum_k sin(w_k t + k j 2 pi / 3)     k = 0, 1, 2; j = 0, 1, 2 for x, y, z
//   w_k = 0.618, 1, 1.732 / gust_time: no two in a ratio of whole numbers, so that gusts never repeat
// Each axis has the given rms; the axes are uncorrelated. A flight is the same every time: phases are 0 at its start.
// Assumes gusts that are long against the vehicle; neglects shear and the drift of the wake.
// [1] Shinozuka, Jan, Digital simulation of random processes and its applications, J. Sound Vib. 25(1), 1972: sums of
// sines.
#pragma once

#include "model/effects/beat_averaged_effect.hpp"
#include "model/math.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct Wind {
  static constexpr EffectInfo kInfo{"wind", Stage::air, 4, "world_force", "Shinozuka, Jan 1972"};
  static constexpr std::array<EffectParameter, 5> kParameters{{{"x_m_s", -5, 5, 0.3, -0.9, 0.9},
                                                               {"y_m_s", -5, 5, 0.3, -0.9, 0.9},
                                                               {"z_m_s", -5, 5, 0.1, -0.3, 0.3},
                                                               {"gust_m_s", 0, 3, 0.15, 0, 0.45},
                                                               {"gust_time_s", 0.01, 100, 0.5, 0.2, 0.8}}};
  static constexpr int kStates = 3;  // phases, in half turns
  static constexpr double kPhaseRates[3] = {0.618034 * 0.31830989, 0.31830989,
                                            1.7320508 * 0.31830989};  // w_k gust_time / pi

  template <class T>
  static FLAPPY_INLINE void wind(const T (&q)[5], const Surroundings<T>& s, const StateRows<T>& state,
                                 Vec3<T>& wind_B) {
    const auto wrapped = [](const T& half_turns) {
      return where(half_turns >= T(1), T(half_turns - T(2)), half_turns);
    };
    T gust[3] = {T(0), T(0), T(0)};
    for (int k = 0; k < 3; ++k) {
      const T phase = state.get(k);
      for (int axis = 0; axis < 3; ++axis)
        gust[axis] += sin_cos_pi(wrapped(T(phase + T(k * axis % 3 * (2.0 / 3))))).sin;
      state.set(k, wrapped(T(phase + T(kPhaseRates[k]) * T(s.step_s / q[4]))));
    }
    const T size = T(0.81649658092772603) * q[3];  // sqrt(2/3)
    wind_B = transpose_times(s.attitude, Vec3<T>{q[0] + size * gust[0], q[1] + size * gust[1], q[2] + size * gust[2]});
  }

  static constexpr int kBeatAveragedMagnitudes = 3;
  static constexpr std::array<EffectParameter, 3> kBeatAveragedParameters{
      {{"x_m_s", -5, 5, 0.3, -0.9, 0.9}, {"y_m_s", -5, 5, 0.3, -0.9, 0.9}, {"z_m_s", -5, 5, 0.1, -0.3, 0.3}}};
  template <class T>
  static FLAPPY_INLINE void beat_averaged_wind(const T (&q)[3], const BeatAveragedState<T>& s, Vec3<T>& wind_B) {
    wind_B = wind_B + transpose_times(s.attitude, Vec3<T>{q[0], q[1], q[2]});
  }
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
