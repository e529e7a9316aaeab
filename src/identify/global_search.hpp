// pagmo's genetic algorithm and CMA-ES with one batch of evaluations per generation. pagmo 2.18 evaluates one point at
// a time, although a generation's points do not depend on its own fitness. So each generation is evolved twice from the
// same state: first to collect its points, then with their costs.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

namespace flappy::identify {

using Point = std::vector<double>;
/// Costs of several points of the unit cube; lower is better.
using BatchCost = std::function<std::vector<double>(const std::vector<Point>&)>;

enum class Search { genetic, cma_es };

struct SearchOptions {
  unsigned population = 200, generations = 200;
  std::uint64_t seed = 1;
};

struct SearchResult {
  Point point;
  double cost = 0;
  std::size_t evaluations = 0;
  unsigned generations = 0;
};

/// Searches the unit cube; `start` is in the first generation. `more`: called after each one; false ends the search.
SearchResult search(Search method, const BatchCost& cost, const Point& start, const SearchOptions& options,
                    const std::function<bool(const SearchResult&)>& more = {});

}  // namespace flappy::identify
