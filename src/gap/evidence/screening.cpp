#include "gap/evidence/screening.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "model/effects/registry.hpp"

namespace flappy::gap {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Of a size that cannot be negative: log of twice the probability that N(mean, sd^2) is positive, as half its prior was.
double log_twice_positive(double mean, double sd) {
  return std::log(std::max(std::erfc(-mean / (sd * std::numbers::sqrt2)), 1e-300));
}

/// One effect at a time, beside the columns of a fit.
class Screening {
 public:
  Screening(const Evidence& evidence, const Fitter& fitter, const Fit& fit, const std::vector<SizeColumn>& columns)
      : columns_(columns) {
    Columns c = fitter.columns_of(fit.point);
    base_ = c.chosen;
    for (const SizeColumn& column : columns) c.add(column.change, 0);
    reduced_ = evidence.reduce(fit.point.statistics, c.columns, fitter.all_flights(), evidence.discrepancy_sd());
    mean_ = c.mean();
    without_ = solve({}).log_evidence;
  }

  Screened of(const std::string& effect) const {
    const std::vector<Unknown> unknowns = unknowns_of(effect);
    std::vector<std::size_t> own;
    for (std::size_t i = 0; i < columns_.size(); ++i)
      if (columns_[i].effect == effect) own.push_back(i);
    const auto one_sided = [&](std::size_t i) {
      return unknowns[static_cast<std::size_t>(columns_[i].unknown)].low >= 0;
    };
    Screened s{effect, 0, VectorXd::Zero(static_cast<Index>(unknowns.size()))};
    for (bool whole = true; !own.empty(); whole = false) {
      const Posterior p = solve(own);
      const auto at = [&](std::size_t k) { return static_cast<Index>(base_.size() + k); };
      if (whole) {
        s.gain = p.log_evidence - without_;
        for (std::size_t k = 0; k < own.size(); ++k)
          if (one_sided(own[k])) s.gain += log_twice_positive(p.mean[at(k)], std::sqrt(p.covariance(at(k), at(k))));
      }
      // of sizes with one sign, the one that comes out farthest on the other is none
      std::size_t worst = own.size();
      for (std::size_t k = 0; k < own.size(); ++k)
        if (one_sided(own[k]) && p.mean[at(k)] < (worst == own.size() ? 0 : p.mean[at(worst)])) worst = k;
      if (worst == own.size()) {
        for (std::size_t k = 0; k < own.size(); ++k) s.coordinates[columns_[own[k]].unknown] = p.mean[at(k)];
        break;
      }
      own.erase(own.begin() + static_cast<std::ptrdiff_t>(worst));
    }
    return s;
  }

 private:
  Posterior solve(const std::vector<std::size_t>& own) const {
    std::vector<int> chosen = base_;
    for (const std::size_t i : own) chosen.push_back(static_cast<int>(base_.size() + i));
    return Evidence::posterior(reduced_, chosen, mean_(chosen));
  }

  const std::vector<SizeColumn>& columns_;
  std::vector<int> base_;
  Reduced reduced_;
  VectorXd mean_;
  double without_ = 0;
};

}  // namespace

std::vector<SizeStep> size_steps(const sim::Randomisation& uncertain, const VectorXd& at,
                                 const std::vector<std::string>& withheld) {
  std::vector<SizeStep> steps;
  for (const model::EffectEntry& e : model::effects()) {
    const std::string id = e.info.id;
    if (std::ranges::count(withheld, id)) continue;
    const Hypothesis h(uncertain, {id});
    const Index first = at.size();
    VectorXd here = h.start();
    here.head(first) = at;
    for (Index i = first; i < h.size(); ++i) {
      if (!h.unknowns()[static_cast<std::size_t>(i)].size) continue;
      VectorXd there = here;
      there[i] = kSizeReach;
      steps.push_back({id, i - first, h.candidate(there), {}});
      for (Index shape = first; shape < h.size(); ++shape) {
        if (h.unknowns()[static_cast<std::size_t>(shape)].size) continue;
        VectorXd other = there;
        other[shape] = 1;
        steps.back().shaped.push_back(h.candidate(h.bounded(other)));
      }
    }
  }
  return steps;
}

std::vector<Screened> screen(const Evidence& evidence, const Fitter& fitter, const Fit& fit,
                             const std::vector<SizeColumn>& columns) {
  const Screening screening(evidence, fitter, fit, columns);
  std::vector<Screened> ranking;
  for (const SizeColumn& c : columns)
    if (ranking.empty() || ranking.back().effect != c.effect) ranking.push_back(screening.of(c.effect));
  std::ranges::sort(ranking, std::greater{}, &Screened::gain);
  return ranking;
}

}  // namespace flappy::gap
