// Which figures of the catalogue an effect of the blind robot comes to.
#include <algorithm>
#include <cmath>

#include "benchmark/detectability.hpp"
#include "gap/evidence/hypothesis.hpp"

namespace flappy::benchmark {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using gap::BasisCoefficients;

constexpr int kIterations = 8;
/// Reach of differences, and the step below which there is no more to be had: of a coordinate, of which the prior has 1.645.
constexpr double kReach = 0.1, kConverged = 0.002;
/// Where the search begins: about a typical size; shapes in the middle, or one of them near an end of what is plausible.
constexpr double kStart = 0.5, kShapeStart = 1.5;

/// An entry of the catalogue against what an effect does to the rows.
class Likeness {
 public:
  Likeness(const Subject& subject, const std::vector<BasisCoefficients>& parameters, std::string entry,
           BasisCoefficients wanted)
      : subject_(subject),
        parameters_(parameters),
        entry_(std::move(entry)),
        unknowns_(gap::unknowns_of(entry_)),
        wanted_(std::move(wanted)) {}

  TrueValue find() {
    VectorXd at = start();
    double least = cost(left_at({at})[0], at);
    for (int n = 0; n < kIterations; ++n) {
      const std::vector<VectorXd> tries = steps_from(at);
      const std::vector<BasisCoefficients> left = left_at(tries);
      std::size_t best = tries.size();
      for (std::size_t i = 0; i < tries.size(); ++i)
        if (const double c = cost(left[i], tries[i]); c < least) best = i, least = c;
      if (best == tries.size()) break;
      const double moved = (tries[best] - at).cwiseAbs().maxCoeff();
      at = tries[best];
      if (moved < kConverged) break;
    }
    TrueValue result;
    for (Index i = 0; i < size(); ++i)
      if (of(i).size) result.values[entry_ + "." + of(i).name] = of(i).value(at[i]);
    const BasisCoefficients left = left_at({at})[0];
    if (left.size() > 0) result.misfit = std::sqrt(std::min(1.0, measure({left})(0, 0) / measure({wanted_})(0, 0)));
    return result;
  }

 private:
  Index size() const { return static_cast<Index>(unknowns_.size()); }
  const gap::Unknown& of(Index i) const { return unknowns_[static_cast<std::size_t>(i)]; }

  VectorXd bounded(VectorXd x) const {
    for (Index i = 0; i < size(); ++i) x[i] = of(i).coordinate(of(i).value(x[i]));
    return x;
  }
  MatrixXd measure(const std::vector<BasisCoefficients>& columns) const {
    return subject_.information(parameters_, columns);
  }
  std::vector<BasisCoefficients> left_at(const std::vector<VectorXd>& places) const {
    std::vector<BasisCoefficients> left = subject_.catalogue(entry_, places);
    for (BasisCoefficients& s : left)
      if (s.size() > 0) s = wanted_ - s;
    return left;
  }
  double cost(const BasisCoefficients& left, const VectorXd& at) const {
    if (left.size() == 0) return 1e300;
    double sum = measure({left})(0, 0);
    for (Index i = 0; i < size(); ++i)
      if (!of(i).size) sum += at[i] * at[i];
    return sum;
  }

  /// The shapes for which sizes one after another are most like it; sizes of both signs begin at none.
  VectorXd start() const {
    std::vector<VectorXd> shapes = {VectorXd::Zero(size())};
    for (Index i = 0; i < size(); ++i)
      if (!of(i).size)
        for (const double to : {-kShapeStart, kShapeStart}) shapes.emplace_back(to * VectorXd::Unit(size(), i));
    std::vector<VectorXd> places;
    std::vector<std::size_t> shape_of;
    for (std::size_t k = 0; k < shapes.size(); ++k)
      for (Index i = 0; i < size(); ++i)
        if (of(i).size) {
          places.push_back(bounded(shapes[k] + kStart * VectorXd::Unit(size(), i)));
          shape_of.push_back(k);
        }
    const std::vector<BasisCoefficients> ours = subject_.catalogue(entry_, places);
    std::vector<double> likeness(shapes.size(), 0);
    for (std::size_t p = 0; p < places.size(); ++p) {
      if (ours[p].size() == 0) continue;
      const MatrixXd m = measure({wanted_, ours[p]});
      if (m(1, 1) > 0) likeness[shape_of[p]] += m(0, 1) * m(0, 1) / (m(0, 0) * m(1, 1));
    }
    VectorXd at = shapes[static_cast<std::size_t>(std::ranges::max_element(likeness) - likeness.begin())];
    for (Index i = 0; i < size(); ++i)
      if (of(i).size && of(i).low >= 0) at[i] = kStart;
    return bounded(at);
  }

  /// Shares of a Gauss-Newton step.
  std::vector<VectorXd> steps_from(const VectorXd& at) const {
    std::vector<VectorXd> places = {at};
    for (Index i = 0; i < size(); ++i)
      for (const double to : {kReach, -kReach}) places.push_back(bounded(at + to * VectorXd::Unit(size(), i)));
    const std::vector<BasisCoefficients> left = left_at(places);
    std::vector<BasisCoefficients> columns;
    std::vector<Index> moved;
    for (Index i = 0; i < size(); ++i) {
      const auto k = static_cast<std::size_t>(1 + 2 * i);
      const double span = places[k][i] - places[k + 1][i];
      if (left[k].size() == 0 || left[k + 1].size() == 0 || !(span > 0)) continue;
      columns.emplace_back((left[k + 1] - left[k]) / span);
      moved.push_back(i);
    }
    const auto m = static_cast<Index>(moved.size());
    if (m == 0 || left[0].size() == 0) return {};
    columns.push_back(left[0]);
    const MatrixXd sums = measure(columns);
    MatrixXd normal = sums.topLeftCorner(m, m);
    VectorXd right = sums.col(m).head(m);
    for (Index k = 0; k < m; ++k) {
      const Index i = moved[static_cast<std::size_t>(k)];
      normal(k, k) *= 1 + 1e-9;
      normal(k, k) += of(i).size ? 1e-9 : 1;
      if (!of(i).size) right[k] -= at[i];
    }
    const VectorXd step = normal.ldlt().solve(right);
    std::vector<VectorXd> tries;
    for (const double share : {1.0, 0.5, 0.25, 0.1}) {
      VectorXd to = at;
      to(moved) += share * step;
      tries.push_back(bounded(to));
    }
    return tries;
  }

  const Subject& subject_;
  const std::vector<BasisCoefficients>& parameters_;
  std::string entry_;
  std::vector<gap::Unknown> unknowns_;
  BasisCoefficients wanted_;
};

}  // namespace

TrueValue true_value(const Subject& subject, const std::vector<BasisCoefficients>& parameters, blind::Effect effect,
                     double size) {
  BasisCoefficients wanted = subject.added({{effect, size, subject.flown().seed}})[0];
  if (wanted.size() == 0) return {};
  return Likeness(subject, parameters, blind::effect_names()[static_cast<std::size_t>(effect)], std::move(wanted))
      .find();
}

std::map<std::string, std::optional<double>> true_values(const blind::Case& c,
                                                         const std::vector<blind::BlindEffect>& effects,
                                                         const sim::Randomisation& uncertain, int threads) {
  const blind::Sizes sizes(effects);  // refuses what there is not
  std::map<std::string, std::optional<double>> result;
  blind::Case plain = c;
  plain.sizes = {};
  plain.power = plain.wings = false;
  plain.programme = blind::Programme::rich;
  std::vector<blind::RobotFlight> flights = fly_all(plain, threads);
  std::unique_ptr<const Subject> subject;
  std::vector<BasisCoefficients> parameters;
  if (std::ranges::none_of(flights, &blind::RobotFlight::crashed)) {
    subject = std::make_unique<const Subject>(plain, std::move(flights), threads);
    parameters = subject->simulated_parameters(uncertain);
  }
  for (std::size_t e = 0; e < blind::kBlindEffects; ++e) {
    const auto effect = static_cast<blind::Effect>(e);
    if (!sizes.has(effect) || !in_catalogue(effect)) continue;
    const std::string& id = blind::effect_names()[e];
    for (const gap::Unknown& u : gap::unknowns_of(id))
      if (u.size) result[id + "." + u.name] = std::nullopt;
    if (!subject) continue;
    const TrueValue found = true_value(*subject, parameters, effect, sizes[effect]);
    if (found.misfit >= kMostMisfit) continue;
    for (const auto& [name, value] : found.values) result[name] = value;
  }
  return result;
}

}  // namespace flappy::benchmark
