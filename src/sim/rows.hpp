// Rows of numbers, one for each member of a struct, to structs of lanes and back. Compiled once per instruction set.
#pragma once

#include "sim/lanes.hpp"

namespace flappy::sim {
inline namespace FLAPPY_ISA {

using model::Lanes;

#if defined(FLAPPY_SCALAR)
template <class T>
inline constexpr int kWidth = 1;
#elif defined(__AVX512F__)
template <class T>
inline constexpr int kWidth = 64 / sizeof(T);
#elif defined(__AVX2__)
template <class T>
inline constexpr int kWidth = 32 / sizeof(T);
#else
template <class T>
inline constexpr int kWidth = 16 / sizeof(T);
#endif

template <class S, class T, int lanes>
FLAPPY_INLINE S load_rows(const T (*rows)[lanes], int first) {
  S s;
  using L = Lanes<T, kWidth<T>>;
  static_assert(sizeof(S) % sizeof(L) == 0);
  L* to = reinterpret_cast<L*>(&s);
  for (std::size_t i = 0; i < sizeof(S) / sizeof(L); ++i) to[i] = L::load(rows[i] + first);
  return s;
}

/// For rows that follow one another `stride` numbers apart, in blocks of any width.
template <class S, class T>
FLAPPY_INLINE S load_rows_at(const T* rows, int stride) {
  S s;
  using L = Lanes<T, kWidth<T>>;
  L* to = reinterpret_cast<L*>(&s);
  for (std::size_t i = 0; i < sizeof(S) / sizeof(L); ++i) to[i] = L::load(rows + static_cast<int>(i) * stride);
  return s;
}
template <class S, class T>
FLAPPY_INLINE void store_rows_at(const S& s, T* rows, int stride) {
  using L = Lanes<T, kWidth<T>>;
  const L* from = reinterpret_cast<const L*>(&s);
  for (std::size_t i = 0; i < sizeof(S) / sizeof(L); ++i) from[i].store(rows + static_cast<int>(i) * stride);
}

/// For rows that are read repeatedly: in place if lanes fill a row, else a copy. In place they do not use the stack,
/// whose spills would otherwise collide with them in the cache, at a cost of 4 % of the step.
template <class S, class T, int lanes>
FLAPPY_INLINE decltype(auto) view_rows(const T (*rows)[lanes], int first) {
  if constexpr (kWidth<T> == lanes) return (*reinterpret_cast<const S*>(rows));
  else return load_rows<S>(rows, first);
}

template <class S, class T, int lanes>
FLAPPY_INLINE void store_rows(const S& s, T (*rows)[lanes], int first) {
  using L = Lanes<T, kWidth<T>>;
  const L* from = reinterpret_cast<const L*>(&s);
  for (std::size_t i = 0; i < sizeof(S) / sizeof(L); ++i) from[i].store(rows[i] + first);
}

}  // namespace FLAPPY_ISA
}  // namespace flappy::sim
