// Products and triangular solves of wide matrices, by each instruction set.
#include "gap/evidence/wide_kernel.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

#include "sim/kernels.hpp"

namespace flappy::gap {

FLAPPY_KERNELS(WideKernel, wide_kernel_of_set);

namespace {

using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Random numbers in the first `columns` columns, zeros in the others.
Matrix drawn(Eigen::Index rows, Eigen::Index columns, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  Matrix m = Matrix::Zero(rows, padded(columns));
  for (Eigen::Index i = 0; i < rows; ++i)
    for (Eigen::Index j = 0; j < columns; ++j) m(i, j) = normal(random);
  return m;
}

/// All results of a kernel, one after another, of matrices of `rows` and `columns`.
std::vector<Matrix> results(const WideKernel& kernel, Eigen::Index rows, Eigen::Index columns) {
  const Matrix x = drawn(rows, columns, 1), square = drawn(rows, rows, 2).leftCols(rows);
  const Matrix l =
      Eigen::LLT<Eigen::MatrixXd>(square * square.transpose() + Eigen::MatrixXd::Identity(rows, rows)).matrixL();
  const Eigen::Index width = x.cols();
  Matrix lower = drawn(width, columns, 3).triangularView<Eigen::Lower>();
  lower.bottomRows(width - columns).setZero();
  std::vector<Matrix> all = {x, x, Matrix::Identity(width, width), Matrix::Zero(rows, width), Matrix::Ones(rows, 1)};
  kernel.solve_lower(l.data(), rows, width, all[0].data());
  kernel.solve_transposed(l.data(), rows, width, all[1].data());
  kernel.subtract_squares(x.data(), rows, width, all[2].data());
  all[2] = Matrix(all[2].triangularView<Eigen::Lower>());
  kernel.times_lower(x.data(), lower.data(), rows, width, all[3].data());
  kernel.add_row_squares(x.data(), rows, width, all[4].data());
  // a bound of the error of a sum of n products of numbers of order one, with the condition of L: n n eps max|L^-1| ~ 1e-10
  const double most = 1e-10;
  EXPECT_LT((l * all[0] - x).cwiseAbs().maxCoeff(), most);
  EXPECT_LT((l.transpose() * all[1] - x).cwiseAbs().maxCoeff(), most);
  const Matrix less = Matrix(Matrix::Identity(width, width) - x.transpose() * x).triangularView<Eigen::Lower>();
  EXPECT_LT((all[2] - less).cwiseAbs().maxCoeff(), most);
  EXPECT_LT((all[3] - x * lower).cwiseAbs().maxCoeff(), most);
  EXPECT_LT((all[4] - Matrix::Ones(rows, 1) - x.rowwise().squaredNorm()).cwiseAbs().maxCoeff(), most);
  return all;
}

TEST(WideKernel, ComputesTheSameBytesWithLanesOfAnyWidth) {
  for (const auto& [rows, columns] :
       {std::pair<Eigen::Index, Eigen::Index>{58, 126}, {29, 39}, {7, 1}, {4, 64}, {1, 33}}) {
    SCOPED_TRACE(testing::Message() << rows << " x " << columns);
    const std::vector<Matrix> scalar = results(*wide_kernel_of_sets[0], rows, columns);
    for (const std::string& set : sim::instruction_sets()) {
      const std::vector<Matrix> own = results(*wide_kernel_of_sets[sim::place_of(set)], rows, columns);
      for (std::size_t i = 0; i < own.size(); ++i) EXPECT_EQ(own[i], scalar[i]) << set << ", result " << i;
    }
  }
}

}  // namespace
}  // namespace flappy::gap
