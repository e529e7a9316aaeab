#include "gap/fit/fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "io/parallel.hpp"

namespace flappy::gap {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Reach of the first differences, in prior standard deviations. Choice.
constexpr double kFirstReach = 0.3;
/// Reach of later differences, in standard deviations of the posterior. Choice.
constexpr double kReachSd = 3;
/// Bounds of that reach, in prior standard deviations. Choice.
constexpr double kMinReach = 0.1, kMaxReach = 1;
/// Number of points around that of a fit over which statistics are averaged. Choice.
constexpr int kAround = 8;
/// Distance of these points, in reaches. Choice.
constexpr double kAroundReach = 0.2;
/// A smaller step, in prior standard deviations, ends the iteration. Choice.
constexpr double kConverged = 0.02;
/// Nuisance regressors with less information, in prior precisions, are left out. Choice: they matter hundredths of a
/// nat.
constexpr double kMinInformation = 0.05;
/// Largest distance, in reaches, at which the columns of another point are used. Choice.
constexpr double kMaxDistance = 2;
/// Largest number of steps in a fit of effects whose parameters stay where they are, and in a fine fit. Choice.
constexpr int kMaxEffectSteps = 2, kMaxFineSteps = 4;
/// Smallest reach of the differences of a fine fit, in prior standard deviations. Choice: shorter ones are lost in what
/// is rough.
constexpr double kMinEffectReach = 0.03;
/// A fine fit ends at a step of fewer standard deviations of the posterior. Choice: at a step of one, what a linear
/// model gains may differ from what a simulation gains by half a nat for each coordinate.
constexpr double kSettled_sd = 0.5;

/// Directions of a fit with a column.
std::vector<Index> seen_directions(const Fit& fit) {
  std::vector<Index> seen;
  for (std::size_t d = 0; d < fit.columns.size(); ++d)
    if (fit.columns[d].size() > 0) seen.push_back(static_cast<Index>(d));
  return seen;
}

}  // namespace

Directions Fitter::axes(const Hypothesis& hypothesis) {
  return {MatrixXd::Identity(hypothesis.size(), hypothesis.size()), VectorXd::Constant(hypothesis.size(), kFirstReach)};
}

Fit Fitter::linearise(const Hypothesis& hypothesis, const VectorXd& at, Directions directions,
                      const std::vector<SharedColumn>& known, bool forward) const {
  std::vector<VehicleHypothesis> vehicles = {hypothesis.vehicle(at)};
  std::vector<double> spans;
  const auto first = static_cast<Index>(known.size());
  const std::size_t sides = forward ? 1 : 2;
  for (Index d = first; d < directions.reach.size(); ++d) {
    if (linear_column(hypothesis, d)) continue;
    const VectorXd axis = directions.axes.col(d);
    const VectorXd up = hypothesis.bounded(at + directions.reach[d] * axis);
    const VectorXd down = hypothesis.bounded(at - directions.reach[d] * axis);
    // the longer side, where a bound is near
    const bool upward = std::abs((up - at).dot(axis)) >= std::abs((at - down).dot(axis));
    const VectorXd &to = !forward || upward ? up : down, &from = forward ? at : down;
    spans.push_back((to - from).dot(axis));
    vehicles.push_back(hypothesis.vehicle(to));
    if (!forward) vehicles.push_back(hypothesis.vehicle(from));
  }
  const std::vector<VectorXd> shifts =
      forward ? std::vector<VectorXd>() : around(hypothesis, at, directions, known, vehicles);
  Fit l{at, std::move(directions), {}, {}, known, 1, {}};
  std::vector<std::size_t> flown;
  for (Index d = first; d < l.directions.reach.size(); ++d) {
    const BasisCoefficients* linear = linear_column(hypothesis, d);
    if (linear == nullptr) flown.push_back(l.columns.size());
    l.columns.emplace_back(linear == nullptr ? BasisCoefficients() : *linear);
  }
  // residuals are reduced as they come
  std::vector<BasisCoefficients> of_sides(sides * flown.size());
  std::vector<SufficientStatistics> there(shifts.size());
  for_residuals(*flights_, vehicles, threads_, [&](std::size_t i, Residuals rows) {
    if (i == 0) l.residual = std::move(rows);
    else if (rows.empty()) return;
    else if (i <= of_sides.size()) of_sides[i - 1] = evidence_->basis_coefficients(rows);
    else there[i - 1 - of_sides.size()] = evidence_->statistics(rows);
  });
  if (l.residual.empty()) return l;
  const BasisCoefficients here = forward ? evidence_->basis_coefficients(l.residual) : BasisCoefficients();
  for (std::size_t n = 0; n < flown.size(); ++n) {
    const BasisCoefficients &to = of_sides[sides * n], &from = forward ? here : of_sides[sides * n + 1];
    if (to.size() > 0 && from.size() > 0 && spans[n] != 0)
      l.columns[flown[n]] = BasisCoefficients((from - to) / spans[n]);
  }
  l.statistics = evidence_->statistics(l.residual);
  average(std::move(there), shifts, l);
  return l;
}

const BasisCoefficients* Fitter::linear_column(const Hypothesis& hypothesis, Index direction) const {
  if (direction < hypothesis.shared()) return nullptr;
  const Unknown& u = hypothesis.unknowns()[static_cast<std::size_t>(direction)];
  const auto linear = linear_.find({u.effect, u.name});
  return linear == linear_.end() ? nullptr : &linear->second;
}

/// Steps along the directions to points around `at`; adds the vehicles of these points.
std::vector<VectorXd> Fitter::around(const Hypothesis& hypothesis, const VectorXd& at, const Directions& directions,
                                     const std::vector<SharedColumn>& known,
                                     std::vector<VehicleHypothesis>& vehicles) const {
  std::vector<VectorXd> shifts;
  const Index k = std::min(directions.reach.size(), hypothesis.shared());
  for (int i = 0; k > 0 && i < kAround; ++i) {
    VectorXd shift = VectorXd::Zero(k);
    for (Index d = 0; d < k; ++d) {
      if (static_cast<std::size_t>(d) < known.size() && known[static_cast<std::size_t>(d)].size() == 0) continue;
      // Hadamard columns but the first: each direction goes up as often as down, any seven in a row are orthogonal
      const int sign = __builtin_popcount(static_cast<unsigned>((d % (kAround - 1) + 1) & i)) % 2 ? -1 : 1;
      shift[d] = kAroundReach * sign * directions.reach[d];
    }
    if (shift.isZero()) return {};
    const VectorXd there = hypothesis.bounded(at + directions.axes.leftCols(k) * shift);
    shifts.push_back(directions.axes.leftCols(k).transpose() * (there - at));
    vehicles.push_back(hypothesis.vehicle(there));
  }
  return shifts;
}

/// The residual at one point is rough, so statistics are averaged over points around. The columns take each point back
/// to the fit; nothing is averaged if one is missing. `around`: statistics at the points, empty where a simulation
/// diverges.
void Fitter::average(std::vector<SufficientStatistics> around, const std::vector<VectorXd>& shifts, Fit& fit) const {
  for (Index d = 0; !shifts.empty() && d < shifts[0].size(); ++d)
    if (shifts[0][d] != 0 && fit.columns[static_cast<std::size_t>(d)].size() == 0) return;
  io::parallel_for(around.size(), threads_, [&](std::size_t i) {
    if (around[i].sums.empty()) return;
    BasisCoefficients back = BasisCoefficients::Zero(kGroups, evidence_->basis().size());
    for (Index d = 0; d < shifts[i].size(); ++d)
      if (shifts[i][d] != 0) back += shifts[i][d] * *fit.columns[static_cast<std::size_t>(d)];
    evidence_->add(1, back, around[i]);
  });
  double n = 1;
  for (const SufficientStatistics& there : around) {
    if (there.sums.empty()) continue;
    for (std::size_t f = 0; f < there.sums.size(); ++f)
      for (std::size_t g = 0; g < there.sums[f].size(); ++g) fit.statistics.sums[f][g] += there.sums[f][g];
    n += 1;
  }
  for (auto& flight : fit.statistics.sums)
    for (VectorXd& sum : flight) sum /= n;
}

Fitter::Fitter(const FitRules& rules, const Flights& flights, std::shared_ptr<const Evidence> evidence, int threads)
    : rules_(&rules), flights_(&flights), evidence_(std::move(evidence)), threads_(threads) {}

Fitter Fitter::with_evidence(std::shared_ptr<const Evidence> evidence) const {
  Fitter f = *this;
  f.evidence_ = std::move(evidence);
  return f;
}

Fitter Fitter::with_linear_magnitudes(LinearMagnitudes magnitudes) const {
  Fitter f = *this;
  f.linear_ = std::move(magnitudes);
  return f;
}

Fitter Fitter::with_nuisances(const Regressors& nuisances, const std::vector<Background>& background,
                              const Fit& fit) const {
  Fitter f = *this;
  f.nuisances_.clear();
  Regressors all = own_regressors(fit);
  const std::size_t first = all.columns.size();
  for (std::size_t k = 0; k < nuisances.columns.size(); ++k) all.add(*nuisances.columns[k], nuisances.prior_means[k]);
  for (const Background& b : background) {
    int effect = f.place_of(b.effect);
    if (effect < 0) {  // a new effect; scales that were found before keep their indices
      effect = static_cast<int>(f.effects_.size());
      f.effects_.push_back(b.effect);
    }
    all.add(b.column, 0, effect, evidence_->discrepancy().scale_prior(b.effect));
  }
  const Reduced reduced = reduce(fit, all);
  for (std::size_t i = first; i < all.columns.size(); ++i) {
    const auto diagonal = static_cast<Index>(i);
    if (!(reduced.sums(diagonal, diagonal) > kMinInformation)) continue;
    f.nuisances_.push_back({*all.columns[i], all.prior_means[i], all.effects[i], all.priors[i], i - first});
  }
  return f.with_scales(scales_);
}

Fitter Fitter::with_scales(Scales scales) const {
  Fitter f = *this;
  f.scales_ = std::move(scales);
  for (Nuisance& n : f.nuisances_) {
    const auto effect = static_cast<std::size_t>(n.effect);
    const double before = n.scale;
    if (n.effect >= 0)
      n.scale = effect < f.scales_.effects.size() ? f.scales_.effects[effect] : f.scales_.prior_scale(n.prior);
    if (n.scale == before && n.scaled.size() > 0) continue;  // unchanged: shared with the other fitter
    n.scaled = BasisCoefficients(n.scale * *n.column);
  }
  return f;
}

Fitter Fitter::without_background() const {
  Fitter f = *this;
  std::erase_if(f.nuisances_, [](const Nuisance& n) { return n.effect >= 0; });
  return f;
}

int Fitter::place_of(const std::string& effect) const {
  const auto at = std::ranges::find(effects_, effect);
  return at == effects_.end() ? -1 : static_cast<int>(at - effects_.begin());
}

std::vector<Fitter::NuisanceEstimate> Fitter::nuisances(const Fit& fit) const {
  const Regressors r = regressors(fit);
  const Posterior p = Evidence::posterior(reduce(fit, r), r.all, r.prior_mean());
  std::vector<NuisanceEstimate> list;
  const std::size_t own = r.columns.size() - nuisances_.size();
  for (std::size_t k = 0; k < nuisances_.size() && nuisances_[k].effect < 0; ++k) {
    const auto i = static_cast<Index>(own + k);
    list.push_back({{nuisances_[k].place, p.mean[i]}, std::sqrt(p.covariance(i, i))});
  }
  return list;
}

Regressors Fitter::own_regressors(const Fit& fit) {
  Regressors r;
  for (std::size_t d = 0; d < fit.columns.size(); ++d)
    if (fit.columns[d].size() > 0) r.add(fit.columns[d], -fit.directions.axes.col(static_cast<Index>(d)).dot(fit.at));
  return r;
}

void Fitter::add_nuisances(bool scaled, Regressors& to) const {
  for (const Nuisance& n : nuisances_) to.add(scaled ? n.scaled : n.column, n.prior_mean, n.effect, n.prior);
}

Regressors Fitter::regressors(const Fit& fit) const {
  Regressors r = own_regressors(fit);
  add_nuisances(true, r);
  return r;
}

Regressors Fitter::unscaled_regressors(const Fit& fit) const {
  Regressors r = own_regressors(fit);
  add_nuisances(false, r);
  return r;
}

/// Linear change by those magnitudes of each effect whose law may deviate.
std::map<std::string, BasisCoefficients> Fitter::changes(const Hypothesis& hypothesis, const Fit& fit) const {
  std::map<std::string, BasisCoefficients> whole;
  for (Index i = hypothesis.shared(); i < hypothesis.size(); ++i) {
    const Unknown& u = hypothesis.unknowns()[static_cast<std::size_t>(i)];
    const BasisCoefficients& column = fit.columns[static_cast<std::size_t>(i)];
    if (!u.magnitude || !rules_->law_may_deviate(u) || column.size() == 0) continue;
    BasisCoefficients& change = whole[u.effect];
    if (change.size() == 0) change = BasisCoefficients::Zero(column.rows(), column.cols());
    change += fit.at[i] * column;
  }
  return whole;
}

BasisCoefficients Fitter::law_sd(const Hypothesis& hypothesis, const Fit& fit, double law_factor) const {
  BasisCoefficients squares = BasisCoefficients::Zero(kGroups, evidence_->basis().size());
  for (const auto& [effect, change] : changes(hypothesis, fit))
    squares += law_sd_of(effect, change, law_factor).cwiseAbs2();
  return squares.cwiseSqrt();
}

bool Fitter::law_may_deviate(const Hypothesis& hypothesis, const Fit& fit) const {
  return std::ranges::any_of(changes(hypothesis, fit),
                             [&](const auto& change) { return law_sd_of(change.first, change.second, 1).any(); });
}

Posterior Fitter::posterior(const Hypothesis& hypothesis, const Fit& fit, const std::vector<char>& use) const {
  const Regressors r = regressors(fit);
  return solve(fit, r, evidence_->reduce(fit.statistics, r.columns, use, discrepancy_sd(hypothesis, fit)));
}

BasisCoefficients Fitter::discrepancy_sd(const Hypothesis& hypothesis, const Fit& fit) const {
  return (evidence_->discrepancy_sd(scales_).cwiseAbs2() + law_sd(hypothesis, fit).cwiseAbs2()).cwiseSqrt();
}

Fitter::JointFit Fitter::joint_fit(const Hypothesis& hypothesis, const Fit& fit, const std::vector<char>& use) const {
  const Regressors r = regressors(fit);
  const Posterior p = Evidence::posterior(
      evidence_->reduce(fit.statistics, r.columns, use, discrepancy_sd(hypothesis, fit)), r.all, r.prior_mean(), false);
  VectorXd along = VectorXd::Zero(static_cast<Index>(fit.columns.size()));
  Index k = 0;
  for (std::size_t d = 0; d < fit.columns.size(); ++d)
    if (fit.columns[d].size() > 0) along[static_cast<Index>(d)] = p.mean[k++];
  JointFit joint{hypothesis.bounded(fit.at + fit.directions.axes * along),
                 BasisCoefficients::Zero(kGroups, evidence_->basis().size()),
                 {}};
  for (std::size_t n = 0; k < p.mean.size(); ++k, ++n) {
    joint.nuisances += p.mean[k] * *r.columns[static_cast<std::size_t>(k)];
    joint.means.push_back({nuisances_[n].place, nuisances_[n].scale * p.mean[k]});
  }
  return joint;
}

BasisCoefficients Fitter::explained(const Fit& fit, const std::vector<char>& use) const {
  const Regressors r = regressors(fit);
  const BasisCoefficients sd = evidence_->discrepancy_sd(scales_);
  const Posterior p =
      Evidence::posterior(evidence_->reduce(fit.statistics, r.columns, use, sd), r.all, r.prior_mean(), false);
  BasisCoefficients all = BasisCoefficients::Zero(kGroups, evidence_->basis().size());
  for (Index i = 0; i < p.mean.size(); ++i) all += p.mean[i] * *r.columns[static_cast<std::size_t>(i)];
  return all + evidence_->discrepancy_mean(fit.statistics, all, use, sd);
}

Reduced Fitter::reduce(const Fit& fit, const Regressors& r) const {
  return evidence_->reduce(fit.statistics, r.columns, all_flights(), evidence_->discrepancy_sd(scales_));
}

/// `damping`: precision added around the present point (Levenberg); if not 0, without a covariance.
Posterior Fitter::solve(const Fit& fit, const Regressors& r, Reduced reduced, double damping) const {
  const auto own = static_cast<Index>(seen_directions(fit).size());
  reduced.sums.diagonal().head(own).array() += damping;
  return of_directions(fit, Evidence::posterior(reduced, r.all, r.prior_mean(), damping == 0));
}

Posterior Fitter::of_directions(const Fit& fit, const Posterior& p) {
  const std::vector<Index> seen = seen_directions(fit);
  const auto own = static_cast<Index>(seen.size()), k = static_cast<Index>(fit.columns.size());
  Posterior all{p.log_evidence, VectorXd::Zero(k), MatrixXd::Identity(k, k)};
  all.mean(seen) = p.mean.head(own);
  if (p.covariance.size() > 0) all.covariance(seen, seen) = p.covariance.topLeftCorner(own, own);
  return all;
}

VectorXd Fit::mean() const { return at + directions.axes * posterior.mean; }
MatrixXd Fit::covariance() const { return directions.axes * posterior.covariance * directions.axes.transpose(); }

Directions Fitter::joint_directions(const Hypothesis& hypothesis, const Fit& parameters) {
  Directions d = axes(hypothesis);
  const Index shared = hypothesis.shared();
  d.axes.topLeftCorner(shared, shared) = parameters.directions.axes.topLeftCorner(shared, shared);
  d.reach.head(shared) = parameters.directions.reach.head(shared);
  return d;
}

std::vector<SharedColumn> Fitter::shared_columns(const Hypothesis& hypothesis, const Fit& parameters) {
  const auto& columns = parameters.columns;
  return {columns.begin(), columns.begin() + static_cast<std::ptrdiff_t>(hypothesis.shared())};
}

/// Principal axes of the posterior of the parameters, and the coordinates of the effects.
Directions Fitter::principal(const Hypothesis& hypothesis, const Fit& fit) {
  const Index shared = hypothesis.shared(), size = hypothesis.size();
  const MatrixXd covariance = fit.covariance();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(covariance.topLeftCorner(shared, shared));
  Directions d = axes(hypothesis);
  d.axes.topLeftCorner(shared, shared) = eigen.eigenvectors();
  for (Index i = 0; i < size; ++i) {
    const double variance = i < shared ? eigen.eigenvalues()[i] : covariance(i, i);
    d.reach[i] = std::clamp(kReachSd * std::sqrt(variance), kMinReach, kMaxReach);
  }
  return d;
}

Fit Fitter::fit(const Hypothesis& hypothesis, VectorXd start, int max_iterations) const {
  const bool forward = max_iterations > 1;
  return improve(hypothesis, linearise(hypothesis, hypothesis.bounded(std::move(start)), axes(hypothesis), {}, forward),
                 max_iterations, nullptr, forward ? Columns::forward : Columns::central);
}

Fit Fitter::fit_given(const Hypothesis& hypothesis, const VectorXd& start, const Fit& parameters,
                      int max_iterations) const {
  return improve(hypothesis,
                 linearise(hypothesis, hypothesis.bounded(start), joint_directions(hypothesis, parameters),
                           shared_columns(hypothesis, parameters)),
                 max_iterations, &parameters, Columns::central);
}

Fit Fitter::fit_effects(const Hypothesis& hypothesis, const VectorXd& start, const Fit& parameters) const {
  const Index effects = hypothesis.size() - hypothesis.shared();
  const bool fine = rules_->fits_effects_finely();
  VectorXd at = hypothesis.bounded(start);
  at.head(hypothesis.shared()) = parameters.at.head(hypothesis.shared());
  Directions directions = joint_directions(hypothesis, parameters);
  for (int n = 0;; ++n) {
    Fit result = linearise(hypothesis, at, directions, shared_columns(hypothesis, parameters));
    if (!result.flown()) return result;
    const Regressors r = regressors(result);
    const BasisCoefficients sd = rules_->effects_discrepancy_sd(*this, hypothesis, result);
    result.posterior = solve(result, r, evidence_->reduce(result.statistics, r.columns, all_flights(), sd));
    if (n == (fine ? kMaxFineSteps : kMaxEffectSteps)) return result;
    VectorXd there = hypothesis.bounded(result.mean());
    there.head(hypothesis.shared()) = at.head(hypothesis.shared());
    there = rules_->next_effects(*this, hypothesis, result, there, sd);
    const VectorXd sd_of_effects = result.covariance().diagonal().tail(effects).cwiseSqrt();
    const Eigen::ArrayXd step = (there - at).tail(effects).array().abs(), now = directions.reach.tail(effects).array();
    if (fine)
      directions.reach.tail(effects) = (kReachSd * sd_of_effects).cwiseMax(kMinEffectReach).cwiseMin(kFirstReach);
    const bool settled = !fine || ((step < kSettled_sd * sd_of_effects.array()).all() &&
                                   (now < 2 * directions.reach.tail(effects).array()).all());
    if ((step < now).all() && settled) return result;
    at = there;
  }
}

Fit Fitter::fit_linear(const Hypothesis& hypothesis, const Fit& parameters,
                       const std::vector<BasisCoefficients>& effects) const {
  Fit result = parameters;
  result.residual.clear();
  result.at = hypothesis.start();
  result.at.head(hypothesis.shared()) = parameters.at;
  result.directions = joint_directions(hypothesis, parameters);
  result.columns.insert(result.columns.end(), effects.begin(), effects.end());
  const Regressors r = regressors(result);
  result.posterior = solve(result, r, reduce(result, r));
  return result;
}

Fit Fitter::refit(const Hypothesis& hypothesis, const Fit& before, int max_iterations) const {
  Fit result = before;
  result.statistics = evidence_->statistics(before.residual);
  return improve(hypothesis, std::move(result), max_iterations, nullptr, Columns::elsewhere);
}

/// Gauss-Newton. Columns are kept while steps stay close; on the way they are by forward differences, and the last point gets central ones.
/// `columns`: those that `fit` has.
Fit Fitter::improve(const Hypothesis& hypothesis, Fit fit, int max_iterations, const Fit* parameters,
                    Columns columns) const {
  if (!fit.flown()) return fit;
  VectorXd linearised_at = fit.at;
  std::vector<Index> in_log;
  for (Index i = hypothesis.shared(); i < hypothesis.size(); ++i)
    if (hypothesis.unknowns()[static_cast<std::size_t>(i)].in_log) in_log.push_back(i);
  const auto linearise_here = [&](const VectorXd& at, Columns how) {
    Fit next = parameters == nullptr
                   ? linearise(hypothesis, at, principal(hypothesis, fit), {}, how == Columns::forward)
                   : linearise(hypothesis, at, fit.directions, shared_columns(hypothesis, *parameters));
    if (!next.flown()) return false;
    next.posterior = std::move(fit.posterior);
    fit = std::move(next);
    linearised_at = at;
    columns = parameters == nullptr ? how : Columns::central;
    return true;
  };
  for (int n = 1;; ++n) {
    const Regressors r = regressors(fit);
    const Reduced reduced = reduce(fit, r);
    fit.posterior = solve(fit, r, reduced);
    const VectorXd step = fit.directions.axes * fit.posterior.mean;
    bool improved = n < max_iterations && step.cwiseAbs().maxCoeff() >= kConverged;
    if (improved) {
      // Shares of the Gauss-Newton step, all tried at once. Choice.
      constexpr double kStepShares[] = {1.4, 1, 0.7, 0.5, 0.35, 0.25, 0.1, 0.03};
      // Dampings of further steps (Levenberg), shorter where there is little information. Choice.
      constexpr double kDampings[] = {0.3, 1, 3, 10, 30, 100, 300, 1000};
      std::vector<VectorXd> tries;
      for (const double share : kStepShares) tries.push_back(hypothesis.bounded(fit.at + share * step));
      for (const double damping : kDampings)
        tries.push_back(hypothesis.bounded(fit.at + fit.directions.axes * solve(fit, r, reduced, damping).mean));
      // effects of sensors keep their values, so that all tries share one log; their changes are added linearly
      std::vector<VehicleHypothesis> vehicles;
      for (VectorXd at : tries) {
        at(in_log) = fit.at(in_log);
        vehicles.push_back(hypothesis.vehicle(at));
      }
      std::vector<Residuals> rest = residuals(*flights_, vehicles, threads_);
      rest.push_back(fit.residual);
      tries.push_back(fit.at);
      Regressors nuisances;
      add_nuisances(true, nuisances);
      const Index others = static_cast<Index>(nuisances.columns.size()),
                  first = static_cast<Index>(r.columns.size()) - others;
      const MatrixXd sums = reduced.sums.block(first, first, others, others);
      const BasisCoefficients sd = evidence_->discrepancy_sd(scales_);
      const auto costs_of = [&](const std::vector<SufficientStatistics>& of, const std::vector<VectorXd>& at) {
        std::vector<double> costs(of.size(), std::numeric_limits<double>::infinity());
        const auto all = evidence_->reduce_each(of, nuisances.columns, all_flights(), sd, &sums);
        io::parallel_for(of.size(), threads_, [&](std::size_t i) {
          if (all[i])
            costs[i] = 0.5 * at[i].squaredNorm() -
                       Evidence::posterior(*all[i], nuisances.all, nuisances.prior_mean(), false).log_evidence;
        });
        return costs;
      };
      std::vector<SufficientStatistics> statistics(rest.size());
      io::parallel_for(rest.size(), threads_, [&](std::size_t i) {
        if (rest[i].empty()) return;
        statistics[i] = evidence_->statistics(rest[i]);
        for (const Index k : in_log)
          if (const BasisCoefficients& column = fit.columns[static_cast<std::size_t>(k)]; column.size() > 0)
            evidence_->add(fit.at[k] - tries[i][k], column, statistics[i]);
      });
      std::vector<double> costs = costs_of(statistics, tries);
      const auto best = static_cast<std::size_t>(std::ranges::min_element(costs) - costs.begin());
      if (!in_log.empty() && best + 1 < rest.size()) {
        rest[best] = std::move(residuals(*flights_, {hypothesis.vehicle(tries[best])}, threads_)[0]);
        statistics[best] = rest[best].empty() ? SufficientStatistics{} : evidence_->statistics(rest[best]);
        costs[best] = costs_of({statistics[best]}, {tries[best]}).front();
      }
      improved = costs.back() - costs[best] >= rules_->min_step_nats();
      if (improved) {
        const VectorXd away = fit.directions.axes.transpose() * (tries[best] - linearised_at);
        if (away.cwiseAbs().cwiseQuotient(fit.directions.reach).maxCoeff() > kMaxDistance) {
          if (!linearise_here(tries[best], Columns::forward)) return fit;
        } else {
          fit.at = tries[best];
          fit.residual = std::move(rest[best]);
          fit.statistics = std::move(statistics[best]);
          columns = Columns::elsewhere;
        }
      }
    }
    if (improved) continue;
    if (columns == Columns::central || !linearise_here(fit.at, Columns::central)) return fit;
    max_iterations = n + 1;  // one more iteration, which computes the posterior with the new columns and does not step
  }
}

}  // namespace flappy::gap
