// The voltage arrives late: V(t - delay), interpolated linearly between steps; 0 before the start of a flight. Valid up
// to kSlots - 2 steps, 25 ms at 1e-4 s; the delay is rounded to 1/1024 of a step.
// [1] Franklin, Powell, Workman, Digital Control of Dynamic Systems, 3rd ed., ch. 4: transport delay.
#pragma once

#include "model/effects/beat_averaged_effect.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct CommandDelay {
  static constexpr EffectInfo kInfo{"command_delay", Stage::drive, 1, "drive_lag", "Franklin, Powell, Workman, ch. 4"};
  static constexpr std::array<EffectParameter, 1> kParameters{{{"delay_s", 0, 0.02, 0.009, 0, 0.02}}};
  static constexpr int kSlots = 256,
                       kStates = 2 * kSlots + 1;  // the last kSlots voltages, left and right; slot of the newest

  template <class T>
  static FLAPPY_INLINE void hinges(const T (&q)[1], const Surroundings<T>& s, const StateRows<T>& state,
                                   Sides<Hinges<T>>& h) {
    using E = Element<T>;
    const T late = clamp(T(nearest(T(T(q[0] * s.per_step) * T(1024))) * T(1.0 / 1024)), T(0), T(kSlots - 2));
    for (int i = 0; i < static_cast<int>(sizeof(T) / sizeof(E)); ++i) {
      if (!state.on.raw[i]) continue;
      const auto at = [&](int row) -> E& { return state.rows[row * state.stride + i]; };
      const int now = (static_cast<int>(at(2 * kSlots)) + 1) % kSlots;
      at(2 * kSlots) = static_cast<E>(now);
      at(2 * now) = h.left.voltage_V.raw[i];
      at(2 * now + 1) = h.right.voltage_V.raw[i];
      const int whole = static_cast<int>(late.raw[i]);
      const E part = late.raw[i] - static_cast<E>(whole);
      const int newer = 2 * ((now + kSlots - whole) % kSlots), older = 2 * ((now + kSlots - whole - 1) % kSlots);
      h.left.voltage_V.raw[i] = (1 - part) * at(newer) + part * at(older);
      h.right.voltage_V.raw[i] = (1 - part) * at(newer + 1) + part * at(older + 1);
    }
  }

  static constexpr std::array<EffectParameter, 1> kBeatAveragedParameters{{{"delay_s", 0, 0.5, 0.03, 0, 0.1}}};
  template <class T>
  static FLAPPY_INLINE void beat_averaged_drive(const T (&q)[1], BeatAveragedDrive<T>& drive) {
    drive.delay_s += q[0];
  }
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
