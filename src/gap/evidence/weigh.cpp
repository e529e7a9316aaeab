// How far models of this robot are off, found from its flights: a scale of each block of the discrepancy.
//
// Given the scales, theta and delta are normal (evidence.hpp). In units of its sd, d = s D, a group's delta is z:
//   z | theta ~ N(H^-1 d (right - normal change theta), H^-1)      H = 1 + d normal d
// so that the expected squares of delta in a block follow, and with n coefficients in it the scale that makes them most probable,
//   s^2 = (sum E[delta^2] / D^2 + nu f^2) / (n + nu),
// f being the robot's own. What every vehicle has of an entry has a scale alike, about f or about 1 (Tail): a robot, or a maker's, may have much
// of what looks like one entry, and a hypothesis pays for that what log_prior says (Dempster, Laird, Rubin 1977: the log evidence, with what is
// thought of the scales, never falls). The evidence is taken where it is largest: the width of that maximum is the same for every hypothesis, to first order.
#include <cmath>
#include <limits>

#include "gap/evidence/evidence.hpp"
#include "io/parallel.hpp"

namespace flappy::gap {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Nats that another iteration has to bring.
constexpr double kSettled = 0.1;
/// Strides grow so while they succeed.
constexpr double kLonger = 1.5, kLongest = 8;
/// A block that is free is so many times larger than the robot's others, at least.
constexpr double kLeastFree = 2;

/// One group, with all columns.
struct Sums {
  MatrixXd normal, change, all;  ///< basis x basis; basis x columns; normal (change), and the residual's sum
  VectorXd base;                 ///< sd of delta at scale 1
  double squares = 0;            ///< of the residual
};

/// What a group says under given scales.
struct Half {
  VectorXd sd, own;
  Eigen::LLT<MatrixXd> llt;
  MatrixXd half;  ///< L^-1 d all
};

double log_prior(double scale, double robot, double freedom) {
  const double ratio = robot / scale;
  return freedom / 2 * (2 * std::log(ratio) + 1 - ratio * ratio);
}

/// The most probable factor f of a robot: of scales s of nu degrees of freedom, whose nu add up to `freedom` and nu / s^2 to `inverses`.
double robot_of(double freedom, double inverses, double sd) {
  constexpr double kFinest = 0.02;
  double best = 1, most = -std::numeric_limits<double>::infinity();
  for (double log_f = -5; log_f <= 3; log_f += kFinest) {
    const double value = freedom * log_f - std::exp(2 * log_f) * inverses / 2 - 0.5 * std::pow(log_f / sd, 2);
    if (value > most) most = value, best = std::exp(log_f);
  }
  return best;
}

/// From scales on, so many times as far as expectation-maximisation would go, which crawls (Salakhutdinov, Roweis 2003).
Scales strided(const Scales& from, const Scales& to, double stride) {
  const auto go = [&](double a, double b) { return a * std::pow(b / a, stride); };
  Scales s = to;
  s.robot = go(from.robot, to.robot);
  for (std::size_t e = 0; e < s.entries.size(); ++e) s.entries[e] = go(from.entries[e], to.entries[e]);
  for (std::size_t b = 0; b < s.blocks.size(); ++b)
    if (!from.free[b] && !to.free[b]) s.blocks[b] = go(from.blocks[b], to.blocks[b]);
  return s;
}

}  // namespace

int Evidence::block_of(int group, BasisFunction function) {
  const int harmonic = (group % kCoefficients + 1) / 2;
  return (group / kCoefficients * (kHarmonics + 1) + harmonic) * kClasses + static_cast<int>(regimes_of(function));
}

double Evidence::price_of(double times, Tail tail) const {
  return -log_prior(times, scales_.usual(tail), tail.freedom);
}

Weighed Evidence::weigh(const SufficientStatistics& residual, const Columns& columns, const std::vector<char>& use,
                        const BasisCoefficients& own_sd, const Scales& start, std::optional<double> freeing_nats,
                        int iterations) const {
  const Index q = basis_.size(), k = static_cast<Index>(columns.columns.size());
  std::vector<double> nu;
  for (std::size_t b = 0; b < kBlocks; ++b) nu.push_back(discrepancy_.freedom_of(static_cast<Regimes>(b % kClasses)));
  const VectorXd prior_mean = columns.mean();
  std::vector<int> seen;
  for (int g = 0; g < kGroups; ++g)
    for (std::size_t f = 0; f < use.size(); ++f)
      if (use[f] && normal_[f][static_cast<std::size_t>(g)](0, 0) > 0) {
        seen.push_back(g);
        break;
      }
  std::vector<Sums> sums(seen.size());
  std::vector<int> counts(kBlocks, 0);
  for (const int g : seen)
    for (int i = 0; i < basis_.size(); ++i) ++counts[static_cast<std::size_t>(block_of(g, basis_.kind(i)))];
  io::parallel_for(seen.size(), threads_, [&](std::size_t n) {
    Sums& s = sums[n];
    auto [normal, right] = sums_of(residual, use, seen[n]);
    s.normal = std::move(normal);
    s.change.resize(q, k);
    for (Index i = 0; i < k; ++i)
      s.change.col(i) = columns.columns[static_cast<std::size_t>(i)]->row(seen[n]).transpose();
    s.all.resize(q, k + 1);
    s.all.leftCols(k).noalias() = s.normal * s.change;
    s.all.col(k) = right;
    s.base = base_sd(seen[n]);
    s.squares = squares_of(s.normal, right);
  });
  MatrixXd whole = MatrixXd::Zero(k + 1, k + 1);
  for (const Sums& s : sums) {
    whole.topLeftCorner(k, k).noalias() += s.change.transpose() * s.all.leftCols(k);
    whole.row(k).head(k) += s.all.col(k).transpose() * s.change;
    whole(k, k) += s.squares;
  }

  Weighed best;
  best.scales = start;
  if (best.scales.blocks.empty()) best.scales.blocks.assign(kBlocks, 1);
  if (best.scales.free.empty()) best.scales.free.assign(kBlocks, 0);
  best.posterior.log_evidence = -std::numeric_limits<double>::infinity();
  std::vector<int> of_entry;  // how many columns
  std::vector<Tail> tails;
  for (std::size_t i = 0; i < columns.entry.size(); ++i)
    if (columns.entry[i] >= 0) {
      const auto e = static_cast<std::size_t>(columns.entry[i]);
      of_entry.resize(std::max(of_entry.size(), e + 1));
      tails.resize(of_entry.size());
      ++of_entry[e];
      tails[e] = columns.tail[i];
    }
  best.scales.entries.resize(std::max(best.scales.entries.size(), of_entry.size()), 1);
  of_entry.resize(best.scales.entries.size());
  tails.resize(best.scales.entries.size());
  Scales now = best.scales, next = best.scales;
  double stride = 1;
  std::vector<Half> halves(seen.size());
  std::vector<int> chosen(static_cast<std::size_t>(k));
  for (Index i = 0; i < k; ++i) chosen[static_cast<std::size_t>(i)] = static_cast<int>(i);
  for (int iteration = 0; iteration < iterations; ++iteration) {
    io::parallel_for(seen.size(), threads_, [&](std::size_t n) {
      const Sums& s = sums[n];
      Half& h = halves[n];
      h.own = own_sd.size() > 0 ? VectorXd(own_sd.row(seen[n]).transpose()) : VectorXd::Zero(q);
      h.sd.resize(q);
      for (Index i = 0; i < q; ++i) {
        const int block = block_of(seen[n], basis_.kind(static_cast<int>(i)));
        h.sd[i] = std::hypot(now.blocks[static_cast<std::size_t>(block)] * s.base[i], h.own[i]);
      }
      MatrixXd precision = h.sd.asDiagonal() * s.normal * h.sd.asDiagonal();
      precision.diagonal().array() += 1;
      h.llt.compute(precision);
      h.half = h.llt.matrixL().solve(h.sd.asDiagonal() * s.all);
    });
    // columns in units of what is thought of their coefficients
    VectorXd unit = VectorXd::Ones(k + 1);
    for (Index i = 0; i < k; ++i)
      if (const int e = columns.entry[static_cast<std::size_t>(i)]; e >= 0)
        unit[i] = now.entries[static_cast<std::size_t>(e)];
    io::parallel_for(seen.size(), threads_, [&](std::size_t n) { halves[n].half *= unit.asDiagonal(); });
    Reduced reduced{unit.asDiagonal() * whole * unit.asDiagonal(), 0};
    for (const Half& h : halves) {
      reduced.sums.selfadjointView<Eigen::Lower>().rankUpdate(h.half.transpose(), -1);
      reduced.log_scale -= h.llt.matrixLLT().diagonal().array().log().sum();
    }
    reduced.sums = MatrixXd(reduced.sums.selfadjointView<Eigen::Lower>());
    Weighed w{posterior(reduced, chosen, prior_mean), now, 1, BasisCoefficients::Zero(kGroups, q),
              BasisCoefficients::Zero(kGroups, q)};
    double thought = -0.5 * std::pow(std::log(now.robot) / discrepancy_.spread.robot_sd, 2);
    for (std::size_t b = 0; b < kBlocks; ++b)
      if (counts[b] > 0)
        thought += now.free[b] ? -*freeing_nats : held_ ? 0 : log_prior(now.blocks[b], now.robot, nu[b]);
    for (std::size_t e = 0; e < of_entry.size(); ++e)
      if (of_entry[e] > 0 && !held_) thought += log_prior(now.entries[e], now.usual(tails[e]), tails[e].freedom);
    w.posterior.log_evidence += thought;
    const double gain = w.posterior.log_evidence - best.posterior.log_evidence;
    if (!(gain > 0)) {  // too far: from the best on, by a step that cannot fail
      if (stride == 1) break;
      stride = 1;
      now = strided(best.scales, next, stride);
      continue;
    }

    // expected squares of delta, in units of D
    const MatrixXd spread = w.posterior.covariance.llt().matrixL();
    io::parallel_for(seen.size(), threads_, [&](std::size_t n) {
      const Half& h = halves[n];
      const VectorXd z = h.llt.matrixU().solve(h.half.col(k) - h.half.leftCols(k) * w.posterior.mean);
      const MatrixXd inverse = h.llt.matrixU().solve(MatrixXd::Identity(q, q));
      MatrixXd moved;
      if (k > 0)  // neither Eigen's triangular products nor its rows are for matrices without columns
        moved = h.llt.matrixU().solve(h.half.leftCols(k) * spread.triangularView<Eigen::Lower>());
      for (Index i = 0; i < q; ++i) {
        const double d = h.sd[i], shared = d > 0 ? 1 - std::pow(h.own[i] / d, 2) : 0;  // of the discrepancy's own
        const double square =
            d * d * (z[i] * z[i] + inverse.row(i).squaredNorm() + (k > 0 ? moved.row(i).squaredNorm() : 0.0));
        const double own = shared * shared * square + shared * h.own[i] * h.own[i];
        w.delta(seen[n], i) = z[i];
        w.squares(seen[n], i) = sums[n].base[i] > 0 ? own / (sums[n].base[i] * sums[n].base[i]) : 0;
      }
    });
    const VectorXd w_mean = w.posterior.mean, w_variance = w.posterior.covariance.diagonal();
    best = std::move(w);
    if (gain < kSettled || (held_ && !freeing_nats)) break;
    stride = std::min(kLongest, kLonger * stride);
    next = best.scales;
    std::vector<double> total(kBlocks, 0);
    for (const int g : seen)
      for (Index i = 0; i < q; ++i)
        total[static_cast<std::size_t>(block_of(g, basis_.kind(static_cast<int>(i))))] += best.squares(g, i);
    double freedom = 0, inverses = 0;
    if (!held_) {
      std::vector<double> squares(of_entry.size(), 0);
      for (Index i = 0; i < k; ++i)
        if (const int e = columns.entry[static_cast<std::size_t>(i)]; e >= 0)
          squares[static_cast<std::size_t>(e)] += w_mean[i] * w_mean[i] + w_variance[i];
      for (std::size_t e = 0; e < of_entry.size(); ++e) {
        if (of_entry[e] == 0) continue;
        const double nu_e = tails[e].freedom, usual = next.usual(tails[e]);
        const double squares_e = squares[e] * next.entries[e] * next.entries[e];
        next.entries[e] = std::sqrt((squares_e + nu_e * usual * usual) / (of_entry[e] + nu_e));
        if (tails[e].of_model) freedom += nu_e, inverses += nu_e / (next.entries[e] * next.entries[e]);
      }
    }
    for (std::size_t b = 0; b < kBlocks; ++b) {
      if (counts[b] == 0) continue;
      const double n = counts[b], f2 = next.robot * next.robot;
      const double usual2 = held_ ? scales_.blocks[b] * scales_.blocks[b] : (total[b] + nu[b] * f2) / (n + nu[b]);
      next.blocks[b] = std::sqrt(usual2);
      next.free[b] = 0;
      // heavy tails hold whatever models are off by: to be spared their price is no cause
      if (freeing_nats && nu[b] >= discrepancy_.spread.place_freedom) {
        const double free2 = std::max(total[b] / n, kLeastFree * kLeastFree * f2);
        const auto objective = [&](double s2) { return -0.5 * (n * std::log(s2) + total[b] / s2); };
        const double usual = held_ ? 0 : log_prior(std::sqrt(usual2), next.robot, nu[b]);
        if (objective(free2) - *freeing_nats > objective(usual2) + usual) {
          next.blocks[b] = std::sqrt(free2);
          next.free[b] = 1;
        }
      }
      if (!next.free[b]) freedom += nu[b], inverses += nu[b] / (next.blocks[b] * next.blocks[b]);
    }
    if (!held_) next.robot = robot_of(freedom, inverses, discrepancy_.spread.robot_sd);
    now = strided(best.scales, next, stride);
  }
  return best;
}

}  // namespace flappy::gap
