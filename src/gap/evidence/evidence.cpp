#include "gap/evidence/evidence.hpp"

#include <algorithm>
#include <cmath>

#include "io/parallel.hpp"
#include "io/statistics.hpp"

namespace flappy::gap {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Eigen sums products in blocks that fit the processor's caches. Fixed sizes, bytes, so that the last digits of a
/// diagnosis, to which a fit may be sensitive, do not depend on the processor.
[[maybe_unused]] const bool kBlocksAreFixed = [] {
  Eigen::setCpuCacheSizes(32 << 10, 512 << 10, 8 << 20);
  return true;
}();

/// Degrees of freedom of the noise's Student t. Choice.
constexpr double kNoiseFreedom = 4;
/// Ridge of least squares on the whole basis. Choice.
constexpr double kLooseRidge = 1e-6;
/// Largest memory of the noise from beat to beat. Choice.
constexpr double kMaxPast = 0.95;
/// Standard deviation over the median of absolute values. Derived: of normal noise.
constexpr double kRobustSd = 1.4826;
/// Residuals are clipped at so many robust standard deviations where the memory of the noise is found. Choice.
constexpr double kClipSd = 3;

std::size_t row_of(std::size_t beat, int group) {
  return beat * kRowsPerBeat + static_cast<std::size_t>(column_of(group));
}

/// For least squares on the whole basis.
Eigen::LDLT<MatrixXd> loose_factor(MatrixXd normal) {
  normal.diagonal().array() += kLooseRidge * normal(0, 0);
  return normal.ldlt();
}

/// A group with delta integrated out: sums a' b over its rows become a' b - of(a)' of(b).
struct WithoutDiscrepancy {
  WithoutDiscrepancy(const MatrixXd& normal, VectorXd discrepancy_sd) : sd(std::move(discrepancy_sd)) {
    MatrixXd precision = sd.asDiagonal() * normal * sd.asDiagonal();
    precision.diagonal().array() += 1;
    llt.compute(precision);
  }
  /// `sums`: sums of products of the basis and a.
  MatrixXd of(const MatrixXd& sums) const { return llt.matrixL().solve(sd.asDiagonal() * sums); }

  VectorXd sd;
  Eigen::LLT<MatrixXd> llt;  ///< Cholesky factor of the posterior precision of delta over its prior standard deviation
};

}  // namespace

VectorXd Regressors::prior_mean() const {
  return Eigen::Map<const VectorXd>(prior_means.data(), static_cast<Index>(prior_means.size()));
}

void Regressors::add(const BasisCoefficients& column, double prior_mean, int effect, ScalePrior prior) {
  all.push_back(static_cast<int>(columns.size()));
  columns.push_back(&column);
  prior_means.push_back(prior_mean);
  effects.push_back(effect);
  priors.push_back(prior);
}

Evidence::Evidence(const EvidenceRules& rules, const Flights& flights, ModelDiscrepancy discrepancy, int threads)
    : rules_(&rules),
      flights_(&flights),
      discrepancy_(std::move(discrepancy)),
      threads_(threads),
      basis_(std::make_shared<const RegimeBasis>(rules, flights)),
      groups_(kGroups),
      has_rows_(kGroups, 0) {
  for (const auto& f : flights.all()) {
    weights_.emplace_back(f->beats() * kRowsPerBeat, 1.0);
    for (int g = first_group(f->clamped(), 0), c = 0; c < kChannels * kCoefficients; ++g, ++c)
      if (f->has_rows(channel_of(g), g % kCoefficients)) has_rows_[static_cast<std::size_t>(g)] = 1;
  }
  for (int channel = 0; channel < kSettingChannels; ++channel) {
    double all = 0;
    for (int c = 0; c < kCoefficients; ++c) {
      const int g = channel * kCoefficients + c;
      double sum = 0, n = 0;
      for (const auto& f : flights.all())
        for (std::size_t j = 0; j < f->beats(); ++j)
          if (f->clamped() == of_bench(g) && f->covers(j, channel_of(g)) && has_rows(g))
            sum += f->signal()[row_of(j, g)] * f->signal()[row_of(j, g)], n += 1;
      groups_[static_cast<std::size_t>(g)].signal = n > 0 ? sum / n : 0;
      all += groups_[static_cast<std::size_t>(g)].signal / kCoefficients;
    }
    // the group's own mean square averaged with its channel's: errors of the waveform move power between harmonics
    for (int c = 0; c < kCoefficients; ++c) {
      double& s = groups_[static_cast<std::size_t>(channel) * kCoefficients + static_cast<std::size_t>(c)].signal;
      s = std::sqrt((s + all) / 2);
    }
  }
  Residuals declared;
  for (std::size_t f = 0; f < flights.size(); ++f) declared.push_back(flight(f).declared_noise(f + 1));
  const Index q = basis().size();
  for (int channel = 0; channel < kSettingChannels; ++channel) {
    MatrixXd normal = MatrixXd::Identity(q, q) * 1e-12;
    double n = 0;
    for (std::size_t f = 0; f < flights.size(); ++f)
      for_rows(f, channel * kCoefficients, [&](std::size_t j, bool) {
        const auto b = basis().values(f).row(static_cast<Index>(j));
        normal.noalias() += b.transpose() * b;
        n += 1;
      });
    normal.diagonal().array() += kLooseRidge * n;
    inverse_.push_back(normal.inverse());
  }
  learn(declared, Learn::declared);
  sum_basis();
}

Evidence Evidence::with_weights(const Residuals& residual) const {
  Evidence e = *this;
  e.learn(residual, Learn::weights);
  e.sum_basis();
  return e;
}

Evidence Evidence::with_noise(const Residuals& residual) const {
  Evidence e = *this;
  e.learn(residual, Learn::noise);
  e.sum_basis();
  return e;
}

Evidence Evidence::with_rest_as_noise(const Residuals& residual) const {
  Evidence e = *this;
  e.learn(residual, Learn::rest_as_noise);
  e.sum_basis();
  e.scales_held_ = true;
  return e;
}

Evidence Evidence::with_discrepancy(ModelDiscrepancy discrepancy) const {
  Evidence e = *this;
  e.discrepancy_ = std::move(discrepancy);
  return e;
}

Evidence Evidence::with_tests(const std::vector<char>& tests, SufficientStatistics& statistics) const {
  std::vector<std::vector<MatrixXd>> sums = sums_->of_flights;
  for (std::size_t f = 0; f < tests.size(); ++f) {
    const MatrixXd to = basis().without_offsets(tests[f] != 0);
    for (std::size_t g = 0; g < static_cast<std::size_t>(kGroups); ++g) {
      if (!has_rows(static_cast<int>(g))) continue;
      sums[f][g] = to.transpose() * sums[f][g] * to;
      statistics.sums[f][g] = to.transpose() * statistics.sums[f][g];
    }
  }
  Evidence e = *this;
  e.take_sums(std::move(sums));
  return e;
}

Rows Evidence::without(std::size_t flight, Rows residual, const BasisCoefficients& change) const {
  for (int g = 0; g < kGroups; ++g) {
    if (!has_rows(g) || this->flight(flight).clamped() != of_bench(g)) continue;
    const VectorXd smooth = basis().values(flight) * change.row(g).transpose();
    for (std::size_t j = 0; j < this->flight(flight).beats(); ++j)
      residual[row_of(j, g)] -= smooth[static_cast<Index>(j)];
  }
  return residual;
}

/// Calls use(beat, whether the beat before counts) for the beats that a group covers.
template <class Use>
void Evidence::for_rows(std::size_t flight, int group, const Use& use) const {
  const PredictedFlight& f = this->flight(flight);
  if (f.clamped() != of_bench(group)) return;
  const int channel = channel_of(group);
  bool before = false;
  for (std::size_t j = 0; j < f.beats(); ++j) {
    const bool now = f.covers(j, channel);
    if (now) use(j, before);
    before = now;
  }
}

/// Coefficients of the constants that give a group its mean over the references, and over the tests.
VectorXd Evidence::session_means(const Residuals& residual, int group) const {
  VectorXd delta = VectorXd::Zero(basis().size());
  const auto mean_of = [&](bool references) {
    double sum = 0, n = 0;
    for (std::size_t f = 0; f < flights_->size(); ++f)
      for_rows(f, group, [&](std::size_t j, bool) {
        if (flights_->is_reference(f) == references) sum += residual[f][row_of(j, group)], n += 1;
      });
    return n > 0 ? sum / n : 0;
  };
  delta[0] = mean_of(flights_->is_reference(0));
  for (int i = 0; i < basis().size(); ++i)
    if (basis().of_tests(i) && basis().kind(i) == BasisFunction::constant) delta[i] = mean_of(false) - delta[0];
  return delta;
}

void Evidence::learn(const Residuals& residual, Learn what) {
  const Index q = basis().size();
  io::parallel_for(static_cast<std::size_t>(kGroups), threads_, [&](std::size_t k) {
    const int g = static_cast<int>(k);
    if (!has_rows(g)) return;
    VectorXd right = VectorXd::Zero(q);
    double n = 0;
    for (std::size_t f = 0; f < flights_->size(); ++f)
      for_rows(f, g, [&](std::size_t j, bool) {
        right += residual[f][row_of(j, g)] * basis().values(f).row(static_cast<Index>(j)).transpose();
        n += 1;
      });
    if (n == 0) return;
    VectorXd delta = VectorXd::Zero(q);
    if (flight(0).disturbed(channel_of(g))) delta = session_means(residual, g);
    else if (what != Learn::rest_as_noise) delta = inverse_[static_cast<std::size_t>(g / kCoefficients)] * right;
    const auto rest = [&](std::size_t f, std::size_t j) {
      return residual[f][row_of(j, g)] - basis().values(f).row(static_cast<Index>(j)).dot(delta);
    };
    std::vector<double> sizes;
    for (std::size_t f = 0; f < flights_->size(); ++f)
      for_rows(f, g, [&](std::size_t j, bool) { sizes.push_back(std::abs(rest(f, j))); });
    const double clip = kClipSd * kRobustSd * io::upper_median(sizes);
    double product = 0, square = 0;
    for (std::size_t f = 0; f < flights_->size(); ++f)
      for_rows(f, g, [&](std::size_t j, bool before) {
        if (!before) return;
        const double a = std::clamp(rest(f, j - 1), -clip, clip), b = std::clamp(rest(f, j), -clip, clip);
        product += a * b;
        square += (a * a + b * b) / 2;
      });
    Group& known = groups_[static_cast<std::size_t>(g)];
    Group group = known;
    group.past = square > 0 ? std::clamp(product / square, -kMaxPast, kMaxPast) : 0;
    std::vector<double> steps;
    const auto innovation = [&](std::size_t f, std::size_t j, bool before) {
      return before ? rest(f, j) - group.past * rest(f, j - 1) : rest(f, j) * std::sqrt(1 - group.past * group.past);
    };
    for (std::size_t f = 0; f < flights_->size(); ++f)
      for_rows(f, g, [&](std::size_t j, bool before) { steps.push_back(std::abs(innovation(f, j, before))); });
    group.sd = std::max({kRobustSd * io::upper_median(steps), group.declared_sd, 1e-9});
    if (what == Learn::declared) group.declared_sd = group.sd;
    if (what != Learn::weights) known = group;
    if (what == Learn::declared) return;  // declared noise has no outliers
    for (std::size_t f = 0; f < flights_->size(); ++f)
      for_rows(f, g, [&](std::size_t j, bool before) {
        const double t = innovation(f, j, before) / group.sd;
        weights_[f][row_of(j, g)] = std::min(1.0, (kNoiseFreedom + 1) / (kNoiseFreedom + t * t));
      });
  });
}

/// Calls use(beat, now, past) for the rows of a group: whitened row = now x (this row) - past x (the beat before's).
template <class Use>
void Evidence::for_whitened(std::size_t flight, int group, const Use& use) const {
  const Group& g = groups_[static_cast<std::size_t>(group)];
  for_rows(flight, group, [&](std::size_t j, bool before) {
    const double scale = std::sqrt(weights_[flight][row_of(j, group)]) / g.sd;
    if (before) use(j, scale, scale * g.past);
    else use(j, scale * std::sqrt(1 - g.past * g.past), 0.0);
  });
}

void Evidence::sum_basis() {
  const Index q = basis().size();
  std::vector<std::vector<MatrixXd>> sums(flights_->size(), std::vector<MatrixXd>(kGroups));
  for (std::size_t f = 0; f < flights_->size(); ++f) {
    const MatrixXd& values = basis().values(f);
    io::parallel_for(static_cast<std::size_t>(kGroups), threads_, [&](std::size_t group) {
      const int g = static_cast<int>(group);
      if (!has_rows(g)) return;
      sums[f][group] = MatrixXd::Zero(q, q);
      MatrixXd rows(static_cast<Index>(flight(f).beats()), q);
      Index n = 0;
      for_whitened(f, g, [&](std::size_t j, double now, double past) {
        const auto i = static_cast<Index>(j);
        if (past != 0) rows.row(n) = now * values.row(i) - past * values.row(i - 1);
        else rows.row(n) = now * values.row(i);
        ++n;
      });
      if (n == 0) return;
      const auto used = rows.topRows(n);
      sums[f][group].selfadjointView<Eigen::Lower>().rankUpdate(used.transpose());
      sums[f][group] = MatrixXd(sums[f][group].selfadjointView<Eigen::Lower>());
    });
  }
  take_sums(std::move(sums));
}

void Evidence::take_sums(std::vector<std::vector<MatrixXd>> of_flights) {
  auto s = std::make_shared<Sums>();
  s->of_flights = std::move(of_flights);
  s->all.resize(kGroups);
  s->loose.resize(kGroups);
  io::parallel_for(static_cast<std::size_t>(kGroups), threads_, [&](std::size_t g) {
    if (!has_rows(static_cast<int>(g))) return;
    MatrixXd& all = s->all[g];
    all = s->of_flights[0][g];
    for (std::size_t f = 1; f < s->of_flights.size(); ++f) all += s->of_flights[f][g];
    s->loose[g] = loose_factor(all);
  });
  sums_ = std::move(s);
}

/// Sums of a group over the flights that count.
class Evidence::GroupSums {
 public:
  GroupSums(const Evidence& e, const std::vector<char>& use, int group)
      : sums_(*e.sums_), use_(use), g_(static_cast<std::size_t>(group)), has_rows_(e.has_rows(group)) {
    if (!has_rows_ || std::ranges::all_of(use, std::identity())) return;
    own_ = MatrixXd::Zero(e.basis().size(), e.basis().size());
    for (std::size_t f = 0; f < use.size(); ++f)
      if (use[f]) own_ += sums_.of_flights[f][g_];
  }
  const MatrixXd& normal() const { return own_.size() > 0 ? own_ : sums_.all[g_]; }
  bool has_rows() const { return has_rows_ && normal()(0, 0) != 0; }
  VectorXd right(const SufficientStatistics& residual) const {
    VectorXd sum = VectorXd::Zero(normal().rows());
    for (std::size_t f = 0; f < use_.size(); ++f)
      if (use_[f]) sum += residual.sums[f][g_];
    return sum;
  }
  /// Square of the smooth part of a residual.
  double smooth_square(const VectorXd& right) const {
    return own_.size() > 0 ? loose_factor(own_).solve(right).dot(right) : sums_.loose[g_].solve(right).dot(right);
  }

 private:
  const Sums& sums_;
  const std::vector<char>& use_;
  std::size_t g_;
  bool has_rows_;
  MatrixXd own_;  ///< empty: all flights count
};

Evidence::GroupSum Evidence::sum_of(const SufficientStatistics& residual, const std::vector<char>& use,
                                    int group) const {
  const GroupSums sums(*this, use, group);
  const VectorXd right = sums.right(residual);
  return {sums.normal(), right, sums.smooth_square(right)};
}

BasisCoefficients Evidence::basis_coefficients(const Residuals& rows) const {
  const Index q = basis().size();
  BasisCoefficients result = BasisCoefficients::Zero(kGroups, q);
  for (int channel = 0; channel < kSettingChannels; ++channel) {
    const int first = channel * kCoefficients;
    MatrixXd right = MatrixXd::Zero(q, kCoefficients);
    for (std::size_t f = 0; f < flights_->size(); ++f) {
      if (flight(f).clamped() != of_bench(first)) continue;
      MatrixXd counted = MatrixXd::Zero(basis().values(f).rows(), kCoefficients);
      for_rows(f, first, [&](std::size_t j, bool) {
        counted.row(static_cast<Index>(j)) =
            Eigen::Map<const Eigen::RowVectorXd>(&rows[f][row_of(j, first)], kCoefficients);
      });
      right.noalias() += basis().values(f).transpose() * counted;
    }
    result.middleRows(first, kCoefficients) = (inverse_[static_cast<std::size_t>(channel)] * right).transpose();
  }
  return result;
}

SufficientStatistics Evidence::statistics(const Residuals& residual) const {
  const Index q = basis().size();
  SufficientStatistics s{{flights_->size(), std::vector<VectorXd>(kGroups, VectorXd::Zero(q))}};
  for (std::size_t f = 0; f < flights_->size(); ++f) {
    const MatrixXd& values = basis().values(f);
    for (int g = 0; g < kGroups; ++g) {
      if (!has_rows(g)) continue;
      VectorXd counted = VectorXd::Zero(values.rows());
      for_whitened(f, g, [&](std::size_t j, double now, double past) {
        const auto i = static_cast<Index>(j);
        const double y = now * residual[f][row_of(j, g)] - (past != 0 ? past * residual[f][row_of(j - 1, g)] : 0);
        counted[i] += now * y;
        if (past != 0) counted[i - 1] -= past * y;
      });
      s.sums[f][static_cast<std::size_t>(g)] = values.transpose() * counted;
    }
  }
  return s;
}

void Evidence::add(double share, const BasisCoefficients& change, SufficientStatistics& to) const {
  for (std::size_t f = 0; f < flights_->size(); ++f)
    for (int g = 0; g < kGroups; ++g)
      if (has_rows(g))
        to.sums[f][static_cast<std::size_t>(g)] +=
            share * (sums_->of_flights[f][static_cast<std::size_t>(g)] * change.row(g).transpose());
}

double Evidence::noise_sd(int group) const {
  const Group& g = groups_[static_cast<std::size_t>(group)];
  return g.sd / std::sqrt(1 - g.past * g.past);
}

VectorXd Evidence::prior_sd(int group) const {
  VectorXd sd(basis().size());
  for (int i = 0; i < basis().size(); ++i) {
    const auto& shares = basis().of_tests(i) ? discrepancy_.session.shares : discrepancy_.shares;
    sd[i] = signal(group) * share_of(shares, group / kCoefficients, (group % kCoefficients + 1) / 2, basis().kind(i));
  }
  return sd;
}

BasisCoefficients Evidence::discrepancy_sd(const Scales& scales) const {
  BasisCoefficients sd(kGroups, basis().size());
  for (int g = 0; g < kGroups; ++g) {
    sd.row(g) = prior_sd(g).transpose();
    for (int i = 0; i < basis().size(); ++i) sd(g, i) *= scales.block(static_cast<std::size_t>(block_of(g, i)));
  }
  return sd;
}

Reduced Evidence::reduce(const SufficientStatistics& residual, const std::vector<const BasisCoefficients*>& regressors,
                         const std::vector<char>& use, const BasisCoefficients& discrepancy_sd) const {
  return *std::move(reduce_each({residual}, regressors, use, discrepancy_sd).front());
}

std::vector<std::optional<Reduced>> Evidence::reduce_each(const std::vector<SufficientStatistics>& residuals,
                                                          const std::vector<const BasisCoefficients*>& regressors,
                                                          const std::vector<char>& use,
                                                          const BasisCoefficients& discrepancy_sd,
                                                          const MatrixXd* known) const {
  const Index q = basis().size(), k = static_cast<Index>(regressors.size());
  MatrixXd sums = known != nullptr ? *known : MatrixXd(MatrixXd::Zero(k, k));
  std::vector<std::optional<Reduced>> results(residuals.size());
  for (std::size_t i = 0; i < residuals.size(); ++i)
    if (!residuals[i].sums.empty()) results[i] = Reduced{MatrixXd::Zero(k + 1, k + 1), 0};
  MatrixXd change(q, k), weighed(q, k);
  for (int g = 0; g < kGroups; ++g) {
    const GroupSums group(*this, use, g);
    if (!group.has_rows()) continue;
    const MatrixXd& normal = group.normal();
    for (Index i = 0; i < k; ++i) change.col(i) = regressors[static_cast<std::size_t>(i)]->row(g).transpose();
    const WithoutDiscrepancy without(normal, discrepancy_sd.row(g).transpose());
    if (k > 0 && known == nullptr) {  // Eigen's triangular product reads the first element even of an empty matrix
      const MatrixXd half = without.of(normal);
      weighed.noalias() = (normal - half.transpose() * half) * change;
      sums.triangularView<Eigen::Lower>() += change.transpose() * weighed;
    }
    io::parallel_for(residuals.size(), threads_, [&](std::size_t i) {
      if (!results[i]) return;
      Reduced& result = *results[i];
      const VectorXd right = group.right(residuals[i]), half_right = without.of(right);
      const VectorXd delta = without.sd.cwiseProduct(without.llt.matrixU().solve(half_right));
      result.sums.row(k).head(k) += (right - normal * delta).transpose() * change;
      result.sums(k, k) += group.smooth_square(right) - half_right.squaredNorm();
      result.log_scale -= without.llt.matrixLLT().diagonal().array().log().sum();
    });
  }
  for (std::optional<Reduced>& result : results) {
    if (!result) continue;
    result->sums.topLeftCorner(k, k) = sums;
    result->sums = MatrixXd(result->sums.selfadjointView<Eigen::Lower>());
  }
  return results;
}

BasisCoefficients Evidence::discrepancy_mean(const SufficientStatistics& residual, const BasisCoefficients& explained,
                                             const std::vector<char>& use,
                                             const BasisCoefficients& discrepancy_sd) const {
  BasisCoefficients mean = BasisCoefficients::Zero(kGroups, basis().size());
  for (int g = 0; g < kGroups; ++g) {
    const GroupSums group(*this, use, g);
    if (!group.has_rows()) continue;
    const WithoutDiscrepancy without(group.normal(), discrepancy_sd.row(g).transpose());
    const VectorXd half = without.of(group.right(residual) - group.normal() * explained.row(g).transpose());
    mean.row(g) = without.sd.cwiseProduct(without.llt.matrixU().solve(half)).transpose();
  }
  return mean;
}

Posterior Evidence::posterior(const Reduced& reduced, const std::vector<int>& chosen, const VectorXd& prior_mean,
                              bool covariance) {
  const Index k = static_cast<Index>(chosen.size()), last = reduced.sums.rows() - 1;
  MatrixXd precision = reduced.sums(chosen, chosen);
  VectorXd right = reduced.sums(chosen, last);
  precision.diagonal().array() += 1;
  right += prior_mean;
  const Eigen::LLT<MatrixXd> llt(precision);
  Posterior p;
  p.mean = llt.solve(right);
  if (covariance) p.covariance = llt.solve(MatrixXd::Identity(k, k));
  p.log_evidence = reduced.log_scale - 0.5 * (reduced.sums(last, last) + prior_mean.squaredNorm() - right.dot(p.mean)) -
                   llt.matrixLLT().diagonal().array().log().sum();
  return p;
}

}  // namespace flappy::gap
