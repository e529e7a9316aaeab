#include "lab/benchmark/predict/rivals.hpp"

#include <algorithm>
#include <array>
#include <boost/math/distributions/fisher_f.hpp>
#include <functional>

namespace flappy::benchmark {
namespace {

/// Sums of squares of each group of rows, in units of the noise variance.
std::vector<double> energies(const gap::FlightList& flights, const std::vector<double>& noise_sd,
                             const gap::Residuals& residual) {
  std::vector<double> sums(gap::kGroups, 0);
  for (std::size_t f = 0; f < flights.size(); ++f)
    for (std::size_t j = 0; j < flights[f]->beats(); ++j)
      for (int g = 0; g < gap::kGroups; ++g) {
        const auto k = static_cast<std::size_t>(g);
        const int channel = gap::channel_of(g);
        if (flights[f]->clamped() != gap::of_bench(g) || !flights[f]->has_rows(channel, g % gap::kCoefficients) ||
            !(noise_sd[k] > 0) || !flights[f]->covers(j, channel))
          continue;
        const double x = residual[f][j * gap::kRowsPerBeat + static_cast<std::size_t>(gap::column_of(g))] / noise_sd[k];
        sums[k] += x * x;
      }
  return sums;
}

/// What the parameters alone leave: like the residuals of hypotheses, of flights held out in a contrast, else of the fit.
const gap::TestResiduals& before_effects(const gap::Flights& flights, const gap::Inference& d) {
  return flights.references.empty() ? d.parameters.residual : d.refit;
}

/// Ranks effects by what `left` says of the hypothesis that has them, against `before` of the parameters alone.
Rival least(const gap::Flights& flights, const gap::Inference& d,
            const std::function<double(const std::vector<double>& energies)>& left) {
  const bool contrast = !flights.references.empty();
  const double before = left(energies(flights.tests, d.noise_sd, before_effects(flights, d)));
  std::vector<std::pair<double, std::vector<std::string>>> hypotheses;
  for (const gap::ScoredHypothesis& a : d.hypotheses)
    if (a.fitted())
      hypotheses.emplace_back(left(energies(flights.tests, d.noise_sd, contrast ? a.held_out : a.fit.residual)),
                              a.effects);
  std::ranges::stable_sort(hypotheses, {}, [](const auto& h) { return h.first; });
  Rival r;
  for (const auto& [sum, effects] : hypotheses)
    for (const std::string& e : effects)
      if (std::ranges::count(r.ranking, e) == 0) r.ranking.push_back(e);
  if (hypotheses.empty() || !(before > 0)) return r;
  r.named = hypotheses.front().second;
  r.strength = (before - hypotheses.front().first) / before;
  return r;
}

/// Means of the four inputs of the wing beat over a flight; none: the log has no such inputs.
std::optional<Eigen::Vector4d> mean_inputs(const gap::PredictedFlight& flight) {
  const gap::Recording* recording = flight.recording();
  if (!recording || !recording->log.command.inputs) return std::nullopt;
  const flightlog::BeatInputs& u = *recording->log.command.inputs;
  const auto mean = [](const flightlog::Column& x) {
    return Eigen::Map<const Eigen::VectorXd>(x.data(), static_cast<Eigen::Index>(x.size())).mean();
  };
  return Eigen::Vector4d(mean(u.amplitude_V), mean(u.difference_V), mean(u.bias_V), mean(u.split_cycle));
}

}  // namespace

Rival best_rmse(const gap::Flights& flights, const gap::Inference& d) {
  return least(flights, d, [](const std::vector<double>& of) {
    double all = 0;
    for (const double x : of) all += x;
    return all;
  });
}

Rival largest_residual(const gap::Flights& flights, const gap::Inference& d) {
  const std::vector<double> before = energies(flights.tests, d.noise_sd, before_effects(flights, d));
  const auto largest = static_cast<std::size_t>(std::ranges::max_element(before) - before.begin());
  return least(flights, d, [&](const std::vector<double>& of) { return of[largest]; });
}

double hotelling_strength(const Eigen::MatrixX4d& references, const Eigen::MatrixX4d& tests) {
  constexpr Eigen::Index kInputs = 4;
  const Eigen::Index n1 = references.rows(), n2 = tests.rows(), freedom = n1 + n2 - 2, left = freedom - kInputs + 1;
  if (n1 == 0 || n2 == 0 || left < 1) return 0;
  Eigen::Matrix4d pooled = Eigen::Matrix4d::Zero();
  for (const Eigen::MatrixX4d* m : {&references, &tests}) {
    const Eigen::MatrixX4d off = m->rowwise() - m->colwise().mean();
    pooled += off.transpose() * off / static_cast<double>(freedom);
  }
  const Eigen::Vector4d change = (tests.colwise().mean() - references.colwise().mean()).transpose();
  const double t2 =
      static_cast<double>(n1 * n2) / static_cast<double>(n1 + n2) * change.dot(pooled.ldlt().solve(change));
  const double f = t2 * static_cast<double>(left) / static_cast<double>(freedom * kInputs);
  if (!(f >= 0)) return 0;
  return boost::math::cdf(boost::math::fisher_f(double{kInputs}, static_cast<double>(left)), f);
}

Rival hotelling(const gap::Flights& flights) {
  std::array<Eigen::MatrixX4d, 2> means;  // references, tests
  for (const auto& [list, of] : {std::pair{&flights.references, &means[0]}, {&flights.tests, &means[1]}})
    for (const auto& flight : *list)
      if (const auto mean = mean_inputs(*flight)) {
        of->conservativeResize(of->rows() + 1, Eigen::NoChange);
        of->row(of->rows() - 1) = mean->transpose();
      }
  Rival r;
  r.strength = hotelling_strength(means[0], means[1]);
  if (r.strength > 0) r.named = {kSomething};
  return r;
}

}  // namespace flappy::benchmark
