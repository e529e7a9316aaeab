#include <gtest/gtest.h>

#include "gap/synthetic_flight.hpp"

namespace flappy::gap::regime_basis_test {
namespace {

int index_of(const RegimeBasis& basis, const std::string& name) {
  for (int i = 0; i < basis.size(); ++i)
    if (basis.name(i) == name) return i;
  return -1;
}

RegimeBasis basis_of(const Flights& flights) { return {question_of(flights), flights}; }

TEST(RegimeBasis, HasFunctionsOfMeanZeroAndRmsOne) {
  const auto made = synthetic_flights(2, synthetic_law);
  const Flights flights = as_flights(made);
  const RegimeBasis basis = basis_of(flights);
  // constant, four functions, the offset of the second flight, two products
  ASSERT_EQ(basis.size(), 8);
  EXPECT_EQ(basis.kind(0), BasisFunction::constant);
  EXPECT_EQ(basis.quantity(0), "always");
  EXPECT_TRUE((basis.values(0).col(0).array() == 1).all());
  for (int i = 1; i < basis.size(); ++i) {
    const double n = 2 * 120, mean = (basis.values(0).col(i).sum() + basis.values(1).col(i).sum()) / n,
                 square = (basis.values(0).col(i).squaredNorm() + basis.values(1).col(i).squaredNorm()) / n;
    EXPECT_NEAR(mean, 0, 1e-12) << basis.name(i);
    EXPECT_NEAR(square, 1, 1e-12) << basis.name(i);
  }
  const int product = index_of(basis, "amplitude velocity_x");
  ASSERT_GE(product, 0);
  EXPECT_EQ(basis.quantity(product), "velocity");
  EXPECT_EQ(basis.kind(product), BasisFunction::product);
}

// A bench stands at 1 m; the flights are at 0, with a spread of 1 m.
TEST(RegimeBasis, CentresABenchByItself) {
  std::vector<std::shared_ptr<SyntheticFlight>> made;
  for (int k = 0; k < 4; ++k)
    made.push_back(std::make_shared<SyntheticFlight>("f" + std::to_string(k), k, synthetic_law));
  made[1]->on_bench = made[3]->on_bench = true;
  made[1]->height_m.setConstant(1), made[3]->height_m.setConstant(1);
  made[3]->amplitude.array() += 5;
  const Flights flights = as_flights(made);
  const RegimeBasis basis(question_of(flights), flights);
  for (int i = 1; i < basis.size(); ++i) {
    if (basis.kind(i) == BasisFunction::flight || basis.kind(i) == BasisFunction::product) continue;
    for (const std::size_t first : {0U, 1U}) {
      const Eigen::MatrixXd &a = basis.values(first), &b = basis.values(first + 2);
      EXPECT_NEAR(a.col(i).sum() + b.col(i).sum(), 0, 1e-9) << basis.name(i);
      const double squares = a.col(i).squaredNorm() + b.col(i).squaredNorm(),
                   n = static_cast<double>(a.rows() + b.rows());
      const bool still = first == 1 && basis.quantity(i) == "height";
      EXPECT_NEAR(squares / n, still ? 0 : 1, 1e-9) << basis.name(i);
    }
  }
}

TEST(RegimeBasis, HasNoProductsInAContrastOfABench) {
  const auto made = synthetic_flights(4, synthetic_law);
  for (const auto& f : made) f->on_bench = true;
  EXPECT_GE(index_of(basis_of(as_flights(made)), "amplitude velocity_x"), 0) << "alone";
  EXPECT_LT(index_of(basis_of(as_flights(made, 2)), "amplitude velocity_x"), 0);
  made[0]->on_bench = false;
  EXPECT_GE(index_of(basis_of(as_flights(made, 2)), "amplitude velocity_x"), 0) << "with a flight";
}

TEST(RegimeBasis, TellsFlightsFromHeights) {
  const Flights flights{{},
                        {std::make_shared<SyntheticFlight>("low", 1, synthetic_law, 0),
                         std::make_shared<SyntheticFlight>("high", 2, synthetic_law, 5)}};
  const RegimeBasis basis = basis_of(flights);
  const int offset = index_of(basis, "flight high");
  ASSERT_GE(offset, 0);
  EXPECT_EQ(basis.kind(offset), BasisFunction::flight);
  const auto first = basis.values(0).col(offset), second = basis.values(1).col(offset);
  EXPECT_NEAR((first.array() - first[0]).abs().maxCoeff(), 0, 1e-12);
  EXPECT_NEAR((second.array() + first[0]).abs().maxCoeff(), 0, 1e-12) << "as many beats in both";
  EXPECT_EQ(index_of(basis_of({{}, {flights[0]}}), "flight low"), -1);
}

TEST(RegimeBasis, LeavesOutWhatNeverChanges) {
  auto flight = std::make_shared<SyntheticFlight>("hover", 1, synthetic_law);
  flight->velocity.setConstant(0.3);
  const RegimeBasis basis = basis_of({{}, {flight}});
  EXPECT_EQ(index_of(basis, "velocity_x"), -1);
  EXPECT_EQ(index_of(basis, "amplitude amplitude"), -1) << "no product where a factor never changes";
  EXPECT_EQ(basis.size(), 4);
}

// A change of all flights, written with functions of the tests alone, is the same change there and none in the references.
TEST(RegimeBasis, HasFunctionsOfTheTestsAgain) {
  const auto made = synthetic_flights(4, synthetic_law);
  const RegimeBasis basis = basis_of(as_flights(made, 2));
  // constant, four functions, offsets of the second reference and the second test, two products; all but the offsets again
  ASSERT_EQ(basis.size(), 9 + 7);
  ASSERT_TRUE(basis.of_tests(basis.size() - 1));
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd change(1, basis.size());
  for (int i = 0; i < basis.size(); ++i) change(0, i) = normal(random);
  const Eigen::MatrixXd in_tests = basis.in_tests(change);
  for (std::size_t f = 0; f < 4; ++f) {
    const Eigen::VectorXd all = basis.values(f) * change.transpose(), part = basis.values(f) * in_tests.transpose();
    EXPECT_LT((part - (f < 2 ? 0.0 : 1.0) * all).cwiseAbs().maxCoeff(), 1e-12) << f;
  }
  // and back again, but for the offsets of flights
  for (int i = 0; i < basis.size(); ++i)
    if (basis.kind(i) == BasisFunction::flight || basis.of_tests(i)) change(0, i) = 0;
  EXPECT_LT((basis.in_all(basis.in_tests(change)) - change).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_FALSE(basis_of(as_flights(made, 4)).of_tests(8)) << "nothing to compare with";
}

// A reference flight, put in the place of the tests, has each function a second time, and no offset.
TEST(RegimeBasis, PutsReferencesInThePlaceOfTests) {
  const auto made = synthetic_flights(4, synthetic_law);
  const RegimeBasis basis = basis_of(as_flights(made, 2));
  const Eigen::MatrixXd there = basis.values(1) * basis.without_offsets(true),
                        stays = basis.values(1) * basis.without_offsets(false);
  int again = 0;
  while (!basis.of_tests(again)) ++again;
  for (int i = 0; !basis.of_tests(i); ++i) {
    if (basis.kind(i) == BasisFunction::flight) {
      EXPECT_EQ(there.col(i).norm() + stays.col(i).norm(), 0) << basis.name(i);
      continue;
    }
    EXPECT_EQ(there.col(i), basis.values(1).col(i)) << basis.name(i);
    EXPECT_EQ(there.col(again), basis.values(1).col(i)) << basis.name(i);
    EXPECT_EQ(stays.col(i), basis.values(1).col(i)) << basis.name(i);
    EXPECT_EQ(stays.col(again), 0 * stays.col(i)) << basis.name(i);
    ++again;
  }
  EXPECT_EQ(again, basis.size());
}

TEST(RegimeBasis, SaysWhatReferencesDoNotVisit) {
  const auto made = synthetic_flights(4, synthetic_law);
  EXPECT_TRUE(basis_of(as_flights(made, 2)).covers_all());
  for (std::size_t f : {0, 1}) made[f]->velocity *= 0.1;
  const RegimeBasis calm = basis_of(as_flights(made, 2));
  EXPECT_FALSE(calm.covers(Regimes::velocity));
  EXPECT_TRUE(calm.covers(Regimes::inputs) && calm.covers(Regimes::place) && calm.covers(Regimes::always));
  for (std::size_t f : {2, 3}) made[f]->velocity *= 0.1;
  EXPECT_TRUE(basis_of(as_flights(made, 2)).covers_all()) << "as calm as the tests";
}

}  // namespace
}  // namespace flappy::gap::regime_basis_test
