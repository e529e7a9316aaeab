// Numbers in the bytes of a recording, in the order of this processor, which is little-endian.
#pragma once

#include <bit>
#include <cstring>

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

}  // namespace flappy::flightlog
