// Functions in which the physics is written, for plain float and double; lanes.hpp has the same functions for many
// flappers at once. FLAPPY_ISA names the instruction set for which a file is compiled, so that one program can contain
// the same templates for several instruction sets without the linker merging their code.
#pragma once

#include <bit>
#include <cstdint>

#ifndef FLAPPY_ISA
#define FLAPPY_ISA portable
#endif

#define FLAPPY_INLINE inline __attribute__((always_inline))

namespace flappy::model {
inline namespace FLAPPY_ISA {

FLAPPY_INLINE float where(bool condition, float yes, float no) { return condition ? yes : no; }
FLAPPY_INLINE double where(bool condition, double yes, double no) { return condition ? yes : no; }
FLAPPY_INLINE bool any(bool condition) { return condition; }
/// any(), with a hint to the compiler that it is usually false.
template <class M>
FLAPPY_INLINE bool rarely(const M& mask) {
  return __builtin_expect(any(mask), 0);
}
FLAPPY_INLINE float min(float a, float b) { return a < b ? a : b; }
FLAPPY_INLINE double min(double a, double b) { return a < b ? a : b; }
FLAPPY_INLINE float max(float a, float b) { return a > b ? a : b; }
FLAPPY_INLINE double max(double a, double b) { return a > b ? a : b; }
FLAPPY_INLINE float sqrt(float a) { return __builtin_sqrtf(a); }
FLAPPY_INLINE double sqrt(double a) { return __builtin_sqrt(a); }
FLAPPY_INLINE float abs(float a) { return __builtin_fabsf(a); }
FLAPPY_INLINE double abs(double a) { return __builtin_fabs(a); }

FLAPPY_INLINE float copysign(float magnitude, float sign) { return __builtin_copysignf(magnitude, sign); }
FLAPPY_INLINE double copysign(double magnitude, double sign) { return __builtin_copysign(magnitude, sign); }

// Functions on bits. Adding 1.5 x 2^23 (double: 2^52) puts a whole number into the lowest bits without a conversion.

/// 2^-k for a whole number k within the normal range.
FLAPPY_INLINE float half_to(float k) { return std::bit_cast<float>(std::bit_cast<std::uint32_t>(12583039 - k) << 23); }
FLAPPY_INLINE double half_to(double k) {
  return std::bit_cast<double>(std::bit_cast<std::uint64_t>(6755399441056767 - k) << 52);
}

/// x = mantissa(x) 2^exponent(x) with 1 <= mantissa(x) < 2, for a positive normal x.
FLAPPY_INLINE float exponent(float x) {
  return std::bit_cast<float>(std::bit_cast<std::uint32_t>(x) >> 23 | 0x4b000000U) - (0x1p23f + 127);
}
FLAPPY_INLINE double exponent(double x) {
  return std::bit_cast<double>(std::bit_cast<std::uint64_t>(x) >> 52 | 0x4330000000000000ULL) - (0x1p52 + 1023);
}
FLAPPY_INLINE float mantissa(float x) {
  return std::bit_cast<float>((std::bit_cast<std::uint32_t>(x) & 0x007fffffU) | 0x3f800000U);
}
FLAPPY_INLINE double mantissa(double x) {
  return std::bit_cast<double>((std::bit_cast<std::uint64_t>(x) & 0x000fffffffffffffULL) | 0x3ff0000000000000ULL);
}

template <class T>
FLAPPY_INLINE T clamp(T value, T low, T high) {
  return min(max(value, low), high);
}

/// The element type behind a scalar or a vector of lanes: float or double.
template <class T>
struct ElementOf {
  using type = T;
};
template <class T>
using Element = typename ElementOf<T>::type;

/// Adding this constant rounds to a whole number, ties to even, up to 2^22 in float and 2^51 in double.
template <class T>
inline constexpr double kToWhole = sizeof(Element<T>) == 4 ? 0x1.8p23 : 0x1.8p52;
template <class T>
FLAPPY_INLINE T nearest(T a) {
  return T(a + T(kToWhole<T>)) - T(kToWhole<T>);
}

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
