// Our own elementary functions: libm's change with the processor, these give the same bits everywhere.
// Minimax polynomials; the stated errors are those of the polynomial, before rounding.
#pragma once

#include <bit>
#include <cstdint>
#include <numbers>

#include "model/scalar.hpp"

namespace flappy::model {
inline namespace FLAPPY_ISA {

/// Horner's scheme, lowest coefficient first.
template <class T, class... C>
FLAPPY_INLINE T polynomial(T x, double c0, C... higher) {
  if constexpr (sizeof...(C) == 0) return T(c0);
  else return polynomial(x, higher...) * x + T(c0);
}

/// Angles that sin_cos accepts: every joint of a vehicle stays within.
inline constexpr double kLargestAngle_rad = 1.75;

template <class T>
struct SinCos {
  T sin, cos;
};

/// Sine and cosine for |x| <= kLargestAngle_rad, without range reduction. Absolute error of the polynomials:
/// 1.4e-8 and 9e-10 in float, 1.5e-18 and 8e-18 in double.
template <class T>
FLAPPY_INLINE SinCos<T> sin_cos(T x) {
  const T u = x * x;
  if constexpr (sizeof(Element<T>) == 4) {
    const T s =
        polynomial(u, -0.16666652095508948, 0.0083328690443799029, -0.00019795201602044300, 2.5746579492065598e-6);
    const T c = polynomial(u, -0.49999998687300314, 0.041666605729632825, -0.00138879694924598958,
                           0.000024740930771132188, -2.5731345378016664e-7);
    return {T(x * u) * s + x, u * c + T(1)};
  } else {
    const T s =
        polynomial(u, -0.16666666666666661505, 0.0083333333333327866, -0.00019841269841071899, 2.7557319189320432e-6,
                   -2.5052105025782109e-8, 1.6058853984410592e-10, -7.6409328793503318e-13, 2.7011679140136345e-15);
    const T c = polynomial(u, -0.49999999999999999758, 0.041666666666666634911, -0.001388888888888745557,
                           0.000024801587301270106, -2.7557319184272169e-7, 2.0876753984134242e-9,
                           -1.1470605572589490e-11, 4.7755398110766260e-14, -1.5005533557104328e-16);
    return {T(x * u) * s + x, u * c + T(1)};
  }
}

/// exp(-x) for x >= 0; 0 where it would be subnormal. Relative error of the polynomials: 4e-9 in float, 4e-18
/// in double.
template <class T>
FLAPPY_INLINE T exp_negative(T x) {
  constexpr bool kSingle = sizeof(Element<T>) == 4;
  constexpr double kLargest = kSingle ? 87 : 708;
  constexpr double kRound = kSingle ? 0x1.8p23 : 0x1.8p52;                        // adding it rounds to whole
  constexpr double kLn2High = kSingle ? 0.693115234375 : 0.69314718036912381649;  // exact times any exponent
  constexpr double kLn2Low = kSingle ? 3.1946184945309417e-5 : 1.9082149292705878e-10;
  const T y = min(x, T(kLargest));
  const T k = T(y * T(std::numbers::log2e) + T(kRound)) - T(kRound);
  const T r = (y - k * T(kLn2High)) - k * T(kLn2Low);
  T e;
  if constexpr (kSingle)
    e = polynomial(r, 0.50000000951192014, -0.16666518843506661, 0.041666206047268758, -0.0083688890749988058,
                   0.0013950475325785419);
  else
    e = polynomial(r, 0.50000000000000127, -0.16666666666666699, 0.041666666666515453, -0.0083333333333071757,
                   0.0013888888947006546, -0.00019841269917470975, 0.000024801489952148856, -2.7557216203949453e-6,
                   2.7631276775699542e-7, -2.5117896702802308e-8);
  return where(x > T(kLargest), T(0), T(T(T(r * r) * e + (T(1) - r)) * half_to(k)));
}

/// Natural logarithm of a positive normal number, on the host only. Error below 4.5e-16 max(1, |log x|).
inline double log(double x) {
  const std::uint64_t bits = std::bit_cast<std::uint64_t>(x);
  int exponent = static_cast<int>(bits >> 52) - 1023;
  double m = std::bit_cast<double>((bits & 0x000fffffffffffffULL) | 0x3ff0000000000000ULL);
  if (m > std::numbers::sqrt2) m *= 0.5, ++exponent;
  const double s = (m - 1) / (m + 1), u = s * s;  // log m = 2 atanh s, |s| < 0.172
  const double series =
      polynomial(u, 1.0 / 3, 1.0 / 5, 1.0 / 7, 1.0 / 9, 1.0 / 11, 1.0 / 13, 1.0 / 15, 1.0 / 17, 1.0 / 19);
  return exponent * std::numbers::ln2 + 2 * (s + s * u * series);
}

/// cos(pi x) for |x| <= 1.
template <class T>
FLAPPY_INLINE T cos_pi(T x) {
  return sin_cos(T((T(0.5) - abs(x)) * T(std::numbers::pi))).sin;
}

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
