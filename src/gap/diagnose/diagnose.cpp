#include "gap/diagnose/diagnose.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>

#include "gap/diagnose/verdict.hpp"
#include "gap/evidence/screening.hpp"
#include "gap/localise/closure.hpp"
#include "io/parallel.hpp"
#include "model/effects/registry.hpp"

namespace flappy::gap {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

class Diagnoser {
 public:
  Diagnoser(const std::vector<PredictedFlight>& flights, const sim::Randomisation& uncertain,
            const DiagnoseOptions& options)
      : flights_(flights),
        uncertain_(uncertain),
        options_(options),
        rule_(options.rule),
        threads_(io::thread_count(options.threads)),
        all_(flights.size(), 1),
        evidence_(flights, options.discrepancy, threads_),
        fitter_(flights, evidence_, threads_) {}

  Diagnosis run() {
    Diagnosis d;
    progress(0, "fitting parameters");
    const Hypothesis plain(uncertain_, {});
    const Linearised nominal = fit_parameters(plain);
    progress(0.3, "screening effects");
    const std::vector<SizeColumn> columns = size_columns({}, parameters_);
    std::vector<BasisCoefficients> background;
    for (const SizeColumn& c : columns) background.push_back(options_.discrepancy.background_sd(c.effect) * c.change);
    fitter_.set_background(std::move(background));
    parameters_ = fitter_.refit(plain, parameters_, 4);
    d.parameters = parameters_;
    around_ = row_context_of(flights_, noise_sd());
    loss_ = losses_of(around_, parameters_.point.residual);
    d.hypotheses.push_back(weigh(ScoredHypothesis::Kind::none, plain, nominal, std::log(rule_.prior.none)));
    plain_ = log_evidence(plain, parameters_.point);
    d.hypotheses.push_back(
        weigh(ScoredHypothesis::Kind::parameters, plain, parameters_.point, std::log(rule_.prior.parameters)));
    ScoredHypothesis unknown = explain_freely(plain, parameters_.point, std::log(rule_.prior.unknown));
    const double parameters = d.hypotheses[1].log_evidence;

    std::vector<ScoredHypothesis> singles;
    const std::vector<Screened> screened = screen(evidence_, fitter_, parameters_, columns);
    for (std::size_t i = 0; i < screened.size(); ++i) {
      const Screened& s = screened[i];
      ScoredHypothesis a;
      if (static_cast<int>(i) < options_.finalists && s.gain > 0 &&
          progress(0.4 + 0.3 * static_cast<double>(i) / options_.finalists, "fitting " + s.effect))
        a = fit_effects({s});
      singles.push_back(vanished(a) ? leave_open(s, columns) : std::move(a));
    }
    std::ranges::sort(singles, std::greater{}, &ScoredHypothesis::log_evidence);
    // further effects jointly with the best
    if (!singles.empty() && singles.front().fitted() && singles.front().log_evidence > parameters) {
      ScoredHypothesis best = singles.front();
      for (int n = 2; n <= options_.most_effects; ++n) {
        if (!progress(0.7 + 0.1 * n, "fitting another jointly with " + best.effects.back())) break;
        const auto further = screen(evidence_, fitter_, best.fit, size_columns(best.effects, best.fit));
        if (further.empty() || further.front().gain < rule_.gain.further_screened_nats) break;
        std::vector<Screened> set = screened_of(best);
        set.push_back(further.front());
        ScoredHypothesis more = fit_effects(set);
        if (vanished(more) || more.log_evidence < best.log_evidence) break;
        singles.push_back(more);
        best = std::move(more);
      }
    }
    // what looks like an entry at first, and leaves more than that entry's equation may
    const auto best = std::ranges::max_element(singles, {}, &ScoredHypothesis::log_evidence);
    if (best != singles.end() && best->fitted()) {
      const double log_prior = std::log(rule_.prior.unknown / static_cast<double>(model::effects().size()));
      ScoredHypothesis freer = explain_freely(Hypothesis(uncertain_, best->effects), best->fit.point, log_prior);
      if (!freer.terms.empty() && freer.log_evidence > unknown.log_evidence) unknown = std::move(freer);
      unknown.log_evidence -= std::max(0.0, best->log_evidence - parameters - rule_.unknown.large_effect_nats);
    }
    d.hypotheses.push_back(std::move(unknown));
    for (ScoredHypothesis& a : singles) {
      if (a.fitted()) widen(a.fit, Hypothesis(uncertain_, a.effects), rule_);
      d.hypotheses.push_back(std::move(a));
    }
    d.complete = !stopped_;
    set_probabilities(d.hypotheses, rule_);
    d.conclusion = conclude(d.hypotheses, rule_);
    d.nominal = nominal.residual;
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

  /// Leaves the fit in parameters_ and returns the nominal vehicle's residual under the noise found with it.
  Linearised fit_parameters(const Hypothesis& plain) {
    const Directions none{MatrixXd(plain.size(), 0), VectorXd(0)};
    const Linearised nominal = fitter_.linearise(plain, plain.start(), none);
    evidence_.learn_weights(nominal.residual);
    Fit fit = fitter_.fit(plain, plain.start(), 3);
    for (int i = 0; i < 2; ++i) {
      evidence_.learn_weights(fit.point.residual);
      fit = fitter_.refit(plain, fit, 3);
    }
    evidence_.learn_noise(fit.point.residual);
    parameters_ = fitter_.refit(plain, fit, 6);
    return fitter_.linearise(plain, plain.start(), none);
  }

  Posterior posterior(const Linearised& l, const Columns& c, const std::vector<char>& use,
                      const BasisCoefficients& sd) const {
    return Evidence::posterior(evidence_.reduce(l.statistics, c.columns, use, sd), c.chosen, c.mean());
  }

  /// Whatever models are mistaken by; of what so many effects gain over the parameters, what is more than chance.
  double log_evidence(const Hypothesis& h, const Linearised& l) const {
    const Columns c = fitter_.columns_of(l);
    const BasisCoefficients own = fitter_.form_error(h, l);
    const BasisCoefficients discrepancy = evidence_.discrepancy_sd();
    std::vector<double> each;
    for (const ModelDiscrepancy::Scale& m : options_.discrepancy.scales)
      each.push_back(std::log(m.probability) +
                     posterior(l, c, all_, together(m.factor * discrepancy, own)).log_evidence);
    const double most = *std::ranges::max_element(each);
    double sum = 0;
    for (const double e : each) sum += std::exp(e - most);
    const double all = most + std::log(sum), gain = all - plain_;
    if (h.effects().empty()) return all;
    const double by_chance =
        rule_.gain.by_chance_nats + rule_.gain.further_by_chance_nats * static_cast<double>(h.effects().size() - 1);
    return plain_ + std::max(gain - by_chance, std::min(gain, 0.0));
  }

  static BasisCoefficients together(const BasisCoefficients& a, const BasisCoefficients& b) {
    return (a.array().square() + b.array().square()).sqrt();
  }

  ScoredHypothesis weigh(ScoredHypothesis::Kind kind, const Hypothesis& h, const Linearised& l,
                         double log_prior) const {
    ScoredHypothesis a;
    a.kind = kind;
    a.effects = h.effects();
    a.log_evidence = log_evidence(h, l) + log_prior;
    return a;
  }

  struct Possible {
    Term term;
    double cost;  ///< nats of choosing it
  };

  /// All terms that there may be.
  std::vector<Possible> possible_terms() const {
    std::vector<Possible> all;
    for (const bool every_channel : {false, true})
      for (const bool every_harmonic : {false, true}) {
        const std::size_t first = all.size();
        for (int channel = 0; channel < (every_channel ? 1 : kChannels); ++channel)
          for (int harmonic = 0; harmonic <= (every_harmonic ? 0 : kHarmonics); ++harmonic) {
            Term t{every_channel ? Term::kAll : channel, every_harmonic ? Term::kAll : harmonic};
            double signal = 0;
            for (int g = 0; g < kGroups; ++g)
              if (t.has(g) && has_rows(g / kCoefficients, g % kCoefficients)) signal += evidence_.signal(g);
            for (t.function = 0; signal > 0 && t.function < evidence_.basis().size(); ++t.function)
              for (const double times : rule_.unknown.times)
                all.push_back({{t.channel, t.harmonic, t.function, times}, 0});
          }
        constexpr double kKinds = 4;
        for (std::size_t i = first; i < all.size(); ++i)
          all[i].cost = std::log(kKinds * static_cast<double>(all.size() - first)) + rule_.unknown.term_cost_nats;
      }
    return all;
  }

  /// Gives single functions of the regime more room than every model needs, as long as that pays.
  ScoredHypothesis explain_freely(const Hypothesis& h, const Linearised& l, double log_prior) const {
    const Columns c = fitter_.columns_of(l);
    const BasisCoefficients discrepancy = evidence_.discrepancy_sd();
    BasisCoefficients sd = together(discrepancy, fitter_.form_error(h, l));
    Posterior now = posterior(l, c, all_, sd);
    ScoredHypothesis a;
    a.kind = ScoredHypothesis::Kind::unknown;
    a.jointly_with = h.effects();
    double gained = 0;
    std::vector<Possible> possible = possible_terms();
    for (int n = 0; n < rule_.unknown.terms; ++n) {
      SufficientStatistics settled = l.statistics;  // with the columns where they are most probable
      for (std::size_t k = 0; k < c.columns.size(); ++k)
        evidence_.add(-now.mean[static_cast<Index>(k)], *c.columns[k], settled);
      std::map<double, BasisCoefficients> gains;
      for (const double times : rule_.unknown.times)
        gains[times] = evidence_.local_gains(settled, all_, sd, times * discrepancy);
      for (Possible& p : possible) {
        p.term.gain = -p.cost;
        for (int g = 0; g < kGroups; ++g)
          if (p.term.has(g)) p.term.gain += gains[p.term.times](g, p.term.function);
      }
      std::ranges::partial_sort(possible, possible.begin() + rule_.unknown.tried, std::greater{},
                                [](const Possible& p) { return p.term.gain; });
      // of the first, what they gain with columns that follow
      std::optional<Term> best;
      BasisCoefficients best_sd;
      Posterior best_posterior;
      for (int i = 0; i < rule_.unknown.tried; ++i) {
        Term t = possible[static_cast<std::size_t>(i)].term;
        BasisCoefficients room = sd;
        for (int g = 0; g < kGroups; ++g)
          if (t.has(g)) room(g, t.function) = std::hypot(sd(g, t.function), t.times * discrepancy(g, t.function));
        Posterior p = posterior(l, c, all_, room);
        t.gain = p.log_evidence - now.log_evidence - possible[static_cast<std::size_t>(i)].cost;
        if (best && t.gain <= best->gain) continue;
        best = t;
        best_sd = std::move(room);
        best_posterior = std::move(p);
      }
      if (best->gain < 0) break;
      gained += best->gain;
      sd = std::move(best_sd);
      now = std::move(best_posterior);
      a.terms.push_back(*best);
    }
    if (a.terms.empty()) gained = -possible.front().cost;  // a cause has to show somewhere
    // what the terms gain, beside what is known without them
    a.log_evidence = log_evidence(h, l) + gained + log_prior;
    return a;
  }

  /// What every size would change beside a fit.
  std::vector<SizeColumn> size_columns(const std::vector<std::string>& jointly_with, const Fit& fit) const {
    std::vector<SizeColumn> columns;
    std::vector<Candidate> candidates;
    for (SizeStep& s : size_steps(uncertain_, jointly_with, fit.point.at, options_.withheld)) {
      columns.push_back({s.effect, s.unknown, {}});
      candidates.push_back(std::move(s.candidate));
    }
    std::vector<Residuals> rows = residuals(flights_, candidates, threads_);
    for (std::size_t i = 0; i < columns.size(); ++i) {
      if (rows[i].empty()) continue;  // it comes apart
      for (std::size_t f = 0; f < rows[i].size(); ++f)
        for (std::size_t k = 0; k < rows[i][f].size(); ++k)
          rows[i][f][k] = (fit.point.residual[f][k] - rows[i][f][k]) / kSizeReach;
      columns[i].change = evidence_.basis_coefficients(rows[i]);
    }
    std::erase_if(columns, [](const SizeColumn& c) { return c.change.size() == 0; });
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
  ScoredHypothesis leave_open(const Screened& s, const std::vector<SizeColumn>& columns) const {
    ScoredHypothesis a;
    a.kind = ScoredHypothesis::Kind::effect;
    a.effects = {s.effect};
    const Hypothesis h(uncertain_, a.effects);
    std::vector<BasisCoefficients> own(unknowns_of(s.effect).size());
    for (const SizeColumn& c : columns)
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
  const sim::Randomisation& uncertain_;
  const DiagnoseOptions& options_;
  const VerdictRule& rule_;
  int threads_;
  std::vector<char> all_;
  Evidence evidence_;
  Fitter fitter_;
  Fit parameters_;
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
