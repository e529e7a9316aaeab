#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "identify/global_search.hpp"
#include "identify/least_squares.hpp"

namespace flappy::identify {
namespace {

using Eigen::VectorXd;

/// Rosenbrock's valley as residuals, lowest at (`x`, x^2 scaled); in the unit cube where x is.
Residuals valley(double x) {
  return [x](const std::vector<VectorXd>& points) {
    std::vector<VectorXd> all;
    for (const VectorXd& p : points) all.push_back((VectorXd(2) << 10 * (p[1] - p[0] * p[0]), p[0] - x).finished());
    return all;
  };
}

TEST(LeastSquares, FindsTheFloorOfAValley) {
  const LeastSquares found = minimise(valley(0.7), VectorXd::Zero(2));
  EXPECT_NEAR(found.point[0], 0.7, 1e-6);
  EXPECT_NEAR(found.point[1], 0.49, 1e-6);
  EXPECT_LT(found.cost, 1e-12);
}

TEST(LeastSquares, StopsAtItsBounds) {
  const LeastSquares found = minimise(valley(1.5), VectorXd::Constant(2, 0.2));
  EXPECT_EQ(found.point[0], 1);
  EXPECT_NEAR(found.point[1], 1, 1e-6);
  EXPECT_NEAR(found.cost, 0.25, 1e-9);
}

TEST(LeastSquares, SlopesAreCentral) {
  const Residuals cube = [](const std::vector<VectorXd>& points) {
    std::vector<VectorXd> all;
    for (const VectorXd& p : points) all.push_back(p.array().cube().matrix());
    return all;
  };
  const VectorXd p = VectorXd::Constant(1, 0.5);
  const Eigen::MatrixXd steps = first_steps(1);
  EXPECT_NEAR(jacobian(cube, p, steps)(0, 0), 0.75 + kDifference * kDifference, 1e-9);  // h^2 f''' / 6
  EXPECT_NEAR(jacobian(cube, VectorXd::Ones(1), steps)(0, 0), 3, 3.1 * kDifference);    // one-sided at a bound
}

TEST(LeastSquares, KinksAreNoKnowledge) {
  // a steep sum and a shallow difference, under ripples of 0.02 with slopes of up to 20
  const Residuals rough = [](const std::vector<VectorXd>& points) {
    std::vector<VectorXd> all;
    for (const VectorXd& p : points) {
      VectorXd r(40);
      for (Eigen::Index i = 0; i < r.size(); ++i) {
        const double phase = static_cast<double>(i);
        r[i] = (i % 2 == 0 ? 1000 * (p[0] + p[1]) : 2 * (p[0] - p[1])) + 0.02 * std::sin(1e3 * p[0] + phase * phase);
      }
      all.push_back(r);
    }
    return all;
  };
  const VectorXd p = (VectorXd(2) << 0.5, 0.4).finished();
  const auto least = [](const Eigen::MatrixXd& j) { return Eigen::JacobiSVD<Eigen::MatrixXd>(j).singularValues()[1]; };
  const double exact = 2 * std::sqrt(2 * 20);
  Eigen::MatrixXd j = jacobian(rough, p, first_steps(2));
  EXPECT_GT(least(j), 3 * exact);
  for (int i = 0; i < 2; ++i) j = jacobian(rough, p, steps_along(j, p, 1));
  // 40 ripples of 0.02 over two steps of 0.05 leave 1.3 at most, about square
  EXPECT_NEAR(least(j), exact, 0.05 * exact);
}

TEST(LeastSquares, StepsStayInside) {
  const Eigen::MatrixXd slopes = (Eigen::MatrixXd(3, 3) << 1, 1, 0, 1, 1.1, 0, 0, 0, 1e3).finished();
  const VectorXd p = (VectorXd(3) << 0.02, 1, 0.5).finished();
  const Eigen::MatrixXd steps = steps_along(slopes, p, 10);
  for (Eigen::Index i = 0; i < 3; ++i) {
    EXPECT_EQ(steps(1, i), i == 1 ? kDifference : 0) << "at a bound: a step of its own";
    EXPECT_LE(std::abs(steps(0, i)), 0.02 + 1e-12);
  }
  EXPECT_NEAR(steps.col(2).norm(), 0.02, 1e-12);  // as far as there is room
  EXPECT_NEAR(steps.col(0).norm(), 0.01, 1e-12);  // as far as the noise: 10 of 1e3
}

TEST(LeastSquares, AvoidsWhatCannotBeEvaluated) {
  const Residuals broken = [](const std::vector<VectorXd>& points) {
    std::vector<VectorXd> all;
    for (const VectorXd& p : points)
      all.push_back(
          VectorXd::Constant(1, p[0] > 0.6 ? std::numeric_limits<double>::quiet_NaN() : std::exp(p[0]) - 1.6));
    return all;
  };
  EXPECT_NEAR(minimise(broken, VectorXd::Zero(1)).point[0], std::log(1.6), 1e-6);
}

struct Calls {
  std::size_t batches = 0, largest = 0;
};

BatchCost bowl(Calls& calls) {
  return [&calls](const std::vector<Point>& points) {
    ++calls.batches;
    calls.largest = std::max(calls.largest, points.size());
    std::vector<double> costs;
    for (const Point& p : points) {
      double cost = 0;
      for (std::size_t i = 0; i < p.size(); ++i) cost += (p[i] - 0.3) * (p[i] - 0.3) * static_cast<double>(1 + 10 * i);
      costs.push_back(cost);
    }
    return costs;
  };
}

TEST(GlobalSearch, AGenerationIsOneCall) {
  for (const Search method : {Search::genetic, Search::cma_es}) {
    Calls calls;
    const SearchOptions options{.population = 20, .generations = 60, .seed = 3};
    const Point start(5, 0.9);
    const SearchResult r = search(method, bowl(calls), start, options);
    EXPECT_EQ(r.generations, 60u);
    EXPECT_EQ(calls.batches, 62u);  // the first generation in two calls: `start` is not random
    EXPECT_EQ(calls.largest, 20u);
    EXPECT_EQ(r.evaluations, 20u * 61);
    EXPECT_LT(r.cost, method == Search::cma_es ? 1e-6 : 1e-2);  // it starts at 37.8
    EXPECT_NEAR(r.point[4], 0.3, method == Search::cma_es ? 1e-3 : 0.05);
    Calls others;
    const SearchResult again = search(method, bowl(others), start, options);
    EXPECT_EQ(again.point, r.point);
    EXPECT_EQ(search(method, bowl(others), start, options, [](const SearchResult&) { return false; }).generations, 1u);
  }
}

}  // namespace
}  // namespace flappy::identify
