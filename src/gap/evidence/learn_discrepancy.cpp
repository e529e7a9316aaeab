#include "gap/evidence/learn_discrepancy.hpp"

#include <algorithm>
#include <cmath>

#include "io/files.hpp"
#include "io/progress.hpp"
#include "io/statistics.hpp"

namespace flappy::gap {
namespace {

using Eigen::Index;

constexpr int kIterations = 16;
/// Coefficients that the mean of like channels counts for.
constexpr double kShrink = 6;
/// Below these nothing was learnt, but that the robots were few.
constexpr double kLeastShare = 2e-4, kLeastSize = 0.01;
constexpr std::size_t kKinds = static_cast<std::size_t>(BasisFunction::count);

struct Moment {
  double sum = 0, count = 0;
  double root() const { return count > 0 ? std::sqrt(sum / count) : 0; }
};
using Shares = std::array<std::array<std::array<Moment, kKinds>, kHarmonics + 1>, kChannels>;

/// What a robot has of each entry, in units of what is usual: heavy-tailed.
using Factors = std::map<std::string, double>;

/// What every robot says of the variances, given those that are thought.
void expect(const std::vector<std::unique_ptr<RobotFit>>& robots, const ModelDiscrepancy& now, Shares& shares,
            std::map<std::string, Moment>& sizes, std::vector<Factors>& factors) {
  factors.resize(robots.size());
  for (std::size_t r = 0; r < robots.size(); ++r) {
    const std::unique_ptr<RobotFit>& robot = robots[r];
    robot->set_discrepancy(now);
    const Evidence& evidence = robot->evidence();
    const Linearised& at = robot->parameters().point;
    Columns c = robot->fitter().own_columns_of(at);
    const Columns lines = robot->lines();
    for (std::size_t k = 0; k < lines.columns.size(); ++k) c.add(*lines.columns[k], lines.prior_mean[k]);
    const std::size_t first = c.columns.size();
    std::vector<Background> background = robot->background(false);
    for (Background& b : background) {
      b.column *= factors[r].try_emplace(b.entry, 1).first->second;
      c.add(b.column, 0);
    }
    const Weighed w = evidence.weigh(at.statistics, c, robot->fitter().all_flights(), {}, Scales{}, {}, 1);
    std::map<std::string, Moment> own;
    for (std::size_t k = 0; k < background.size(); ++k) {
      const auto i = static_cast<Index>(first + k);
      Moment& m = own[background[k].entry];
      m.sum += std::pow(factors[r].at(background[k].entry), 2) *
               (w.posterior.mean[i] * w.posterior.mean[i] + w.posterior.covariance(i, i));
      m.count += 1;
    }
    for (const auto& [entry, m] : own) {
      const double nu = now.tail_of(entry).freedom, factor2 = (m.sum + nu) / (m.count + nu);
      factors[r][entry] = std::sqrt(factor2);
      sizes[entry].sum += std::pow(now.background_sd(entry), 2) * m.sum / factor2;
      sizes[entry].count += m.count;
    }
    for (int g = 0; g < kGroups; ++g)
      for (int i = 0; i < evidence.basis().size(); ++i) {
        if (w.squares(g, i) == 0) continue;  // nothing was seen
        const int channel = g / kCoefficients, harmonic = (g % kCoefficients + 1) / 2;
        const BasisFunction kind = evidence.basis().kind(i);
        Moment& m = shares[static_cast<std::size_t>(channel)][static_cast<std::size_t>(harmonic)]
                          [static_cast<std::size_t>(kind)];
        m.sum += w.squares(g, i) * std::pow(now.share(channel, harmonic, kind), 2);
        m.count += 1;
      }
  }
}

/// Channels whose figures are alike.
constexpr std::array<std::pair<int, int>, 7> kAlike = {{{kTorqueX, kTorqueZ},
                                                        {kForceX, kForceZ},
                                                        {kStrokeLeft, kStrokeRight},
                                                        {kBattery, kBattery},
                                                        {kCurrentLeft, kCurrentRight},
                                                        {kPathX, kPathZ},
                                                        {kTurnX, kTurnZ}}};

void shrink(Shares& shares) {
  for (const auto& [first, last] : kAlike)
    for (std::size_t h = 0; h <= kHarmonics; ++h)
      for (std::size_t k = 0; k < kKinds; ++k) {
        Moment all;
        for (int c = first; c <= last; ++c) {
          all.sum += shares[static_cast<std::size_t>(c)][h][k].sum;
          all.count += shares[static_cast<std::size_t>(c)][h][k].count;
        }
        if (all.count == 0) continue;
        for (int c = first; c <= last; ++c) {
          Moment& m = shares[static_cast<std::size_t>(c)][h][k];
          m.sum += kShrink * all.sum / all.count;
          m.count += kShrink;
        }
      }
}

/// What most of an entry's columns is: of which regimes, in units of what models get wrong.
std::map<std::string, std::size_t> classes_of(const std::vector<std::unique_ptr<RobotFit>>& robots) {
  std::map<std::string, std::array<double, kClasses>> sums;
  for (const std::unique_ptr<RobotFit>& robot : robots) {
    const Evidence& evidence = robot->evidence();
    const BasisCoefficients sd = evidence.discrepancy_sd();
    for (const Background& b : robot->background(false))
      for (int g = 0; g < kGroups; ++g)
        for (int i = 0; i < evidence.basis().size(); ++i)
          if (sd(g, i) > 0)
            sums[b.entry][static_cast<std::size_t>(regimes_of(evidence.basis().kind(i)))] +=
                std::pow(b.column(g, i) / sd(g, i), 2);
  }
  std::map<std::string, std::size_t> classes;
  for (const auto& [effect, of] : sums)
    classes[effect] = static_cast<std::size_t>(std::ranges::max_element(of) - of.begin());
  return classes;
}

/// Robots are of few makings, of which each looks like a few entries: half of an entry's variance is that of the median of its class,
/// which those few do not move.
void shrink(const std::map<std::string, std::size_t>& classes, std::map<std::string, Moment>& sizes) {
  std::array<std::vector<double>, kClasses> of_class;
  for (const auto& [effect, m] : sizes) of_class[classes.at(effect)].push_back(m.sum / m.count);
  for (auto& [effect, m] : sizes) m = {m.sum / m.count + io::upper_median(of_class[classes.at(effect)]), 2};
}

void take(const Shares& shares, const std::map<std::string, Moment>& sizes, ModelDiscrepancy& d) {
  for (std::size_t c = 0; c < kChannels; ++c)
    for (std::size_t h = 0; h <= kHarmonics; ++h)
      for (std::size_t k = 0; k < kKinds; ++k)
        if (shares[c][h][k].count > 0) d.shares[c][h][k] = std::max(shares[c][h][k].root(), kLeastShare);
  for (const auto& [effect, m] : sizes) d.background[effect] = std::max(m.root(), kLeastSize);
}

}  // namespace

ModelDiscrepancy learn_discrepancy(const std::vector<std::unique_ptr<RobotFit>>& robots,
                                   const ModelDiscrepancy& start) {
  ModelDiscrepancy now = start;
  io::ProgressLine line("learning");
  for (std::size_t i = 0; i < robots.size() && !io::interrupted(); ++i) {
    line.show(static_cast<double>(i) / static_cast<double>(robots.size()), "fitting robot " + std::to_string(i + 1));
    robots[i]->fit_parameters();
    robots[i]->refit_beside_background();
  }
  if (io::interrupted()) throw io::InputError("stopped: nothing was learnt; accepted: all robots");
  std::vector<Factors> factors;
  for (int n = 1; n <= kIterations; ++n) {
    Shares shares{};
    std::map<std::string, Moment> sizes;
    expect(robots, now, shares, sizes, factors);
    if (n == kIterations) {
      shrink(shares);
      shrink(classes_of(robots), sizes);
    }
    take(shares, sizes, now);
  }
  return now;
}

}  // namespace flappy::gap
