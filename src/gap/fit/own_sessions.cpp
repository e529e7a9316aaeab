#include "gap/fit/own_sessions.hpp"

#include <algorithm>
#include <cmath>

#include "gap/replay/session_names.hpp"

namespace flappy::gap {
namespace {

using Eigen::Index;

/// Flights of each session of the references, [session][flight].
std::vector<std::vector<char>> sessions_of(const Flights& flights) {
  const std::vector<int> of = session_numbers(session_names(flights.references));
  std::vector<std::vector<char>> sessions(static_cast<std::size_t>(std::ranges::max(of)) + 1,
                                          std::vector<char>(flights.size(), 0));
  for (std::size_t f = 0; f < of.size(); ++f) sessions[static_cast<std::size_t>(of[f])][f] = 1;
  return sessions;
}

/// `effect`: index in Fitter::effects(); -1: none.
bool between_sessions(const Fitter& fitter, int effect) {
  return effect >= 0 && fitter.effects()[static_cast<std::size_t>(effect)].starts_with(kSessionOf);
}

/// The columns of a contrast for one among references: those of changes between sessions act in the tests alone, all
/// others in all flights.
std::vector<BasisCoefficients> columns_among_references(const Fitter& fitter, const Regressors& regressors) {
  std::vector<BasisCoefficients> columns;
  for (std::size_t k = 0; k < regressors.columns.size(); ++k) {
    columns.push_back(*regressors.columns[k]);
    for (int i = 0; i < fitter.evidence().basis().size(); ++i)
      if (fitter.evidence().basis().of_tests(i) != between_sessions(fitter, regressors.effects[k]))
        columns.back().col(i).setZero();
  }
  return columns;
}

}  // namespace

std::optional<OwnSessions> own_sessions(const Fitter& fitter, const Fit& parameters) {
  const std::vector<std::vector<char>> sessions = sessions_of(fitter.flights());
  if (sessions.size() < 2) return std::nullopt;
  const Evidence& evidence = fitter.evidence();
  Regressors regressors = fitter.unscaled_regressors(parameters);
  const std::vector<BasisCoefficients> columns = columns_among_references(fitter, regressors);
  for (std::size_t k = 0; k < columns.size(); ++k) regressors.columns[k] = &columns[k];
  std::vector<char> use(fitter.flights().size(), 0);
  std::fill_n(use.begin(), fitter.flights().references.size(), 1);

  OwnSessions own{static_cast<double>(sessions.size()), 0, std::vector<double>(kBlocks, 0),
                  std::vector<double>(kBlocks, 0)};
  Scales start;
  for (const std::vector<char>& tests : sessions) {
    SufficientStatistics statistics = parameters.statistics;
    const Evidence among = evidence.with_tests(tests, statistics);
    const ScaledEvidence w = among.weigh(statistics, regressors, use, {}, start);
    start = w.scales;
    own.mean_log_scale += std::log(w.scales.session) / own.count;
    for (std::size_t k = 0; k < columns.size(); ++k) {
      if (!between_sessions(fitter, regressors.effects[k])) continue;
      const auto e = static_cast<std::size_t>(regressors.effects[k]);
      const auto i = static_cast<Index>(k);
      auto& [squares, known] = own.magnitudes[fitter.effects()[e]];
      squares += std::pow(w.scales.effects[e] * w.posterior.mean[i], 2);
      known += 1 - std::min(1.0, w.posterior.covariance(i, i));
    }
    for (int g = 0; g < kGroups; ++g)
      for (int i = 0; i < evidence.basis().size(); ++i) {
        if (!evidence.basis().of_tests(i) || w.squares(g, i) == 0) continue;  // no rows
        const auto b = static_cast<std::size_t>(evidence.block_of(g, i));
        const double variance = std::pow(w.scales.blocks[b], 2);
        const double square = std::pow(w.delta(g, i), 2) * variance;
        own.squares[b] += square / std::pow(w.scales.session, 2);
        // how much of the prior variance the flights take away (MacKay, Neural Computation 4, 1992)
        own.known[b] += 1 - std::min(1.0, (w.squares(g, i) - square) / variance);
      }
  }
  return own;
}

}  // namespace flappy::gap
