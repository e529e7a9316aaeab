// Elementary functions that give the same bits on every processor, which those of libm do not. Minimax polynomials; the
// stated errors are those of the polynomial, before rounding.
#pragma once

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

/// Largest angle that sin_cos() accepts; every joint of a vehicle stays within it.
inline constexpr double kLargestAngle_rad = 1.75;

template <class T>
struct SinCos {
  T sin, cos;
};

/// Sine and cosine for |x| <= kLargestAngle_rad. Absolute errors: 1.4e-8, 9e-10 in float, 1.5e-18, 8e-18 in double.
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

/// exp(-y) = 2^-k (1 - r + r^2 e) with a whole k and |r| < 0.35. Relative error of the polynomials: 4e-9 in float,
/// 4e-18 in double.
template <class T>
struct ExpParts {
  T k, r, e;
};
template <class T>
inline constexpr double kLargestDecay = sizeof(Element<T>) == 4 ? 87 : 708;

template <class T>
FLAPPY_INLINE ExpParts<T> exp_parts(T y) {
  constexpr bool kSingle = sizeof(Element<T>) == 4;
  constexpr double kLn2High = kSingle ? 0.693115234375 : 0.69314718036912381649;  // exact times any exponent
  constexpr double kLn2Low = kSingle ? 3.1946184945309417e-5 : 1.9082149292705878e-10;
  const T k = T(y * T(std::numbers::log2e) + T(kToWhole<T>)) - T(kToWhole<T>);
  const T r = (y - k * T(kLn2High)) - k * T(kLn2Low);
  if constexpr (kSingle)
    return {k, r,
            polynomial(r, 0.50000000951192014, -0.16666518843506661, 0.041666206047268758, -0.0083688890749988058,
                       0.0013950475325785419)};
  else
    return {k, r,
            polynomial(r, 0.50000000000000127, -0.16666666666666699, 0.041666666666515453, -0.0083333333333071757,
                       0.0013888888947006546, -0.00019841269917470975, 0.000024801489952148856, -2.7557216203949453e-6,
                       2.7631276775699542e-7, -2.5117896702802308e-8)};
}

/// exp(-x) for x >= 0; 0 if the result would be subnormal.
template <class T>
FLAPPY_INLINE T exp_negative(T x) {
  const auto [k, r, e] = exp_parts(min(x, T(kLargestDecay<T>)));
  return where(x > T(kLargestDecay<T>), T(0), T(T(T(r * r) * e + (T(1) - r)) * half_to(k)));
}

/// exp(x); 0 below -87 (double: -708), where it would be subnormal; at most the finite exp(88) (double: exp(709)).
template <class T>
FLAPPY_INLINE T exp(T x) {
  constexpr double kLargest = sizeof(Element<T>) == 4 ? 88 : 709;
  const auto [k, r, e] = exp_parts(min(T(kLargestDecay<T>), max(T(-kLargest), T(-x))));
  return where(x < T(-kLargestDecay<T>), T(0), T(T(T(r * r) * e + (T(1) - r)) * half_to(k)));
}

/// Hyperbolic tangent, from exp(-2 |x|) - 1, which keeps its digits for small x.
template <class T>
FLAPPY_INLINE T tanh(T x) {
  const auto [k, r, e] = exp_parts(min(T(kLargestDecay<T>), T(T(2) * abs(x))));
  const T half = half_to(k);
  const T below_one = half * T(T(r * r) * e - r) + (half - T(1));
  return copysign(T(below_one / (T(2) + below_one)), x);
}

/// Natural logarithm of a positive normal number. Relative error below 2.4e-7 in float, 4.5e-16 in double; relative
/// error of the polynomials 9e-10 and 3e-17.
template <class T>
FLAPPY_INLINE T log(T x) {
  const T whole = mantissa(x), k = exponent(x);
  const auto upper = whole > T(std::numbers::sqrt2);
  const T m = where(upper, T(whole * T(0.5)), whole), n = where(upper, T(k + T(1)), k);
  const T s = (m - T(1)) / (m + T(1)), u = s * s;  // log m = 2 atanh s, |s| < 0.172
  T series;
  if constexpr (sizeof(Element<T>) == 4)
    series = polynomial(u, 0.3333338797092438, 0.19988785684108734, 0.1493554562330246);
  else series = polynomial(u, 1.0 / 3, 1.0 / 5, 1.0 / 7, 1.0 / 9, 1.0 / 11, 1.0 / 13, 1.0 / 15, 1.0 / 17, 1.0 / 19);
  return n * T(std::numbers::ln2) + T(2) * T(s + T(s * u) * series);
}

/// Angle of (x, y) in [-pi, pi]; 0 at the origin. Relative error of the polynomials: 3e-9 in float, 5e-18 in double.
template <class T>
FLAPPY_INLINE T atan2(T y, T x) {
  constexpr double kTanHalfOctant = 0.41421356237309505;
  const T a = abs(x), b = abs(y);
  const T low = min(b, a), high = max(a, b);
  const auto upper = low > T(high * T(kTanHalfOctant));  // then by tan(angle - pi / 4), halved against overflow
  const T over = where(upper, T(T(0.5) * T(low - high)), low);
  const T under = where(upper, T(T(0.5) * low + T(T(0.5) * high)), high);
  const T t = over / where(under == T(0), T(1), under), u = t * t;
  T series;
  if constexpr (sizeof(Element<T>) == 4)
    series = polynomial(u, -0.33333316445350647, 0.19998472929000854, -0.14243541657924652, 0.10593843460083008,
                        -0.06078217923641205);
  else
    series = polynomial(u, -0.333333333333332, 0.1999999999995321, -0.1428571428016262, 0.11111110781946291,
                        -0.09090897718961907, 0.07692059600978196, -0.06663097832843037, 0.05847848981806023,
                        -0.05039142729221756, 0.03806089654504962, -0.017903645377373784);
  const T octant = where(upper, T(std::numbers::pi / 4), T(0)) + T(T(t * u) * series + t);
  const T quadrant = where(b > a, T(T(std::numbers::pi / 2) - octant), octant);
  return copysign(where(x < T(0), T(T(std::numbers::pi) - quadrant), quadrant), y);
}

/// Arc sine; arguments outside [-1, 1] are clamped. Relative error of the polynomials: 6e-9 in float, 2e-17 in double.
template <class T>
FLAPPY_INLINE T asin(T x) {
  const T a = min(T(1), abs(x));
  const auto upper = a > T(0.5);  // then by pi / 2 - 2 asin(sqrt((1 - a) / 2))
  const T u = where(upper, T(T(0.5) * T(T(1) - a)), T(a * a));
  const T s = where(upper, sqrt(u), a);
  T series;
  if constexpr (sizeof(Element<T>) == 4)
    series = polynomial(u, 0.16666752099990845, 0.07495300471782684, 0.045470092445611954, 0.02418058179318905,
                        0.042165011167526245);
  else
    series = polynomial(u, 0.16666666666665408, 0.07500000000336958, 0.044642856828373406, 0.030381959135137297,
                        0.022371758094167166, 0.017359704102334356, 0.013885242021520427, 0.012169168452636872,
                        0.006528162222608601, 0.019527754731310548, -0.01622345592600375, 0.03191172778324828);
  const T small = T(s * u) * series + s;
  return copysign(where(upper, T(T(std::numbers::pi / 2) - T(2) * small), small), x);
}

template <class T>
FLAPPY_INLINE T cos_pi(T x) {
  return sin_cos(T((T(0.5) - abs(x)) * T(std::numbers::pi))).sin;
}

/// Sine and cosine of pi x for |x| <= 1; exact at multiples of 1/2.
template <class T>
FLAPPY_INLINE SinCos<T> sin_cos_pi(T x) {
  const T a = abs(x), b = min(a, T(T(1) - a)), c = T(0.5) - b;  // the angles to the x axis and to the y axis
  const auto swap = b > c;
  const SinCos<T> r = sin_cos(T(min(b, c) * T(std::numbers::pi)));
  return {copysign(where(swap, r.cos, r.sin), x), copysign(where(swap, r.sin, r.cos), T(T(0.5) - a))};
}

/// Sine and cosine of any angle up to 1e4 rad; reducing it costs an absolute error of half an ulp of 1.
template <class T>
FLAPPY_INLINE SinCos<T> sin_cos_wide(T x) {
  const T q = T(x * T(2 / std::numbers::pi) + T(kToWhole<T>)) - T(kToWhole<T>);
  T r;  // x - q pi / 2; all parts of pi / 2 but the last are exact when multiplied by q
  if constexpr (sizeof(Element<T>) == 4)
    r = ((x - q * T(1.5703125)) - q * T(0.0004837512969970703)) - q * T(7.549789954891882e-08);
  else r = (x - q * T(1.5707963267959713)) + q * T(1.0746346554971943e-12);
  const SinCos<T> near = sin_cos(r);
  const T turn = q - T(4) * nearest(T(q * T(0.25)));  // quarters of a turn, from -2 to 2
  const auto swap = abs(turn) == T(1);
  const T s = where(swap, near.cos, near.sin), c = where(swap, near.sin, near.cos);
  return {where((turn < T(0)) | (turn > T(1)), T(-s), s), where((turn > T(0)) | (turn < T(-1)), T(-c), c)};
}

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
