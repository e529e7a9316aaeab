// Wing-beat signal with split cycle (Doman, Oppenheimer, Sigthorsson 2010; here as Fei et al. 2019). Within a beat of
// fraction t in [0, 1):
//   V = A cos(pi t / s) + V_0              for t < s
//   V = A cos(pi (t - 1) / (1 - s)) + V_0  for t >= s
//   left:  A = V_amp + V_d, s = 0.5 - d_sigma      right: A = V_amp - V_d, s = 0.5 + d_sigma
#pragma once

#include "model/flapper.hpp"
#include "model/math.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

template <class T>
struct WingBeat {
  T amplitude_V, difference_V, bias_V, split_cycle;
};

/// Fraction of the beat in [-1/2, 1/2) from a phase counter, which is 2^32 times the fraction.
template <class T>
FLAPPY_INLINE T beat_fraction(std::uint32_t phase) {
  return static_cast<T>(static_cast<std::int32_t>(phase)) * static_cast<T>(0x1p-32);
}

/// Voltage of one motor. `fraction`: of the beat, in [-1/2, 1/2), -x stands for 1 - x. The inputs are already clipped.
template <int side, class T>
FLAPPY_INLINE T wing_beat_voltage(const WingBeat<T>& u, const T& fraction, const T& limit_V) {
  const T s = T(0.5) - T(T(side) * u.split_cycle);
  const T t = where(fraction < T(0), T(fraction + T(1)), fraction);
  const T x = where(t < s, T(t / s), T((t - T(1)) / (T(1) - s)));
  const T amplitude = u.amplitude_V + T(side) * u.difference_V;
  return clamp(T(amplitude * cos_pi(x) + u.bias_V), T(-limit_V), limit_V);
}

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
