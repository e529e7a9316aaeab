#include "lab/benchmark/predict/best_rmse.hpp"

#include <algorithm>

namespace flappy::benchmark {
namespace {

/// Sum of squares of all rows, in units of the noise variance.
double energy(const gap::FlightList& flights, const std::vector<double>& noise_sd, const gap::Residuals& residual) {
  std::vector<double> sums(gap::kGroups, 0);
  for (std::size_t f = 0; f < flights.size(); ++f)
    for (std::size_t j = 0; j < flights[f]->beats(); ++j)
      for (int g = 0; g < gap::kGroups; ++g) {
        const auto k = static_cast<std::size_t>(g);
        if (!flights[f]->has_rows(g / gap::kCoefficients, g % gap::kCoefficients) || !(noise_sd[k] > 0) ||
            !flights[f]->covers(j, g / gap::kCoefficients))
          continue;
        const double x = residual[f][j * gap::kRowsPerBeat + k] / noise_sd[k];
        sums[k] += x * x;
      }
  double all = 0;
  for (const double s : sums) all += s;
  return all;
}

}  // namespace

Baseline best_rmse(const gap::Flights& flights, const gap::Inference& d) {
  const bool contrast = !flights.references.empty();
  std::vector<std::pair<double, std::vector<std::string>>> left;
  for (const gap::ScoredHypothesis& a : d.hypotheses)
    if (a.fitted())
      left.emplace_back(energy(flights.tests, d.noise_sd, contrast ? a.held_out : a.fit.residual), a.effects);
  std::ranges::stable_sort(left, {}, [](const auto& h) { return h.first; });
  Baseline b;
  for (const auto& [sum, effects] : left)
    for (const std::string& e : effects)
      if (std::ranges::count(b.ranking, e) == 0) b.ranking.push_back(e);
  if (!left.empty()) b.named = left.front().second;
  return b;
}

}  // namespace flappy::benchmark
