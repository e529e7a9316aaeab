#include "gap/learn/learn_scatter.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "io/parallel.hpp"
#include "io/statistics.hpp"
#include "io/text.hpp"

namespace flappy::gap {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Degrees of freedom that are tried. Choice: finer than a few robots tell.
constexpr double kFreedoms[] = {0.5, 0.7, 1, 1.4, 2, 2.8, 4, 5.6, 8, 11, 16, 32};
/// Largest degrees of freedom that are tried. Choice: the last is as good as none.
constexpr double kMaxFreedoms[] = {2.8, 4, 5.6, 8, 11, 16, 32, 1000};
/// Shares of the noise that are tried. Choice.
constexpr double kNoiseShares[] = {0, 0.25, 0.5, 0.7, 1, 1.4, 2};
/// Drifts that are tried, in scatters a session. Choice.
constexpr double kDrifts[] = {0, 0.06, 0.09, 0.13, 0.18, 0.25, 0.35, 0.5, 0.7, 1, 1.4, 2};
/// Factor between scatters that are tried. Choice: eight to a factor of two.
constexpr double kScatterStep = 1.0905;
/// Number of such steps from the scatter that it began with. Choice: a factor of 16.
constexpr int kScatterSteps = 32;
/// Standard deviation of the logarithm of a scatter about what it began with. Choice: a factor of 2.7, as one robot more.
constexpr double kScatterSpread = 1;
/// Sessions before the first that is foretold. Choice.
constexpr Index kMinBefore = 3;

/// A quantity of one group, seen along directions in which the random walk does not correlate and the mean is 0.
struct Directions {
  VectorXd square;  ///< squares of the quantity along them
  VectorXd walk;    ///< variance by the random walk of 1 along them
  double noise;     ///< mean variance by the noise of the flights
};

Directions directions_of(const SessionGroup& group, Index q) {
  const Index n = group.times.size();
  MatrixXd ones = MatrixXd::Ones(n, 1), k(n, n);
  for (Index i = 0; i < n; ++i)
    for (Index j = 0; j < n; ++j) k(i, j) = std::min(group.times[i], group.times[j]) - group.times.minCoeff();
  const MatrixXd all = ones.householderQr().householderQ();
  const MatrixXd rest = all.rightCols(n - 1);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(rest.transpose() * k * rest);
  const VectorXd along = solver.eigenvectors().transpose() * (rest.transpose() * group.sessions.values.col(q));
  return {along.cwiseAbs2(), solver.eigenvalues().cwiseMax(0), group.sessions.variances.col(q).mean()};
}

bool is_seen(const SessionGroup& group, Index q) { return group.sessions.variances.col(q).maxCoeff() < kUnseen / 2; }

/// Of one kind of quantity.
struct Trial {
  double freedom, share_of_noise, scatter, drift;
};

double log_evidence(const Directions& d, const Trial& t) {
  const double before = t.scatter * t.scatter + t.share_of_noise * t.share_of_noise * d.noise;
  const double f = t.freedom + static_cast<double>(d.square.size());
  double sum = 0, log_size = 0;
  for (Index i = 0; i < d.square.size(); ++i) {
    const double r = 1 + t.drift * t.drift / before * d.walk[i];
    sum += d.square[i] / r, log_size += std::log(r);
  }
  return std::lgamma(f / 2) - std::lgamma(t.freedom / 2) + t.freedom / 2 * std::log(t.freedom * before) -
         f / 2 * std::log(t.freedom * before + sum) - 0.5 * log_size;
}

using Kinds = std::map<std::string, std::vector<Directions>>;

Kinds kinds_of(const std::vector<RobotSessions>& robots) {
  Kinds kinds;
  for (const RobotSessions& robot : robots)
    for (const SessionGroup& group : robot.groups)
      for (std::size_t q = 0; q < group.quantities.size(); ++q)
        if (group.times.size() > 1 && is_seen(group, static_cast<Index>(q)))
          kinds[group.quantities[q].block].push_back(directions_of(group, static_cast<Index>(q)));
  return kinds;
}

/// The most probable scatter and drift of a kind, and their log density.
double fit_kind(const std::vector<Directions>& kind, double start, Trial& t) {
  double most = -std::numeric_limits<double>::infinity();
  Trial best = t;
  for (int step = -kScatterSteps; step <= kScatterSteps; ++step)
    for (const double drift : kDrifts) {
      t.scatter = start * std::pow(kScatterStep, step);
      t.drift = drift * t.scatter;
      double sum = -0.5 * std::pow(step * std::log(kScatterStep) / kScatterSpread, 2);
      for (const Directions& d : kind) sum += log_evidence(d, t);
      if (sum > most) most = sum, best = t;
    }
  t = best;
  return most;
}

SessionGroup part_of(const SessionGroup& group, Index first, Index size) {
  return {group.quantities,
          {group.sessions.values.middleRows(first, size), group.sessions.variances.middleRows(first, size)},
          group.times.segment(first, size)};
}

void foretell(const SessionGroup& before, const SessionGroup& next, const SessionPrior& prior,
              const SessionPrior& reference, Foretold& all) {
  const auto scatter_by = [&](const SessionPrior& p) {
    return SessionScatter(before.quantities, before.sessions, {before.times, next.times[0]}, p);
  };
  const SessionScatter own = scatter_by(prior), others = scatter_by(reference);
  for (Index q = 0; q < own.mean().size(); ++q) {
    if (!is_seen(before, q) || !is_seen(next, q)) continue;
    const double value = next.sessions.values(0, q);
    const auto log_density = [&](const SessionScatter& s, double& t) {
      const double variance = s.variance_of_next()[q] + std::max(next.sessions.variances(0, q) - s.noise()[q], 0.0);
      t = (value - s.mean()[q]) / std::sqrt(variance);
      return std::lgamma((s.freedom() + 1) / 2) - std::lgamma(s.freedom() / 2) -
             0.5 * std::log(s.freedom() * variance) - (s.freedom() + 1) / 2 * std::log1p(t * t / s.freedom());
    };
    double t = 0, of_reference = 0;
    all.log_score += log_density(own, t) - log_density(others, of_reference);
    all.outside += io::t_tail(t, own.freedom()) < 1 - kInside;
    all.number += 1;
  }
}

}  // namespace

SessionGroup sessions_of(const FlightList& flights, const sim::Randomisation& uncertain,
                         const InferenceOptions& options) {
  const ReferenceFit reference(flights, uncertain, options);
  const VehicleHypothesis robot = Hypothesis(uncertain, {}).vehicle(reference.fit.parameters().at);
  const CommonTrend trend = common_trend(flights, robot);
  std::vector<std::optional<FlightQuantities>> made(flights.size());
  io::parallel_for(made.size(), options.threads, [&](std::size_t f) { made[f].emplace(*flights[f], robot, trend); });
  std::vector<FlightQuantities> quantities;
  for (auto& q : made) quantities.push_back(std::move(*q));
  const std::vector<std::string> names = session_names(flights);
  return {quantities.front().quantities(), session_values(quantities, session_numbers(names), options.sessions),
          session_times(names, {}).references};
}

Foretold foretold(const RobotSessions& robot, const SessionPrior& prior, const SessionPrior& reference, bool later) {
  Foretold all;
  for (const SessionGroup& group : robot.groups) {
    const Index n = group.times.size(), half = (n + 1) / 2;
    for (Index k = later ? half : kMinBefore; k < n; ++k)
      foretell(part_of(group, 0, later ? half : k), part_of(group, k, 1), prior, reference, all);
  }
  return all;
}

SessionPrior learn_scatter(const std::vector<RobotSessions>& robots, const SessionPrior& start) {
  const Kinds kinds = kinds_of(robots);
  SessionPrior learnt = start;
  double most = -std::numeric_limits<double>::infinity();
  for (const double freedom : kFreedoms)
    for (const double share : kNoiseShares) {
      SessionPrior now = start;
      now.freedom = freedom, now.share_of_noise = share;
      double sum = 0;
      for (const auto& [name, kind] : kinds) {
        Trial t{freedom, share, 0, 0};
        sum += fit_kind(kind, start.blocks.at(name).scatter, t);
        now.blocks[name].scatter = t.scatter, now.blocks[name].drift = t.drift;
      }
      if (sum > most) most = sum, learnt = now;
    }
  most = -std::numeric_limits<double>::infinity();
  SessionPrior best = learnt;
  for (const double most_freedom : kMaxFreedoms) {
    learnt.most_freedom = most_freedom;
    double sum = 0;
    for (const RobotSessions& robot : robots)
      for (const bool later : {false, true}) sum += foretold(robot, learnt, start, later).log_score;
    if (sum > most) most = sum, best = learnt;
  }
  return best;
}

namespace {

constexpr const char* kScatterHead =
    R"(# How much the quantities of a flight (src/gap/session/quantities.hpp) differ from session to session of a robot to which nothing is done, before its
# own reference flights are seen, and how much a cause changes them. Read by flappy-gap diagnose --reference of beat-averaged vehicles, written by
# flappy-gap learn-sessions.
#
# Learnt: flappy-gap learn-sessions, )";
constexpr const char* kScatterPrior =
    R"(# Probabilities before any flight. The probability of an effect is split evenly over the catalogue, and so is that of a further effect.
# Choice: with flights of docs/results/faults.md in view, which says how.
)";
constexpr const char* kScatterTogether =
    R"(# The same of a set whose effects come together, in place of further_effect. A weight on a line hangs on a hook, which is a weight on the robot; a
# weight near a rotor stands in its jet. Choice.
)";
constexpr const char* kScatterBlocks =
    R"(# scatter: standard deviation between sessions. drift: by how much the robot's mean moves from a session to the next. unknown: standard deviation of the
# change by a cause that is not in the catalogue. leak: probability that a quantity changes by as much where another does: the controller counteracts
# what disturbs the robot, so that a disturbance looks like a slope of the thrust or a delay.
)";
constexpr const char* kScatterUnits[] = {"share of the thrust",
                                         "share of the thrust, by the battery's voltage over the nominal one",
                                         "share of the thrust, 1/m",
                                         "drag along z, 1/s",
                                         "force along z over the speed squared, 1/m",
                                         "s",
                                         "along x and y, m/s^2",
                                         "along x and y, 1/s",
                                         "weight of the load as a share of the robot's",
                                         "about x and y over the weight, m",
                                         "moment about z over the weight, m",
                                         "of the inputs, logarithm of its rms"};

}  // namespace

std::string session_prior_text(const SessionPrior& p, const std::string& learnt) {
  const auto number = [](double v) { return io::format("%.4g", v); };
  std::string text =
      kScatterHead + learnt +
      ".\nschema = 1\n\n# For how many sessions of the robot the values below count. Learnt.\nfreedom = " +
      number(p.freedom) +
      "\n\n# Largest degrees of freedom, however many sessions there are: of heavier tails than a normal distribution. "
      "Learnt.\nmost_freedom = " +
      number(p.most_freedom) +
      "\n\n# Besides, flights differ by this share of the noise of one flight. Learnt.\nshare_of_noise = " +
      number(p.share_of_noise) + "\n\n" + kScatterPrior + "[prior]\nunchanged = " + number(p.unchanged) +
      "\neffect = " + number(p.effect) + "\nunknown = " + number(p.unknown) +
      "\nfurther_effect = " + number(p.further_effect) + "\n\n" + kScatterTogether + "[together]\n";
  for (const auto& [name, share] : p.together) text += name + " = " + number(share) + "\n";
  text += std::string("\n") + kScatterBlocks;
  for (std::size_t k = 0; k < std::size(kSessionBlocks); ++k) {
    const SessionPrior::Block& b = p.blocks.at(kSessionBlocks[k]);
    text += std::string("[") + kSessionBlocks[k] + "]  # " + kScatterUnits[k] + "\nscatter = " + number(b.scatter) +
            "\ndrift = " + number(b.drift) + "\nunknown = " + number(b.unknown) +
            "  # Choice.\nleak = " + number(b.leak) + "  # Choice.\n\n";
  }
  text.pop_back();
  return text;
}

}  // namespace flappy::gap
