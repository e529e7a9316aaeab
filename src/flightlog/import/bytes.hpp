// Numbers in the bytes of a recording, in the order of this processor, which is little-endian.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

namespace flappy::flightlog {

static_assert(std::endian::native == std::endian::little);

template <class T>
T number_at(const char* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof(T));
  return value;
}

template <class T>
double read_as(const char* bytes) {
  return static_cast<double>(number_at<T>(bytes));
}

/// A half-precision number (IEEE 754 binary16).
inline double read_half(const char* bytes) {
  const auto bits = number_at<std::uint16_t>(bytes);
  const int exponent = bits >> 10 & 0x1F, fraction = bits & 0x3FF;
  const double sign = (bits & 0x8000) != 0 ? -1 : 1;
  if (exponent == 0x1F)
    return fraction != 0 ? std::numeric_limits<double>::quiet_NaN() : sign * std::numeric_limits<double>::infinity();
  return sign * (exponent == 0 ? std::ldexp(fraction, -24) : std::ldexp(fraction + 0x400, exponent - 25));
}

}  // namespace flappy::flightlog
