#include "benchmark/detectability.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "gap/evidence/hypothesis.hpp"

namespace flappy::benchmark {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using gap::BasisCoefficients;

/// Sizes at which effects are tried: few do twice as much at twice the size. Those of sensors do.
constexpr double kSizes[] = {0.25, 0.5, 1, 4}, kSensorSizes[] = {1, 4}, kDelaySizes[] = {0.01, 0.03, 0.1};
/// A size is taken for this much, give or take, before any flight.
constexpr double kSizeSd = 2;
/// A typical size of the catalogue is a third of the end of its prior, 1.645 of its coordinate.
constexpr double kTypicalCoordinate = 1.645 / 3;
constexpr double kLeastSize = 1e-3, kMostSize = 4;
constexpr double kThird = 1.0 / 3;

/// Effects that draw a direction, and how many others span what they could have drawn. Those of sensors: the catalogue's axes.
constexpr std::pair<blind::Effect, int> kDirections[] = {{blind::Effect::com_offset, 2},
                                                         {blind::Effect::inertia_products, 3},
                                                         {blind::Effect::wing_damage, 2},
                                                         {blind::Effect::wind, 2}};

}  // namespace

double expected_gain(const MatrixXd& information, const VectorXd& truth, const MatrixXd& hypothesis,
                     const VectorXd& precision) {
  const MatrixXd a = hypothesis.transpose() * information * hypothesis;
  const VectorXd f = hypothesis.transpose() * (information * truth);
  const Eigen::LLT<MatrixXd> llt(MatrixXd(precision.asDiagonal()) + a);
  return 0.5 * (f.dot(llt.solve(f)) + llt.solve(a).trace() + precision.array().log().sum()) -
         llt.matrixLLT().diagonal().array().log().sum();
}

DetectabilityAnalysis::DetectabilityAnalysis(const Subject& subject, const sim::Randomisation& uncertain) {
  std::vector<Subject::Added> list;
  const std::uint64_t seed = subject.flown().seed;
  for (std::size_t e = 0; e < blind::kBlindEffects; ++e) {
    const auto effect = static_cast<blind::Effect>(e);
    if (effect == blind::Effect::command_delay)  // straight for a small part of a beat only
      for (const double size : kDelaySizes) list.push_back({effect, size, seed});
    if (acts_on_sensors(effect))
      for (const double size : kSensorSizes) list.push_back({effect, size, seed});
    else
      for (const double size : kSizes) list.push_back({effect, size, seed});
    for (const auto& [turned, others] : kDirections)
      for (int i = 1; turned == effect && i <= others; ++i)
        list.push_back({effect, 1, seed + static_cast<std::uint64_t>(i)});
  }
  const std::vector<BasisCoefficients> found = subject.added(list);
  std::vector<BasisCoefficients> columns;
  for (std::size_t i = 0; i < list.size(); ++i) {
    if (found[i].size() == 0) continue;
    Columns& c = effects_[static_cast<std::size_t>(list[i].effect)];
    if (list[i].seed != seed) {
      c.further.push_back(static_cast<int>(columns.size()));
    } else {
      c.sizes.push_back(list[i].size);
      c.at.push_back(static_cast<int>(columns.size()));
    }
    columns.push_back(found[i]);
  }
  for (std::size_t e = 0; e < blind::kBlindEffects; ++e) {
    if (!acts_on_sensors(static_cast<blind::Effect>(e)) || !in_catalogue(static_cast<blind::Effect>(e))) continue;
    const auto unknowns = static_cast<Index>(gap::unknowns_of(blind::effect_names()[e]).size());
    std::vector<VectorXd> axes;
    for (Index i = 0; i < unknowns; ++i)
      if (gap::unknowns_of(blind::effect_names()[e])[static_cast<std::size_t>(i)].size)
        axes.emplace_back(kTypicalCoordinate * VectorXd::Unit(unknowns, i));
    for (BasisCoefficients& axis : subject.catalogue(blind::effect_names()[e], axes)) {
      if (axis.size() == 0) continue;
      effects_[e].further.push_back(static_cast<int>(columns.size()));
      columns.push_back(std::move(axis));
    }
  }
  std::vector<BasisCoefficients> known = subject.parameters(uncertain);
  for (BasisCoefficients& s : subject.background()) known.push_back(std::move(s));
  information_ = subject.information(known, columns);
}

/// The first size tried that is no smaller; as many as there are where there is none.
std::size_t DetectabilityAnalysis::tried(blind::Effect effect, double size) const {
  const Columns& c = effects_[static_cast<std::size_t>(effect)];
  return static_cast<std::size_t>(std::ranges::lower_bound(c.sizes, size) - c.sizes.begin());
}

/// What an effect adds at any size: straight of the next larger one that was tried; empty beyond.
VectorXd DetectabilityAnalysis::truth_of(blind::Effect effect, double size) const {
  const Columns& c = effects_[static_cast<std::size_t>(effect)];
  const std::size_t above = tried(effect, size);
  if (above == c.sizes.size()) return {};
  return size / c.sizes[above] * VectorXd::Unit(width(), c.at[above]);
}

/// Of the sizes tried of an effect but one, each beside its further directions, the one that explains the truth best.
double DetectabilityAnalysis::best_gain(const VectorXd& truth, blind::Effect hypothesis, std::size_t but) const {
  const Columns& c = effects_[static_cast<std::size_t>(hypothesis)];
  const auto n = static_cast<Index>(c.further.size());
  MatrixXd m = MatrixXd::Zero(width(), n + 1);
  VectorXd precision = VectorXd::Constant(n + 1, 1 / (kSizeSd * kSizeSd));
  for (Index i = 0; i < n; ++i) m(c.further[static_cast<std::size_t>(i)], i + 1) = 1;
  double best = 0;  // its size may be none
  for (std::size_t i = 0; i < c.at.size(); ++i) {
    if (i == but) continue;
    m.col(0) = VectorXd::Unit(width(), c.at[i]);
    precision[0] = c.sizes[i] * c.sizes[i] / (kSizeSd * kSizeSd);
    best = std::max(best, expected_gain(information_, truth, m, precision) * kThird);
  }
  return best;
}

/// The effect itself as a hypothesis. Differences of predicted flights are rough (gap/evidence/fit.hpp), the same way wherever they come
/// from the same flights; so nothing is held against its own: the hypothesis is of any other size tried than the truth.
double DetectabilityAnalysis::gain(blind::Effect truth, double size) const {
  const VectorXd d = truth_of(truth, size);
  if (d.size() == 0) return 0;
  const bool alone = effects_[static_cast<std::size_t>(truth)].at.size() == 1;
  return best_gain(d, truth, alone ? kNone : tried(truth, size));
}

double DetectabilityAnalysis::gain_over(blind::Effect truth, double size, blind::Effect rival) const {
  const VectorXd d = truth_of(truth, size);
  return d.size() == 0 ? 0 : gain(truth, size) - best_gain(d, rival, kNone);
}

double DetectabilityAnalysis::detectable(blind::Effect effect, double nats) const {
  // where another size that was tried takes over, the gain may fall
  const auto enough = [&](double size) {
    return gain(effect, size) >= nats && (2 * size > kMostSize || gain(effect, 2 * size) >= nats);
  };
  constexpr double kStep = 1.1;
  double high = kLeastSize;
  while (high < kMostSize && !enough(high)) high = std::min(kMostSize, high * kStep);
  if (!enough(high)) return std::numeric_limits<double>::infinity();
  double low = high / kStep;
  for (int i = 0; i < 20; ++i) {
    const double middle = std::sqrt(low * high);
    (enough(middle) ? high : low) = middle;
  }
  return high;
}

}  // namespace flappy::benchmark
