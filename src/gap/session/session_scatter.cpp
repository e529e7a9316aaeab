#include "gap/session/session_scatter.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "io/config.hpp"

namespace flappy::gap {

using Eigen::Index;
using Eigen::VectorXd;

SessionPrior read_session_prior(const std::filesystem::path& path) {
  const io::Config config = io::Config::load(path);
  const io::Table root = config.root();
  root.schema(1);
  SessionPrior p;
  p.freedom = root.number("freedom", io::positive());
  p.most_freedom = root.number("most_freedom", io::positive());
  p.share_of_noise = root.number("share_of_noise", io::non_negative());
  const io::Table prior = root.table("prior");
  p.unchanged = prior.number("unchanged", io::positive(1));
  p.effect = prior.number("effect", io::positive(1));
  p.unknown = prior.number("unknown", io::positive(1));
  p.further_effect = prior.number("further_effect", io::positive(1));
  if (!(std::abs(p.unchanged + p.effect + p.unknown - 1) < 1e-9))
    prior.fail("", "unchanged, effect and unknown do not add up to 1", "probabilities that do");
  const io::Table together = root.table("together");
  for (const std::string& key : together.keys()) p.together[key] = together.number(key, io::positive(1));
  for (const char* name : kSessionBlocks) {
    const io::Table block = root.table(name);
    p.blocks[name] = {block.number("scatter", io::positive()), block.number("drift", io::non_negative()),
                      block.number("unknown", io::positive()), block.number("leak", io::Range{0, 1})};
  }
  root.finish();
  return p;
}

double SessionPrior::further(const std::string& a, const std::string& b, std::size_t effects) const {
  const auto at = together.find(std::min(a, b) + "_" + std::max(a, b));
  return at != together.end() ? at->second : further_effect / static_cast<double>(effects);
}

/// No flight counts for much more than others, however little noise it has: flights of a session differ, too.
static double weight_of(const FlightQuantities& flight, Index q, const SessionPrior& prior) {
  return 1 / (flight.variances()[q] + std::pow(prior.of(flight.quantities()[static_cast<std::size_t>(q)]).scatter, 2));
}

Eigen::MatrixXd flight_shares(const std::vector<FlightQuantities>& flights, const SessionPrior& prior) {
  Eigen::MatrixXd shares(static_cast<Index>(flights.size()), flights.front().values().size());
  for (Index f = 0; f < shares.rows(); ++f)
    for (Index q = 0; q < shares.cols(); ++q) shares(f, q) = weight_of(flights[static_cast<std::size_t>(f)], q, prior);
  for (Index q = 0; q < shares.cols(); ++q) shares.col(q) /= shares.col(q).sum();
  return shares;
}

SessionValues session_values(const std::vector<FlightQuantities>& flights, const std::vector<int>& of,
                             const SessionPrior& prior) {
  const Index sessions = 1 + *std::ranges::max_element(of), n = flights.front().values().size();
  SessionValues s{Eigen::MatrixXd::Zero(sessions, n), Eigen::MatrixXd::Zero(sessions, n)};
  Eigen::MatrixXd weights = Eigen::MatrixXd::Zero(sessions, n);
  for (std::size_t f = 0; f < flights.size(); ++f)
    for (Index q = 0; q < n; ++q) {
      const double weight = weight_of(flights[f], q, prior);
      weights(of[f], q) += weight;
      s.values(of[f], q) += weight * flights[f].values()[q];
      s.variances(of[f], q) += weight * weight * flights[f].variances()[q];
    }
  s.values.array() /= weights.array();
  s.variances.array() /= weights.array().square();
  return s;
}

double SessionPrior::variance(const SessionQuantity& quantity, double noise) const {
  return std::pow(of(quantity).scatter, 2) + std::pow(share_of_noise, 2) * noise;
}

SessionScatter::SessionScatter(const std::vector<SessionQuantity>& quantities, const SessionValues& references,
                               const SessionTimes& times, const SessionPrior& prior)
    : quantities_(quantities) {
  const Index size = references.values.cols();
  const auto own = static_cast<double>(references.values.rows() - 1);
  mean_ = variance_ = variance_of_next_ = VectorXd::Zero(size);
  freedom_ = std::min(prior.freedom + own, prior.most_freedom);
  noise_ = references.variances.colwise().mean().transpose();
  for (Index q = 0; q < size; ++q) {
    const SessionQuantity& quantity = quantities[static_cast<std::size_t>(q)];
    const double before = prior.variance(quantity, noise_[q]);
    const SessionWalk walk(times.references, times.tests, std::pow(prior.of(quantity).drift, 2) / before);
    const VectorXd x = references.values.col(q);
    mean_[q] = walk.mean_of_next(x);
    variance_[q] = (prior.freedom * before + walk.sum_of_squares(x)) / (prior.freedom + own);
    variance_of_next_[q] = variance_[q] * walk.factor_of_next();
  }
}

SessionDensity::SessionDensity(const SessionScatter& scatter, const VectorXd& values, const VectorXd& variances,
                               const SessionPrior& prior)
    : difference_(values - scatter.mean()),
      variance_(scatter.variance_of_next() + (variances - scatter.noise()).cwiseMax(0)),
      noise_(variances + scatter.noise()),
      unknown_(difference_.size()),
      leak_(difference_.size()),
      freedom_(scatter.freedom()) {
  const std::vector<SessionQuantity>& all = scatter.quantities();
  for (Index q = 0; q < unknown_.size(); ++q) {
    const SessionPrior::Block& block = prior.of(all[static_cast<std::size_t>(q)]);
    unknown_[q] = block.unknown;
    leak_[q] = block.leak;
  }
  for (Index q = 0; q < difference_.size(); ++q) {
    const bool fresh = q == 0 || all[static_cast<std::size_t>(q)].block != all[static_cast<std::size_t>(q - 1)].block;
    if (fresh) blocks_.emplace_back();
    blocks_.back().push_back(q);
  }
}

double SessionDensity::size_of(const VectorXd& shift) const {
  double square = 0;
  for (const std::vector<Index>& block : blocks_) {
    double of_block = 0;
    for (const Index q : block) of_block += std::pow(shift[q] / unknown_[q], 2);
    square += of_block / static_cast<double>(block.size());
  }
  return std::min(square, 1.0);
}

/// Student's t of several dimensions.
double SessionDensity::block_density(const std::vector<Index>& block, const VectorXd& shift, const VectorXd& variance,
                                     VectorXd* precision) const {
  const auto k = static_cast<double>(block.size());
  double square = 0, log_variance = 0;
  for (const Index q : block) {
    square += std::pow(difference_[q] - shift[q], 2) / variance[q];
    log_variance += std::log(variance[q]);
  }
  if (precision != nullptr)
    for (const Index q : block) (*precision)[q] = (freedom_ + k) / (freedom_ + square) / variance[q];
  return std::lgamma((freedom_ + k) / 2) - std::lgamma(freedom_ / 2) - 0.5 * k * std::log(freedom_ * std::numbers::pi) -
         0.5 * log_variance - (freedom_ + k) / 2 * std::log1p(square / freedom_);
}

double SessionDensity::log_density(const VectorXd& shift, const VectorXd& more) const {
  const double size = size_of(shift);
  const VectorXd near = variance_ + more + size * noise_, far = near + unknown_.cwiseAbs2();
  double sum = 0;
  for (const std::vector<Index>& block : blocks_) {
    const double leaks = size * leak_[block.front()], own = block_density(block, shift, near, nullptr);
    if (!(leaks > 0)) {
      sum += own;
      continue;
    }
    const double leaked = block_density(block, shift, far, nullptr), most = std::max(own, leaked);
    sum += most + std::log((1 - leaks) * std::exp(own - most) + leaks * std::exp(leaked - most));
  }
  return sum;
}

VectorXd SessionDensity::precision(const VectorXd& shift, const VectorXd& more) const {
  const double size = size_of(shift);
  const VectorXd near = variance_ + more + size * noise_, far = near + unknown_.cwiseAbs2();
  VectorXd own(shift.size()), leaked(shift.size());
  for (const std::vector<Index>& block : blocks_) {
    const double leaks = size * leak_[block.front()];
    const double odds = std::log(leaks / (1 - leaks)) + block_density(block, shift, far, &leaked) -
                        block_density(block, shift, near, &own);
    const double share = leaks > 0 ? 1 / (1 + std::exp(-odds)) : 0;
    for (const Index q : block) own[q] += share * (leaked[q] - own[q]);
  }
  return own;
}

}  // namespace flappy::gap
