// Which figures of the catalogue an effect of the blind robot comes to.
#include <algorithm>
#include <cmath>

#include "blind/oracle.hpp"
#include "gap/hypothesis.hpp"

namespace flappy::blind {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using gap::Smooth;

constexpr int kIterations = 8;
/// Reach of differences, and the step below which there is no more to be had: of a coordinate, of which the prior has 1.645.
constexpr double kReach = 0.1, kConverged = 0.002;
/// Where the search begins: a typical size, or none where both signs are plausible.
constexpr double kStart = 0.5;
}  // namespace

TrueValue true_value(const Subject& subject, Effect effect, double size) {
  const std::string& id = effect_names()[static_cast<std::size_t>(effect)];
  const std::vector<gap::Unknown> unknowns = gap::unknowns_of(id);
  const Smooth wanted = subject.added({{effect, size, subject.flown().seed}})[0];
  TrueValue result;
  if (wanted.size() == 0) return result;

  std::vector<Index> sizes;
  VectorXd at = VectorXd::Zero(static_cast<Index>(unknowns.size()));
  for (Index i = 0; i < at.size(); ++i) {
    const gap::Unknown& u = unknowns[static_cast<std::size_t>(i)];
    if (!u.size) continue;
    sizes.push_back(i);
    if (u.low >= 0) at[i] = kStart;
  }
  const auto bounded = [&](VectorXd x) {
    for (Index i = 0; i < x.size(); ++i) {
      const gap::Unknown& u = unknowns[static_cast<std::size_t>(i)];
      x[i] = u.coordinate(u.value(x[i]));
    }
    return x;
  };
  // what is left of `wanted`, for many places at once
  const auto left_at = [&](const std::vector<VectorXd>& places) {
    std::vector<Smooth> left = subject.catalogue(id, places);
    for (Smooth& s : left)
      if (s.size() > 0) s = wanted - s;
    return left;
  };
  const auto cost_of = [&](const Smooth& left) { return left.size() > 0 ? subject.distance({left})(0, 0) : 1e300; };
  const double all = cost_of(wanted);
  double cost = 1e300;
  for (int n = 0; n < kIterations; ++n) {
    std::vector<VectorXd> places = {at};
    for (const Index i : sizes)
      for (const double to : {kReach, -kReach}) places.push_back(bounded(at + to * VectorXd::Unit(at.size(), i)));
    std::vector<Smooth> left = left_at(places);
    if (left[0].size() == 0) break;
    cost = cost_of(left[0]);
    std::vector<Smooth> columns;
    std::vector<Index> moved;
    for (std::size_t k = 0; k < sizes.size(); ++k) {
      const Smooth &up = left[1 + 2 * k], &down = left[2 + 2 * k];
      const double span = places[1 + 2 * k][sizes[k]] - places[2 + 2 * k][sizes[k]];
      if (up.size() == 0 || down.size() == 0 || !(span > 0)) continue;
      columns.emplace_back((down - up) / span);
      moved.push_back(sizes[k]);
    }
    const auto m = static_cast<Index>(moved.size());
    if (m == 0) break;
    columns.push_back(left[0]);
    const MatrixXd sums = subject.distance(columns);
    MatrixXd normal = sums.topLeftCorner(m, m);
    normal.diagonal() *= 1 + 1e-9;
    const VectorXd step = normal.ldlt().solve(sums.col(m).head(m));
    std::vector<VectorXd> tries;
    for (const double share : {1.0, 0.5, 0.25, 0.1}) {
      VectorXd to = at;
      to(moved) += share * step;
      tries.push_back(bounded(to));
    }
    const std::vector<Smooth> then = left_at(tries);
    std::size_t best = tries.size();
    double least = cost;
    for (std::size_t i = 0; i < tries.size(); ++i)
      if (const double c = cost_of(then[i]); c < least) best = i, least = c;
    if (best == tries.size()) break;
    const double moved_by = (tries[best] - at).cwiseAbs().maxCoeff();
    at = tries[best];
    cost = least;
    if (moved_by < kConverged) break;
  }
  result.misfit = all > 0 ? std::sqrt(std::min(cost / all, 1.0)) : 1;
  for (const Index i : sizes) {
    const gap::Unknown& u = unknowns[static_cast<std::size_t>(i)];
    result.values[id + "." + u.name] = u.value(at[i]);
  }
  return result;
}

std::map<std::string, std::optional<double>> true_values(const Case& c, const std::vector<BlindEffect>& effects,
                                                         int threads) {
  const Sizes sizes(effects);  // refuses what there is not
  std::map<std::string, std::optional<double>> result;
  Case plain = c;
  plain.sizes = {};
  plain.power = plain.wings = false;
  plain.programme = Programme::rich;
  std::vector<Flight> flights = fly_all(plain, threads);
  std::unique_ptr<const Subject> subject;
  if (std::ranges::none_of(flights, &Flight::crashed))
    subject = std::make_unique<const Subject>(plain, std::move(flights), threads);
  for (std::size_t e = 0; e < kEffects; ++e) {
    const auto effect = static_cast<Effect>(e);
    if (!sizes.has(effect) || !in_catalogue(effect)) continue;
    const std::string& id = effect_names()[e];
    for (const gap::Unknown& u : gap::unknowns_of(id))
      if (u.size) result[id + "." + u.name] = std::nullopt;
    if (!subject) continue;
    const TrueValue found = true_value(*subject, effect, sizes[effect]);
    if (found.misfit >= kMostMisfit) continue;
    for (const auto& [name, value] : found.values) result[name] = value;
  }
  return result;
}

}  // namespace flappy::blind
