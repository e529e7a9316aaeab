#include "benchmark/predict/baselines.hpp"

#include <algorithm>
#include <cmath>

#include "gap/evidence/screening.hpp"

namespace flappy::benchmark {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// largest_residual names an effect if the largest residual is at least this, in units of the noise.
constexpr double kStandsOut = 2;
/// Thresholds to choose from: least rms contribution of a column, in units of the noise.
constexpr double kThresholds[] = {0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1};
constexpr int kRounds = 10;
constexpr double kRidge = 1e-6;

/// Sums of squares of rows by group, in units of the noise variance, and the number of rows.
struct Energy {
  std::vector<double> sum = std::vector<double>(gap::kGroups, 0), rows = std::vector<double>(gap::kGroups, 0);
  double rms(std::size_t g) const { return rows[g] > 0 ? std::sqrt(sum[g] / rows[g]) : 0; }
};

template <class Use>
void for_rows(const gap::Flights& flights, const std::vector<double>& noise_sd, std::size_t f, const Use& use) {
  for (std::size_t j = 0; j < flights[f]->beats(); ++j)
    for (int g = 0; g < gap::kGroups; ++g) {
      const auto k = static_cast<std::size_t>(g);
      if (!flights[f]->has_rows(g / gap::kCoefficients, g % gap::kCoefficients) || !(noise_sd[k] > 0) ||
          !flights[f]->covers(j, g / gap::kCoefficients))
        continue;
      use(k, j * gap::kRowsPerBeat + k);
    }
}

Energy energy(const gap::Flights& flights, const std::vector<double>& noise_sd, const gap::Residuals& s) {
  Energy e;
  for (std::size_t f = 0; f < flights.size(); ++f)
    for_rows(flights, noise_sd, f, [&](std::size_t g, std::size_t row) {
      const double x = s[f][row] / noise_sd[g];
      e.sum[g] += x * x;
      e.rows[g] += 1;
    });
  return e;
}

bool in_contrast(const gap::Flights& flights, const gap::Inference& d) {
  return d.parameters.residual.size() > flights.size();
}

/// Names by their number, the largest first; each name once, without "".
std::vector<std::string> ranked(std::vector<std::pair<double, std::string>> list) {
  std::ranges::stable_sort(list, std::greater{}, &std::pair<double, std::string>::first);
  std::vector<std::string> names;
  for (auto& [figure, name] : list)
    if (!name.empty() && std::ranges::count(names, name) == 0) names.push_back(name);
  return names;
}

Baseline largest_residual(const std::vector<Energy>& columns, const std::vector<std::string>& effects,
                          const Energy& residual) {
  std::size_t largest = 0;
  for (std::size_t g = 0; g < gap::kGroups; ++g)
    if (residual.rms(g) > residual.rms(largest)) largest = g;
  std::vector<std::pair<double, std::string>> shown;
  for (std::size_t k = 0; k < columns.size(); ++k) shown.emplace_back(columns[k].rms(largest), effects[k]);
  Baseline b;
  b.ranking = ranked(std::move(shown));
  if (residual.rms(largest) >= kStandsOut && !b.ranking.empty()) b.named = {b.ranking.front()};
  return b;
}

/// Residual of the parameters alone.
const gap::Residuals& residual_of(const gap::Flights& flights, const gap::Inference& d) {
  return in_contrast(flights, d) ? d.refit : d.parameters.residual;
}

Baseline best_rmse(const gap::Flights& flights, const gap::Inference& d) {
  Baseline b;
  double least = 1e300;
  std::vector<std::pair<double, std::string>> left;
  for (const gap::ScoredHypothesis& a : d.hypotheses) {
    if (!a.fitted()) continue;
    const Energy e = energy(flights, d.noise_sd, in_contrast(flights, d) ? a.held_out : a.fit.residual);
    double sum = 0;
    for (const double s : e.sum) sum += s;
    for (const std::string& name : a.effects) left.emplace_back(-sum, name);
    if (sum < least) least = sum, b.named = a.effects;
  }
  b.ranking = ranked(std::move(left));
  return b;
}

VectorXd solve(const MatrixXd& sums, const std::vector<char>& kept) {
  std::vector<Index> which;
  for (Index k = 0; k + 1 < sums.rows(); ++k)
    if (kept[static_cast<std::size_t>(k)] && sums(k, k) > 0) which.push_back(k);
  VectorXd all = VectorXd::Zero(sums.rows() - 1);
  if (which.empty()) return all;
  const VectorXd size = VectorXd(sums.diagonal()(which)).cwiseSqrt().cwiseInverse();
  MatrixXd normal = size.asDiagonal() * sums(which, which) * size.asDiagonal();
  normal.diagonal().array() += kRidge;
  const VectorXd right = size.asDiagonal() * sums(which, sums.cols() - 1);
  const VectorXd x = size.asDiagonal() * normal.ldlt().solve(right);
  for (std::size_t i = 0; i < which.size(); ++i) all[which[i]] = x[static_cast<Index>(i)];
  return all;
}

VectorXd threshold(const Regression& r, const MatrixXd& sums, double rows, double least) {
  std::vector<char> kept(r.effects.size(), 1);
  VectorXd x = solve(sums, kept);
  for (int n = 0; n < kRounds; ++n) {
    bool fewer = false;
    for (std::size_t k = 0; k < kept.size(); ++k) {
      const auto i = static_cast<Index>(k);
      if (!kept[k] || r.effects[k].empty() || std::abs(x[i]) * std::sqrt(sums(i, i) / rows) >= least) continue;
      kept[k] = 0;
      fewer = true;
    }
    if (!fewer) break;
    x = solve(sums, kept);
  }
  return x;
}

}  // namespace

Baseline stlsq(const Regression& r) {
  MatrixXd all = MatrixXd::Zero(r.sums.front().rows(), r.sums.front().cols());
  double rows = 0;
  for (std::size_t f = 0; f < r.sums.size(); ++f) all += r.sums[f], rows += r.rows[f];
  double best = kThresholds[0], least = 1e300;
  for (const double t : kThresholds) {
    double left = 0;
    for (std::size_t f = 0; f < r.sums.size(); ++f) {
      const bool alone = r.sums.size() == 1;
      const MatrixXd others = alone ? all : MatrixXd(all - r.sums[f]);
      VectorXd x(all.rows());
      x << -threshold(r, others, alone ? rows : rows - r.rows[f], t), 1;
      left += x.dot(r.sums[f] * x);
    }
    if (left <= least) least = left, best = t;
  }
  const VectorXd x = threshold(r, all, rows, best);
  std::vector<std::pair<double, std::string>> contributions;
  for (std::size_t k = 0; k < r.effects.size(); ++k) {
    const auto i = static_cast<Index>(k);
    if (x[i] != 0) contributions.emplace_back(std::abs(x[i]) * std::sqrt(all(i, i)), r.effects[k]);
  }
  Baseline b;
  b.named = b.ranking = ranked(std::move(contributions));
  return b;
}

std::vector<double> features(const gap::Flights& flights, const gap::Inference& inference) {
  const gap::Residuals& residual = residual_of(flights, inference);
  const Energy whole = energy(flights, inference.noise_sd, residual);
  std::vector<double> list;
  for (std::size_t g = 0; g < gap::kGroups; ++g) list.push_back(std::log1p(whole.rms(g)));
  std::vector<std::vector<gap::RegimeFunction>> functions;
  for (const auto& f : flights) functions.push_back(f->functions());
  const auto count = static_cast<Index>(functions.front().size());
  // sums over beats: of 1, r, r^2; and for each function b, of b, b^2, b r
  MatrixXd own = MatrixXd::Zero(gap::kGroups, 3), sum = MatrixXd::Zero(gap::kGroups, count), square = sum,
           product = sum;
  for (std::size_t f = 0; f < flights.size(); ++f)
    for_rows(flights, inference.noise_sd, f, [&](std::size_t g, std::size_t row) {
      if (g % gap::kCoefficients > 2) return;
      const auto j = static_cast<Index>(row / gap::kRowsPerBeat), i = static_cast<Index>(g);
      const double r = residual[f][row] / inference.noise_sd[g];
      own.row(i) += Eigen::RowVector3d(1, r, r * r);
      for (Index k = 0; k < count; ++k) {
        const double b = functions[f][static_cast<std::size_t>(k)].values[j];
        sum(i, k) += b;
        square(i, k) += b * b;
        product(i, k) += b * r;
      }
    });
  for (Index g = 0; g < gap::kGroups; ++g) {
    if (g % gap::kCoefficients > 2) continue;
    const double n = std::max(own(g, 0), 1.0), spread = own(g, 2) - own(g, 1) * own(g, 1) / n;
    for (Index k = 0; k < count; ++k) {
      const double together = product(g, k) - sum(g, k) * own(g, 1) / n,
                   alone = (square(g, k) - sum(g, k) * sum(g, k) / n) * spread;
      list.push_back(alone > 0 ? std::log1p(std::abs(together) * std::sqrt(n / alone)) : 0);
    }
  }
  return list;
}

std::map<std::string, Baseline> baselines(const gap::Flights& flights, const sim::Randomisation& uncertain,
                                          const gap::Inference& inference, const std::vector<std::string>& withheld,
                                          int threads) {
  const gap::Hypothesis no_effects(uncertain, {});
  const VectorXd at = inference.parameters.at;
  Regression r;
  std::vector<gap::VehicleHypothesis> vehicles;
  std::vector<std::string> effects;
  for (Index i = 0; i < no_effects.size(); ++i) {
    VectorXd there = at;
    there[i] += gap::kMagnitudeReach;
    vehicles.push_back(no_effects.vehicle(there));
    effects.emplace_back();
  }
  for (gap::MagnitudeStep& s : gap::magnitude_steps(uncertain, at, withheld)) {
    vehicles.push_back(std::move(s.vehicle));
    effects.push_back(std::move(s.effect));
  }
  std::vector<gap::Residuals> rows = residuals(flights, vehicles, threads);
  const gap::Residuals& residual = residual_of(flights, inference);
  // the references' residuals come first
  const gap::Residuals here(inference.parameters.residual.end() - static_cast<std::ptrdiff_t>(flights.size()),
                            inference.parameters.residual.end());
  std::vector<gap::Residuals> columns;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    if (rows[k].empty()) continue;
    for (std::size_t f = 0; f < flights.size(); ++f)
      for (std::size_t i = 0; i < rows[k][f].size(); ++i)
        rows[k][f][i] = (here[f][i] - rows[k][f][i]) / gap::kMagnitudeReach;
    columns.push_back(std::move(rows[k]));
    r.effects.push_back(effects[k]);
  }
  const auto n = static_cast<Index>(columns.size());
  for (std::size_t f = 0; f < flights.size(); ++f) {
    constexpr Index kTogether = 512;
    MatrixXd some(kTogether, n + 1), sums = MatrixXd::Zero(n + 1, n + 1);
    Index filled = 0;
    double count = 0;
    const auto empty = [&] {
      sums.noalias() += some.topRows(filled).transpose() * some.topRows(filled);
      count += static_cast<double>(filled);
      filled = 0;
    };
    for_rows(flights, inference.noise_sd, f, [&](std::size_t g, std::size_t row) {
      for (Index k = 0; k < n; ++k)
        some(filled, k) = columns[static_cast<std::size_t>(k)][f][row] / inference.noise_sd[g];
      some(filled, n) = residual[f][row] / inference.noise_sd[g];
      if (++filled == kTogether) empty();
    });
    empty();
    r.sums.push_back(std::move(sums));
    r.rows.push_back(count);
  }
  std::vector<Energy> shown;
  for (const gap::Residuals& c : columns) shown.push_back(energy(flights, inference.noise_sd, c));
  return {{"largest_residual", largest_residual(shown, r.effects, energy(flights, inference.noise_sd, residual))},
          {"best_rmse", best_rmse(flights, inference)},
          {"stlsq", stlsq(r)}};
}

}  // namespace flappy::benchmark
