// Products of matrices and their transposes, against plain loops.
#include "learn/lanes/matrix.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace flappy::learn {
namespace {

/// The very chain of fused multiply-adds that matrix.hpp promises: no tolerance.
template <class T, bool kAccumulate>
void product_is_one_chain() {
  std::mt19937 engine(3);
  std::uniform_real_distribution<T> unit(-1, 1);
  for (const int rows : {1, 2, 5, 6, 13, 31})
    for (const int columns : {16, 32, 48, 64, 112})
      for (const int depth : {1, 7, 64})
        for (const bool transposed : {false, true}) {
          const int wide = columns + 16;  // rows may be further apart than they are long
          std::vector<T> a(static_cast<std::size_t>(rows * depth)), b(static_cast<std::size_t>(depth * wide));
          std::vector<T> c(static_cast<std::size_t>(rows * wide));
          for (auto* list : {&a, &b, &c})
            for (T& x : *list) x = unit(engine);
          std::vector<T> expected = c;
          const Strided<T> view{a.data(), transposed ? 1 : depth, transposed ? rows : 1};
          for (int i = 0; i < rows; ++i)
            for (int j = 0; j < columns; ++j) {
              T& sum = expected[static_cast<std::size_t>(i * wide + j)];
              if (!kAccumulate) sum = 0;
              for (int k = 0; k < depth; ++k)
                sum =
                    std::fma(view.data[i * view.row + k * view.column], b[static_cast<std::size_t>(k * wide + j)], sum);
            }
          multiply<T, kAccumulate>(rows, columns, depth, view, b.data(), wide, c.data(), wide);
          ASSERT_EQ(c, expected) << rows << " x " << columns << ", depth " << depth;
        }
}

TEST(Matrix, product_is_one_chain_of_fused_multiply_adds) {
  product_is_one_chain<float, false>();
  product_is_one_chain<float, true>();
  product_is_one_chain<double, false>();
  product_is_one_chain<double, true>();
}

template <class T, int N>
void tile_transposes() {
  std::vector<T> from(static_cast<std::size_t>(N * 20)), to(static_cast<std::size_t>(N * 40), T(-1));
  for (std::size_t i = 0; i < from.size(); ++i) from[i] = static_cast<T>(i);
  transpose_tile<T, N>(from.data(), 20, to.data(), 40);
  for (int i = 0; i < N; ++i)
    for (int j = 0; j < 40; ++j)
      ASSERT_EQ(to[static_cast<std::size_t>(i * 40 + j)], j < N ? static_cast<T>(j * 20 + i) : T(-1)) << i << ", " << j;
}

TEST(Matrix, tiles_of_any_width_transpose) {
  tile_transposes<float, 1>();
  tile_transposes<float, 4>();
  tile_transposes<float, 8>();
  tile_transposes<float, 16>();
  tile_transposes<double, 2>();
  tile_transposes<double, 8>();
}

TEST(Matrix, a_matrix_turns) {
  constexpr int kRows = 48, kColumns = 64;
  std::vector<float> from(kRows * kColumns), to(kRows * kColumns);
  for (std::size_t i = 0; i < from.size(); ++i) from[i] = static_cast<float>(i);
  transpose(kRows, kColumns, from.data(), kColumns, to.data(), kRows);
  for (std::size_t i = 0; i < kRows; ++i)
    for (std::size_t j = 0; j < kColumns; ++j) ASSERT_EQ(to[j * kRows + i], from[i * kColumns + j]);
}

}  // namespace
}  // namespace flappy::learn
