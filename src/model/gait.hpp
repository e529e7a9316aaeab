// A driven angle: a Fourier series in the phase of the beat, modulated by inputs, with its rate and acceleration.
//
// Phase. The clock t counts beats, t' = f. Timing d > 0 makes the first half of a beat faster, d < 0 the second:
//   p = t + d (1 - cos 2 pi t)/(2 pi)     p' = f (1 + d sin 2 pi t) + d' (1 - cos 2 pi t)/(2 pi)
//   p'' = f' (1 + d sin 2 pi t) + 2 pi f^2 d cos 2 pi t + 2 f d' sin 2 pi t + d'' (1 - cos 2 pi t)/(2 pi)
// Angle. With O = 2 pi p', the harmonics g(p) = sum a_k cos(2 pi k p) + b_k sin(2 pi k p), factor s and offset o:
//   g' = O dg    g'' = O^2 ddg + O' dg    q = o + s g    q' = o' + s' g + s g'    q'' = o'' + s'' g + 2 s' g' + s g''
//   dg = sum k (b_k cos - a_k sin)        ddg = -sum k^2 (a_k cos + b_k sin)
// so f, d, s and o need two derivatives. They are linear in the inputs u, which follow the commanded U by a critically
// damped second-order filter with the time constant T, u'' = (U - u)/T^2 - 2 u'/T. With e = u - U and E = exp(-h/T),
// exact while U is constant:
//   e(h) = ((1 + h/T) e + h u') E         u'(h) = ((1 - h/T) u' - h/T^2 e) E
#pragma once

#include <numbers>

#include "model/math.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

template <class T>
struct Moving {
  T value, rate, acceleration;

  friend FLAPPY_INLINE Moving operator+(const Moving& a, const Moving& b) {
    return {a.value + b.value, a.rate + b.rate, a.acceleration + b.acceleration};
  }
};

template <class T>
FLAPPY_INLINE Moving<T> add_scaled(const Moving<T>& a, const T& s, const Moving<T>& b) {
  return {a.value + s * b.value, a.rate + s * b.rate, a.acceleration + s * b.acceleration};
}

/// A second-order filter over a fixed time: the coefficients that advance e and u', and 1/T^2, 2/T.
template <class T>
struct InputFilter {
  T e_of_e, e_of_rate, rate_of_e, rate_of_rate, stiffness_1_s2, damping_1_s;
};

inline InputFilter<double> input_filter(double lag_s, double time_s) {
  const double x = time_s / lag_s, left = exp(-x);
  return {(1 + x) * left, time_s * left, -x / lag_s * left, (1 - x) * left, 1 / (lag_s * lag_s), 2 / lag_s};
}

template <class T>
FLAPPY_INLINE void follow(const InputFilter<T>& f, const T& wanted, T& u, T& rate) {
  const T e = u - wanted;
  u = wanted + T(f.e_of_e * e + f.e_of_rate * rate);
  rate = f.rate_of_e * e + f.rate_of_rate * rate;
}

template <class T>
FLAPPY_INLINE Moving<T> moving(const InputFilter<T>& f, const T& wanted, const T& u, const T& rate) {
  return {u, rate, f.stiffness_1_s2 * T(wanted - u) - f.damping_1_s * rate};
}

/// Phase of the beat on one side: sine and cosine of 2 pi p, and 2 pi p', 2 pi p''.
template <class T>
struct BeatPhase {
  SinCos<T> turn;
  T rate_rad_s, acceleration_rad_s2;
};

template <class T>
FLAPPY_INLINE SinCos<T> turn_of(const T& x) {
  const T near = x - nearest(x);
  return sin_cos_pi(T(near + near));
}

/// Phase without timing. `clock_turn`: sine and cosine of 2 pi t. `frequency`: f and derivatives, the second unused.
template <class T>
FLAPPY_INLINE BeatPhase<T> untimed_phase(const SinCos<T>& clock_turn, const Moving<T>& frequency) {
  const T full(2 * std::numbers::pi);
  return {clock_turn, full * frequency.value, full * frequency.rate};
}

/// Phase with timing d. `clock`: t, beats.
template <class T>
FLAPPY_INLINE BeatPhase<T> timed_phase(const T& clock, const SinCos<T>& clock_turn, const Moving<T>& frequency,
                                       const Moving<T>& timing) {
  const T full(2 * std::numbers::pi);
  const T &f = frequency.value, &s = clock_turn.sin, &c = clock_turn.cos, &d = timing.value;
  const T bulge = T(1 / (2 * std::numbers::pi)) * T(T(1) - c), faster = T(1) + d * s;
  const T rate = f * faster + timing.rate * bulge;
  const T acceleration = T(frequency.rate * faster + T(T(full * f) * f) * T(d * c)) +
                         T(T(T(2) * f) * T(timing.rate * s) + timing.acceleration * bulge);
  return {turn_of(T(clock + d * bulge)), full * rate, full * acceleration};
}

/// The harmonics g with their derivatives by time. `cosine(k)`, `sine(k)`: a and b of harmonic k + 1.
template <class T>
FLAPPY_INLINE Moving<T> harmonics(const BeatPhase<T>& phase, std::size_t count, const auto& cosine, const auto& sine) {
  SinCos<T> at = phase.turn;
  T g(0), dg(0), ddg(0);
  for (std::size_t k = 0; k < count; ++k) {
    const T a = cosine(k), b = sine(k), order(static_cast<double>(k + 1));
    const T in_phase = a * at.cos + b * at.sin, across = order * T(b * at.cos - a * at.sin);
    g += in_phase;
    dg += across;
    ddg -= T(order * order) * in_phase;
    at = {at.sin * phase.turn.cos + at.cos * phase.turn.sin, at.cos * phase.turn.cos - at.sin * phase.turn.sin};
  }
  const T& w = phase.rate_rad_s;
  return {g, w * dg, T(w * w) * ddg + phase.acceleration_rad_s2 * dg};
}

template <class T>
FLAPPY_INLINE Moving<T> modulated(const Moving<T>& g, const Moving<T>& scale, const Moving<T>& offset) {
  return {offset.value + scale.value * g.value, offset.rate + T(scale.rate * g.value + scale.value * g.rate),
          T(offset.acceleration + scale.acceleration * g.value) +
              T(T(T(2) * scale.rate) * g.rate + scale.value * g.acceleration)};
}

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
