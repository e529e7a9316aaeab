// pagmo's genetic algorithm and CMA-ES, a generation at a call: pagmo 2.18 asks these two for one fitness at a time, yet what
// they try in a generation depends on no fitness of that generation. So each generation is evolved twice from the same
// state: once to hear what it tries, and, when that has been evaluated as one batch, once more with the answers.
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

/// Searches the unit cube of `start`'s dimension; `start` is one of the first generation. `more`: asked after each
/// generation, false ends the search.
SearchResult search(Search method, const BatchCost& cost, const Point& start, const SearchOptions& options,
                    const std::function<bool(const SearchResult&)>& more = {});

}  // namespace flappy::identify
