// Products of small matrices. Each element is one chain of fused multiply-adds in the order of k, so its bits do not
// depend on tiles or the width of registers. For files compiled once for each instruction set.
#pragma once

#include <utility>

#include "sim/rows.hpp"

namespace flappy::learn {

/// A matrix that is read element by element: element (i, k) is data[i row + k column].
template <class T>
struct Strided {
  const T* data;
  std::ptrdiff_t row, column;
};

inline namespace FLAPPY_ISA {

using sim::kWidth;
using sim::Lanes;

/// A tile of C: at most kTile registers of sums, leaving room for factors, in up to kTileRows rows of kTileVectors.
#if defined(__AVX512F__)
inline constexpr int kTile = 24, kTileVectors = 4, kTileRows = 12;
#elif defined(__AVX2__) && !defined(FLAPPY_SCALAR)
inline constexpr int kTile = 12, kTileVectors = 2, kTileRows = 6;
#else
inline constexpr int kTile = 4, kTileVectors = 2, kTileRows = 2;
#endif

/// multiply() for kRows rows and kVectors registers of columns.
template <class T, int kRows, int kVectors, bool kAccumulate>
FLAPPY_INLINE void multiply_tile(int depth, Strided<T> a, const T* b, std::ptrdiff_t b_row, T* c,
                                 std::ptrdiff_t c_row) {
  using L = Lanes<T, kWidth<T>>;
  L sum[kRows][kVectors];
#pragma GCC unroll 12
  for (int i = 0; i < kRows; ++i)
#pragma GCC unroll 4
    for (int j = 0; j < kVectors; ++j) sum[i][j] = kAccumulate ? L::load(c + i * c_row + j * kWidth<T>) : L(0);
  for (int k = 0; k < depth; ++k) {
    L column[kVectors];
#pragma GCC unroll 4
    for (int j = 0; j < kVectors; ++j) column[j] = L::load(b + j * kWidth<T>);
#pragma GCC unroll 12
    for (int i = 0; i < kRows; ++i) {
      const L factor(a.data[i * a.row]);
#pragma GCC unroll 4
      for (int j = 0; j < kVectors; ++j) sum[i][j] += factor * column[j];
    }
    a.data += a.column;
    b += b_row;
  }
#pragma GCC unroll 12
  for (int i = 0; i < kRows; ++i)
#pragma GCC unroll 4
    for (int j = 0; j < kVectors; ++j) sum[i][j].store(c + i * c_row + j * kWidth<T>);
}

/// multiply() for the last rows, which are fewer than in a tile.
template <class T, int kRows, int kVectors, bool kAccumulate>
FLAPPY_INLINE void multiply_rest(int rows, int depth, Strided<T> a, const T* b, std::ptrdiff_t b_row, T* c,
                                 std::ptrdiff_t c_row) {
  if constexpr (kRows > 0) {
    if (rows == kRows) multiply_tile<T, kRows, kVectors, kAccumulate>(depth, a, b, b_row, c, c_row);
    else multiply_rest<T, kRows - 1, kVectors, kAccumulate>(rows, depth, a, b, b_row, c, c_row);
  }
}

template <class T, int kVectors, bool kAccumulate>
void multiply_panel(int rows, int depth, Strided<T> a, const T* b, std::ptrdiff_t b_row, T* c, std::ptrdiff_t c_row) {
  constexpr int kRows = kTile / kVectors < kTileRows ? kTile / kVectors : kTileRows;
  for (; rows >= kRows; rows -= kRows, a.data += kRows * a.row, c += kRows * c_row)
    multiply_tile<T, kRows, kVectors, kAccumulate>(depth, a, b, b_row, c, c_row);
  multiply_rest<T, kRows - 1, kVectors, kAccumulate>(rows, depth, a, b, b_row, c, c_row);
}

/// C[i][j] = sum over k < depth of A(i, k) B[k][j], i < rows, j < columns; with kAccumulate added to C. `columns`: a
/// multiple of 16. `b_row`, `c_row`: row lengths of B, C.
template <class T, bool kAccumulate = false>
void multiply(int rows, int columns, int depth, Strided<T> a, const T* b, std::ptrdiff_t b_row, T* c,
              std::ptrdiff_t c_row) {
  constexpr int kW = kWidth<T>;
  int j = 0;
  for (; j + kTileVectors * kW <= columns; j += kTileVectors * kW)
    multiply_panel<T, kTileVectors, kAccumulate>(rows, depth, a, b + j, b_row, c + j, c_row);
  if (kTileVectors > 2 && j + 2 * kW <= columns) {
    multiply_panel<T, 2, kAccumulate>(rows, depth, a, b + j, b_row, c + j, c_row);
    j += 2 * kW;
  }
  if (j < columns) multiply_panel<T, 1, kAccumulate>(rows, depth, a, b + j, b_row, c + j, c_row);
}

/// Interleaves the low or high halves of two registers: x0, y0, x1, y1, ...
template <bool kHigh, class L, std::size_t... i>
FLAPPY_INLINE L interleaved(L x, L y, std::index_sequence<i...>) {
  constexpr std::size_t kN = sizeof...(i), kFrom = kHigh ? kN / 2 : 0;
  return L(__builtin_shufflevector(x.raw, y.raw, (i % 2 == 0 ? kFrom + i / 2 : kN + kFrom + i / 2)...));
}

/// to[j][i] = from[i][j] for N rows and columns. Each pass of perfect shuffles moves one bit of the index i into j.
template <class T, int N>
FLAPPY_INLINE void transpose_tile(const T* from, std::ptrdiff_t from_row, T* to, std::ptrdiff_t to_row) {
  using L = Lanes<T, N>;
  using Index = std::make_index_sequence<N>;
  L a[N], b[N];
#pragma GCC unroll 16
  for (int i = 0; i < N; ++i) a[i] = L::load(from + i * from_row);
  if constexpr (N > 1) {
#pragma GCC unroll 4
    for (int pass = 1; pass < N; pass *= 2) {
#pragma GCC unroll 8
      for (int i = 0; i < N / 2; ++i) {
        b[2 * i] = interleaved<false>(a[i], a[i + N / 2], Index());
        b[2 * i + 1] = interleaved<true>(a[i], a[i + N / 2], Index());
      }
#pragma GCC unroll 16
      for (int i = 0; i < N; ++i) a[i] = b[i];
    }
  }
#pragma GCC unroll 16
  for (int i = 0; i < N; ++i) a[i].store(to + i * to_row);
}

/// to[j][i] = from[i][j]; rows and columns are multiples of 16.
template <class T>
void transpose(int rows, int columns, const T* from, std::ptrdiff_t from_row, T* to, std::ptrdiff_t to_row) {
  constexpr int kW = kWidth<T>;
  for (int i = 0; i < rows; i += kW)
    for (int j = 0; j < columns; j += kW)
      transpose_tile<T, kW>(from + i * from_row + j, from_row, to + j * to_row + i, to_row);
}

}  // namespace FLAPPY_ISA
}  // namespace flappy::learn
