#include "gap/fit/screening.hpp"

#include <algorithm>
#include <cmath>

#include "gap/fit/one_sided.hpp"
#include "model/effects/registry.hpp"

namespace flappy::gap {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

class Screening {
 public:
  Screening(const Fitter& fitter, const Fit& fit, const std::vector<MagnitudeColumn>& columns,
            const BasisCoefficients& law_sd)
      : fitter_(fitter), columns_(columns) {
    Regressors r = fitter.regressors(fit);
    base_ = r.all;
    effects_ = r.effects;
    for (const MagnitudeColumn& column : columns) {
      at_.push_back(static_cast<int>(r.columns.size()));
      r.add(column.change, -column.from);
      for (const MagnitudeColumn::Large& large : column.large) {
        r.add(large.chord, 0);
        r.add(large.change, -column.from - large.at);
      }
    }
    const Evidence& evidence = fitter.evidence();
    BasisCoefficients sd = evidence.discrepancy_sd(fitter.scales());
    if (law_sd.size() > 0) sd = (sd.cwiseAbs2() + law_sd.cwiseAbs2()).cwiseSqrt();
    reduced_ = evidence.reduce(fit.statistics, r.columns, fitter.all_flights(), sd);
    mean_ = r.prior_mean();
    without_ = Evidence::posterior(reduced_, base_, mean_(base_)).log_evidence;
  }

  /// Linearises the effect around small and around large magnitudes; returns the best.
  ScreenedEffect screened(const std::string& effect) const {
    std::vector<Linear> magnitudes;
    for (std::size_t i = 0; i < columns_.size(); ++i)
      if (columns_[i].effect == effect) magnitudes.push_back({i, at_[i], 0});
    ScreenedEffect best = around(effect, magnitudes, reduced_);
    for (std::size_t k = 0; k < magnitudes.size(); ++k) {
      const std::vector<MagnitudeColumn::Large>& large = columns_[magnitudes[k].column].large;
      for (std::size_t n = 0; n < large.size(); ++n) {
        std::vector<Linear> there = magnitudes;
        const int chord = magnitudes[k].at + 1 + 2 * static_cast<int>(n);
        there[k].at = chord + 1;
        there[k].from = large[n].at;
        ScreenedEffect s = around(effect, there, less(chord, large[n].at));
        if (s.gain > best.gain) best = std::move(s);
      }
    }
    return best;
  }

 private:
  struct Linear {
    std::size_t column;
    int at;       ///< index in the reduced sums
    double from;  ///< coordinate around which it is linearised, less that of the vehicle file
  };

  /// Sums for the residual less `much` times a regressor.
  Reduced less(int regressor, double much) const {
    Reduced r = reduced_;
    const Index last = r.sums.rows() - 1;
    r.sums(last, last) += much * (much * r.sums(regressor, regressor) - 2 * r.sums(regressor, last));
    r.sums.col(last).head(last) -= much * r.sums.col(regressor).head(last);
    r.sums.row(last).head(last) = r.sums.col(last).head(last).transpose();
    return r;
  }

  ScreenedEffect around(const std::string& effect, std::vector<Linear> magnitudes, const Reduced& reduced) const {
    const auto one_sided = [&](const Linear& m) { return columns_[m.column].one_sided; };
    ScreenedEffect s{effect, 0, VectorXd::Zero(columns_[magnitudes.front().column].unknowns)};
    for (const Linear& m : magnitudes) s.coordinates[columns_[m.column].unknown] = columns_[m.column].from;
    // jointly with the effect's background magnitude, or instead of it, which saves the cost of its scale
    const std::vector<double>& scales = fitter_.scales().effects;
    std::vector<int> others = base_;
    double saved = 0;
    for (const std::string& name : backgrounds_of(effect)) {
      const int place = fitter_.place_of(name);
      const auto of_it = [&](int i) { return effects_[static_cast<std::size_t>(i)] == place; };
      if (place < 0 || std::erase_if(others, of_it) == 0 || static_cast<std::size_t>(place) >= scales.size()) continue;
      saved += Evidence::scale_cost_nats(scales[static_cast<std::size_t>(place)],
                                         fitter_.evidence().discrepancy().scale_prior(name), fitter_.scales());
    }
    const auto with = [&](std::vector<int> chosen) {
      for (const Linear& m : magnitudes) chosen.push_back(m.at);
      return Evidence::posterior(reduced, chosen, mean_(chosen));
    };
    for (bool whole = true; !magnitudes.empty(); whole = false) {
      Posterior p = with(base_), instead = with(others);
      instead.log_evidence += saved;
      if (instead.log_evidence > p.log_evidence) p = std::move(instead);
      const auto at = [&](std::size_t k) { return p.mean.size() - static_cast<Index>(magnitudes.size() - k); };
      const auto coordinate = [&](std::size_t k) {
        return columns_[magnitudes[k].column].from + magnitudes[k].from + p.mean[at(k)];
      };
      const auto positive = [&](std::size_t k) {
        return log_twice_positive(coordinate(k), std::sqrt(p.covariance(at(k), at(k))));
      };
      if (whole) s.gain = p.log_evidence - without_;
      // sets the most negative of forbidden magnitudes to 0: of two that compensate, only one is present. The
      // probability of its positive side stays in the gain
      std::size_t worst = magnitudes.size();
      for (std::size_t k = 0; k < magnitudes.size(); ++k)
        if (one_sided(magnitudes[k]) && coordinate(k) < (worst == magnitudes.size() ? 0 : coordinate(worst))) worst = k;
      if (worst == magnitudes.size()) {
        for (std::size_t k = 0; k < magnitudes.size(); ++k) {
          if (one_sided(magnitudes[k])) s.gain += positive(k);
          s.coordinates[columns_[magnitudes[k].column].unknown] = coordinate(k);
        }
        break;
      }
      s.gain += positive(worst);
      magnitudes.erase(magnitudes.begin() + static_cast<std::ptrdiff_t>(worst));
    }
    return s;
  }

  const Fitter& fitter_;
  const std::vector<MagnitudeColumn>& columns_;
  std::vector<int> effects_;    ///< [regressor of the fit] its Regressors::effects
  std::vector<int> base_, at_;  ///< indices in the reduced sums: regressors of the fit; magnitudes
  Reduced reduced_;
  VectorXd mean_;
  double without_ = 0;
};

/// Distance of near steps, in standard deviations of the background. Choice.
constexpr double kNearSd = 2;
/// Smallest distance of near steps, in prior standard deviations. Choice: shorter differences are rough.
constexpr double kMinNearReach = 0.05;

}  // namespace

std::vector<MagnitudeStep> magnitude_steps(const sim::Randomisation& uncertain, const VectorXd& at,
                                           const std::vector<std::string>& withheld, const NearSteps& near) {
  std::vector<MagnitudeStep> steps;
  const model::Vehicle now = Hypothesis(uncertain, {}).vehicle(at).vehicle;
  for (const model::CatalogueEffect& e : model::catalogue_of(uncertain.nominal())) {
    const std::string id = e.info.id;
    if (std::ranges::count(withheld, id)) continue;
    const Hypothesis h(uncertain, {id});
    const double reach = std::clamp(near.sd ? kNearSd * near.sd(id) : 0, kMinNearReach, kMagnitudeReach);
    const Index first = at.size();
    VectorXd here = h.start(now);
    here.head(first) = at;
    for (Index i = first; i < h.size(); ++i) {
      const Unknown& u = h.unknowns()[static_cast<std::size_t>(i)];
      if (!u.magnitude) continue;
      VectorXd there = here;
      there[i] += kMagnitudeReach;
      const bool one_sided = u.low >= 0;
      steps.push_back({{id, i - first, h.size() - first, one_sided, here[i]}, h.vehicle(there), {}, {}, reach, {}});
      for (const double sign : {1.0, -1.0}) {
        there[i] = here[i] + sign * reach;
        if (near.sd && (!u.in_log || (near.delays && !u.linear())) && (sign > 0 || !one_sided))
          steps.back().near.push_back(h.vehicle(h.bounded(there)));
      }
      for (std::size_t n = 2; n <= kMaxSteps && one_sided; ++n) {
        there[i] = here[i] + kMagnitudeReach * static_cast<double>(n);
        if (h.bounded(there)[i] != there[i]) break;
        steps.back().further.push_back(h.vehicle(there));
      }
      there[i] = here[i] + kMagnitudeReach;
      for (Index shape = first; near.shapes && shape < h.size(); ++shape) {
        if (h.unknowns()[static_cast<std::size_t>(shape)].magnitude) continue;
        VectorXd other = there;
        other[shape] = 1;
        steps.back().shaped.push_back(h.vehicle(h.bounded(other)));
      }
    }
  }
  return steps;
}

std::vector<ScreenedEffect> screen(const Fitter& fitter, const Fit& fit, const std::vector<MagnitudeColumn>& columns,
                                   const BasisCoefficients& law_sd) {
  const Screening screening(fitter, fit, columns, law_sd);
  std::vector<ScreenedEffect> ranking;
  for (const MagnitudeColumn& c : columns)
    if (ranking.empty() || ranking.back().effect != c.effect) ranking.push_back(screening.screened(c.effect));
  std::ranges::sort(ranking, std::greater{}, &ScreenedEffect::gain);
  return ranking;
}

}  // namespace flappy::gap
