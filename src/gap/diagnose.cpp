#include "gap/diagnose.hpp"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <tuple>

#include "model/effects/registry.hpp"

namespace flappy::gap {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Reach of the first difference along a size or a shape.
constexpr double kEffectReach = 0.4;
/// An effect that gains less in the linear screening is not fitted.
constexpr double kLeastGain = 0;
/// What no entry explains may be as large as these shares of the signal.
constexpr double kUnknownSizes[] = {0.02, 0.05, 0.15};

class Diagnoser {
 public:
  Diagnoser(const std::vector<CarriedFlight>& flights, const sim::Randomisation& uncertain,
            const DiagnoseOptions& options)
      : flights_(flights),
        uncertain_(uncertain),
        options_(options),
        threads_(options.threads > 0 ? options.threads : omp_get_num_procs()),
        evidence_(flights),
        fitter_(flights, evidence_, threads_) {}

  Diagnosis run() {
    Diagnosis d;
    progress(0, "fitting parameters");
    const Hypothesis plain(uncertain_, {});
    d.parameters = fit_parameters(plain);
    progress(0.3, "screening effects");
    add_plain_answers(plain, d);
    const std::vector<Screened> ranking = screen(plain, d.parameters, {});
    std::vector<std::vector<std::string>> finalists;
    for (const Screened& s : ranking)
      if (static_cast<int>(finalists.size()) < options_.finalists && s.gain > kLeastGain)
        finalists.push_back({s.effect});
    double done = 0;
    for (const auto& effects : finalists) {
      progress(0.4 + 0.4 * done++ / static_cast<double>(finalists.size()), "fitting " + effects.front());
      d.answers.push_back(fit_effects(effects, d.parameters));
    }
    weigh(d);
    return d;
  }

  Fit fit_parameters(const Hypothesis& plain) {
    const Linearised nominal =
        fitter_.linearise(plain, plain.start(), Directions{MatrixXd(plain.size(), 0), VectorXd(0)});
    evidence_.learn_weights(nominal.residual);
    Fit fit = fitter_.fit(plain, plain.start(), 3);
    for (int i = 0; i < 2; ++i) {
      evidence_.learn_weights(fit.point.residual);
      fit = fitter_.refit(plain, fit, 3);
    }
    evidence_.learn_noise(fit.point.residual);
    return fitter_.refit(plain, fit, 3);
  }

 private:
  struct Screened {
    std::string effect;
    double gain = 0;       ///< nats over the fit it was screened beside
    VectorXd coordinates;  ///< of the effect's unknowns, as far as a linear model sees them
  };

  std::vector<char> all_flights() const { return std::vector<char>(flights_.size(), 1); }

  /// Log probability of all flights, and of every flight given the others.
  std::pair<double, double> weigh_point(const Linearised& l, const Grams& grams, const std::vector<int>& columns,
                                        const VectorXd& prior_mean, double unexplained) const {
    const VectorXd sd = VectorXd::Ones(prior_mean.size());
    (void)l;
    const auto of = [&](const std::vector<char>& use) {
      return Evidence::posterior(evidence_.reduce(grams, use, unexplained), columns, prior_mean, sd).log_evidence;
    };
    const double all = of(all_flights());
    double held_out = 0;
    for (std::size_t f = 0; f < flights_.size(); ++f) {
      std::vector<char> others = all_flights();
      others[f] = 0;
      held_out += all - of(others);
    }
    return {all, held_out};
  }

  void add_plain_answers(const Hypothesis& plain, Diagnosis& d) const {
    const auto add = [&](Answer::Kind kind, const Linearised& l, bool free, double unexplained, double log_prior) {
      std::vector<const Signature*> columns;
      std::vector<int> chosen;
      std::vector<double> mean;
      for (std::size_t k = 0; free && k < l.columns.size(); ++k) {
        if (l.columns[k] == nullptr) continue;
        chosen.push_back(static_cast<int>(columns.size()));
        columns.push_back(l.columns[k].get());
        mean.push_back(-l.directions.axes.col(static_cast<Index>(k)).dot(l.at));
      }
      const Grams grams = evidence_.grams(l.residual, columns);
      Answer a;
      a.kind = kind;
      std::tie(a.log_evidence, a.log_held_out) = weigh_point(
          l, grams, chosen, Eigen::Map<const VectorXd>(mean.data(), static_cast<Index>(mean.size())), unexplained);
      a.log_evidence += log_prior;
      d.answers.push_back(std::move(a));
    };
    const Linearised nominal =
        fitter_.linearise(plain, plain.start(), Directions{MatrixXd(plain.size(), 0), VectorXd(0)});
    add(Answer::Kind::none, nominal, false, 0, 0);
    add(Answer::Kind::parameters, d.parameters.point, true, 0, 0);
    for (const double size : kUnknownSizes) add(Answer::Kind::unknown, d.parameters.point, true, size, 0);
  }

  /// What every effect would gain beside a fit, as far as a linear model sees: sizes step from 0, shapes stay where they are.
  std::vector<Screened> screen(const Hypothesis& base, const Fit& fit, const std::vector<std::string>& beside) const {
    struct Column {
      std::size_t effect;
      Index unknown;
    };
    std::vector<std::string> names;
    std::vector<Column> columns;
    std::vector<Candidate> candidates;
    std::vector<std::vector<Unknown>> unknowns;
    for (const model::EffectEntry& e : model::effects()) {
      const std::string id = e.info.id;
      if (std::ranges::count(options_.withheld, id) || std::ranges::count(beside, id)) continue;
      const Hypothesis h(uncertain_, {id});
      VectorXd at(h.size());
      at << fit.point.at.head(base.shared()), VectorXd::Zero(h.size() - base.shared());
      for (Index i = h.shared(); i < h.size(); ++i) {
        if (!h.unknowns()[static_cast<std::size_t>(i)].size) continue;
        VectorXd there = at;
        there[i] = kEffectReach;
        columns.push_back({names.size(), i - h.shared()});
        candidates.push_back(h.candidate(there));
      }
      names.push_back(id);
      unknowns.push_back(unknowns_of(id));
    }
    std::vector<Signature> rows = fitter_.residuals(candidates);
    std::vector<const Signature*> used;
    std::vector<int> shared;
    std::vector<double> shared_mean;
    const Linearised& l = fit.point;
    for (std::size_t k = 0; k < l.columns.size(); ++k) {
      if (l.columns[k] == nullptr) continue;
      shared.push_back(static_cast<int>(used.size()));
      used.push_back(l.columns[k].get());
      shared_mean.push_back(-l.directions.axes.col(static_cast<Index>(k)).dot(l.at));
    }
    std::vector<int> column_of(columns.size(), -1);
    for (std::size_t c = 0; c < columns.size(); ++c) {
      if (rows[c].empty()) continue;
      for (std::size_t f = 0; f < rows[c].size(); ++f)
        for (std::size_t i = 0; i < rows[c][f].size(); ++i)
          rows[c][f][i] = (l.residual[f][i] - rows[c][f][i]) / kEffectReach;
      evidence_.smooth(rows[c]);
      column_of[c] = static_cast<int>(used.size());
      used.push_back(&rows[c]);
    }
    const Reduced reduced = evidence_.reduce(evidence_.grams(l.residual, used), all_flights(), 0);
    const auto solve = [&](const std::vector<int>& more) {
      std::vector<int> chosen = shared;
      std::vector<double> mean = shared_mean;
      for (const int c : more) chosen.push_back(c), mean.push_back(0);
      return Evidence::posterior(reduced, chosen,
                                 Eigen::Map<const VectorXd>(mean.data(), static_cast<Index>(mean.size())),
                                 VectorXd::Ones(static_cast<Index>(mean.size())));
    };
    const double without = solve({}).log_evidence;
    std::vector<Screened> ranking;
    for (std::size_t e = 0; e < names.size(); ++e) {
      // of sizes with one sign, those that come out on the other are none
      std::vector<std::size_t> own;
      for (std::size_t c = 0; c < columns.size(); ++c)
        if (columns[c].effect == e && column_of[c] >= 0) own.push_back(c);
      Screened s{names[e], 0, VectorXd::Zero(static_cast<Index>(unknowns[e].size()))};
      while (!own.empty()) {
        std::vector<int> more;
        for (const std::size_t c : own) more.push_back(column_of[c]);
        const Posterior p = solve(more);
        std::size_t worst = own.size();
        double below = 0;
        for (std::size_t k = 0; k < own.size(); ++k) {
          const Unknown& u = unknowns[e][static_cast<std::size_t>(columns[own[k]].unknown)];
          const double value = p.mean[static_cast<Index>(shared.size() + k)];
          if (u.low >= 0 && value < below) worst = k, below = value;
        }
        if (worst < own.size()) {
          own.erase(own.begin() + static_cast<std::ptrdiff_t>(worst));
          continue;
        }
        s.gain = p.log_evidence - without;
        for (std::size_t k = 0; k < own.size(); ++k) {
          s.coordinates[columns[own[k]].unknown] = p.mean[static_cast<Index>(shared.size() + k)];
          if (unknowns[e][static_cast<std::size_t>(columns[own[k]].unknown)].low >= 0) s.gain += std::log(2.0);
        }
        break;
      }
      ranking.push_back(std::move(s));
    }
    std::ranges::sort(ranking, std::greater{}, &Screened::gain);
    if (std::getenv("GAP_DEBUG"))
      for (const Screened& s : ranking) {
        std::printf("  screen %-28s %9.1f ", s.effect.c_str(), s.gain);
        for (Index i = 0; i < s.coordinates.size(); ++i) std::printf(" %.3f", s.coordinates[i]);
        std::printf("\n");
      }
    screened_ = ranking;
    return ranking;
  }

  Answer fit_effects(const std::vector<std::string>& effects, const Fit& parameters) const {
    const Hypothesis h(uncertain_, effects);
    VectorXd start = h.start();
    start.head(h.shared()) = parameters.point.at.head(h.shared());
    Index at = h.shared();
    for (const std::string& e : effects) {
      const auto s = std::ranges::find(screened_, e, &Screened::effect);
      start.segment(at, s->coordinates.size()) = 0.7 * s->coordinates;
      at += s->coordinates.size();
    }
    Answer a;
    a.kind = Answer::Kind::effect;
    a.effects = effects;
    a.fit = fitter_.fit(h, h.bounded(start), parameters, 5);
    const Linearised& l = a.fit.point;
    std::vector<const Signature*> columns;
    std::vector<int> chosen;
    std::vector<double> mean;
    for (std::size_t k = 0; k < l.columns.size(); ++k) {
      if (l.columns[k] == nullptr) continue;
      chosen.push_back(static_cast<int>(columns.size()));
      columns.push_back(l.columns[k].get());
      mean.push_back(-l.directions.axes.col(static_cast<Index>(k)).dot(l.at));
    }
    const Grams grams = evidence_.grams(l.residual, columns);
    std::tie(a.log_evidence, a.log_held_out) =
        weigh_point(l, grams, chosen, Eigen::Map<const VectorXd>(mean.data(), static_cast<Index>(mean.size())), 0);
    return a;
  }

  void weigh(Diagnosis& d) const {
    double most = -1e300, sum = 0;
    for (const Answer& a : d.answers) most = std::max(most, a.log_evidence);
    for (Answer& a : d.answers) sum += a.probability = std::exp(a.log_evidence - most);
    for (Answer& a : d.answers) a.probability /= sum;
    std::ranges::sort(d.answers, std::greater{}, &Answer::probability);
  }

  void progress(double share, const std::string& what) const {
    if (options_.progress) options_.progress(share, what);
  }

  const std::vector<CarriedFlight>& flights_;
  const sim::Randomisation& uncertain_;
  const DiagnoseOptions& options_;
  int threads_;
  mutable Evidence evidence_;
  Fitter fitter_;
  mutable std::vector<Screened> screened_;
};

}  // namespace

Diagnosis diagnose(const std::vector<CarriedFlight>& flights, const sim::Randomisation& uncertain,
                   const DiagnoseOptions& options) {
  return Diagnoser(flights, uncertain, options).run();
}

}  // namespace flappy::gap
