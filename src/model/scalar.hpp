// The vocabulary that physics is written in, for plain float and double; lanes.hpp has the same words for
// many flappers at once. FLAPPY_ISA names the instruction set a file is compiled for, so that one program can
// hold the same templates for several of them without the linker merging their code.
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
/// any(), where the compiler is to favour the other way.
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

/// 2^-k for a whole number k within the normal range.
FLAPPY_INLINE float half_to(float k) { return std::bit_cast<float>((127 - static_cast<std::int32_t>(k)) << 23); }
FLAPPY_INLINE double half_to(double k) {
  return std::bit_cast<double>((std::int64_t{1023} - static_cast<std::int64_t>(k)) << 52);
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

}  // namespace FLAPPY_ISA
}  // namespace flappy::model
