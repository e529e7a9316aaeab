// A driver with a dead zone: its output is V - dead sgn V outside, 0 within. It resembles a half bridge's dead time and
// voltage drop, whose sign is that of the current, which differs where back-EMF exceeds the voltage.
// [1] Tao, Kokotovic, Adaptive Control of Systems with Actuator and Sensor Nonlinearities, 1996, ch. 2: dead zone.
#pragma once

#include "model/effects/effect.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

struct DriverDeadZone {
  static constexpr EffectInfo kInfo{"driver_dead_zone", Stage::drive, 1, "low_voltage", "Tao, Kokotovic 1996"};
  static constexpr std::array<EffectParameter, 1> kParameters{{{"dead_V", 0, 5, 0.4, 0, 1.2}}};

  template <class T>
  static FLAPPY_INLINE void hinges(const T (&q)[1], const Surroundings<T>&, const StateRows<T>&, Sides<Hinges<T>>& h) {
    h.left.voltage_V -= clamp(h.left.voltage_V, T(-q[0]), q[0]);
    h.right.voltage_V -= clamp(h.right.voltage_V, T(-q[0]), q[0]);
  }
};

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
