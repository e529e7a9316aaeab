#include "gap/diagnose/diagnose.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>

#include "gap/diagnose/held_out.hpp"
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
/// Effects that are fitted jointly with what explains most.
constexpr std::size_t kFurther = 2;
/// Effects that explain most, beside which parameters are moved.
constexpr std::size_t kFreely = 3;
/// Less than this share of what parameters leave may be chance; and the log evidence of what is refuted.
constexpr double kLeastExplainable = 0.15, kRefuted = -1e9;
/// Of the way to a vehicle that no file may hold.
constexpr int kMostHalvings = 10;
/// A size that changes no row by so much, in its unit, cannot be told from none.
constexpr double kNoChange = 1e-9;

class Diagnoser {
 public:
  Diagnoser(const std::vector<PredictedFlight>& flights, const sim::Randomisation& uncertain,
            const DiagnoseOptions& options)
      : flights_(flights),
        options_(options),
        rule_(options.rule),
        threads_(io::thread_count(options.threads)),
        robot_(flights, uncertain, options.discrepancy, options.withheld, threads_) {}

  Diagnosis run() {
    Diagnosis d;
    progress(0, "fitting parameters");
    robot_.fit_parameters();
    progress(0.3, "screening effects");
    robot_.refit_beside_background();
    const Hypothesis& plain = robot_.plain();
    std::vector<ScoredHypothesis> singles;
    std::vector<Screened> open;
    const std::vector<Screened> screened = screen(evidence_, fitter_, parameters_, robot_.sizes());
    if (!within_the_beat()) d.untestable = untestable();
    std::vector<Screened> finalists;
    for (const Screened& s : screened) {
      if (std::ranges::count(d.untestable, s.effect)) continue;
      if (static_cast<int>(finalists.size()) < options_.finalists) finalists.push_back(s);
      else open.push_back(s);
    }
    d.parameters = parameters_;
    d.hypotheses.push_back(weigh(ScoredHypothesis::Kind::none, plain, robot_.nominal(), std::log(rule_.prior.none)));
    d.hypotheses.push_back(
        weigh(ScoredHypothesis::Kind::parameters, plain, parameters_.point, std::log(rule_.prior.parameters)));
    plain_ = d.hypotheses[1].log_evidence - d.hypotheses[1].log_prior;
    if (progress(0.4, "fitting effects")) {
      // also those that promise nothing: beside parameters that make up for an effect, a line sees nothing of it
      std::vector<ScoredHypothesis> fits(finalists.size());
      io::parallel_for(fits.size(), threads_, [&](std::size_t i) { fits[i] = fit_effects({finalists[i]}); });
      std::vector<std::size_t> order(fits.size());
      std::iota(order.begin(), order.end(), std::size_t{0});
      std::ranges::stable_sort(order, std::greater{}, [&](std::size_t i) { return fits[i].log_evidence; });
      order.resize(std::min(order.size(), kFreely));
      io::parallel_for(order.size(), threads_,
                       [&](std::size_t i) { move_parameters({finalists[order[i]]}, fits[order[i]]); });
      for (std::size_t i = 0; i < fits.size(); ++i)
        // a fit that flew to where less is explained than a line from the parameters promises found nothing
        if (vanished(fits[i]) || fits[i].log_evidence < leave_open(finalists[i]).log_evidence)
          open.push_back(finalists[i]);
        else singles.push_back(std::move(fits[i]));
    } else {
      open.insert(open.end(), finalists.begin(), finalists.end());
    }
    d.hypotheses.push_back(explain_freely(plain, parameters_.point, std::log(rule_.prior.unknown)));
    for (const Screened& s : open) singles.push_back(leave_open(s));
    // further effects jointly with what explains most: an effect, or what hides one as a background of its hypothesis
    const auto explained = [](const ScoredHypothesis& a) { return a.log_evidence - a.log_prior; };
    std::ranges::sort(singles, std::greater{}, explained);
    if (!singles.empty() && singles.front().fitted() &&
        explained(singles.front()) > plain_ + rule_.gain.chance_of(singles.front().effects.back())) {
      ScoredHypothesis best = singles.front();
      for (int n = 2; n <= options_.most_effects; ++n) {
        if (!progress(0.7 + 0.3 * (n - 1) / options_.most_effects,
                      "fitting another jointly with " + best.effects.back()))
          break;
        // what is missing besides hides behind what models are off by with the best in force, not without it
        robot_.take_scales(Hypothesis(uncertain_, best.effects), best.fit.point);
        std::vector<Screened> further = screen(evidence_, fitter_, best.fit, beside(best.effects, robot_.sizes()));
        std::erase_if(further, [&](const Screened& s) { return s.gain < rule_.gain.further_screened_nats; });
        further.resize(std::min(further.size(), evidence_.discrepancy().spread.beside_all ? 1 : kFurther));
        std::vector<ScoredHypothesis> more(further.size());
        std::vector<std::vector<Screened>> sets(further.size(), screened_of(best));
        io::parallel_for(more.size(), threads_, [&](std::size_t i) {
          sets[i].push_back(further[i]);
          more[i] = fit_effects(sets[i]);
        });
        if (const auto first = std::ranges::max_element(more, {}, explained); first != more.end())
          move_parameters(sets[static_cast<std::size_t>(first - more.begin())], *first);
        std::erase_if(more, [&](const ScoredHypothesis& a) { return vanished(a); });
        std::erase_if(more, [&](const ScoredHypothesis& a) {
          return explained(a) < explained(best) + rule_.gain.chance_of(a.effects.back());
        });
        if (more.empty()) break;
        for (const ScoredHypothesis& a : more) {  // what showed beside that may be all there is
          const Screened last = screened_of(a).back();
          const auto single = std::ranges::find(singles, std::vector{last.effect}, &ScoredHypothesis::effects);
          if (single == singles.end() || single->fitted()) continue;
          if (ScoredHypothesis fitted = fit_effects({last}); fitted.fitted()) *single = std::move(fitted);
        }
        singles.insert(singles.end(), more.begin(), more.end());
        best = *std::ranges::max_element(more, {}, explained);
      }
      robot_.take_scales(plain, parameters_.point);
    }
    // what leaves more than that entry's equation may
    std::ranges::sort(singles, std::greater{}, explained);
    std::size_t asked = 0;
    while (asked < std::min(singles.size(), kMostRemainders) && singles[asked].fitted() &&
           explained(singles[asked]) >= plain_)
      ++asked;
    std::vector<ScoredHypothesis> remainders(asked);
    io::parallel_for(asked, threads_, [&](std::size_t i) {
      remainders[i] = explain_freely(Hypothesis(uncertain_, singles[i].effects), singles[i].fit.point, 0);
    });
    for (std::size_t i = 0; i < asked; ++i) {
      const ScoredHypothesis& a = singles[i];
      ScoredHypothesis& more = remainders[i];
      if (more.terms.empty()) continue;
      more.kind = ScoredHypothesis::Kind::effect;
      more.effects = a.effects;
      const double shape = more.fit.point.shape;
      more.fit = a.fit;
      more.otherwise = a.otherwise;
      more.fit.point.shape = shape;
      more.log_evidence += a.log_prior + std::log(rule_.prior.remainder);
      more.log_prior = a.log_prior + std::log(rule_.prior.remainder);
    }
    for (ScoredHypothesis& more : remainders)
      if (!more.terms.empty()) singles.push_back(std::move(more));
    for (ScoredHypothesis& a : singles) {
      if (a.fitted()) widen(a.fit, Hypothesis(uncertain_, a.effects), rule_);
      d.hypotheses.push_back(std::move(a));
    }
    d.complete = !stopped_;
    d.nominal = robot_.nominal().residual;
    hold_out(d);
    if (rule_.refutation.least_share > 0) refute(d);
    if (!robot_.evidence().discrepancy().spread.beside_all) share_backgrounds(d.hypotheses);
    set_probabilities(d.hypotheses, rule_);
    d.conclusion = conclude(d.hypotheses, rule_);
    if (within_the_beat()) fly_the_likeliest(d.hypotheses, d.conclusion);
    const ScoredHypothesis& answer = flown(d);
    const Hypothesis h(uncertain_, answer.effects);
    d.sensors = answer.fitted() ? robot_.sensors(h, answer.fit) : robot_.sensors(plain, parameters_);
    const auto alone = [&](const Hypothesis& of, const Fit& fit) {
      if (!within_the_beat()) return fitter_.joint(of, fit.point, fitter_.all_flights(), true).at;
      VectorXd at = fitter_.alone(of, fit).point.at;
      // figures of a body go each their own way, and together may be no body's
      for (int n = 0; n < kMostHalvings && model::physical_fault(of.candidate(at).vehicle); ++n)
        at = (at + fit.point.at) / 2;
      return at;
    };
    if (answer.fitted()) d.corrected = alone(h, answer.fit);
    else if (answer.kind == ScoredHypothesis::Kind::effect) d.corrected = h.bounded(answer.fit.mean());
    else d.corrected = alone(plain, parameters_);
    d.minors = uncertain_.minors();
    d.noise_sd = noise_sd();
    if (!within_the_beat()) d.validation = validate(robot_, flights_, d, threads_);
    return d;
  }

 private:
  std::vector<double> noise_sd() const {
    std::vector<double> sd;
    for (int g = 0; g < kGroups; ++g) sd.push_back(evidence_.noise_sd(g));
    return sd;
  }

  /// None or parameters.
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
  ScoredHypothesis explain_freely(const Hypothesis& h, const Linearised& l, double log_prior) {
    Weighed w = robot_.weigh(h, l, rule_.unknown.freeing_nats);
    if (freest_) {  // what hides while models may be off by little shows where they may be off by much
      Weighed other = robot_.weigh(h, l, *freest_, rule_.unknown.freeing_nats);
      if (other.posterior.log_evidence > w.posterior.log_evidence) w = std::move(other);
    } else {
      freest_ = w.scales;
    }
    ScoredHypothesis a;
    a.kind = ScoredHypothesis::Kind::unknown;
    a.jointly_with = h.effects();
    a.log_evidence = w.posterior.log_evidence + log_prior;
    a.log_prior = log_prior;
    a.fit.point.shape = w.shape;
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

  /// Entries that have no stage for the mean of a beat, or change nothing here: as a battery's where none was logged.
  std::vector<std::string> untestable() const {
    std::vector<std::string> list;
    const model::Vehicle& vehicle = uncertain_.nominal();
    for (const model::EffectEntry& e : model::catalogue_of(vehicle)) {
      double most = 0;
      for (const SizeColumn& c : robot_.sizes())
        if (c.effect == e.info.id) most = std::max(most, c.change.cwiseAbs().maxCoeff());
      if (!(most > kNoChange)) list.emplace_back(e.info.id);
    }
    for (const model::EffectEntry& e : model::effects())
      if (model::find_effect(vehicle, e.info.id) == nullptr) list.emplace_back(e.info.id);
    std::erase_if(list, [&](const std::string& id) { return std::ranges::count(options_.withheld, id) > 0; });
    return list;
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
      const Hypothesis alone(uncertain_, {e});
      const Index n = alone.size() - alone.shared();
      list.push_back({e, 0, a.fit.point.at.segment(at, n)});
      at += n;
    }
    return list;
  }

  /// Whether a fit left one of its effects as the vehicle's file has it: without any size, as a rule.
  bool vanished(const ScoredHypothesis& a) const {
    if (!a.fitted()) return true;
    const Hypothesis h(uncertain_, a.effects);
    const VectorXd file = h.start();
    for (const std::string& e : a.effects) {
      double largest = 0;
      for (Index i = h.shared(); i < h.size(); ++i) {
        const Unknown& u = h.unknowns()[static_cast<std::size_t>(i)];
        if (u.effect == e && u.size) largest = std::max(largest, std::abs(a.fit.point.at[i] - file[i]));
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
    std::vector<BasisCoefficients> own(static_cast<std::size_t>(h.size() - h.shared()));
    for (const SizeColumn& c : robot_.sizes())
      if (c.effect == s.effect) own[static_cast<std::size_t>(c.unknown)] = c.change;
    a.fit = fitter_.linear(h, parameters_, own);
    a.log_prior = log_prior_of_one();
    a.log_evidence = plain_ + std::min(s.gain, 0.0) + a.log_prior;
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
    return std::log(rule_.prior.effect / static_cast<double>(model::catalogue_of(uncertain_.nominal()).size()));
  }

  bool within_the_beat() const { return flights_.front().within_the_beat(); }

  /// From where the effects were screened on, beside the parameters where they are.
  VectorXd start_of(const Hypothesis& h, const std::vector<Screened>& set) const {
    VectorXd start = h.start();
    start.head(h.shared()) = parameters_.point.at.head(h.shared());
    Index at = h.shared();
    for (const Screened& s : set) {
      start.segment(at, s.coordinates.size()) = s.coordinates;
      at += s.coordinates.size();
    }
    return h.bounded(start);
  }

  ScoredHypothesis fit_effects(const std::vector<Screened>& set) const {
    ScoredHypothesis a;
    a.kind = ScoredHypothesis::Kind::effect;
    for (const Screened& s : set) a.effects.push_back(s.effect);
    a.log_evidence = kRefuted;  // until something flies
    const Hypothesis h(uncertain_, a.effects);
    a.log_prior = log_prior_of_one();
    for (std::size_t i = 1; i < set.size(); ++i)
      a.log_prior +=
          std::log(rule_.prior.further_effect / static_cast<double>(model::catalogue_of(uncertain_.nominal()).size()));
    for (Index i = h.shared(); i < h.size(); ++i) {
      const Unknown& u = h.unknowns()[static_cast<std::size_t>(i)];
      if (u.size && u.low >= 0) a.log_prior += std::log(2.0);
    }
    take(h, within_the_beat() ? fitter_.fit_beside(h, start_of(h, set), parameters_) : moved(h, set), a);
    return a;
  }

  Fit moved(const Hypothesis& h, const std::vector<Screened>& set) const {
    return fitter_.fit(h, start_of(h, set), parameters_, 6);
  }

  /// To where the parameters move beside such effects, if that explains more. Of a robot that is known by the beat they are there already: nothing
  /// is rough, and columns of another point are as good.
  void move_parameters(const std::vector<Screened>& set, ScoredHypothesis& a) const {
    if (!within_the_beat()) return;
    const Hypothesis h(uncertain_, a.effects);
    take(h, moved(h, set), a);
  }

  /// Unless the vehicle comes apart, or another fit explains as much.
  void take(const Hypothesis& h, Fit fit, ScoredHypothesis& a) const {
    if (fit.point.residual.empty()) return;
    const Weighed w = robot_.weigh(h, fit.point);
    if (a.fitted() && w.posterior.log_evidence + a.log_prior <= a.log_evidence) return;
    fit.point.shape = w.shape;
    a.log_evidence = w.posterior.log_evidence + a.log_prior;
    a.fit = std::move(fit);
    a.otherwise.reset();
    if (w.shape > 1) a.otherwise = most_otherwise(w);
  }

  /// The function of the place that takes most of a free shape.
  Term most_otherwise(const Weighed& w) const {
    const RegimeBasis& basis = evidence_.basis();
    Term most;
    for (int g = 0; g < kGroups; ++g)
      for (int i = 0; i < basis.size(); ++i) {
        const double gain = 0.5 * std::pow(w.delta(g, i), 2);
        if (regimes_of(basis.kind(i)) == Regimes::place && gain > most.gain)
          most = {g / kCoefficients, (g % kCoefficients + 1) / 2, i, w.shape, gain};
      }
    return most;
  }

  /// What is left in every flight with the fit to the others; of a single flight, with its own.
  void hold_out(Diagnosis& d) const {
    std::vector<Fitted> fits = {{Hypothesis(uncertain_, {}), &parameters_.point}};
    std::vector<Residuals*> of = {&d.refit};
    for (ScoredHypothesis& a : d.hypotheses)
      if (a.fitted()) {
        fits.push_back({Hypothesis(uncertain_, a.effects), &a.fit.point});
        of.push_back(&a.left);
      }
    std::vector<int> each(flights_.size());
    std::iota(each.begin(), each.end(), 0);
    std::vector<Residuals> left = held_out(robot_, flights_, fits, each, threads_);
    for (std::size_t i = 0; i < of.size(); ++i) *of[i] = std::move(left[i]);
  }

  /// What leaves most of that which depends on the regime, in flights held out, explains it not, however probable beside its rivals.
  void refute(Diagnosis& d) const {
    const double plain = mean_square(robot_, flights_, d.refit);
    const double explainable = plain - mean_square(robot_, flights_, smoothed_away(robot_, flights_, d.refit));
    if (!(explainable > kLeastExplainable * plain)) return;
    for (ScoredHypothesis& a : d.hypotheses) {
      if (a.kind == ScoredHypothesis::Kind::unknown) continue;
      const double share = a.fitted() ? (plain - mean_square(robot_, flights_, a.left)) / explainable : 0;
      if (share < rule_.refutation.least_share) a.log_evidence = kRefuted;
    }
  }

  /// What every vehicle has of an entry is a line beside the parameters, and an effect was flown: where that explains more than the line does, a
  /// hypothesis without the effect has it, too, as its background, at the price of its sizes there.
  void share_backgrounds(std::vector<ScoredHypothesis>& all) const {
    const auto parameters = [&] {
      return std::ranges::find(all, ScoredHypothesis::Kind::parameters, &ScoredHypothesis::kind)->log_evidence;
    };
    const double before = parameters();
    for (const ScoredHypothesis& a : all) {
      if (!a.fitted()) continue;
      const Hypothesis h(uncertain_, a.effects);
      const VectorXd mean =
          std::max(1.0, a.fit.point.shape) * a.fit.mean();  // a law that is far from the entry's is as much of it
      std::map<std::string, double> beyond;
      for (const std::string& e : a.effects) {
        std::vector<double> sizes;
        for (Index i = h.shared(); i < h.size(); ++i) {
          const Unknown& u = h.unknowns()[static_cast<std::size_t>(i)];
          if (u.effect == e && u.size) sizes.push_back(mean[i]);
        }
        beyond[e] = robot_.beyond_background(e, Eigen::Map<VectorXd>(sizes.data(), static_cast<Index>(sizes.size())));
      }
      for (ScoredHypothesis& b : all) {
        if (b.kind == ScoredHypothesis::Kind::none || b.terms.empty() != a.terms.empty()) continue;
        if (b.effects.size() >= a.effects.size() || (b.kind == ScoredHypothesis::Kind::effect && !b.fitted())) continue;
        double explained = a.log_evidence - a.log_prior;
        std::size_t shared = 0;
        for (const std::string& e : a.effects)
          if (std::ranges::count(b.effects, e) > 0) ++shared;
          else explained -= std::max(beyond[e], 0.0);
        if (b.kind == ScoredHypothesis::Kind::unknown && b.terms.empty()) explained -= rule_.unknown.freeing_nats;
        if (shared < b.effects.size() || b.log_prior + explained <= b.log_evidence) continue;
        b.log_evidence = b.log_prior + explained;
        b.flown_with = a.flown_with.empty() ? a.effects : a.flown_with;
      }
    }
    // of what the flights tell nothing, that changes nothing
    for (ScoredHypothesis& b : all)
      if (b.kind == ScoredHypothesis::Kind::effect && !b.fitted()) b.log_evidence += parameters() - before;
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
  RobotFit robot_;
  const sim::Randomisation& uncertain_ = robot_.uncertain();
  const Evidence& evidence_ = robot_.evidence();
  const Fitter& fitter_ = robot_.fitter();
  const Fit& parameters_ = robot_.parameters();
  double plain_ = 0;              ///< log evidence of the parameters alone
  std::optional<Scales> freest_;  ///< of an unknown cause alone
  bool stopped_ = false;
};

}  // namespace

const ScoredHypothesis& flown(const Diagnosis& diagnosis) {
  const ScoredHypothesis& concluded = diagnosis.hypotheses[diagnosis.conclusion.hypothesis];
  if (concluded.flown_with.empty()) return concluded;
  return *std::ranges::find_if(diagnosis.hypotheses, [&](const ScoredHypothesis& a) {
    return a.fitted() && a.effects == concluded.flown_with && a.terms.empty() == concluded.terms.empty();
  });
}

Diagnosis diagnose(const std::vector<PredictedFlight>& flights, const sim::Randomisation& uncertain,
                   const DiagnoseOptions& options) {
  return Diagnoser(flights, uncertain, options).run();
}

}  // namespace flappy::gap
