#include "gap/evidence/wide_kernel.hpp"

#include <type_traits>

#include "sim/rows.hpp"

namespace flappy::gap {
inline namespace FLAPPY_ISA {
namespace {

using Size = WideKernel::Size;
using V = sim::Lanes<double, sim::kWidth<double>>;
constexpr Size kLanes = sim::kWidth<double>;
/// Rows, and strips of lanes, that are summed at once in registers.
constexpr Size kRows = 4, kStrips = 4;

template <Size strips>
using Tile = V[kRows][strips];

/// Not fused: a processor without fused operations would take a hundred times as long.
FLAPPY_INLINE V product(const V& a, const V& b) { return V(a.raw * b.raw); }

/// Calls use(first column, number of strips as a constant) until all columns are done.
template <class Use>
FLAPPY_INLINE void for_strips(Size columns, const Use& use) {
  Size first = 0;
  for (; first + kStrips * kLanes <= columns; first += kStrips * kLanes)
    use(first, std::integral_constant<Size, kStrips>());
  for (; first < columns; first += kLanes) use(first, std::integral_constant<Size, 1>());
}

template <Size strips>
FLAPPY_INLINE void load(Tile<strips>& tile, const double* x, Size columns, Size rows) {
  for (Size r = 0; r < kRows; ++r)
    for (Size s = 0; s < strips; ++s) tile[r][s] = r < rows ? V::load(x + r * columns + s * kLanes) : V(0.0);
}

template <Size strips>
FLAPPY_INLINE void store(const Tile<strips>& tile, double* x, Size columns, Size rows) {
  for (Size r = 0; r < rows; ++r)
    for (Size s = 0; s < strips; ++s) tile[r][s].store(x + r * columns + s * kLanes);
}

/// tile[r][s] += sign factor(r, j) x[j][s], for j from `from` to before `to`.
template <int sign, Size strips, class Factor>
FLAPPY_INLINE void accumulate(Tile<strips>& tile, const double* x, Size columns, Size from, Size to,
                              const Factor& factor) {
  for (Size j = from; j < to; ++j) {
    V at[strips];
    for (Size s = 0; s < strips; ++s) at[s] = V::load(x + j * columns + s * kLanes);
    for (Size r = 0; r < kRows; ++r) {
      const V f(factor(r, j));
      for (Size s = 0; s < strips; ++s)
        tile[r][s] = sign < 0 ? tile[r][s] - product(f, at[s]) : tile[r][s] + product(f, at[s]);
    }
  }
}

/// Row r of a tile, whose own sums are complete, divided by the diagonal.
template <Size strips>
FLAPPY_INLINE void divide(Tile<strips>& tile, Size r, double diagonal) {
  const V inverse(1 / diagonal);
  for (Size s = 0; s < strips; ++s) tile[r][s] = product(tile[r][s], inverse);
}

/// Row r of a tile less `factor` times row j.
template <Size strips>
FLAPPY_INLINE void subtract(Tile<strips>& tile, Size r, double factor, Size j) {
  for (Size s = 0; s < strips; ++s) tile[r][s] = tile[r][s] - product(V(factor), tile[j][s]);
}

void solve_lower(const double* l, Size rows, Size columns, double* x) {
  for_strips(columns, [&](Size first, auto strips) {
    for (Size top = 0; top < rows; top += kRows) {
      const Size here = rows - top < kRows ? rows - top : kRows;
      double* const own = x + top * columns + first;
      Tile<strips> tile;
      load<strips>(tile, own, columns, here);
      accumulate<-1, strips>(tile, x + first, columns, 0, top,
                             [&](Size r, Size j) { return r < here ? l[(top + r) * rows + j] : 0.0; });
      for (Size r = 0; r < here; ++r) {
        const double* row = l + (top + r) * rows + top;
        for (Size j = 0; j < r; ++j) subtract<strips>(tile, r, row[j], j);
        divide<strips>(tile, r, row[r]);
      }
      store<strips>(tile, own, columns, here);
    }
  });
}

void solve_transposed(const double* l, Size rows, Size columns, double* x) {
  for_strips(columns, [&](Size first, auto strips) {
    for (Size end = rows; end > 0;) {
      const Size here = end < kRows ? end : kRows, top = end - here;
      double* const own = x + top * columns + first;
      Tile<strips> tile;
      load<strips>(tile, own, columns, here);
      accumulate<-1, strips>(tile, x + first, columns, end, rows,
                             [&](Size r, Size j) { return r < here ? l[j * rows + top + r] : 0.0; });
      for (Size r = here - 1; r >= 0; --r) {
        for (Size j = r + 1; j < here; ++j) subtract<strips>(tile, r, l[(top + j) * rows + top + r], j);
        divide<strips>(tile, r, l[(top + r) * rows + top + r]);
      }
      store<strips>(tile, own, columns, here);
      end = top;
    }
  });
}

void subtract_squares(const double* x, Size rows, Size columns, double* sums) {
  static_assert(kColumnStep % kRows == 0);
  for (Size top = 0; top < columns; top += kRows)
    for_strips(padded(top + kRows), [&](Size first, auto strips) {
      double* const own = sums + top * columns + first;
      Tile<strips> tile;
      load<strips>(tile, own, columns, kRows);
      accumulate<-1, strips>(tile, x + first, columns, 0, rows,
                             [&](Size r, Size j) { return x[j * columns + top + r]; });
      store<strips>(tile, own, columns, kRows);
    });
}

void times_lower(const double* x, const double* s, Size rows, Size columns, double* y) {
  for_strips(columns, [&](Size first, auto strips) {
    for (Size top = 0; top < rows; top += kRows) {
      const Size here = rows - top < kRows ? rows - top : kRows;
      Tile<strips> tile;
      load<strips>(tile, nullptr, 0, 0);
      accumulate<1, strips>(tile, s + first, columns, first, columns,
                            [&](Size r, Size j) { return r < here ? x[(top + r) * columns + j] : 0.0; });
      store<strips>(tile, y + top * columns + first, columns, here);
    }
  });
}

void add_row_squares(const double* x, Size rows, Size columns, double* squares) {
  for (Size i = 0; i < rows; ++i) {
    double parts[kColumnStep];
    for (Size part = 0; part < kColumnStep; part += kLanes) {
      V sum(0.0);
      for (Size first = part; first < columns; first += kColumnStep) {
        const V at = V::load(x + i * columns + first);
        sum = sum + product(at, at);
      }
      sum.store(parts + part);
    }
    for (const double part : parts) squares[i] += part;
  }
}

}  // namespace

extern const WideKernel wide_kernel_of_set;
const WideKernel wide_kernel_of_set = {solve_lower, solve_transposed, subtract_squares, times_lower, add_row_squares};

}  // namespace FLAPPY_ISA
}  // namespace flappy::gap
