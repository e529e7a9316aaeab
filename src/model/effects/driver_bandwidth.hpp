// The motor's voltage follows the driver's filters as a first-order lag, from 0 at the start of a flight, lag dV/dt =
// V_driver - V: exact for a voltage constant over a step; V at its end. Not the winding's L/R, which would also lag the
// back-EMF.
// [1] Franklin, Powell, Workman, Digital Control of Dynamic Systems, 3rd ed., ch. 4.
#pragma once

#include "model/effects/beat_averaged_effect.hpp"
#include "model/math.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct DriverBandwidth {
  static constexpr EffectInfo kInfo{"driver_bandwidth", Stage::drive, 1, "drive_lag",
                                    "Franklin, Powell, Workman, ch. 4"};
  static constexpr std::array<EffectParameter, 1> kParameters{{{"lag_s", 0, 0.02, 0.001, 0, 0.003}}};
  static constexpr int kStates = 2;  // voltages, left and right

  template <class T>
  static FLAPPY_INLINE void hinges(const T (&q)[1], const Surroundings<T>& s, const StateRows<T>& state,
                                   Sides<Hinges<T>>& h) {
    const T kept = exp_negative(T(s.step_s / q[0]));
    const auto follow = [&](int row, Hinges<T>& side) {
      const T fresh = side.voltage_V;
      side.voltage_V = fresh + kept * T(state.get(row) - fresh);
      state.set(row, side.voltage_V);
    };
    follow(0, h.left);
    follow(1, h.right);
  }

  static constexpr std::array<EffectParameter, 1> kBeatAveragedParameters{{{"lag_s", 0, 1, 0.05, 0, 0.15}}};
  template <class T>
  static FLAPPY_INLINE void beat_averaged_drive(const T (&q)[1], BeatAveragedDrive<T>& drive) {
    drive.lag_s += q[0];
  }
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
