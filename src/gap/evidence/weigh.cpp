// Learns how far models of a robot are off: a scale for each block of the model discrepancy and each effect's
// background. With s D the prior standard deviation of delta in a group, and z = delta / (s D), theta and delta are
// normal (evidence.hpp):
//   z | theta ~ N(H^-1 d (right - normal change theta), H^-1)      d = s D, H = 1 + d normal d
// With n coefficients in a block, and f the scale of the robot, the most probable scale is
//   s^2 = (sum E[delta^2] / D^2 + nu f^2) / (n + nu)
// Scales of background magnitudes have the same law, centred on f or 1 (ScalePrior); each hypothesis pays the log-prior
// cost of a large one. Each iteration of expectation-maximisation increases log evidence plus prior (Dempster, Laird,
// Rubin 1977). Scales are taken at the maximum, not integrated out: to first order its width is the same for every
// hypothesis.
#include <cmath>
#include <limits>

#include "gap/evidence/evidence.hpp"
#include "io/parallel.hpp"

namespace flappy::gap {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Iterations end when they gain less evidence than this.
constexpr double kSettled_nats = 0.1;
constexpr double kStrideGrowth = 1.5, kMaxStride = 8;
/// Smallest scale of a free block over the scale of the robot.
constexpr double kMinFree = 2;

struct Sums {
  MatrixXd normal, change, all;  ///< basis x basis; basis x regressors; normal (change), then basis x residual
  VectorXd prior_sd;             ///< prior standard deviation of delta at scale 1
  double squares = 0;            ///< sum of squares of the residual
};

/// A group under given scales.
struct Half {
  VectorXd sd, law_sd;
  Eigen::LLT<MatrixXd> llt;  ///< L L^T = H
  MatrixXd half;             ///< L^-1 d all
};

double log_prior(double scale, double robot, double freedom) {
  const double ratio = robot / scale;
  return freedom / 2 * (2 * std::log(ratio) + 1 - ratio * ratio);
}

/// The most probable robot scale f. `freedom`: sum of nu; `inverses`: sum of nu / s^2 over scales s that follow it;
/// `sd`: of log f.
double robot_scale(double freedom, double inverses, double sd) {
  constexpr double kGrid = 0.02;
  double best = 1, most = -std::numeric_limits<double>::infinity();
  for (double log_f = -5; log_f <= 3; log_f += kGrid) {
    const double value = freedom * log_f - std::exp(2 * log_f) * inverses / 2 - 0.5 * std::pow(log_f / sd, 2);
    if (value > most) most = value, best = std::exp(log_f);
  }
  return best;
}

/// Over-relaxed: `stride` times the step between the logarithms of two sets of scales (Salakhutdinov, Roweis 2003).
Scales strided(const Scales& from, const Scales& to, double stride) {
  const auto go = [&](double a, double b) { return a * std::pow(b / a, stride); };
  Scales s = to;
  s.robot = go(from.robot, to.robot);
  s.session = go(from.session, to.session);
  for (std::size_t e = 0; e < s.effects.size(); ++e) s.effects[e] = go(from.effects[e], to.effects[e]);
  for (std::size_t b = 0; b < s.blocks.size(); ++b)
    if (!from.free[b] && !to.free[b]) s.blocks[b] = go(from.blocks[b], to.blocks[b]);
  return s;
}

}  // namespace

int Evidence::block_of(int group, int function) const {
  const int harmonic = (group % kCoefficients + 1) / 2;
  return (group / kCoefficients * (kHarmonics + 1) + harmonic) * kClasses +
         (basis().of_tests(function) ? kRegimes : 0) + static_cast<int>(regimes_of(basis().kind(function)));
}

double Evidence::scale_cost_nats(double times, ScalePrior prior, const Scales& scales) {
  return -log_prior(times, scales.prior_scale(prior), prior.freedom);
}

ScaledEvidence Evidence::weigh(const SufficientStatistics& residual, const Regressors& regressors,
                               const std::vector<char>& use, const BasisCoefficients& law_sd, const Scales& start,
                               std::optional<double> unknown_penalty_nats, int max_iterations) const {
  const Index q = basis().size(), k = static_cast<Index>(regressors.columns.size());
  std::vector<double> nu;
  for (std::size_t b = 0; b < kBlocks; ++b)
    nu.push_back(block_of_tests(b) ? discrepancy_.session.block_freedom : discrepancy_.freedom_of(regimes_of_block(b)));
  const VectorXd prior_mean = regressors.prior_mean();
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
    for (int i = 0; i < basis().size(); ++i) ++counts[static_cast<std::size_t>(block_of(g, i))];
  io::parallel_for(seen.size(), threads_, [&](std::size_t n) {
    Sums& s = sums[n];
    auto [normal, right] = sums_of(residual, use, seen[n]);
    s.normal = std::move(normal);
    s.change.resize(q, k);
    for (Index i = 0; i < k; ++i)
      s.change.col(i) = regressors.columns[static_cast<std::size_t>(i)]->row(seen[n]).transpose();
    s.all.resize(q, k + 1);
    s.all.leftCols(k).noalias() = s.normal * s.change;
    s.all.col(k) = right;
    s.prior_sd = prior_sd(seen[n]);
    s.squares = smooth_square(s.normal, right);
  });
  MatrixXd whole = MatrixXd::Zero(k + 1, k + 1);
  for (const Sums& s : sums) {
    whole.topLeftCorner(k, k).noalias() += s.change.transpose() * s.all.leftCols(k);
    whole.row(k).head(k) += s.all.col(k).transpose() * s.change;
    whole(k, k) += s.squares;
  }

  ScaledEvidence best;
  best.scales = start;
  if (best.scales.blocks.empty()) best.scales.blocks.assign(kBlocks, 1);
  if (best.scales.free.empty()) best.scales.free.assign(kBlocks, 0);
  best.posterior.log_evidence = -std::numeric_limits<double>::infinity();
  std::vector<int> of_effect;  // number of regressors of each scale
  std::vector<ScalePrior> priors;
  for (std::size_t i = 0; i < regressors.effects.size(); ++i)
    if (regressors.effects[i] >= 0) {
      const auto e = static_cast<std::size_t>(regressors.effects[i]);
      of_effect.resize(std::max(of_effect.size(), e + 1));
      priors.resize(of_effect.size());
      ++of_effect[e];
      priors[e] = regressors.priors[i];
    }
  best.scales.effects.resize(std::max(best.scales.effects.size(), of_effect.size()), 1);
  of_effect.resize(best.scales.effects.size());
  priors.resize(best.scales.effects.size());
  Scales now = best.scales, next = best.scales;
  double stride = 1;
  std::vector<Half> halves(seen.size());
  std::vector<int> chosen(static_cast<std::size_t>(k));
  for (Index i = 0; i < k; ++i) chosen[static_cast<std::size_t>(i)] = static_cast<int>(i);
  /// Leaves the groups under these scales in `halves`.
  const auto evidence_with = [&](const Scales& scales, bool covariance) {
    io::parallel_for(seen.size(), threads_, [&](std::size_t n) {
      const Sums& s = sums[n];
      Half& h = halves[n];
      h.law_sd = law_sd.size() > 0 ? VectorXd(law_sd.row(seen[n]).transpose()) : VectorXd::Zero(q);
      h.sd.resize(q);
      for (Index i = 0; i < q; ++i) {
        const int block = block_of(seen[n], static_cast<int>(i));
        h.sd[i] = std::hypot(scales.blocks[static_cast<std::size_t>(block)] * s.prior_sd[i], h.law_sd[i]);
      }
      MatrixXd precision = h.sd.asDiagonal() * s.normal * h.sd.asDiagonal();
      precision.diagonal().array() += 1;
      h.llt.compute(precision);
      h.half = h.llt.matrixL().solve(h.sd.asDiagonal() * s.all);
    });
    // regressors in units of the prior of their coefficients
    VectorXd unit = VectorXd::Ones(k + 1);
    for (Index i = 0; i < k; ++i)
      if (const int e = regressors.effects[static_cast<std::size_t>(i)]; e >= 0)
        unit[i] = scales.effects[static_cast<std::size_t>(e)];
    io::parallel_for(seen.size(), threads_, [&](std::size_t n) { halves[n].half *= unit.asDiagonal(); });
    Reduced reduced{unit.asDiagonal() * whole * unit.asDiagonal(), 0};
    for (const Half& h : halves) {
      reduced.sums.selfadjointView<Eigen::Lower>().rankUpdate(h.half.transpose(), -1);
      reduced.log_scale -= h.llt.matrixLLT().diagonal().array().log().sum();
    }
    reduced.sums = MatrixXd(reduced.sums.selfadjointView<Eigen::Lower>());
    ScaledEvidence w{posterior(reduced, chosen, prior_mean, covariance), scales, 1, BasisCoefficients::Zero(kGroups, q),
                     BasisCoefficients::Zero(kGroups, q)};
    double log_scales = -0.5 * std::pow(std::log(scales.robot) / discrepancy_.spread.robot_sd, 2);
    log_scales -= 0.5 * std::pow(std::log(scales.session) / discrepancy_.session.scale_sd, 2);
    for (std::size_t b = 0; b < kBlocks; ++b)
      if (counts[b] > 0)
        log_scales += scales.free[b] ? -*unknown_penalty_nats
                      : scales_held_ ? 0
                                     : log_prior(scales.blocks[b], scales.centre(b), nu[b]);
    for (std::size_t e = 0; e < of_effect.size(); ++e)
      if (of_effect[e] > 0 && !scales_held_)
        log_scales += log_prior(scales.effects[e], scales.prior_scale(priors[e]), priors[e].freedom);
    w.posterior.log_evidence += log_scales;
    return w;
  };
  if (max_iterations > 1)
    now = rules_->first_scales(now, [&](const Scales& s) { return evidence_with(s, false).posterior.log_evidence; });
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    ScaledEvidence w = evidence_with(now, true);
    const double gain = w.posterior.log_evidence - best.posterior.log_evidence;
    if (!(gain > 0)) {  // the stride was too long: back to the best scales, and on with stride 1, which cannot lose
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
      if (k > 0)  // Eigen's triangular products and row expressions fail for matrices without columns
        moved = h.llt.matrixU().solve(h.half.leftCols(k) * spread.triangularView<Eigen::Lower>());
      for (Index i = 0; i < q; ++i) {
        const double d = h.sd[i], share = d > 0 ? 1 - std::pow(h.law_sd[i] / d, 2) : 0;  // delta's share of variance
        const double square =
            d * d * (z[i] * z[i] + inverse.row(i).squaredNorm() + (k > 0 ? moved.row(i).squaredNorm() : 0.0));
        const double own = share * share * square + share * h.law_sd[i] * h.law_sd[i];
        w.delta(seen[n], i) = z[i];
        w.squares(seen[n], i) = sums[n].prior_sd[i] > 0 ? own / (sums[n].prior_sd[i] * sums[n].prior_sd[i]) : 0;
      }
    });
    const VectorXd w_mean = w.posterior.mean, w_variance = w.posterior.covariance.diagonal();
    best = std::move(w);
    if (gain < kSettled_nats || (scales_held_ && !unknown_penalty_nats)) break;
    stride = std::min(kMaxStride, kStrideGrowth * stride);
    next = best.scales;
    std::vector<double> total(kBlocks, 0);
    for (const int g : seen)
      for (Index i = 0; i < q; ++i)
        total[static_cast<std::size_t>(block_of(g, static_cast<int>(i)))] += best.squares(g, i);
    double effects_freedom = 0, effects_inverses = 0;
    if (!scales_held_) {
      std::vector<double> squares(of_effect.size(), 0);
      for (Index i = 0; i < k; ++i)
        if (const int e = regressors.effects[static_cast<std::size_t>(i)]; e >= 0)
          squares[static_cast<std::size_t>(e)] += w_mean[i] * w_mean[i] + w_variance[i];
      for (std::size_t e = 0; e < of_effect.size(); ++e) {
        if (of_effect[e] == 0) continue;
        const double nu_e = priors[e].freedom, prior = next.prior_scale(priors[e]);
        const double squares_e = squares[e] * next.effects[e] * next.effects[e];
        next.effects[e] = std::sqrt((squares_e + nu_e * prior * prior) / (of_effect[e] + nu_e));
        if (priors[e].follows_robot)
          effects_freedom += nu_e, effects_inverses += nu_e / (next.effects[e] * next.effects[e]);
      }
    }
    for (int pass = 0; pass < rules_->max_passes(); ++pass) {
      const double robot = next.robot, session = next.session;
      double freedom = effects_freedom, inverses = effects_inverses, session_freedom = 0, session_inverses = 0;
      for (std::size_t b = 0; b < kBlocks; ++b) {
        if (counts[b] == 0) continue;
        const double n = counts[b], f2 = std::pow(next.centre(b), 2);
        const double bound2 = scales_held_ ? 1 : (total[b] + nu[b] * f2) / (n + nu[b]);
        next.blocks[b] = std::sqrt(bound2);
        next.free[b] = 0;
        if (unknown_penalty_nats && rules_->may_be_free(b, basis(), discrepancy_)) {
          const double free2 = std::max(total[b] / n, kMinFree * kMinFree * f2);
          const auto objective = [&](double s2) { return -0.5 * (n * std::log(s2) + total[b] / s2); };
          const double bound = scales_held_ ? 0 : log_prior(std::sqrt(bound2), next.centre(b), nu[b]);
          if (objective(free2) - *unknown_penalty_nats > objective(bound2) + bound) {
            next.blocks[b] = std::sqrt(free2);
            next.free[b] = 1;
          }
        }
        if (next.free[b]) continue;
        const double inverse = nu[b] / (next.blocks[b] * next.blocks[b]);
        if (block_of_tests(b)) session_freedom += nu[b], session_inverses += inverse;
        else freedom += nu[b], inverses += inverse;
      }
      if (!scales_held_) next.robot = robot_scale(freedom, inverses, discrepancy_.spread.robot_sd);
      if (session_freedom > 0)  // there are blocks of test flights
        next.session = robot_scale(session_freedom, session_inverses, discrepancy_.session.scale_sd);
      if (next.robot == robot && next.session == session) break;
    }
    now = strided(best.scales, next, stride);
  }
  return best;
}

}  // namespace flappy::gap
