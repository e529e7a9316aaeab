#include "identify/global_search.hpp"

#include <pagmo/algorithm.hpp>
#include <pagmo/algorithms/cmaes.hpp>
#include <pagmo/algorithms/sga.hpp>
#include <pagmo/batch_evaluators/member_bfe.hpp>
#include <pagmo/bfe.hpp>
#include <pagmo/population.hpp>
#include <pagmo/problem.hpp>
#include <stdexcept>
#include <utility>

namespace flappy::identify {
namespace {

/// Points that pagmo asks for, and the costs it gets. Shared by all copies of the problem that pagmo makes.
struct Exchange {
  BatchCost cost;
  bool answering = false;
  std::vector<Point> asked;
  std::vector<double> answers;
  std::size_t next = 0, evaluations = 0;

  std::vector<double> evaluate(const std::vector<Point>& points) {
    evaluations += points.size();
    return cost(points);
  }
};

struct Exchanged {
  Exchange* exchange = nullptr;
  std::size_t dimensions = 0;

  Point fitness(const Point& x) const {
    Exchange& e = *exchange;
    if (!e.answering) {
      e.asked.push_back(x);
      return {0};
    }
    if (e.next >= e.asked.size() || e.asked[e.next] != x)
      throw std::logic_error("a generation tried other points when it was evolved again");
    return {e.answers[e.next++]};
  }
  Point batch_fitness(const Point& all) const {
    std::vector<Point> points;
    const auto d = static_cast<std::ptrdiff_t>(dimensions);
    for (auto at = all.begin(); at != all.end(); at += d) points.emplace_back(at, at + d);
    return exchange->evaluate(points);
  }
  std::pair<Point, Point> get_bounds() const { return {Point(dimensions, 0.0), Point(dimensions, 1.0)}; }
};

pagmo::algorithm algorithm_of(Search method, unsigned seed) {
  if (method == Search::cma_es) {
    constexpr double kFirstStep = 0.2;  // initial step, as a share of the range
    return pagmo::algorithm(pagmo::cmaes(1, -1, -1, -1, -1, kFirstStep, 0, 0, true, true, seed));
  }
  // Crossover 0.9, offspring near their parents (index 10); mutation 0.08 per gene: about one in twelve genes.
  return pagmo::algorithm(pagmo::sga(1, 0.9, 10, 0.08, 20, 2, "sbx", "polynomial", "tournament", seed));
}

}  // namespace

SearchResult search(Search method, const BatchCost& cost, const Point& start, const SearchOptions& options,
                    const std::function<bool(const SearchResult&)>& more) {
  Exchange exchange;
  exchange.cost = cost;
  const auto seed = static_cast<unsigned>(options.seed);
  const pagmo::problem problem{Exchanged{&exchange, start.size()}};
  pagmo::population population(problem, pagmo::bfe{pagmo::member_bfe{}}, options.population - 1, seed);
  population.push_back(start, exchange.evaluate({start}));
  pagmo::algorithm algorithm = algorithm_of(method, seed);
  SearchResult result;
  bool noted = false;
  const auto note = [&] {
    const auto best = population.best_idx();
    if (!std::exchange(noted, true) || population.get_f()[best][0] < result.cost)
      result.cost = population.get_f()[best][0], result.point = population.get_x()[best];
    result.evaluations = exchange.evaluations;
  };
  note();
  while (result.generations < options.generations) {
    exchange.asked.clear();
    exchange.answering = false;
    (void)pagmo::algorithm(algorithm).evolve(population);
    exchange.answers = exchange.evaluate(exchange.asked);
    exchange.answering = true;
    exchange.next = 0;
    population = algorithm.evolve(population);
    note();
    ++result.generations;
    if (more && !more(result)) break;
  }
  return result;
}

}  // namespace flappy::identify
