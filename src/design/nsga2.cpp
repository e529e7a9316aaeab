#include "design/nsga2.hpp"

#include <algorithm>
#include <limits>
#include <numeric>
#include <pagmo/utils/genetic_operators.hpp>
#include <pagmo/utils/multi_objective.hpp>
#include <random>

namespace flappy::design {
namespace {

constexpr double kCrossover = 0.9, kCrossoverIndex = 10, kMutationIndex = 20;  // Deb's, for real variables

/// The points of a front, with the objectives that vary in it: none or two at least, as no point beats another. Where
/// none varies, all points are alike and any order will do, so they stay as they are.
Points varying(const Points& objectives, const std::vector<std::size_t>& front) {
  Points all, kept(front.size());
  for (const std::size_t i : front) all.push_back(objectives[i]);
  for (std::size_t k = 0; k < all[0].size(); ++k) {
    if (std::ranges::all_of(all, [&](const std::vector<double>& f) { return f[k] == all[0][k]; })) continue;
    for (std::size_t i = 0; i < all.size(); ++i) kept[i].push_back(all[i][k]);
  }
  return kept[0].empty() ? all : kept;
}

}  // namespace

Points children_of(const Points& parents, const Points& objectives, unsigned seed) {
  const std::size_t n = parents.size(), variables = parents[0].size();
  const auto [fronts, beaten, beaten_by, rank] = pagmo::fast_non_dominated_sorting(objectives);
  std::vector<double> room(n, std::numeric_limits<double>::infinity());
  for (const std::vector<std::size_t>& front : fronts) {
    if (front.size() < 3) continue;
    const std::vector<double> distance = pagmo::crowding_distance(varying(objectives, front));
    for (std::size_t i = 0; i < front.size(); ++i) room[front[i]] = distance[i];
  }
  std::mt19937 random(seed);
  const auto better = [&, &rank = rank](std::size_t a, std::size_t b) -> const std::vector<double>& {
    if (rank[a] != rank[b]) return parents[rank[a] < rank[b] ? a : b];
    if (room[a] > room[b]) return parents[a];
    if (room[a] < room[b]) return parents[b];
    return parents[std::uniform_real_distribution<>(0, 1)(random) < 0.5 ? a : b];
  };
  std::vector<std::size_t> orders[2];
  for (std::vector<std::size_t>& order : orders) {
    order.resize(n);
    std::iota(order.begin(), order.end(), 0U);
    std::shuffle(order.begin(), order.end(), random);
  }
  const std::pair<std::vector<double>, std::vector<double>> cube{std::vector<double>(variables, 0),
                                                                 std::vector<double>(variables, 1)};
  const double mutation = 1.0 / static_cast<double>(variables);
  Points children;
  for (std::size_t i = 0; i < n; i += 4)
    for (const std::vector<std::size_t>& order : orders) {
      const std::vector<double>& one = better(order[i], order[i + 1]);
      const std::vector<double>& other = better(order[i + 2], order[i + 3]);
      auto [a, b] = pagmo::sbx_crossover(one, other, cube, 0, kCrossover, kCrossoverIndex, random);
      pagmo::polynomial_mutation(a, cube, 0, mutation, kMutationIndex, random);
      pagmo::polynomial_mutation(b, cube, 0, mutation, kMutationIndex, random);
      children.push_back(std::move(a));
      children.push_back(std::move(b));
    }
  return children;
}

std::vector<std::size_t> best_of(const Points& objectives, std::size_t count) {
  std::vector<std::size_t> best;
  const auto sorted = pagmo::fast_non_dominated_sorting(objectives);
  for (const std::vector<std::size_t>& front : std::get<0>(sorted)) {
    if (best.size() + front.size() > count) {
      for (const std::size_t i : pagmo::select_best_N_mo(varying(objectives, front), count - best.size()))
        best.push_back(front[i]);
      break;
    }
    best.insert(best.end(), front.begin(), front.end());
  }
  return best;
}

}  // namespace flappy::design
