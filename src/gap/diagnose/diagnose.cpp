#include "gap/diagnose/diagnose.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "gap/diagnose/verdict.hpp"
#include "gap/localise/closure.hpp"
#include "io/parallel.hpp"
#include "model/effects/registry.hpp"

namespace flappy::gap {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Sets of effects of which it is asked whether something is left beside them.
constexpr std::size_t kMostRemainders = 3;

class Diagnoser {
 public:
  Diagnoser(const std::vector<PredictedFlight>& flights, const sim::Randomisation& uncertain,
            const DiagnoseOptions& options)
      : flights_(flights),
        options_(options),
        rule_(options.rule),
        threads_(io::thread_count(options.threads)),
        all_(flights.size(), 1),
        robot_(flights, uncertain, options.discrepancy, options.withheld, threads_) {}

  Diagnosis run() {
    Diagnosis d;
    progress(0, "fitting parameters");
    robot_.fit_parameters();
    progress(0.3, "screening effects");
    robot_.refit_beside_background();
    const Hypothesis& plain = robot_.plain();
    d.parameters = parameters_;
    around_ = row_context_of(flights_, noise_sd());
    loss_ = losses_of(around_, parameters_.point.residual);
    d.hypotheses.push_back(weigh(ScoredHypothesis::Kind::none, plain, robot_.nominal(), std::log(rule_.prior.none)));
    d.hypotheses.push_back(
        weigh(ScoredHypothesis::Kind::parameters, plain, parameters_.point, std::log(rule_.prior.parameters)));
    const double parameters = d.hypotheses[1].log_evidence;
    plain_ = parameters - d.hypotheses[1].log_prior;
    d.hypotheses.push_back(explain_freely(plain, parameters_.point, std::log(rule_.prior.unknown)));

    std::vector<ScoredHypothesis> singles;
    const std::vector<Screened> screened = screen(evidence_, fitter_, parameters_, robot_.sizes());
    for (std::size_t i = 0; i < screened.size(); ++i) {
      const Screened& s = screened[i];
      ScoredHypothesis a;
      if (static_cast<int>(i) < options_.finalists && s.gain > 0 &&
          progress(0.4 + 0.3 * static_cast<double>(i) / options_.finalists, "fitting " + s.effect))
        a = fit_effects({s});
      singles.push_back(vanished(a) ? leave_open(s) : std::move(a));
    }
    const auto counts = [&](const ScoredHypothesis& a) { return beyond_chance(a, plain_, rule_); };
    std::ranges::sort(singles, std::greater{}, counts);
    // further effects jointly with the best
    if (!singles.empty() && singles.front().fitted() && counts(singles.front()) > parameters) {
      ScoredHypothesis best = singles.front();
      for (int n = 2; n <= options_.most_effects; ++n) {
        if (!progress(0.7 + 0.1 * n, "fitting another jointly with " + best.effects.back())) break;
        const auto further = screen(evidence_, fitter_, best.fit, beside(best.effects, robot_.sizes()));
        if (further.empty() || further.front().gain < rule_.gain.further_screened_nats) break;
        std::vector<Screened> set = screened_of(best);
        set.push_back(further.front());
        ScoredHypothesis more = fit_effects(set);
        if (vanished(more) || counts(more) < counts(best)) break;
        singles.push_back(more);
        best = std::move(more);
      }
    }
    // what leaves more than that entry's equation may
    std::ranges::sort(singles, std::greater{}, counts);
    for (std::size_t i = 0, n = singles.size(); i < std::min<std::size_t>(n, kMostRemainders); ++i) {
      const ScoredHypothesis& a = singles[i];
      if (!a.fitted() || counts(a) < parameters) break;
      ScoredHypothesis more = explain_freely(Hypothesis(uncertain_, a.effects), a.fit.point, 0);
      if (more.terms.empty()) continue;
      more.kind = ScoredHypothesis::Kind::effect;
      more.effects = a.effects;
      more.fit = a.fit;
      more.log_evidence += a.log_prior + std::log(rule_.prior.remainder);
      more.log_prior = a.log_prior + std::log(rule_.prior.remainder);
      singles.push_back(std::move(more));
    }
    for (ScoredHypothesis& a : singles) {
      if (a.fitted()) widen(a.fit, Hypothesis(uncertain_, a.effects), rule_);
      d.hypotheses.push_back(std::move(a));
    }
    d.complete = !stopped_;
    set_probabilities(d.hypotheses, rule_);
    d.conclusion = conclude(d.hypotheses, rule_);
    const ScoredHypothesis& concluded = d.hypotheses[d.conclusion.hypothesis];
    d.sensors = concluded.fitted() ? robot_.sensors(Hypothesis(uncertain_, concluded.effects), concluded.fit)
                                   : robot_.sensors(plain, parameters_);
    d.minors = uncertain_.minors();
    d.nominal = robot_.nominal().residual;
    hold_out(d);
    d.noise_sd = noise_sd();
    return d;
  }

 private:
  std::vector<double> noise_sd() const {
    std::vector<double> sd;
    for (int g = 0; g < kGroups; ++g) sd.push_back(evidence_.noise_sd(g));
    return sd;
  }

  Posterior posterior(const Linearised& l, const Columns& c, const std::vector<char>& use,
                      const BasisCoefficients& sd) const {
    return Evidence::posterior(evidence_.reduce(l.statistics, c.columns, use, sd), c.chosen, c.mean());
  }

  static BasisCoefficients together(const BasisCoefficients& a, const BasisCoefficients& b) {
    return (a.array().square() + b.array().square()).sqrt();
  }

  ScoredHypothesis weigh(ScoredHypothesis::Kind kind, const Hypothesis& h, const Linearised& l,
                         double log_prior) const {
    ScoredHypothesis a;
    a.kind = kind;
    a.effects = h.effects();
    a.log_evidence = robot_.weigh(h, l).posterior.log_evidence + log_prior;
    a.log_prior = log_prior;
    return a;
  }

  /// Lets blocks of the discrepancy be larger than models are, wherever that pays.
  ScoredHypothesis explain_freely(const Hypothesis& h, const Linearised& l, double log_prior) const {
    const Weighed w = robot_.weigh(h, l, rule_.unknown.freeing_nats);
    ScoredHypothesis a;
    a.kind = ScoredHypothesis::Kind::unknown;
    a.jointly_with = h.effects();
    a.log_evidence = w.posterior.log_evidence + log_prior;
    a.log_prior = log_prior;
    const RegimeBasis& basis = evidence_.basis();
    for (std::size_t block = 0; block < w.scales.free.size(); ++block) {
      if (!w.scales.free[block]) continue;
      // the function that takes most of it
      double sum = 0, most = 0;
      Term t{static_cast<int>(block) / kClasses / (kHarmonics + 1),
             static_cast<int>(block) / kClasses % (kHarmonics + 1)};
      for (int g = 0; g < kGroups; ++g)
        for (int i = 0; i < basis.size(); ++i) {
          if (Evidence::block_of(g, basis.kind(i)) != static_cast<int>(block)) continue;
          const double square = std::pow(w.delta(g, i), 2);
          sum += square;
          if (square > most) most = square, t.function = i;
        }
      t.times = w.scales.blocks[block] / w.scales.robot;
      t.gain = 0.5 * sum * (t.times * t.times - 1) - rule_.unknown.freeing_nats;
      a.terms.push_back(t);
    }
    std::ranges::sort(a.terms, std::greater{}, &Term::gain);
    if (a.terms.empty()) a.log_evidence -= rule_.unknown.freeing_nats;  // a cause has to show somewhere
    return a;
  }

  /// Columns of the effects that are not there yet; that these make them others counts for little.
  static std::vector<SizeColumn> beside(const std::vector<std::string>& effects, std::vector<SizeColumn> columns) {
    std::erase_if(columns, [&](const SizeColumn& c) { return std::ranges::count(effects, c.effect) > 0; });
    return columns;
  }

  /// Where a fit left its effects, to go on from.
  std::vector<Screened> screened_of(const ScoredHypothesis& a) const {
    std::vector<Screened> list;
    Index at = Hypothesis(uncertain_, {}).size();
    for (const std::string& e : a.effects) {
      const auto n = static_cast<Index>(unknowns_of(e).size());
      list.push_back({e, 0, a.fit.point.at.segment(at, n)});
      at += n;
    }
    return list;
  }

  /// Whether a fit left one of its effects without any size.
  bool vanished(const ScoredHypothesis& a) const {
    if (!a.fitted()) return true;
    const Hypothesis h(uncertain_, a.effects);
    for (const std::string& e : a.effects) {
      double largest = 0;
      for (Index i = h.shared(); i < h.size(); ++i) {
        const Unknown& u = h.unknowns()[static_cast<std::size_t>(i)];
        if (u.effect == e && u.size) largest = std::max(largest, std::abs(a.fit.point.at[i]));
      }
      if (largest < rule_.gain.vanished_size) return true;
    }
    return false;
  }

  /// An entry that would gain nothing: what the flights do not tell of it stays as it was thought before.
  ScoredHypothesis leave_open(const Screened& s) const {
    ScoredHypothesis a;
    a.kind = ScoredHypothesis::Kind::effect;
    a.effects = {s.effect};
    const Hypothesis h(uncertain_, a.effects);
    std::vector<BasisCoefficients> own(unknowns_of(s.effect).size());
    for (const SizeColumn& c : robot_.sizes())
      if (c.effect == s.effect) own[static_cast<std::size_t>(c.unknown)] = c.change;
    a.fit = fitter_.linear(h, parameters_, own);
    a.log_evidence = plain_ + std::min(s.gain, 0.0) + log_prior_of_one();
    Posterior& p = a.fit.posterior;
    const Index first = h.shared();
    if (h.unknowns()[static_cast<std::size_t>(first)].low < 0) return a;
    // of its first size what is probable beyond 0, with all else as that has it
    const double mean = p.mean[first], sd = std::sqrt(p.covariance(first, first)), t = mean / sd;
    const double beyond =
        std::exp(-0.5 * t * t) / (std::sqrt(std::numbers::pi / 2) * std::erfc(-t / std::numbers::sqrt2));
    p.mean += p.covariance.col(first) / sd * (t > -5 ? beyond : -t);
    return a;
  }

  double log_prior_of_one() const {
    return std::log(rule_.prior.effect / static_cast<double>(model::effects().size()));
  }

  ScoredHypothesis fit_effects(const std::vector<Screened>& set) const {
    std::vector<std::string> effects;
    for (const Screened& s : set) effects.push_back(s.effect);
    const Hypothesis h(uncertain_, effects);
    VectorXd start = h.start();
    start.head(h.shared()) = parameters_.point.at.head(h.shared());
    Index at = h.shared();
    for (const Screened& s : set) {
      start.segment(at, s.coordinates.size()) = s.coordinates;
      at += s.coordinates.size();
    }
    Fit fit = fitter_.fit(h, h.bounded(start), parameters_, 6);
    if (fit.point.residual.empty() || refuted(loss_, losses_of(around_, fit.point.residual), rule_)) {
      ScoredHypothesis none;
      none.kind = ScoredHypothesis::Kind::effect;
      none.effects = effects;
      return none;
    }
    double log_prior = log_prior_of_one();
    for (std::size_t i = 1; i < set.size(); ++i)
      log_prior += std::log(rule_.prior.further_effect / static_cast<double>(model::effects().size()));
    for (Index i = h.shared(); i < h.size(); ++i) {
      const Unknown& u = h.unknowns()[static_cast<std::size_t>(i)];
      if (u.size && u.low >= 0) log_prior += std::log(2.0);
    }
    ScoredHypothesis a = weigh(ScoredHypothesis::Kind::effect, h, fit.point, log_prior);
    a.fit = std::move(fit);
    return a;
  }

  /// What is left in every flight with the fit to the others; of a single flight, with its own.
  void hold_out(Diagnosis& d) const {
    std::vector<Candidate> candidates;
    std::vector<Residuals*> of;
    const auto add = [&](const Hypothesis& h, const Linearised& l, const BasisCoefficients& sd, Residuals& left) {
      const Columns c = fitter_.columns_of(l);
      for (std::size_t f = 0; f < all_.size(); ++f) {
        std::vector<char> others = all_;
        if (all_.size() > 1) others[f] = 0;
        const Posterior p = posterior(l, c, others, sd);
        VectorXd at = l.at;
        Index i = 0;
        for (std::size_t k = 0; k < l.columns.size(); ++k)
          if (l.columns[k].size() > 0) at += p.mean[i++] * l.directions.axes.col(static_cast<Index>(k));
        candidates.push_back(h.candidate(h.bounded(at)));
      }
      of.push_back(&left);
    };
    add(Hypothesis(uncertain_, {}), parameters_.point, evidence_.discrepancy_sd(), d.refit);
    for (ScoredHypothesis& a : d.hypotheses)
      if (a.fitted()) {
        const Hypothesis h(uncertain_, a.effects);
        add(h, a.fit.point, together(evidence_.discrepancy_sd(), fitter_.form_error(h, a.fit.point)), a.left);
      }
    std::vector<Residuals> rows = residuals(flights_, candidates, threads_);
    for (std::size_t i = 0; i < of.size(); ++i)
      for (std::size_t f = 0; f < all_.size(); ++f) {
        Residuals& s = rows[i * all_.size() + f];
        of[i]->push_back(s.empty() ? Rows() : std::move(s[f]));
      }
  }

  /// Whether to go on.
  bool progress(double share, const std::string& what) {
    stopped_ = stopped_ || (options_.progress && !options_.progress(share, what));
    return !stopped_;
  }

  const std::vector<PredictedFlight>& flights_;
  const DiagnoseOptions& options_;
  const VerdictRule& rule_;
  int threads_;
  std::vector<char> all_;
  RobotFit robot_;
  const sim::Randomisation& uncertain_ = robot_.uncertain();
  const Evidence& evidence_ = robot_.evidence();
  const Fitter& fitter_ = robot_.fitter();
  const Fit& parameters_ = robot_.parameters();
  RowContext around_;
  Losses loss_;       ///< of the parameters alone
  double plain_ = 0;  ///< log evidence of the parameters alone
  bool stopped_ = false;
};

}  // namespace

Diagnosis diagnose(const std::vector<PredictedFlight>& flights, const sim::Randomisation& uncertain,
                   const DiagnoseOptions& options) {
  return Diagnoser(flights, uncertain, options).run();
}

}  // namespace flappy::gap
