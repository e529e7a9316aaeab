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
      : evidence_(evidence), fitter_(fitter), columns_(columns) {
    Columns c = fitter.columns_of(fit.point);
    base_ = c.chosen;
    entry_ = c.entry;
    for (const SizeColumn& column : columns) {
      at_.push_back(static_cast<int>(c.columns.size()));
      c.add(column.change, -column.from);
      for (const SizeColumn::Large& large : column.large) {
        c.add(large.chord, 0);
        c.add(large.change, -column.from - large.at);
      }
    }
    reduced_ = evidence.reduce(fit.point.statistics, c.columns, fitter.all_flights(), evidence.discrepancy_sd());
    mean_ = c.mean();
    without_ = Evidence::posterior(reduced_, base_, mean_(base_)).log_evidence;
  }

  /// The best of all places from which on it may be linear.
  Screened of(const std::string& effect) const {
    std::vector<Size> own;
    for (std::size_t i = 0; i < columns_.size(); ++i)
      if (columns_[i].effect == effect) own.push_back({i, at_[i], 0});
    Screened best = around(effect, own, reduced_);
    for (std::size_t k = 0; k < own.size(); ++k) {
      const std::vector<SizeColumn::Large>& large = columns_[own[k].column].large;
      for (std::size_t n = 0; n < large.size(); ++n) {
        std::vector<Size> there = own;
        const int chord = own[k].at + 1 + 2 * static_cast<int>(n);
        there[k].at = chord + 1;
        there[k].from = large[n].at;
        Screened s = around(effect, there, less(chord, large[n].at));
        if (s.gain > best.gain) best = std::move(s);
      }
    }
    return best;
  }

 private:
  struct Size {
    std::size_t column;
    int at;       ///< in the reduced sums
    double from;  ///< coordinate around which it is linear
  };

  /// The residual without so much of a column.
  Reduced less(int column, double much) const {
    Reduced r = reduced_;
    const Index last = r.sums.rows() - 1;
    r.sums(last, last) += much * (much * r.sums(column, column) - 2 * r.sums(column, last));
    r.sums.col(last).head(last) -= much * r.sums.col(column).head(last);
    r.sums.row(last).head(last) = r.sums.col(last).head(last).transpose();
    return r;
  }

  Screened around(const std::string& effect, std::vector<Size> own, const Reduced& reduced) const {
    const auto one_sided = [&](const Size& s) { return columns_[s.column].one_sided; };
    Screened s{effect, 0, VectorXd::Zero(columns_[own.front().column].unknowns)};
    for (const Size& size : own) s.coordinates[columns_[size.column].unknown] = columns_[size.column].from;
    // beside what this robot has of it as a background, or instead of all that, whose price is then not paid
    const int entry = fitter_.entry_of(effect);
    const std::vector<double>& have = evidence_.scales().entries;
    std::vector<int> others;
    for (const int i : base_)
      if (entry < 0 || entry_[static_cast<std::size_t>(i)] != entry) others.push_back(i);
    double saved = 0;
    if (others.size() < base_.size() && static_cast<std::size_t>(entry) < have.size())
      saved = evidence_.price_of(have[static_cast<std::size_t>(entry)], evidence_.discrepancy().tail_of(effect));
    const auto with = [&](std::vector<int> chosen) {
      for (const Size& size : own) chosen.push_back(size.at);
      return Evidence::posterior(reduced, chosen, mean_(chosen));
    };
    for (bool whole = true; !own.empty(); whole = false) {
      Posterior p = with(base_), instead = with(others);
      instead.log_evidence += saved;
      if (instead.log_evidence > p.log_evidence) p = std::move(instead);
      const auto at = [&](std::size_t k) { return p.mean.size() - static_cast<Index>(own.size() - k); };
      const auto coordinate = [&](std::size_t k) { return columns_[own[k].column].from + own[k].from + p.mean[at(k)]; };
      const auto positive = [&](std::size_t k) {
        return log_twice_positive(coordinate(k), std::sqrt(p.covariance(at(k), at(k))));
      };
      if (whole) s.gain = p.log_evidence - without_;
      // of sizes with one sign, the one that comes out farthest on the other is none: its half of the prior counts beside those that are
      // left, for two that make up for one another are both far on the other side
      std::size_t worst = own.size();
      for (std::size_t k = 0; k < own.size(); ++k)
        if (one_sided(own[k]) && coordinate(k) < (worst == own.size() ? 0 : coordinate(worst))) worst = k;
      if (worst == own.size()) {
        for (std::size_t k = 0; k < own.size(); ++k) {
          if (one_sided(own[k])) s.gain += positive(k);
          s.coordinates[columns_[own[k].column].unknown] = coordinate(k);
        }
        break;
      }
      s.gain += positive(worst);
      own.erase(own.begin() + static_cast<std::ptrdiff_t>(worst));
    }
    return s;
  }

  const Evidence& evidence_;
  const Fitter& fitter_;
  const std::vector<SizeColumn>& columns_;
  std::vector<int> entry_;      ///< of the base, that it is background of
  std::vector<int> base_, at_;  ///< in the reduced sums: what stands beside every effect; each size
  Reduced reduced_;
  VectorXd mean_;
  double without_ = 0;
};

}  // namespace

/// How many standard deviations of it a robot may well have of an entry, and how near differences are rough.
constexpr double kFarFromUsual = 2, kLeastSizeReach = 0.05;

std::vector<SizeStep> size_steps(const sim::Randomisation& uncertain, const VectorXd& at,
                                 const std::vector<std::string>& withheld, const ModelDiscrepancy* usual) {
  std::vector<SizeStep> steps;
  const model::Vehicle now = Hypothesis(uncertain, {}).candidate(at).vehicle;
  for (const model::EffectEntry& e : model::catalogue_of(uncertain.nominal())) {
    const std::string id = e.info.id;
    if (std::ranges::count(withheld, id)) continue;
    const Hypothesis h(uncertain, {id});
    const double sd = usual ? std::max(usual->background_sd(id), usual->background_sd(id + kOfBoth)) : 0,
                 reach = std::clamp(kFarFromUsual * sd, kLeastSizeReach, kSizeReach);
    const Index first = at.size();
    VectorXd here = h.start(now);
    here.head(first) = at;
    for (Index i = first; i < h.size(); ++i) {
      if (!h.unknowns()[static_cast<std::size_t>(i)].size) continue;
      VectorXd there = here;
      there[i] += kSizeReach;
      const bool one_sided = h.unknowns()[static_cast<std::size_t>(i)].low >= 0,
                 of_log = h.unknowns()[static_cast<std::size_t>(i)].log;  // a line, near and far
      steps.push_back({{id, i - first, h.size() - first, one_sided, here[i]}, h.candidate(there), {}, {}, reach, {}});
      for (const double sign : {1.0, -1.0}) {
        there[i] = here[i] + sign * reach;
        if (usual && !of_log && (sign > 0 || !one_sided)) steps.back().near.push_back(h.candidate(h.bounded(there)));
      }
      for (std::size_t n = 2; n <= kFurthest && one_sided; ++n) {
        there[i] = here[i] + kSizeReach * static_cast<double>(n);
        if (h.bounded(there)[i] != there[i]) break;
        steps.back().further.push_back(h.candidate(there));
      }
      there[i] = here[i] + kSizeReach;
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
