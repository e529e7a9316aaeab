// Products and triangular solves with matrices of many columns, row after row. Compiled for each instruction set: lanes
// are columns, and each number is summed in the same order with lanes of any width.
#pragma once

#include <cstddef>

namespace flappy::gap {

/// The number of columns is a multiple of this; columns beyond a matrix's own are 0.
inline constexpr std::ptrdiff_t kColumnStep = 8;
constexpr std::ptrdiff_t padded(std::ptrdiff_t columns) {
  return (columns + kColumnStep - 1) / kColumnStep * kColumnStep;
}

/// x, y: [rows][columns]; l: [rows][rows], of which the lower triangle is read; s, sums: [columns][columns].
struct WideKernel {
  using Size = std::ptrdiff_t;
  /// x = L^-1 x.
  void (*solve_lower)(const double* l, Size rows, Size columns, double* x);
  /// x = L^-T x.
  void (*solve_transposed)(const double* l, Size rows, Size columns, double* x);
  /// sums -= x^T x; only the lower triangle of `sums` is right.
  void (*subtract_squares)(const double* x, Size rows, Size columns, double* sums);
  /// y = x S. `s`: lower triangle, 0 elsewhere.
  void (*times_lower)(const double* x, const double* s, Size rows, Size columns, double* y);
  /// squares[i] += the sum of squares of row i of x.
  void (*add_row_squares)(const double* x, Size rows, Size columns, double* squares);
};

/// The best for this processor.
const WideKernel& wide_kernel();

}  // namespace flappy::gap
