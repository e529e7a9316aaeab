// A generation against pagmo's own, and with an objective that does not vary.
#include "design/nsga2.hpp"

#include <gtest/gtest.h>

#include <pagmo/algorithm.hpp>
#include <pagmo/algorithms/nsga2.hpp>
#include <pagmo/batch_evaluators/member_bfe.hpp>
#include <pagmo/bfe.hpp>
#include <pagmo/population.hpp>
#include <pagmo/problem.hpp>
#include <random>

namespace flappy::design {
namespace {

constexpr std::size_t kFew = 24, kVariables = 4;

/// Three objectives in conflict; a part of the cube is refused, with the same objectives everywhere.
std::vector<double> objectives_at(const std::vector<double>& x) {
  if (x[2] > 0.8) return {20, 20, 20};
  const double far = 1 + x[2] + x[3];
  return {x[0] * far, (1 - x[0]) * far, far * (1 - x[0] * x[1])};
}

struct Conflict {
  std::vector<double> fitness(const std::vector<double>& x) const { return objectives_at(x); }
  std::vector<double> batch_fitness(const std::vector<double>& all) const {
    std::vector<double> list;
    for (auto at = all.begin(); at != all.end(); at += kVariables)
      for (const double f : objectives_at({at, at + kVariables})) list.push_back(f);
    return list;
  }
  std::vector<double>::size_type get_nobj() const { return 3; }
  std::pair<std::vector<double>, std::vector<double>> get_bounds() const {
    return {std::vector<double>(kVariables, 0), std::vector<double>(kVariables, 1)};
  }
};

struct Evolved {
  Points points, objectives;

  void put(const Points& more) {
    for (const std::vector<double>& x : more) points.push_back(x), objectives.push_back(objectives_at(x));
  }
  void next(unsigned seed) {
    Evolved all = *this;
    all.put(children_of(points, objectives, seed));
    points.clear(), objectives.clear();
    for (const std::size_t i : best_of(all.objectives, kFew)) put({all.points[i]});
  }
};

Evolved drawn() {
  std::mt19937 random(3);
  std::uniform_real_distribution<> uniform;
  Evolved g;
  for (std::size_t i = 0; i < kFew; ++i) g.put({{uniform(random), uniform(random), uniform(random), uniform(random)}});
  return g;
}

TEST(Nsga2, IsThatOfPagmoWhereAllObjectivesVary) {
  Evolved ours = drawn();
  pagmo::population theirs(pagmo::problem(Conflict{}), 0, 1U);
  for (std::size_t i = 0; i < kFew; ++i) theirs.push_back(ours.points[i], ours.objectives[i]);
  for (unsigned seed = 1; seed < 30; ++seed) {
    pagmo::nsga2 nsga2(1, 0.9, 10, 1.0 / kVariables, 20, seed);
    nsga2.set_bfe(pagmo::bfe(pagmo::member_bfe{}));
    theirs = pagmo::algorithm(nsga2).evolve(theirs);
    ours.next(seed);
    ASSERT_EQ(ours.points, theirs.get_x()) << seed;
  }
}

TEST(Nsga2, LeavesOutAnObjectiveThatDoesNotVary) {
  Evolved g = drawn();
  for (unsigned seed = 1; seed < 30; ++seed) {
    Points without = g.objectives, with;
    for (std::vector<double>& f : without) f.pop_back();
    for (const std::vector<double>& f : without) with.push_back({f[0], 0.25, f[1]});
    ASSERT_EQ(children_of(g.points, with, seed), children_of(g.points, without, seed)) << seed;
    ASSERT_EQ(best_of(with, 10), best_of(without, 10)) << seed;
    g.next(seed);
  }
}

}  // namespace
}  // namespace flappy::design
