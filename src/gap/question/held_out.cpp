#include "gap/question/held_out.hpp"

#include <algorithm>

namespace flappy::gap {

std::vector<std::vector<char>> others_of(const Flights& flights, const std::vector<int>& fold) {
  const auto folds = static_cast<std::size_t>(*std::ranges::max_element(fold)) + 1;
  const std::size_t first = flights.references.size();
  std::vector<std::vector<char>> others(folds, std::vector<char>(flights.size(), 1));
  for (std::size_t k = 0; folds > 1 && k < folds; ++k)
    for (std::size_t f = 0; f < fold.size(); ++f) others[k][first + f] = fold[f] != static_cast<int>(k) ? 1 : 0;
  return others;
}

std::vector<TestResiduals> held_out_by_simulation(const Fitter& fitter, const Flights& flights,
                                                  const std::vector<FittedHypothesis>& fits,
                                                  const std::vector<int>& fold, bool less_nuisances, int threads) {
  const std::vector<std::vector<char>> others = others_of(flights, fold);
  std::vector<VehicleHypothesis> vehicles;
  std::vector<BasisCoefficients> nuisances;
  for (const FittedHypothesis& fit : fits)
    for (const std::vector<char>& use : others) {
      Fitter::JointFit joint = fitter.joint_fit(fit.hypothesis, *fit.fit, use);
      vehicles.push_back(fit.hypothesis.vehicle(joint.at));
      nuisances.push_back(std::move(joint.nuisances));
    }
  std::vector<Residuals> rows = residuals(flights, vehicles, threads);
  std::vector<TestResiduals> rest(fits.size(), TestResiduals(fold.size()));
  for (std::size_t i = 0; i < fits.size(); ++i)
    for (std::size_t f = 0; f < fold.size(); ++f) {
      const std::size_t k = i * others.size() + static_cast<std::size_t>(fold[f]);
      if (rows[k].empty()) continue;
      rest[i][f] =
          less_nuisances ? fitter.evidence().without(f, std::move(rows[k][f]), nuisances[k]) : std::move(rows[k][f]);
    }
  return rest;
}

}  // namespace flappy::gap
