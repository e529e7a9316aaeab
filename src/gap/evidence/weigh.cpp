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
#include <memory>

#include "gap/evidence/evidence.hpp"
#include "gap/evidence/wide_kernel.hpp"
#include "io/parallel.hpp"
#include "sim/kernels.hpp"

namespace flappy::gap {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
/// Row after row, as WideKernel has it.
using WideMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Iterations end when they gain less evidence than this. Choice.
constexpr double kSettled_nats = 0.1;
/// Growth of the stride of over-relaxed steps from one iteration to the next. Choice.
constexpr double kStrideGrowth = 1.5;
/// Largest stride. Choice.
constexpr double kMaxStride = 8;
/// Smallest scale of a free block over the scale of the robot. Choice.
constexpr double kMinFree = 2;

double log_prior(double scale, double robot, double freedom) {
  const double ratio = robot / scale;
  return freedom / 2 * (2 * std::log(ratio) + 1 - ratio * ratio);
}

/// The most probable robot scale f. `freedom`: sum of nu; `inverses`: sum of nu / s^2 over scales s that follow it;
/// `mean`, `sd`: of log f.
double robot_scale(double freedom, double inverses, double mean, double sd) {
  // Step of the grid of log f. Choice.
  constexpr double kGrid = 0.02;
  double best = 1, most = -std::numeric_limits<double>::infinity();
  for (double log_f = -5; log_f <= 3; log_f += kGrid) {
    const double value = freedom * log_f - std::exp(2 * log_f) * inverses / 2 - 0.5 * std::pow((log_f - mean) / sd, 2);
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

FLAPPY_KERNELS(WideKernel, wide_kernel_of_set);

const WideKernel& wide_kernel() {
  static const WideKernel& kernel = *wide_kernel_of_sets[sim::place_of("")];
  return kernel;
}

void Scales::centre_tests(const SessionVariation& sessions) {
  session = sessions.first_scale();
  if (blocks.empty()) blocks.assign(kBlocks, 1);
  for (std::size_t b = 0; b < kBlocks; ++b)
    if (block_of_tests(b)) blocks[b] = session * sessions.centre(b);
}

int Evidence::block_of(int group, int function) const {
  const int harmonic = (group % kCoefficients + 1) / 2;
  return (group / kCoefficients * (kHarmonics + 1) + harmonic) * kClasses +
         (basis().of_tests(function) ? kRegimes : 0) + static_cast<int>(regimes_of(basis().kind(function)));
}

double Evidence::scale_cost_nats(double times, ScalePrior prior, const Scales& scales) {
  return -log_prior(times, scales.prior_scale(prior), prior.freedom);
}

/// Weighs one residual, from any start and with any law_sd. The constructor computes the sums that depend on neither.
class Evidence::Weighing {
 public:
  Weighing(const Evidence& evidence, const SufficientStatistics& residual, const Regressors& regressors,
           const std::vector<char>& use, std::optional<double> unknown_penalty_nats)
      : e_(evidence),
        regressors_(regressors),
        unknown_penalty_nats_(unknown_penalty_nats),
        q_(evidence.basis().size()),
        k_(static_cast<Index>(regressors.columns.size())),
        prior_mean_(regressors.prior_mean()) {
    find_groups(use);
    count_blocks();
    sum_groups(residual, use);
    count_effects();
  }

  /// Expectation-maximisation, over-relaxed.
  ScaledEvidence run(const BasisCoefficients& law_sd, Scales start, int max_iterations) {
    law_sd_ = &law_sd;
    start.effects.resize(std::max(start.effects.size(), of_effect_.size()), 1);
    if (start.blocks.empty()) start.blocks.assign(kBlocks, 1);
    if (start.free.empty()) start.free.assign(kBlocks, 0);
    ScaledEvidence best;
    best.scales = start;
    best.posterior.log_evidence = -std::numeric_limits<double>::infinity();
    Scales now = start, next = start;
    double stride = 1;
    if (max_iterations > 1 && start.session == sessions().first_scale())  // not searched before
      now = e_.rules_->first_scales(now, [&](const Scales& s) { return evidence_at(s, false).posterior.log_evidence; });
    for (int iteration = 0; iteration < max_iterations; ++iteration) {
      ScaledEvidence w = evidence_at(now, true);
      const double gain = w.posterior.log_evidence - best.posterior.log_evidence;
      if (!(gain > 0)) {  // the stride was too long: back to the best scales, and on with stride 1, which cannot lose
        if (stride == 1) break;
        stride = 1;
        now = strided(best.scales, next, stride);
        continue;
      }
      expect_squares(w);
      best = std::move(w);
      if (gain < kSettled_nats || (e_.scales_held_ && !unknown_penalty_nats_)) break;
      stride = std::min(kMaxStride, kStrideGrowth * stride);
      next = most_probable_scales(best);
      now = strided(best.scales, next, stride);
    }
    return best;
  }

 private:
  /// What does not depend on scales, of a group.
  struct Sums {
    MatrixXd normal, change;  ///< basis x basis; basis x regressors
    WideMatrix all;           ///< normal (change), then basis x residual, then columns of zeros
    VectorXd prior_sd;        ///< prior standard deviation of delta at scale 1
    double squares = 0;       ///< sum of squares of the residual
  };
  /// A group under given scales.
  struct Half {
    VectorXd sd, law_sd;
    double log_determinant = 0;  ///< half that of H
    WideMatrix lower;            ///< L, with L L^T = H
    WideMatrix half;             ///< L^-1 d all, then columns of zeros
  };
  /// Scales that follow a centre f: the sums of nu, and of nu / s^2.
  struct Followers {
    double freedom = 0, inverses = 0;
    void add(double nu, double scale) { freedom += nu, inverses += nu / (scale * scale); }
  };

  const SessionVariation& sessions() const { return e_.discrepancy_.session; }
  /// Centre of the prior of a block's scale.
  double centre(const Scales& scales, std::size_t b) const {
    return scales.centre(b) * (block_of_tests(b) ? sessions().centre(b) : 1);
  }

  /// Groups with rows in the flights that count.
  void find_groups(const std::vector<char>& use) {
    for (int g = 0; g < kGroups; ++g)
      for (std::size_t f = 0; f < use.size(); ++f)
        if (use[f] && e_.has_rows(g) && e_.sums_->of_flights[f][static_cast<std::size_t>(g)](0, 0) > 0) {
          seen_.push_back(g);
          break;
        }
  }

  void count_blocks() {
    for (std::size_t b = 0; b < kBlocks; ++b)
      nu_.push_back(block_of_tests(b) ? sessions().freedom(b) : e_.discrepancy_.freedom_of(regimes_of_block(b)));
    counts_.assign(kBlocks, 0);
    for (const int g : seen_)
      for (int i = 0; i < e_.basis().size(); ++i) ++counts_[static_cast<std::size_t>(e_.block_of(g, i))];
  }

  void sum_groups(const SufficientStatistics& residual, const std::vector<char>& use) {
    sums_.resize(seen_.size());
    halves_.resize(seen_.size());
    io::parallel_for(seen_.size(), e_.threads_, [&](std::size_t n) {
      Sums& s = sums_[n];
      GroupSum sum = e_.sum_of(residual, use, seen_[n]);
      s.normal = std::move(sum.normal);
      s.change.resize(q_, k_);
      for (Index i = 0; i < k_; ++i)
        s.change.col(i) = regressors_.columns[static_cast<std::size_t>(i)]->row(seen_[n]).transpose();
      s.all = WideMatrix::Zero(q_, padded(k_ + 1));
      s.all.leftCols(k_).noalias() = s.normal * s.change;
      s.all.col(k_) = sum.right;
      s.prior_sd = e_.prior_sd(seen_[n]);
      s.squares = sum.square;
    });
    whole_ = MatrixXd::Zero(k_ + 1, k_ + 1);
    for (const Sums& s : sums_) {
      whole_.topLeftCorner(k_, k_).noalias() += s.change.transpose() * s.all.leftCols(k_);
      whole_.row(k_).head(k_) += s.all.col(k_).transpose() * s.change;
      whole_(k_, k_) += s.squares;
    }
    for (Index i = 0; i < k_; ++i) chosen_.push_back(static_cast<int>(i));
  }

  void count_effects() {
    for (std::size_t i = 0; i < regressors_.effects.size(); ++i)
      if (regressors_.effects[i] >= 0) {
        const auto e = static_cast<std::size_t>(regressors_.effects[i]);
        of_effect_.resize(std::max(of_effect_.size(), e + 1));
        priors_.resize(of_effect_.size());
        ++of_effect_[e];
        priors_[e] = regressors_.priors[i];
      }
  }

  /// The evidence with delta integrated out, under these scales. Leaves the groups in halves_.
  ScaledEvidence evidence_at(const Scales& scales, bool covariance) {
    // regressors in units of the prior of their coefficients
    VectorXd unit = VectorXd::Ones(padded(k_ + 1));
    for (Index i = 0; i < k_; ++i)
      if (const int e = regressors_.effects[static_cast<std::size_t>(i)]; e >= 0)
        unit[i] = scales.effects[static_cast<std::size_t>(e)];
    // each group: H, and what delta takes from the sums
    io::parallel_for(seen_.size(), e_.threads_, [&](std::size_t n) {
      const Sums& s = sums_[n];
      Half& h = halves_[n];
      h.law_sd = law_sd_->size() > 0 ? VectorXd(law_sd_->row(seen_[n]).transpose()) : VectorXd::Zero(q_);
      h.sd.resize(q_);
      for (Index i = 0; i < q_; ++i) {
        const int block = e_.block_of(seen_[n], static_cast<int>(i));
        h.sd[i] = std::hypot(scales.blocks[static_cast<std::size_t>(block)] * s.prior_sd[i], h.law_sd[i]);
      }
      MatrixXd precision = h.sd.asDiagonal() * s.normal * h.sd.asDiagonal();
      precision.diagonal().array() += 1;
      const Eigen::LLT<MatrixXd> llt(precision);
      h.log_determinant = llt.matrixLLT().diagonal().array().log().sum();
      h.lower = llt.matrixLLT();
      h.half = h.sd.asDiagonal() * s.all * unit.asDiagonal();
      kernel_.solve_lower(h.lower.data(), q_, h.half.cols(), h.half.data());
    });
    // the sum over the groups
    Reduced reduced{unit.head(k_ + 1).asDiagonal() * whole_ * unit.head(k_ + 1).asDiagonal(), 0};
    WideMatrix sums = WideMatrix::Zero(unit.size(), unit.size());
    for (const Half& h : halves_) {
      kernel_.subtract_squares(h.half.data(), q_, h.half.cols(), sums.data());
      reduced.log_scale -= h.log_determinant;
    }
    reduced.sums += sums.topLeftCorner(k_ + 1, k_ + 1);
    reduced.sums = MatrixXd(reduced.sums.selfadjointView<Eigen::Lower>());
    ScaledEvidence w{posterior(reduced, chosen_, prior_mean_, covariance), scales, 1,
                     BasisCoefficients::Zero(kGroups, q_), BasisCoefficients::Zero(kGroups, q_)};
    w.posterior.log_evidence += log_prior_of(scales);
    return w;
  }

  double log_prior_of(const Scales& scales) const {
    double sum = -0.5 * std::pow(std::log(scales.robot) / e_.discrepancy_.spread.robot_sd, 2);
    sum -= 0.5 * std::pow((std::log(scales.session) - sessions().log_scale()) / sessions().sd_of_scale(), 2);
    for (std::size_t b = 0; b < kBlocks; ++b)
      if (counts_[b] > 0)
        sum += scales.free[b]    ? -*unknown_penalty_nats_
               : e_.scales_held_ ? 0
                                 : log_prior(scales.blocks[b], centre(scales, b), nu_[b]);
    for (std::size_t e = 0; e < of_effect_.size(); ++e)
      if (of_effect_[e] > 0 && !e_.scales_held_)
        sum += log_prior(scales.effects[e], scales.prior_scale(priors_[e]), priors_[e].freedom);
    return sum;
  }

  /// E step: delta, and its expected squares in units of D, given the posterior of the regressors.
  void expect_squares(ScaledEvidence& w) const {
    const Index width = padded(k_ + 1);
    WideMatrix spread = WideMatrix::Zero(width, width);  // without the residual, which is no regressor
    if (k_ > 0) spread.topLeftCorner(k_, k_) = w.posterior.covariance.llt().matrixL();
    io::parallel_for(seen_.size(), e_.threads_, [&](std::size_t n) {
      const Half& h = halves_[n];
      WideMatrix z = WideMatrix::Zero(q_, kColumnStep);
      z.col(0) = h.half.col(k_) - h.half.leftCols(k_) * w.posterior.mean;
      kernel_.solve_transposed(h.lower.data(), q_, z.cols(), z.data());
      // H^-1 = L^-T L^-1; then what regressors that are not known move
      VectorXd variance = VectorXd::Zero(q_);
      WideMatrix inverse = WideMatrix::Identity(q_, padded(q_));
      kernel_.solve_transposed(h.lower.data(), q_, inverse.cols(), inverse.data());
      kernel_.add_row_squares(inverse.data(), q_, inverse.cols(), variance.data());
      WideMatrix moved(q_, width);
      kernel_.times_lower(h.half.data(), spread.data(), q_, width, moved.data());
      kernel_.solve_transposed(h.lower.data(), q_, width, moved.data());
      kernel_.add_row_squares(moved.data(), q_, width, variance.data());
      for (Index i = 0; i < q_; ++i) {
        const double d = h.sd[i], share = d > 0 ? 1 - std::pow(h.law_sd[i] / d, 2) : 0;  // delta's share of variance
        const double square = d * d * (z(i, 0) * z(i, 0) + variance[i]);
        const double own = share * share * square + share * h.law_sd[i] * h.law_sd[i];
        w.delta(seen_[n], i) = z(i, 0);
        w.squares(seen_[n], i) = sums_[n].prior_sd[i] > 0 ? own / (sums_[n].prior_sd[i] * sums_[n].prior_sd[i]) : 0;
      }
    });
  }

  /// M step.
  Scales most_probable_scales(const ScaledEvidence& w) const {
    Scales next = w.scales;
    std::vector<double> total(kBlocks, 0);
    for (const int g : seen_)
      for (Index i = 0; i < q_; ++i)
        total[static_cast<std::size_t>(e_.block_of(g, static_cast<int>(i)))] += w.squares(g, i);
    const Followers effects = maximise_effects(w.posterior, next);
    // blocks and their centres hold each other back
    for (int pass = 0; pass < e_.rules_->max_passes(); ++pass) {
      const double robot = next.robot, session = next.session;
      Followers of_robot = effects, of_session;
      for (std::size_t b = 0; b < kBlocks; ++b) {
        if (counts_[b] == 0) continue;
        maximise_block(b, total[b], next);
        if (!next.free[b])
          (block_of_tests(b) ? of_session : of_robot).add(nu_[b], next.blocks[b] * next.centre(b) / centre(next, b));
      }
      if (!e_.scales_held_)
        next.robot = robot_scale(of_robot.freedom, of_robot.inverses, 0, e_.discrepancy_.spread.robot_sd);
      if (of_session.freedom > 0)  // there are blocks of test flights
        next.session =
            robot_scale(of_session.freedom, of_session.inverses, sessions().log_scale(), sessions().sd_of_scale());
      if (next.robot == robot && next.session == session) break;
    }
    return next;
  }

  /// Scales of background magnitudes; returns those that follow the robot.
  Followers maximise_effects(const Posterior& p, Scales& next) const {
    Followers follow;
    if (e_.scales_held_) return follow;
    std::vector<double> squares(of_effect_.size(), 0);
    for (Index i = 0; i < k_; ++i)
      if (const int e = regressors_.effects[static_cast<std::size_t>(i)]; e >= 0)
        squares[static_cast<std::size_t>(e)] += p.mean[i] * p.mean[i] + p.covariance(i, i);
    for (std::size_t e = 0; e < of_effect_.size(); ++e) {
      if (of_effect_[e] == 0) continue;
      const double nu_e = priors_[e].freedom, prior = next.prior_scale(priors_[e]);
      const double squares_e = squares[e] * next.effects[e] * next.effects[e];
      next.effects[e] = std::sqrt((squares_e + nu_e * prior * prior) / (of_effect_[e] + nu_e));
      if (priors_[e].follows_robot) follow.add(nu_e, next.effects[e]);
    }
    return follow;
  }

  /// The scale of a block, within its prior or free of it. `total`: expected squares of its coefficients.
  void maximise_block(std::size_t b, double total, Scales& next) const {
    const double n = counts_[b], f2 = std::pow(centre(next, b), 2);
    const double bound2 = e_.scales_held_ ? 1 : (total + nu_[b] * f2) / (n + nu_[b]);
    next.blocks[b] = std::sqrt(bound2);
    next.free[b] = 0;
    if (!unknown_penalty_nats_ || !e_.rules_->may_be_free(b, e_.basis(), e_.discrepancy_)) return;
    const double free2 = std::max(total / n, kMinFree * kMinFree * f2);
    const auto objective = [&](double s2) { return -0.5 * (n * std::log(s2) + total / s2); };
    const double bound = e_.scales_held_ ? 0 : log_prior(std::sqrt(bound2), centre(next, b), nu_[b]);
    if (!(objective(free2) - *unknown_penalty_nats_ > objective(bound2) + bound)) return;
    next.blocks[b] = std::sqrt(free2);
    next.free[b] = 1;
  }

  const Evidence& e_;
  const WideKernel& kernel_ = wide_kernel();
  const Regressors& regressors_;
  const BasisCoefficients* law_sd_ = nullptr;  ///< argument of run()
  std::optional<double> unknown_penalty_nats_;
  Index q_, k_;  ///< number of functions of the basis; of regressors
  VectorXd prior_mean_;
  std::vector<int> seen_;           ///< groups with rows
  std::vector<double> nu_;          ///< [block] degrees of freedom of its scale
  std::vector<int> counts_;         ///< [block] number of its coefficients
  std::vector<int> of_effect_;      ///< [effect] number of regressors of its scale
  std::vector<ScalePrior> priors_;  ///< [effect]
  std::vector<Sums> sums_;          ///< [seen group]
  std::vector<Half> halves_;        ///< [seen group]
  MatrixXd whole_;                  ///< sums of products of the regressors and, last, the residual, over all groups
  std::vector<int> chosen_;         ///< all regressors
};

ScaledEvidence Evidence::weigh(const SufficientStatistics& residual, const Regressors& regressors,
                               const std::vector<char>& use, const BasisCoefficients& law_sd, const Scales& start,
                               std::optional<double> unknown_penalty_nats, int max_iterations) const {
  return Weighing(*this, residual, regressors, use, unknown_penalty_nats).run(law_sd, start, max_iterations);
}

Evidence::Weigher Evidence::weigher(const SufficientStatistics& residual, const Regressors& regressors,
                                    const std::vector<char>& use, std::optional<double> unknown_penalty_nats) const {
  return [w = std::make_shared<Weighing>(*this, residual, regressors, use, unknown_penalty_nats)](
             const BasisCoefficients& law_sd, const Scales& start) { return w->run(law_sd, start, kMaxIterations); };
}

}  // namespace flappy::gap
