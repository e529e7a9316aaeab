#include "gap/evidence.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flappy::gap {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Degrees of freedom of the noise's Student t.
constexpr double kTail = 4;
/// Of the whole basis when it is only to take structure out of the noise.
constexpr double kLooseRidge = 1e-6;
constexpr double kMostPast = 0.95;

std::size_t row_of(std::size_t beat, int group) { return beat * kRowsPerBeat + static_cast<std::size_t>(group); }

double median(std::vector<double> v) {
  if (v.empty()) return 0;
  const auto middle = v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2);
  std::ranges::nth_element(v, middle);
  return *middle;
}

}  // namespace

Evidence::Evidence(const std::vector<CarriedFlight>& flights) : flights_(flights), basis_(flights), groups_(kGroups) {
  for (const CarriedFlight& f : flights) weights_.emplace_back(f.beats() * kRowsPerBeat, 1.0);
  for (int channel = 0; channel < kChannels; ++channel) {
    double all = 0;
    for (int c = 0; c < kCoefficients; ++c) {
      const int g = channel * kCoefficients + c;
      double sum = 0, n = 0;
      for (const CarriedFlight& f : flights)
        for (std::size_t j = 0; j < f.beats(); ++j)
          if (f.covers(j, channel)) sum += f.signal()[row_of(j, g)] * f.signal()[row_of(j, g)], n += 1;
      groups_[static_cast<std::size_t>(g)].signal = n > 0 ? sum / n : 0;
      all += groups_[static_cast<std::size_t>(g)].signal / kCoefficients;
    }
    // half its own, half that of its channel: an error of shape moves power between harmonics
    for (int c = 0; c < kCoefficients; ++c) {
      double& s = groups_[static_cast<std::size_t>(channel * kCoefficients + c)].signal;
      s = std::sqrt((s + all) / 2);
    }
  }
  Signature declared;
  for (std::size_t f = 0; f < flights.size(); ++f) declared.push_back(flights[f].declared_noise(f + 1));
  find_noise(declared, Find::declared);
}

void Evidence::learn_weights(const Signature& residual) { find_noise(residual, Find::weights); }
void Evidence::learn_noise(const Signature& residual) { find_noise(residual, Find::noise); }

/// Calls use(beat, whether the one before it counts) for the beats of a flight that a channel covers.
template <class Use>
void Evidence::for_rows(std::size_t flight, int channel, const Use& use) const {
  const CarriedFlight& f = flights_[flight];
  bool before = false;
  for (std::size_t j = 0; j < f.beats(); ++j) {
    const bool now = f.covers(j, channel);
    if (now) use(j, before);
    before = now;
  }
}

void Evidence::find_noise(const Signature& residual, Find what) {
  const Index q = basis_.size();
#pragma omp parallel for schedule(dynamic) num_threads(2)
  for (int g = 0; g < kGroups; ++g) {
    const int channel = g / kCoefficients;
    if (!has_rows(channel, g % kCoefficients)) continue;
    MatrixXd normal = MatrixXd::Zero(q, q);
    VectorXd right = VectorXd::Zero(q);
    double n = 0;
    for (std::size_t f = 0; f < flights_.size(); ++f)
      for_rows(f, channel, [&](std::size_t j, bool) {
        const auto b = basis_.values(f).row(static_cast<Index>(j));
        normal.noalias() += b.transpose() * b;
        right += residual[f][row_of(j, g)] * b.transpose();
        n += 1;
      });
    if (n == 0) continue;
    normal.diagonal().array() += kLooseRidge * n;
    const VectorXd eta = normal.ldlt().solve(right);
    const auto left = [&](std::size_t f, std::size_t j) {
      return residual[f][row_of(j, g)] - basis_.values(f).row(static_cast<Index>(j)).dot(eta);
    };
    std::vector<double> sizes;
    for (std::size_t f = 0; f < flights_.size(); ++f)
      for_rows(f, channel, [&](std::size_t j, bool) { sizes.push_back(std::abs(left(f, j))); });
    const double clip = 3 * 1.4826 * median(sizes);
    double product = 0, square = 0;
    for (std::size_t f = 0; f < flights_.size(); ++f)
      for_rows(f, channel, [&](std::size_t j, bool before) {
        if (!before) return;
        const double a = std::clamp(left(f, j - 1), -clip, clip), b = std::clamp(left(f, j), -clip, clip);
        product += a * b;
        square += (a * a + b * b) / 2;
      });
    Group& known = groups_[static_cast<std::size_t>(g)];
    Group group = known;
    group.past = square > 0 ? std::clamp(product / square, -kMostPast, kMostPast) : 0;
    std::vector<double> steps;
    const auto innovation = [&](std::size_t f, std::size_t j, bool before) {
      return before ? left(f, j) - group.past * left(f, j - 1) : left(f, j) * std::sqrt(1 - group.past * group.past);
    };
    for (std::size_t f = 0; f < flights_.size(); ++f)
      for_rows(f, channel, [&](std::size_t j, bool before) { steps.push_back(std::abs(innovation(f, j, before))); });
    group.sd = std::max({1.4826 * median(steps), group.least_sd, 1e-9});
    if (what == Find::declared) group.least_sd = group.sd;
    if (what != Find::weights) known = group;
    if (what == Find::declared) continue;  // of what is declared, no row is too far off
    for (std::size_t f = 0; f < flights_.size(); ++f)
      for_rows(f, channel, [&](std::size_t j, bool before) {
        const double t = innovation(f, j, before) / group.sd;
        weights_[f][row_of(j, g)] = std::min(1.0, (kTail + 1) / (kTail + t * t));
      });
  }
}

void Evidence::smooth(Signature& rows) const {
  const Index q = basis_.size();
  for (int channel = 0; channel < kChannels; ++channel) {
    MatrixXd normal = MatrixXd::Zero(q, q), right = MatrixXd::Zero(q, kCoefficients);
    double n = 0;
    for (std::size_t f = 0; f < flights_.size(); ++f)
      for_rows(f, channel, [&](std::size_t j, bool) {
        const auto b = basis_.values(f).row(static_cast<Index>(j));
        const Eigen::Map<const Eigen::RowVectorXd> y(&rows[f][row_of(j, channel * kCoefficients)], kCoefficients);
        normal.noalias() += b.transpose() * b;
        right.noalias() += b.transpose() * y;
        n += 1;
      });
    if (n == 0) continue;
    normal.diagonal().array() += kLooseRidge * n;
    const MatrixXd eta = normal.ldlt().solve(right);
    for (std::size_t f = 0; f < flights_.size(); ++f)
      for_rows(f, channel, [&](std::size_t j, bool) {
        Eigen::Map<Eigen::RowVectorXd> y(&rows[f][row_of(j, channel * kCoefficients)], kCoefficients);
        y = basis_.values(f).row(static_cast<Index>(j)) * eta;
      });
  }
}

Grams Evidence::grams(const Signature& residual, const std::vector<const Signature*>& columns) const {
  const Index q = basis_.size(), k = static_cast<Index>(columns.size()), width = q + k + 1;
  Grams result;
  result.basis = static_cast<int>(q);
  result.columns = static_cast<int>(k);
  result.sums.assign(flights_.size(), std::vector<MatrixXd>(kGroups));
  result.constant.assign(flights_.size(), 0);
  for (std::size_t f = 0; f < flights_.size(); ++f) {
    std::vector<double> constants(kGroups, 0);
#pragma omp parallel for schedule(dynamic) num_threads(2)
    for (int g = 0; g < kGroups; ++g) {
      const Group& group = groups_[static_cast<std::size_t>(g)];
      const int channel = g / kCoefficients;
      if (!has_rows(channel, g % kCoefficients)) {
        result.sums[f][static_cast<std::size_t>(g)] = MatrixXd::Zero(width, width);
        continue;
      }
      MatrixXd z(static_cast<Index>(flights_[f].beats()), width);
      Index n = 0;
      VectorXd now(width), past = VectorXd::Zero(width);
      for_rows(f, channel, [&](std::size_t j, bool before) {
        now.head(q) = basis_.values(f).row(static_cast<Index>(j));
        for (Index i = 0; i < k; ++i) now[q + i] = (*columns[static_cast<std::size_t>(i)])[f][row_of(j, g)];
        now[q + k] = residual[f][row_of(j, g)];
        const double weight = weights_[f][row_of(j, g)], scale = std::sqrt(weight) / group.sd;
        if (before) z.row(n) = scale * (now - group.past * past).transpose();
        else z.row(n) = scale * std::sqrt(1 - group.past * group.past) * now.transpose();
        constants[static_cast<std::size_t>(g)] += std::log(scale / std::sqrt(2 * std::numbers::pi));
        past = now;
        ++n;
      });
      const auto used = z.topRows(n);
      MatrixXd sum = MatrixXd::Zero(width, width);
      if (n > 0) sum.selfadjointView<Eigen::Lower>().rankUpdate(used.transpose());
      sum = sum.selfadjointView<Eigen::Lower>();
      // what is no smooth function of the regime is noise, whatever the hypothesis
      MatrixXd smooth = sum.topLeftCorner(q, q);
      smooth.diagonal().array() += kLooseRidge * static_cast<double>(n) + 1e-12;
      const VectorXd right = sum.block(0, q + k, q, 1);
      sum(q + k, q + k) = right.dot(smooth.ldlt().solve(right));
      result.sums[f][static_cast<std::size_t>(g)] = std::move(sum);
    }
    for (const double c : constants) result.constant[f] += c;
  }
  return result;
}

Reduced Evidence::reduce(const Grams& grams, const std::vector<char>& use, double unexplained) const {
  const Index q = grams.basis, k = grams.columns + 1;
  Reduced result{MatrixXd::Zero(k, k), 0};
  for (std::size_t f = 0; f < use.size(); ++f)
    if (use[f]) result.log_scale += grams.constant[f];
  for (int g = 0; g < kGroups; ++g) {
    MatrixXd sum = MatrixXd::Zero(q + k, q + k);
    for (std::size_t f = 0; f < use.size(); ++f)
      if (use[f]) sum += grams.sums[f][static_cast<std::size_t>(g)];
    if (sum(0, 0) == 0) continue;  // nothing was seen
    // precision of eta given the rest, in units of its prior's sd
    const double signal = groups_[static_cast<std::size_t>(g)].signal;
    VectorXd sd(q);
    for (Index i = 0; i < q; ++i) sd[i] = signal * std::hypot(basis_.floor(static_cast<int>(i)), unexplained);
    MatrixXd precision = sd.asDiagonal() * sum.topLeftCorner(q, q) * sd.asDiagonal();
    precision.diagonal().array() += 1;
    const Eigen::LLT<MatrixXd> llt(precision);
    const MatrixXd cross = llt.matrixL().solve(sd.asDiagonal() * sum.block(0, q, q, k));
    result.sums += sum.bottomRightCorner(k, k) - cross.transpose() * cross;
    result.log_scale -= llt.matrixLLT().diagonal().array().log().sum();
  }
  return result;
}

Posterior Evidence::posterior(const Reduced& reduced, const std::vector<int>& columns, const VectorXd& prior_mean,
                              const VectorXd& prior_sd) {
  const Index k = static_cast<Index>(columns.size()), last = reduced.sums.rows() - 1;
  MatrixXd precision(k, k);
  VectorXd right(k);
  for (Index i = 0; i < k; ++i) {
    for (Index j = 0; j < k; ++j)
      precision(i, j) = reduced.sums(columns[static_cast<std::size_t>(i)], columns[static_cast<std::size_t>(j)]);
    right[i] = reduced.sums(columns[static_cast<std::size_t>(i)], last);
  }
  const VectorXd weight = prior_sd.array().square().inverse();
  precision.diagonal() += weight;
  right += weight.cwiseProduct(prior_mean);
  const Eigen::LLT<MatrixXd> llt(precision);
  Posterior p;
  p.mean = llt.solve(right);
  p.covariance = llt.solve(MatrixXd::Identity(k, k));
  p.log_evidence =
      reduced.log_scale -
      0.5 * (reduced.sums(last, last) + weight.dot(prior_mean.cwiseProduct(prior_mean)) - right.dot(p.mean)) -
      llt.matrixLLT().diagonal().array().log().sum() - prior_sd.array().log().sum();
  return p;
}

Signature Evidence::whitened(const Signature& residual) const {
  Signature result;
  for (std::size_t f = 0; f < flights_.size(); ++f) {
    result.emplace_back(residual[f].size(), 0.0);
    for (int g = 0; g < kGroups; ++g) {
      if (!has_rows(g / kCoefficients, g % kCoefficients)) continue;
      const Group& group = groups_[static_cast<std::size_t>(g)];
      for_rows(f, g / kCoefficients, [&](std::size_t j, bool before) {
        const double past = before ? group.past * residual[f][row_of(j - 1, g)] : 0;
        const double scale = before ? 1 : std::sqrt(1 - group.past * group.past);
        result[f][row_of(j, g)] = scale * (residual[f][row_of(j, g)] - past) / group.sd;
      });
    }
  }
  return result;
}

}  // namespace flappy::gap
