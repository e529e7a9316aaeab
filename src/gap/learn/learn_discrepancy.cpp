#include "gap/learn/learn_discrepancy.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <optional>
#include <utility>

#include "gap/fit/own_sessions.hpp"
#include "gap/question/question.hpp"
#include "io/files.hpp"
#include "io/log.hpp"
#include "io/progress.hpp"
#include "io/statistics.hpp"
#include "io/text.hpp"
#include "model/effects/registry.hpp"

namespace flappy::gap {
namespace {

using Eigen::Index;

/// Iterations of expectation-maximisation. Choice.
constexpr int kIterations = 16;
/// The mean square of like channels counts as much as this many coefficients. The scale that pairs of sessions start
/// with counts as much as this many pairs. Choice.
constexpr double kShrink = 6;
/// Smallest share of the discrepancy that is learnt. Choice: smaller ones are due to the small number of robots.
constexpr double kMinShare = 2e-4;
/// Smallest standard deviation of a background magnitude that is learnt. Choice: smaller ones are due to the small
/// number of robots.
constexpr double kMinBackground = 0.01;
/// Errors of laws are learnt from no fewer pairs. Choice.
constexpr std::size_t kMinLaws = 5;
/// Smallest standard deviation of the logarithm of errors of laws. Choice.
constexpr double kMinSpread = 0.25;
/// The centre from which learning starts weighs as much as this many errors of its stage. Choice.
constexpr double kShrinkLaws = 2;
/// The quantile of errors of laws, over their centres, that is the largest of them. Choice.
constexpr double kLargestLaw = 0.95;
/// What counts of a robot's own sessions is learnt from no fewer robots with several. Choice.
constexpr std::size_t kMinOwn = 5;
/// The largest scatter of sessions of one robot, over that of all robots. Choice.
constexpr double kMaxOwn = 0.9;
constexpr std::size_t kKinds = static_cast<std::size_t>(BasisFunction::count);

struct Moment {
  double sum = 0, count = 0;
  double root() const { return count > 0 ? std::sqrt(sum / count) : 0; }
};
using ShareMoments = std::array<std::array<std::array<Moment, kKinds>, kHarmonics + 1>, kSettingChannels>;

/// [effect] Scales of a robot's background magnitudes; they make their prior heavy-tailed.
using Factors = std::map<std::string, double>;

using Robots = std::vector<std::unique_ptr<const RobotFit>>;

/// Expected squares of the coefficients and background magnitudes over all robots, given `now`.
void expect(const Robots& robots, const ModelDiscrepancy& now, ShareMoments& shares,
            std::map<std::string, Moment>& backgrounds, std::vector<Factors>& factors) {
  factors.resize(robots.size());
  for (std::size_t k = 0; k < robots.size(); ++k) {
    const RobotFit& robot = *robots[k];
    const Evidence evidence = robot.evidence().with_discrepancy(now);
    Regressors r = Fitter::own_regressors(robot.parameters());
    const Regressors nuisances = robot.nuisance_regressors();
    for (std::size_t i = 0; i < nuisances.columns.size(); ++i) r.add(*nuisances.columns[i], nuisances.prior_means[i]);
    const std::size_t first = r.columns.size();
    std::vector<Background> background = robot.background(now, false);
    for (Background& b : background) {
      b.column *= factors[k].try_emplace(b.effect, 1).first->second;
      r.add(b.column, 0);
    }
    const ScaledEvidence w =
        evidence.weigh(robot.parameters().statistics, r, robot.fitter().all_flights(), {}, Scales{}, {}, 1);
    std::map<std::string, Moment> of_robot;
    for (std::size_t n = 0; n < background.size(); ++n) {
      const auto i = static_cast<Index>(first + n);
      Moment& m = of_robot[background[n].effect];
      m.sum += std::pow(factors[k].at(background[n].effect), 2) *
               (w.posterior.mean[i] * w.posterior.mean[i] + w.posterior.covariance(i, i));
      m.count += 1;
    }
    for (const auto& [effect, m] : of_robot) {
      const double nu = now.scale_prior(effect).freedom, factor2 = (m.sum + nu) / (m.count + nu);
      factors[k][effect] = std::sqrt(factor2);
      backgrounds[effect].sum += std::pow(now.background_sd(effect), 2) * m.sum / factor2;
      backgrounds[effect].count += m.count;
    }
    for (int g = 0; g < kGroups; ++g)
      for (int i = 0; i < evidence.basis().size(); ++i) {
        if (w.squares(g, i) == 0) continue;  // no rows
        const int channel = g / kCoefficients, harmonic = (g % kCoefficients + 1) / 2;
        const BasisFunction kind = evidence.basis().kind(i);
        Moment& m = shares[static_cast<std::size_t>(channel)][static_cast<std::size_t>(harmonic)]
                          [static_cast<std::size_t>(kind)];
        m.sum += w.squares(g, i) * std::pow(now.share(channel, harmonic, kind), 2);
        m.count += 1;
      }
  }
}

/// First and last of the channels that are shrunk towards their mean.
constexpr std::array<std::pair<int, int>, 8> kAlike = {{{kAngularAccelerationX, kAngularAccelerationZ},
                                                        {kSpecificForceX, kSpecificForceZ},
                                                        {kStrokeLeft, kStrokeRight},
                                                        {kRotationLeft, kRotationRight},
                                                        {kBattery, kBattery},
                                                        {kCurrentLeft, kCurrentRight},
                                                        {kPathX, kPathZ},
                                                        {kRotateX, kRotateZ}}};

void shrink(ShareMoments& shares) {
  for (const int setting : {0, static_cast<int>(kChannels)})
    for (const auto& [first, last] : kAlike)
      for (std::size_t h = 0; h <= kHarmonics; ++h)
        for (std::size_t k = 0; k < kKinds; ++k) {
          Moment all;
          for (int c = setting + first; c <= setting + last; ++c) {
            all.sum += shares[static_cast<std::size_t>(c)][h][k].sum;
            all.count += shares[static_cast<std::size_t>(c)][h][k].count;
          }
          if (all.count == 0) continue;
          for (int c = setting + first; c <= setting + last; ++c) {
            Moment& m = shares[static_cast<std::size_t>(c)][h][k];
            m.sum += kShrink * all.sum / all.count;
            m.count += kShrink;
          }
        }
}

/// The class of regimes in which each effect's background is largest, in units of the model discrepancy.
std::map<std::string, std::size_t> classes_of(const Robots& robots, const ModelDiscrepancy& now) {
  std::map<std::string, std::array<double, kRegimes>> sums;
  for (const auto& robot : robots) {
    const Evidence evidence = robot->evidence().with_discrepancy(now);
    const BasisCoefficients sd = evidence.discrepancy_sd(robot->fitter().scales());
    for (const Background& b : robot->background(now, false))
      for (int g = 0; g < kGroups; ++g)
        for (int i = 0; i < evidence.basis().size(); ++i)
          if (sd(g, i) > 0)
            sums[b.effect][static_cast<std::size_t>(regimes_of(evidence.basis().kind(i)))] +=
                std::pow(b.column(g, i) / sd(g, i), 2);
  }
  std::map<std::string, std::size_t> classes;
  for (const auto& [effect, of_class] : sums)
    classes[effect] = static_cast<std::size_t>(std::ranges::max_element(of_class) - of_class.begin());
  return classes;
}

/// Averages each effect's variance with the median of its class. The median ignores the few effects that the errors of
/// the few simulators behind the robots look like.
void shrink(const std::map<std::string, std::size_t>& classes, std::map<std::string, Moment>& backgrounds) {
  std::array<std::vector<double>, kRegimes> of_class;
  for (const auto& [effect, m] : backgrounds) of_class[classes.at(effect)].push_back(m.sum / m.count);
  for (auto& [effect, m] : backgrounds) m = {m.sum / m.count + io::upper_median(of_class[classes.at(effect)]), 2};
}

void take(const ShareMoments& moments, const std::map<std::string, Moment>& backgrounds, Shares& shares,
          std::map<std::string, double>& background) {
  const Shares before = shares;
  for (std::size_t c = 0; c < kSettingChannels; ++c) {
    bool seen = false;
    for (std::size_t h = 0; h <= kHarmonics; ++h)
      for (std::size_t k = 0; k < kKinds; ++k)
        if (moments[c][h][k].count > 0) shares[c][h][k] = std::max(moments[c][h][k].root(), kMinShare), seen = true;
    // a channel that no run on a bench has shown takes the shares of flights
    if (c >= kChannels && !seen && before[c] == before[c - kChannels]) shares[c] = shares[c - kChannels];
  }
  for (const auto& [effect, m] : backgrounds) background[effect] = std::max(m.root(), kMinBackground);
}

/// Expected squares over all pairs of what differs between their sessions, given `now`.
void expect_sessions(const Robots& pairs, const ModelDiscrepancy& now, ShareMoments& shares,
                     std::map<std::string, Moment>& backgrounds) {
  for (const auto& pair : pairs) {
    const Fitter fitter = pair->fitter_given(now);
    const Regressors r = fitter.unscaled_regressors(pair->parameters());
    Scales scales = fitter.scales();
    scales.centre_tests(now.session);
    const ScaledEvidence w =
        fitter.evidence().weigh(pair->parameters().statistics, r, fitter.all_flights(), {}, scales, {}, 1);
    for (std::size_t k = 0; k < r.effects.size(); ++k) {
      if (r.effects[k] < 0) continue;
      const std::string& name = fitter.effects()[static_cast<std::size_t>(r.effects[k])];
      if (!name.starts_with(kSessionOf) || name == kSessionParameters) continue;
      const std::string effect = name.substr(std::string(kSessionOf).size());
      const auto i = static_cast<Index>(k);
      backgrounds[effect].sum += std::pow(now.session.background_sd(effect), 2) *
                                 (w.posterior.mean[i] * w.posterior.mean[i] + w.posterior.covariance(i, i));
      backgrounds[effect].count += 1;
    }
    const RegimeBasis& basis = fitter.evidence().basis();
    for (int g = 0; g < kGroups; ++g)
      for (int i = 0; i < basis.size(); ++i) {
        if (!basis.of_tests(i) || w.squares(g, i) == 0) continue;
        const int channel = g / kCoefficients, harmonic = (g % kCoefficients + 1) / 2;
        Moment& m = shares[static_cast<std::size_t>(channel)][static_cast<std::size_t>(harmonic)]
                          [static_cast<std::size_t>(basis.kind(i))];
        m.sum += w.squares(g, i) * std::pow(share_of(now.session.shares, channel, harmonic, basis.kind(i)), 2);
        m.count += 1;
      }
  }
}

/// Averages each effect's variance with the median of all.
void shrink(std::map<std::string, Moment>& backgrounds) {
  std::vector<double> variances;
  for (const auto& [effect, m] : backgrounds) variances.push_back(m.sum / m.count);
  const double median = variances.empty() ? 0 : io::upper_median(variances);
  for (auto& [effect, m] : backgrounds) m = {m.sum / m.count + median, 2};
}

/// Deviation of the law of an effect from the catalogue's, as a share of its change: the most probable one of a grid.
/// None: the effect cannot be simulated.
std::optional<double> law_error(const RobotFit& robot, const std::string& effect, const ModelDiscrepancy& now) {
  // Factor between errors of laws that are tried. Choice: four to a factor of two.
  constexpr double kStep = 1.1892;
  // Errors of laws that are tried reach from the one to the other. Choice.
  constexpr double kSmallest = 0.01, kLargest = 4;
  const Fitter fitter = robot.fitter_given(now);
  std::vector<MagnitudeColumn> columns = robot.magnitudes();
  std::erase_if(columns, [&](const MagnitudeColumn& m) { return m.effect != effect; });
  if (columns.empty()) return std::nullopt;
  const Hypothesis h(robot.uncertain(), {effect});
  Eigen::VectorXd start = h.start();
  start.tail(h.size() - h.shared()) = screen(fitter, robot.parameters(), columns).front().coordinates;
  const Fit fit = fitter.fit_effects(h, start, robot.parameters());
  if (!fit.flown()) return std::nullopt;
  const Regressors regressors = fitter.unscaled_regressors(fit);
  double best = kSmallest, most = -std::numeric_limits<double>::infinity();
  for (double error = kSmallest; error < kLargest; error *= kStep) {
    const double log_evidence =
        fitter.evidence()
            .weigh(fit.statistics, regressors, fitter.all_flights(),
                   fitter.law_sd(h, fit, error / now.session.law_error_of(effect)), fitter.scales())
            .posterior.log_evidence;
    if (log_evidence > most) most = log_evidence, best = error;
  }
  return best;
}

/// Standard deviation of the logarithm of the sessions' scales; that of `now` counts as much as kShrink pairs.
double scale_sd(const Robots& pairs, const ModelDiscrepancy& now) {
  double sum = kShrink * std::pow(now.session.scale_sd, 2);
  for (const auto& pair : pairs) {
    const Fitter fitter = pair->fitter_given(now);
    const ScaledEvidence w = fitter.evidence().weigh(
        pair->parameters().statistics, fitter.unscaled_regressors(pair->parameters()), fitter.all_flights(), {}, {});
    sum += std::pow(std::log(w.scales.session), 2);
  }
  return std::sqrt(sum / (kShrink + static_cast<double>(pairs.size())));
}

/// Log evidence of the test flights under harmless changes alone, and its scales.
ScaledEvidence weigh_harmless(const RobotFit& pair, const ModelDiscrepancy& d) {
  const Fitter fitter = pair.fitter_given(d);
  Scales start;
  start.centre_tests(d.session);
  return fitter.evidence().weigh(pair.parameters().statistics, fitter.unscaled_regressors(pair.parameters()),
                                 fitter.all_flights(), {}, start);
}

/// Nats by which the evidence at the most probable scales of the magnitudes of changes exceeds that with these scales
/// integrated out: n coefficients of one scale then follow Student's t of n dimensions (Gelman et al., Bayesian Data
/// Analysis, 3rd ed., appendix A). A difference that depends on the freedom alone, but for n, what the flights determine.
double by_maximising_nats(const RobotFit& pair, const ModelDiscrepancy& d, const ScaledEvidence& w) {
  const Fitter fitter = pair.fitter_given(d);
  const Regressors r = fitter.unscaled_regressors(pair.parameters());
  std::map<std::string, double> known;
  for (std::size_t k = 0; k < r.effects.size(); ++k)
    if (r.effects[k] >= 0)
      known[fitter.effects()[static_cast<std::size_t>(r.effects[k])]] +=
          1 - std::min(1.0, w.posterior.covariance(static_cast<Index>(k), static_cast<Index>(k)));
  double sum = 0;
  for (const auto& [name, n] : known) {
    if (!name.starts_with(kSessionOf)) continue;
    const double nu = d.scale_prior(name).freedom;
    sum += -(n + nu) / 2 * std::log(nu / (n + nu)) - n / 2 - std::lgamma((nu + n) / 2) + std::lgamma(nu / 2) +
           n / 2 * std::log(nu / 2);
  }
  return sum;
}

/// Sets `to` to the value of `tries` that makes the test flights of all robots most probable. `now`: of which `to` is a
/// part; `own`: [robot].
void choose(const Robots& pairs, const std::vector<std::optional<OwnSessions>>& own, ModelDiscrepancy& now, double& to,
            std::initializer_list<double> tries, const char* what) {
  double best = to, most = -std::numeric_limits<double>::infinity();
  for (const double value : tries) {
    to = value;
    double sum = 0;
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      now.session.own = own[k];
      const ScaledEvidence w = weigh_harmless(*pairs[k], now);
      sum += w.posterior.log_evidence - by_maximising_nats(*pairs[k], now, w);
    }
    io::log(io::LogLevel::info, io::format("%s %.2f: %.2f nats", what, value, sum));
    if (sum > most) most = sum, best = value;
  }
  to = best;
  now.session.own.reset();
}

/// Sets what counts of the robots' own sessions: mean and scatter of what the scales of tests are over those that
/// references foretell, the share that makes the tests most probable, and the freedom of magnitudes.
void learn_own(const Robots& pairs, ModelDiscrepancy& now) {
  SessionVariation& to = now.session;
  std::vector<std::optional<OwnSessions>> own;
  std::vector<double> over, weights;
  for (const auto& pair : pairs) {
    own.push_back(own_sessions(pair->fitter_given(now), pair->parameters()));
    if (!own.back()) continue;
    over.push_back(std::log(weigh_harmless(*pair, now).scales.session) - own.back()->mean_log_scale -
                   own.back()->from_fewer());
    weights.push_back(1 - 1 / own.back()->count);
  }
  if (over.size() >= kMinOwn) {
    const auto n = static_cast<double>(over.size());
    to.own_offset = std::accumulate(over.begin(), over.end(), 0.0) / n;
    double squares = 0;
    for (std::size_t k = 0; k < over.size(); ++k) squares += weights[k] * std::pow(over[k] - to.own_offset, 2);
    to.own_scale_sd = std::min(std::sqrt(squares / (n - 1)), kMaxOwn * to.scale_sd);
    choose(pairs, own, now, to.own_share, {0, 0.02, 0.05, 0.1, 0.2, 0.5}, "own_share");
  }
  choose(pairs, own, now, to.effect_freedom, {1, 2, 4, 8, 30}, "effect_freedom");
}

}  // namespace

void learn_laws(const LawErrors& errors, SessionVariation& to) {
  std::array<Moment, model::kStages> stages;
  for (std::size_t stage = 0; stage < model::kStages; ++stage)
    stages[stage] = {kShrinkLaws * std::log(to.law_error[stage]), kShrinkLaws};
  for (const auto& [effect, error] : errors) {
    Moment& m = stages[static_cast<std::size_t>(model::stage_of(effect))];
    m.sum += std::log(error);
    m.count += 1;
  }
  for (std::size_t stage = 0; stage < model::kStages; ++stage)
    to.law_error[stage] = std::exp(stages[stage].sum / stages[stage].count);
  std::vector<double> over;
  over.reserve(errors.size());
  for (const auto& [effect, error] : errors) over.push_back(error / to.law_error_of(effect));
  to.law_spread = std::max(std::log(io::quantile(over, 0.84) / io::quantile(over, 0.16)) / 2, kMinSpread);
  to.law_most = std::max(io::quantile(over, kLargestLaw), 1.0);
}

ModelDiscrepancy learn_discrepancy(const std::vector<Flights>& flights, const sim::Randomisation& uncertain,
                                   const ModelDiscrepancy& start, int threads) {
  io::ProgressLine line("learning");
  Robots robots;
  for (std::size_t i = 0; i < flights.size() && !io::interrupted(); ++i) {
    line.show(static_cast<double>(i) / static_cast<double>(flights.size()), "fitting robot " + std::to_string(i + 1));
    robots.push_back(std::make_unique<const RobotFit>(question_of(flights[i]), flights[i], uncertain, start,
                                                      std::vector<std::string>(), threads));
  }
  if (io::interrupted()) throw io::InputError("stopped: nothing was learnt; accepted: all robots");
  ModelDiscrepancy now = start;
  std::vector<Factors> factors;
  for (int n = 1; n <= kIterations; ++n) {
    if (io::interrupted()) throw io::InputError("stopped: nothing was learnt; accepted: all robots");
    ShareMoments shares{};
    std::map<std::string, Moment> backgrounds;
    expect(robots, now, shares, backgrounds, factors);
    if (n == kIterations) {
      shrink(shares);
      shrink(classes_of(robots, now), backgrounds);
    }
    take(shares, backgrounds, now.shares, now.background);
  }
  return now;
}

SessionVariation learn_sessions(const std::vector<SessionPair>& pairs, const sim::Randomisation& uncertain,
                                const ModelDiscrepancy& start, int threads) {
  io::ProgressLine line("learning");
  const auto count = static_cast<double>(pairs.size());
  double done = 0;
  const auto heed = [] {
    if (io::interrupted()) throw io::InputError("stopped: nothing was learnt; accepted: all pairs");
  };
  const auto go_on = [&] {
    heed();
    line.show(done / count, io::format("fitting pair %.0f", done + 1));
    done += 1;
  };
  const auto fit = [&](const SessionPair& p) {
    const Flights references{p.flights.references, {}};
    return std::make_unique<const RobotFit>(
        question_of(p.flights),
        RobotFit::of_references(question_of(references), references, uncertain, start, {}, threads), p.flights);
  };
  Robots harmless;
  for (const SessionPair& p : pairs) {
    if (!p.effect.empty()) continue;
    go_on();
    harmless.push_back(fit(p));
    for (const auto& f : p.flights.all()) f->forget();
  }
  ModelDiscrepancy now = start;
  for (int n = 1; n <= kIterations && !harmless.empty(); ++n) {
    heed();
    ShareMoments shares{};
    std::map<std::string, Moment> backgrounds;
    expect_sessions(harmless, now, shares, backgrounds);
    if (n == kIterations) {
      shrink(shares);
      shrink(backgrounds);
    }
    take(shares, backgrounds, now.session.shares, now.session.background);
  }
  if (!harmless.empty()) now.session.scale_sd = scale_sd(harmless, now);
  if (!harmless.empty()) learn_own(harmless, now);
  harmless.clear();
  LawErrors errors;
  for (const SessionPair& p : pairs) {
    if (p.effect.empty()) continue;
    go_on();
    if (const auto error = law_error(*fit(p), p.effect, now)) errors.emplace_back(p.effect, *error);
    for (const auto& f : p.flights.all()) f->forget();
  }
  heed();
  const auto asked = std::ranges::count_if(pairs, [](const SessionPair& p) { return !p.effect.empty(); });
  const std::string few = io::format("--pairs: %zu of %td pairs with an effect tell of its law; accepted: at least %zu",
                                     errors.size(), asked, kMinLaws);
  if (errors.size() >= kMinLaws) learn_laws(errors, now.session);
  else if (std::cmp_equal(asked, pairs.size())) throw io::InputError(few);
  else if (asked > 0) io::log(io::LogLevel::warning, few + ", so law_error stays as it was");
  return now.session;
}

}  // namespace flappy::gap
