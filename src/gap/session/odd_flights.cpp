#include "gap/session/odd_flights.hpp"

#include <algorithm>
#include <cmath>

namespace flappy::gap {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// A flight is odd beyond this many standard deviations. Choice: flights of a set are many, and so are quantities.
constexpr double kOdd = 5;

}  // namespace

std::vector<OddFlight> odd_flights(const std::vector<std::string>& names, const std::vector<FlightQuantities>& flights,
                                   const SessionScatter& scatter, const SessionPrior& prior) {
  std::vector<OddFlight> odd;
  if (flights.size() < 3) return odd;
  for (std::size_t f = 0; f < flights.size(); ++f) {
    std::vector<int> of(flights.size(), 0);  // the others are session 0, the flight is 1
    of[f] = 1;
    const SessionValues mean = session_values(flights, of, prior);
    OddFlight most{names[f], "", 0, {}, {}};
    for (Index q = 0; q < scatter.variance().size(); ++q) {
      const double n = static_cast<double>(flights.size() - 1);
      double square = scatter.freedom() * scatter.variance()[q];  // of sessions, and of the others of the set
      for (std::size_t g = 0; g < flights.size(); ++g)
        if (g != f) square += std::pow(flights[g].values()[q] - mean.values(0, q), 2);
      const double sd = std::sqrt(square / (scatter.freedom() + n - 1) * (1 + 1 / n) +
                                  std::max(flights[f].variances()[q] - scatter.noise()[q], 0.0));
      const double times = (flights[f].values()[q] - mean.values(0, q)) / sd;
      if (std::abs(times) > std::abs(most.times))
        most.times = times, most.quantity = scatter.quantities()[static_cast<std::size_t>(q)].name;
    }
    if (std::abs(most.times) > kOdd) odd.push_back(std::move(most));
  }
  std::ranges::stable_sort(odd, std::greater{}, [](const OddFlight& o) { return std::abs(o.times); });
  return odd;
}

std::optional<StepWithin> step_within(const PredictedFlight& flight, const VehicleHypothesis& robot,
                                      const CommonTrend& trend) {
  std::optional<StepWithin> clearest;
  for (const FlightSeries& series : flight_series(flight, robot, trend)) {
    const Index n = series.values.size(), least = std::max<Index>(3, n / 10);
    if (n < 2 * least) continue;
    VectorXd sums = VectorXd::Zero(n + 1), squares = VectorXd::Zero(n + 1);
    for (Index j = 0; j < n; ++j) {
      sums[j + 1] = sums[j] + series.values[j];
      squares[j + 1] = squares[j] + series.values[j] * series.values[j];
    }
    Index at = -1;
    double most = 0;
    for (Index k = least; k <= n - least; ++k) {
      const double a = static_cast<double>(k), b = static_cast<double>(n - k);
      const double between = std::pow(sums[k] / a - (sums[n] - sums[k]) / b, 2) * a * b / static_cast<double>(n);
      if (between > most) most = between, at = k;
    }
    if (at < 0) continue;
    const double a = static_cast<double>(at), b = static_cast<double>(n - at);
    const double first = sums[at] / a, second = (sums[n] - sums[at]) / b;
    double square = 0, product = 0, before = 0;
    for (Index j = 0; j < n; ++j) {
      const double rest = series.values[j] - (j < at ? first : second);
      square += rest * rest;
      if (j > 0) product += rest * before;
      before = rest;
    }
    const double past = std::clamp(product / std::max(square, 1e-30), 0.0, 0.95);
    const double variance = square / std::max(static_cast<double>(n) - 2, 1.0) * (1 + past) / (1 - past);
    const double times = std::abs(second - first) / std::sqrt(std::max(variance, 1e-18) * (1 / a + 1 / b));
    if (!clearest || times > clearest->times) clearest = {series.quantity, series.time_s[at], second - first, times};
  }
  return clearest;
}

}  // namespace flappy::gap
