#include "gap/next/separation.hpp"

#include <algorithm>
#include <cmath>

#include "gap/answer/verdict.hpp"
#include "gap/next/expected_nats.hpp"
#include "io/parallel.hpp"
#include "model/effects/registry.hpp"

namespace flappy::gap {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Doublings and halvings of a magnitude. Derived: up to kMaxFactor.
constexpr int kDoublings = 4;
static_assert(1 << kDoublings == static_cast<int>(kMaxFactor));

/// The vehicle with the effect at `times` its typical magnitude.
VehicleHypothesis vehicle_with(const RobotFit& robot, const model::CatalogueEffect& effect, double times) {
  const Hypothesis h(robot.uncertain(), {effect.info.id});
  VectorXd at = h.start();
  for (Index i = h.shared(); i < h.size(); ++i) {
    const Unknown& u = h.unknowns()[static_cast<std::size_t>(i)];
    const auto p =
        std::ranges::find_if(effect.parameters, [&](const model::EffectParameter& x) { return x.name == u.name; });
    at[i] = u.coordinate(p->typical * (u.magnitude ? times : 1));
  }
  return h.vehicle(h.bounded(at));
}

/// Gains, [rival].
VectorXd gains_of(const Fitter& fitter, const Fit& fit, const std::vector<MagnitudeColumn>& columns,
                  const BasisCoefficients& law_sd, const std::vector<std::string>& rivals) {
  VectorXd gains = VectorXd::Zero(static_cast<Index>(rivals.size()));
  for (const ScreenedEffect& s : screen(fitter, fit, columns, law_sd))
    if (const auto rival = std::ranges::find(rivals, s.effect); rival != rivals.end())
      gains[rival - rivals.begin()] = s.gain;
  return gains;
}

/// Probability of a rival, given the gains of all.
double probability_of(Index effect, const std::vector<std::string>& rivals, const VectorXd& gains,
                      const VerdictRule& rule) {
  std::vector<ScoredHypothesis> all(3);
  all[0].kind = HypothesisKind::none, all[0].log_prior = std::log(rule.prior.none);
  all[1].kind = HypothesisKind::parameters, all[1].log_prior = std::log(rule.prior.parameters);
  all[2].kind = HypothesisKind::unknown, all[2].log_prior = std::log(rule.prior.unknown);
  for (ScoredHypothesis& a : all) a.log_evidence = a.log_prior;
  const auto n = static_cast<double>(gains.size());
  for (Index i = 0; i < gains.size(); ++i) {
    ScoredHypothesis a;
    a.kind = HypothesisKind::effect;
    a.effects = {rivals[static_cast<std::size_t>(i)]};
    a.log_prior = std::log(rule.prior.effect / n);
    a.log_evidence = a.log_prior + gains[i];
    all.push_back(std::move(a));
  }
  set_probabilities(all, rule);
  const std::vector<std::string> asked = {rivals[static_cast<std::size_t>(effect)]};
  return std::ranges::find(all, asked, &ScoredHypothesis::effects)->probability;
}

class Separator {
 public:
  Separator(const Flights& flights, const RobotFit& robot, const std::map<std::string, double>& asked,
            const VerdictRule& rule, int threads)
      : flights_(flights), robot_(robot), rule_(rule), threads_(threads), unchanged_(robot.parameters()) {
    for (auto& flight : unchanged_.statistics.sums)
      for (VectorXd& sums : flight) sums.setZero();
    for (const MagnitudeColumn& m : robot.magnitudes())
      if ((rivals_.empty() || rivals_.back() != m.effect) && m.change.cwiseAbs().maxCoeff() > kNoChange)
        rivals_.push_back(m.effect);
    for (std::size_t r = 0; r < rivals_.size(); ++r)
      if (const auto at = asked.find(rivals_[r]); at != asked.end())
        asked_.push_back(
            {model::find_effect(robot.uncertain().nominal(), rivals_[r]), static_cast<Index>(r), at->second});
  }

  Separation run(bool sure) {
    const std::vector<std::optional<VectorXd>> gains = gains_at(std::vector<double>(asked_.size(), 1));
    const std::vector<std::optional<double>> from =
        sure ? sure_from(gains) : std::vector<std::optional<double>>(gains.size());
    Separation s;
    s.rivals = rivals_;
    s.rivals.emplace_back("parameters");
    const auto n = static_cast<Index>(rivals_.size());
    for (std::size_t t = 0; t < gains.size(); ++t) {
      if (!gains[t]) continue;
      VectorXd over_parameters(n + 1);
      over_parameters << *gains[t], 0;
      s.effects.emplace_back(asked_[t].effect->info.id);
      s.nats.conservativeResize(s.nats.rows() + 1, n + 1);
      s.nats.bottomRows(1) = expected_nats(over_parameters, asked_[t].rival).transpose();
      s.probability.push_back(probability_of(asked_[t].rival, rivals_, *gains[t], rule_));
      s.sure_from.push_back(from[t]);
    }
    return s;
  }

 private:
  struct Asked {
    const model::CatalogueEffect* effect;
    Index rival;
    double times;
  };

  /// [asked] Gains of all rivals if the robot has this effect, at `factors` times its magnitude; a factor of 0: not
  /// asked. None: the simulation diverges.
  std::vector<std::optional<VectorXd>> gains_at(const std::vector<double>& factors) const {
    std::vector<std::size_t> which;
    std::vector<VehicleHypothesis> vehicles;
    for (std::size_t t = 0; t < asked_.size(); ++t)
      if (factors[t] > 0) {
        which.push_back(t);
        vehicles.push_back(vehicle_with(robot_, *asked_[t].effect, asked_[t].times * factors[t]));
      }
    std::vector<Residuals> there = residuals(flights_, vehicles, threads_);
    std::vector<std::optional<VectorXd>> gains(asked_.size());
    io::parallel_for(which.size(), threads_, [&](std::size_t i) {
      Residuals& rows = there[i];
      if (rows.empty()) return;
      for (std::size_t f = 0; f < rows.size(); ++f)
        for (std::size_t k = 0; k < rows[f].size(); ++k) rows[f][k] = robot_.parameters().residual[f][k] - rows[f][k];
      const BasisCoefficients change = robot_.evidence().basis_coefficients(rows);
      Fit changed = unchanged_;
      robot_.evidence().add(1, change, changed.statistics);
      gains[which[i]] = gains_of(robot_.fitter(), changed, robot_.magnitudes(),
                                 robot_.fitter().law_sd_of(asked_[which[i]].effect->info.id, change, 1), rivals_);
    });
    return gains;
  }

  /// Doubles or halves magnitudes until they enclose where the probability is kSure; in between, gains are linear in
  /// the square of the magnitude. `at_one`: gains_at factors of 1.
  std::vector<std::optional<double>> sure_from(const std::vector<std::optional<VectorXd>>& at_one) const {
    const std::size_t n = asked_.size();
    const auto sure = [&](std::size_t t, const VectorXd& gains) {
      return probability_of(asked_[t].rival, rivals_, gains, rule_) >= kSure;
    };
    std::vector<std::optional<double>> found(n);
    std::vector<std::optional<VectorXd>> gains = at_one;
    std::vector<double> factors(n, 0), steps(n, 0);
    for (std::size_t t = 0; t < n; ++t)
      if (gains[t]) factors[t] = 1, steps[t] = sure(t, *gains[t]) ? 0.5 : 2;
    for (int k = 0; k < kDoublings && std::ranges::any_of(factors, [](double f) { return f > 0; }); ++k) {
      for (std::size_t t = 0; t < n; ++t) {
        if (factors[t] == 0) continue;
        const double before = std::exchange(factors[t], factors[t] * steps[t]);
        const double most = largest_factor(*asked_[t].effect) / asked_[t].times;
        if (factors[t] > most) factors[t] = before < most ? most : 0;
        steps[t] = factors[t] / before;
      }
      const std::vector<std::optional<VectorXd>> next = gains_at(factors);
      for (std::size_t t = 0; t < n; ++t) {
        if (factors[t] == 0) continue;
        const bool reached = next[t] && sure(t, *next[t]) == (steps[t] > 1);
        if (reached)
          found[t] = steps[t] > 1 ? between(t, factors[t] / steps[t], *gains[t], factors[t], *next[t])
                                  : between(t, factors[t], *next[t], factors[t] / steps[t], *gains[t]);
        if (reached || !next[t]) factors[t] = 0;
        gains[t] = next[t];
      }
    }
    for (std::size_t t = 0; t < n; ++t)
      if (factors[t] > 0 && steps[t] < 1) found[t] = factors[t];
    return found;
  }

  double between(std::size_t t, double low, const VectorXd& below, double high, const VectorXd& above) const {
    const double from = low, to = high;
    while (high / low > 1.02) {
      const double middle = std::sqrt(low * high), share = (middle * middle - from * from) / (to * to - from * from);
      (probability_of(asked_[t].rival, rivals_, below + share * (above - below), rule_) >= kSure ? high : low) = middle;
    }
    return high;
  }

  const Flights& flights_;
  const RobotFit& robot_;
  const VerdictRule& rule_;
  int threads_;
  Fit unchanged_;  ///< the fit of the parameters, whose residual is 0
  std::vector<std::string> rivals_;
  std::vector<Asked> asked_;
};

}  // namespace

double largest_factor(const model::CatalogueEffect& effect) {
  double most = 1e300;
  for (int k = 0; k < effect.info.magnitudes; ++k) {
    const model::EffectParameter& p = effect.parameters[static_cast<std::size_t>(k)];
    most = std::min(most, (p.typical > 0 ? p.high : p.low) / p.typical);
  }
  return most;
}

Separation separation_of(const Flights& flights, const RobotFit& robot, const std::map<std::string, double>& asked,
                         const VerdictRule& rule, int threads, bool sure) {
  return Separator(flights, robot, asked, rule, threads).run(sure);
}

}  // namespace flappy::gap
