#include "gap/evidence/fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "gap/replay/sensor_correction.hpp"
#include "io/parallel.hpp"

namespace flappy::gap {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Reach of the first differences, and bounds of the later ones: so many standard deviations of what is known then, for a
/// step has to be long where little is known and short where much is.
constexpr double kFirstReach = 0.3, kLeastReach = 0.1, kMostReach = 1, kReachSd = 3;
/// Points around another, and their share of the reach of its differences.
constexpr int kAround = 8;
constexpr double kAroundReach = 0.2;
constexpr double kConverged = 0.02;
/// Nats that another step has to bring, where steps are flown, and where they cost nothing.
constexpr double kWorthwhile = 0.5, kWorthwhileByTheBeat = 0.05;
/// Information in a column of standard normal coefficient below which it changes nothing: its evidence by some hundredths of a nat.
constexpr double kTelling = 0.05;
/// How far, in reaches of its differences, columns of another point are trusted.
constexpr double kFar = 2;
/// Of functions of the place those are of another shape which its change follows by so much of the square by which it follows any.
constexpr double kNatural = 0.1;
/// Times that effects are moved where parameters stay.
constexpr int kMostOwn = 2;
/// Steps towards a robot that has nothing of any entry.
constexpr int kMostAlone = 6;

}  // namespace

std::vector<Residuals> residuals(const std::vector<PredictedFlight>& flights, const std::vector<Candidate>& candidates,
                                 int threads) {
  // candidates whose sensors agree share a log
  std::map<EffectValues, std::vector<std::size_t>> by_sensors;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    // a vehicle that is known by the beat has its sensors in its prediction
    EffectValues sensors =
        candidates[i].vehicle.beat_averaged ? EffectValues() : sensor_effects(candidates[i].vehicle.effects);
    sensors.insert(candidates[i].sensors.begin(), candidates[i].sensors.end());
    by_sensors[sensors].push_back(i);
  }
  std::vector<Residuals> list(candidates.size());
  const auto compare = [&](const std::vector<PredictedFlight>& seen, const std::vector<std::size_t>& which,
                           int at_once) {
    std::vector<Candidate> group;
    for (const std::size_t i : which) group.push_back(candidates[i]);
    std::vector<Residuals> predicted = predict_all(seen, group, at_once);
    for (std::size_t g = 0; g < which.size(); ++g) {
      Residuals& s = predicted[g];
      const bool whole = std::ranges::none_of(s, [](const Rows& rows) { return rows.empty(); });
      for (std::size_t f = 0; whole && f < seen.size(); ++f)
        for (std::size_t i = 0; i < s[f].size(); ++i) s[f][i] = seen[f].measured()[i] - s[f][i];
      if (whole) list[which[g]] = std::move(s);
    }
  };
  std::vector<std::pair<EffectValues, std::vector<std::size_t>>> corrected;
  for (auto& [sensors, which] : by_sensors) {
    if (sensors.empty()) compare(flights, which, threads);
    else corrected.emplace_back(sensors, which);
  }
  // few logs leave threads to their flights
  const int at_once =
      std::max(1, io::thread_count(threads) / static_cast<int>(std::max<std::size_t>(1, corrected.size())));
  io::parallel_for(corrected.size(), threads, [&](std::size_t k) {
    std::vector<std::optional<PredictedFlight>> logs(flights.size());
    io::parallel_for(flights.size(), at_once, [&](std::size_t f) {
      logs[f] = flights[f].with_log(without(corrected[k].first, flights[f].recording().log));
    });
    std::vector<PredictedFlight> seen;
    for (std::optional<PredictedFlight>& log : logs) seen.push_back(std::move(*log));
    compare(seen, corrected[k].second, at_once);
  });
  return list;
}

Directions Fitter::axes(const Hypothesis& hypothesis) {
  return {MatrixXd::Identity(hypothesis.size(), hypothesis.size()), VectorXd::Constant(hypothesis.size(), kFirstReach)};
}

Linearised Fitter::linearise(const Hypothesis& hypothesis, const VectorXd& at, Directions directions,
                             const std::vector<BasisCoefficients>& known) const {
  std::vector<Candidate> candidates = {hypothesis.candidate(at)};
  std::vector<double> spans;
  const auto first = static_cast<Index>(known.size());
  for (Index d = first; d < directions.reach.size(); ++d) {
    if (line_of(hypothesis, d)) continue;
    const VectorXd axis = directions.axes.col(d);
    const VectorXd up = hypothesis.bounded(at + directions.reach[d] * axis);
    const VectorXd down = hypothesis.bounded(at - directions.reach[d] * axis);
    spans.push_back((up - down).dot(axis));
    candidates.push_back(hypothesis.candidate(up));
    candidates.push_back(hypothesis.candidate(down));
  }
  const std::vector<VectorXd> shifts = around(hypothesis, at, directions, known, candidates);
  std::vector<Residuals> rows = residuals(flights_, candidates, threads_);
  Linearised l{at, std::move(directions), std::move(rows[0]), {}, known};
  std::vector<std::size_t> flown;
  for (Index d = first; d < l.directions.reach.size(); ++d) {
    const BasisCoefficients* line = line_of(hypothesis, d);
    if (line == nullptr) flown.push_back(l.columns.size());
    l.columns.push_back(line == nullptr ? BasisCoefficients() : *line);
  }
  io::parallel_for(flown.size(), threads_, [&](std::size_t n) {
    Residuals &up = rows[1 + 2 * n], &down = rows[2 + 2 * n];
    if (up.empty() || down.empty() || !(spans[n] > 0)) return;
    for (std::size_t f = 0; f < up.size(); ++f)
      for (std::size_t i = 0; i < up[f].size(); ++i) up[f][i] = (down[f][i] - up[f][i]) / spans[n];
    l.columns[flown[n]] = evidence_.basis_coefficients(up);
  });
  if (l.residual.empty()) return l;
  l.statistics = evidence_.statistics(l.residual);
  average({rows.begin() + static_cast<std::ptrdiff_t>(rows.size() - shifts.size()), rows.end()}, shifts, l);
  return l;
}

const BasisCoefficients* Fitter::line_of(const Hypothesis& hypothesis, Index direction) const {
  if (direction < hypothesis.shared()) return nullptr;
  const Unknown& u = hypothesis.unknowns()[static_cast<std::size_t>(direction)];
  const auto line = lines_.find({u.effect, u.name});
  return line == lines_.end() ? nullptr : &line->second;
}

/// Points around another, as the steps to them along the directions.
std::vector<VectorXd> Fitter::around(const Hypothesis& hypothesis, const VectorXd& at, const Directions& directions,
                                     const std::vector<BasisCoefficients>& known,
                                     std::vector<Candidate>& candidates) const {
  std::vector<VectorXd> shifts;
  const Index k = std::min(directions.reach.size(), hypothesis.shared());
  for (int i = 0; k > 0 && i < kAround; ++i) {
    VectorXd shift = VectorXd::Zero(k);
    for (Index d = 0; d < k; ++d) {
      if (static_cast<std::size_t>(d) < known.size() && known[static_cast<std::size_t>(d)].size() == 0) continue;
      // columns of a Hadamard matrix but its first: every direction goes as often up as down, and of any seven that follow one
      // another no two together
      const int sign = __builtin_popcount(static_cast<unsigned>((d % (kAround - 1) + 1) & i)) % 2 ? -1 : 1;
      shift[d] = kAroundReach * sign * directions.reach[d];
    }
    const VectorXd there = hypothesis.bounded(at + directions.axes.leftCols(k) * shift);
    shifts.push_back(directions.axes.leftCols(k).transpose() * (there - at));
    candidates.push_back(hypothesis.candidate(there));
  }
  return shifts;
}

/// The residual at a point is as rough as the columns were: its mean over points around, each brought back by the columns,
/// is less so. Where a column is missing, nothing would bring it back.
void Fitter::average(const std::vector<Residuals>& rows, const std::vector<VectorXd>& shifts, Linearised& l) const {
  for (Index d = 0; !shifts.empty() && d < shifts[0].size(); ++d)
    if (shifts[0][d] != 0 && l.columns[static_cast<std::size_t>(d)].size() == 0) return;
  std::vector<SufficientStatistics> around(rows.size());
  io::parallel_for(rows.size(), threads_, [&](std::size_t i) {
    if (rows[i].empty()) return;
    around[i] = evidence_.statistics(rows[i]);
    BasisCoefficients back = BasisCoefficients::Zero(kGroups, evidence_.basis().size());
    for (Index d = 0; d < shifts[i].size(); ++d)
      if (shifts[i][d] != 0) back += shifts[i][d] * l.columns[static_cast<std::size_t>(d)];
    evidence_.add(1, back, around[i]);
  });
  double n = 1;
  for (const SufficientStatistics& there : around) {
    if (there.sums.empty()) continue;
    for (std::size_t f = 0; f < there.sums.size(); ++f)
      for (std::size_t g = 0; g < there.sums[f].size(); ++g) l.statistics.sums[f][g] += there.sums[f][g];
    n += 1;
  }
  for (auto& flight : l.statistics.sums)
    for (VectorXd& sum : flight) sum /= n;
}

void Fitter::set_background(const Columns& same, const std::vector<Background>& of_entries, const Fit& beside) {
  background_.clear();
  means_.clear();
  entry_.clear();
  tails_.clear();
  places_.clear();
  Columns all = own_columns_of(beside.point);
  const std::size_t first = all.columns.size(), scaled = first + same.columns.size();
  for (std::size_t k = 0; k < same.columns.size(); ++k) all.add(*same.columns[k], same.prior_mean[k]);
  for (const Background& b : of_entries) {
    int entry = entry_of(b.entry);
    if (entry < 0) {  // scales that were found stay with their entries
      entry = static_cast<int>(entries_.size());
      entries_.push_back(b.entry);
    }
    all.add(b.column, 0, entry, evidence_.discrepancy().tail_of(b.entry));
  }
  const Reduced reduced = reduce(beside.point, all);
  for (std::size_t i = first; i < all.columns.size(); ++i) {
    const auto diagonal = static_cast<Index>(i);
    if (!(reduced.sums(diagonal, diagonal) > kTelling)) continue;
    background_.push_back(*all.columns[i]);
    means_.push_back(all.prior_mean[i]);
    entry_.push_back(all.entry[i]);
    tails_.push_back(all.tail[i]);
    if (i < scaled) places_.push_back(i - first);
  }
  take_scales();
}

int Fitter::entry_of(const std::string& effect) const {
  const auto at = std::ranges::find(entries_, effect);
  return at == entries_.end() ? -1 : static_cast<int>(at - entries_.begin());
}

std::vector<Fitter::Beside> Fitter::beside(const Linearised& point) const {
  const Columns c = columns_of(point);
  const Posterior p = Evidence::posterior(reduce(point, c), c.chosen, c.mean());
  std::vector<Beside> list;
  for (std::size_t k = 0; k < places_.size(); ++k) {
    const Index i = static_cast<Index>(c.columns.size() - scaled_.size() + k);
    list.push_back({places_[k], p.mean[i], std::sqrt(p.covariance(i, i))});
  }
  return list;
}

void Fitter::take_scales() {
  const Scales& s = evidence_.scales();
  scaled_ = background_;
  for (std::size_t k = places_.size(); k < scaled_.size(); ++k) {
    const auto entry = static_cast<std::size_t>(entry_[k]);
    scaled_[k] *= entry < s.entries.size() ? s.entries[entry] : s.usual(tails_[k]);
  }
}

Columns Fitter::own_columns_of(const Linearised& point) {
  Columns c;
  for (std::size_t d = 0; d < point.columns.size(); ++d)
    if (point.columns[d].size() > 0)
      c.add(point.columns[d], -point.directions.axes.col(static_cast<Index>(d)).dot(point.at));
  return c;
}

void Fitter::add_background(const std::vector<BasisCoefficients>& list, Columns& to) const {
  for (std::size_t k = 0; k < list.size(); ++k) to.add(list[k], means_[k], entry_[k], tails_[k]);
}

Columns Fitter::columns_of(const Linearised& point) const {
  Columns c = own_columns_of(point);
  add_background(scaled_, c);
  return c;
}

Columns Fitter::unscaled_columns_of(const Linearised& point) const {
  Columns c = own_columns_of(point);
  add_background(background_, c);
  return c;
}

/// What all sizes of each effect change that flies. How a sensor errs is known but for its size.
std::map<std::string, BasisCoefficients> Fitter::changes(const Hypothesis& hypothesis, const Linearised& point) const {
  std::map<std::string, BasisCoefficients> whole;
  for (Index i = hypothesis.shared(); i < hypothesis.size(); ++i) {
    const Unknown& u = hypothesis.unknowns()[static_cast<std::size_t>(i)];
    const BasisCoefficients& column = point.columns[static_cast<std::size_t>(i)];
    if (!u.size || u.log || column.size() == 0) continue;
    BasisCoefficients& own = whole[u.effect];
    if (own.size() == 0) own = BasisCoefficients::Zero(column.rows(), column.cols());
    own += point.at[i] * column;
  }
  return whole;
}

BasisCoefficients Fitter::shape_error(const Hypothesis& hypothesis, const Linearised& point, double shape) const {
  BasisCoefficients squares = BasisCoefficients::Zero(kGroups, evidence_.basis().size());
  for (const auto& [effect, own] : changes(hypothesis, point)) squares += shape_of(own, shape).cwiseAbs2();
  return squares.cwiseSqrt();
}

bool Fitter::has_shape(const Hypothesis& hypothesis, const Linearised& point) const {
  return std::ranges::any_of(changes(hypothesis, point),
                             [&](const auto& own) { return shape_of(own.second, 1).any(); });
}

/// Laws of what acts by the place (near surfaces, at a line, in time) differ in more than size: along the functions of the place that this change
/// follows, every load of the body may have as much of it as they have on average, times the shape. Of what it follows by little (as gusts do of
/// time) no load has more than that, for a shape may be many times the entry's, and a heating motor would else explain what turns with the heading.
BasisCoefficients Fitter::shape_of(const BasisCoefficients& change, double shape) const {
  const RegimeBasis& basis = evidence_.basis();
  BasisCoefficients sd = BasisCoefficients::Zero(change.rows(), change.cols());
  if (evidence_.discrepancy().spread.beside_all) return sd;
  const auto of_place = [&](int i) { return regimes_of(basis.kind(i)) == Regimes::place; };
  const auto load = [](int g) { return g / kCoefficients <= kForceZ; };
  VectorXd squares = VectorXd::Zero(change.cols());
  double groups = 0, place = 0, all = 0, most = 0;
  for (int g = 0; g < kGroups; ++g) {
    const double signal = evidence_.signal(g);
    if (!load(g) || !(signal > 0)) continue;
    squares += (change.row(g).transpose() / signal).cwiseAbs2();
    ++groups;
  }
  for (int i = 1; i < basis.size(); ++i) {
    all += squares[i];
    if (of_place(i)) place += squares[i], most = std::max(most, squares[i]);
  }
  if (!(place > all / 2)) return sd;
  for (int g = 0; g < kGroups; ++g)
    for (int i = 1; i < basis.size(); ++i)
      if (load(g) && of_place(i))
        sd(g, i) = (squares[i] > kNatural * most ? shape : 1) * std::sqrt(squares[i] / groups) * evidence_.signal(g);
  return sd;
}

Posterior Fitter::posterior(const Hypothesis& hypothesis, const Linearised& point, const std::vector<char>& use) const {
  const Columns columns = columns_of(point);
  return solve(point, columns,
               evidence_.reduce(point.statistics, columns.columns, use, discrepancy_sd(hypothesis, point)));
}

BasisCoefficients Fitter::discrepancy_sd(const Hypothesis& hypothesis, const Linearised& point) const {
  return (evidence_.discrepancy_sd().cwiseAbs2() + shape_error(hypothesis, point).cwiseAbs2()).cwiseSqrt();
}

Fitter::Joint Fitter::joint(const Hypothesis& hypothesis, const Linearised& point, const std::vector<char>& use,
                            bool alone) const {
  const Columns all = columns_of(point);
  Columns columns;
  for (std::size_t i = 0; i < all.columns.size(); ++i)
    if (!alone || all.entry[i] < 0) columns.add(*all.columns[i], all.prior_mean[i]);
  const Posterior p =
      Evidence::posterior(evidence_.reduce(point.statistics, columns.columns, use, discrepancy_sd(hypothesis, point)),
                          columns.chosen, columns.mean(), false);
  VectorXd own = VectorXd::Zero(static_cast<Index>(point.columns.size()));
  Index k = 0;
  for (std::size_t d = 0; d < point.columns.size(); ++d)
    if (point.columns[d].size() > 0) own[static_cast<Index>(d)] = p.mean[k++];
  Joint joint{hypothesis.bounded(point.at + point.directions.axes * own),
              BasisCoefficients::Zero(kGroups, evidence_.basis().size())};
  for (; k < p.mean.size(); ++k) joint.beside += p.mean[k] * *columns.columns[static_cast<std::size_t>(k)];
  return joint;
}

Reduced Fitter::reduce(const Linearised& point, const Columns& columns) const {
  return evidence_.reduce(point.statistics, columns.columns, all_flights(), evidence_.discrepancy_sd());
}

Posterior Fitter::solve(const Linearised& point, const Columns& columns, Reduced reduced, double damping) const {
  std::vector<Index> seen;
  for (std::size_t d = 0; d < point.columns.size(); ++d)
    if (point.columns[d].size() > 0) seen.push_back(static_cast<Index>(d));
  const auto own = static_cast<Index>(seen.size()), k = static_cast<Index>(point.columns.size());
  reduced.sums.diagonal().head(own).array() += damping;
  const Posterior p = Evidence::posterior(reduced, columns.chosen, columns.mean(), damping == 0);
  Posterior all{p.log_evidence, VectorXd::Zero(k), MatrixXd::Identity(k, k)};
  all.mean(seen) = p.mean.head(own);
  if (damping == 0) all.covariance(seen, seen) = p.covariance.topLeftCorner(own, own);
  return all;
}

VectorXd Fit::mean() const { return point.at + point.directions.axes * posterior.mean; }
MatrixXd Fit::covariance() const {
  return point.directions.axes * posterior.covariance * point.directions.axes.transpose();
}

double Fitter::cost(const Columns& background, const MatrixXd& sums, const SufficientStatistics& residual,
                    const VectorXd& at) const {
  const Reduced reduced =
      evidence_.reduce(residual, background.columns, all_flights(), evidence_.discrepancy_sd(), &sums);
  return 0.5 * at.squaredNorm() -
         Evidence::posterior(reduced, background.chosen, background.mean(), false).log_evidence;
}

/// Those of the parameters' fit, and the effects' own.
Directions Fitter::joint_directions(const Hypothesis& hypothesis, const Fit& parameters) {
  Directions d = axes(hypothesis);
  const Index shared = hypothesis.shared();
  d.axes.topLeftCorner(shared, shared) = parameters.point.directions.axes.topLeftCorner(shared, shared);
  d.reach.head(shared) = parameters.point.directions.reach.head(shared);
  return d;
}

std::vector<BasisCoefficients> Fitter::known(const Hypothesis& hypothesis, const Fit& parameters) {
  const auto& columns = parameters.point.columns;
  return {columns.begin(), columns.begin() + static_cast<std::ptrdiff_t>(hypothesis.shared())};
}

/// The axes of what is known: parameters turned among themselves, effects as they are.
Directions Fitter::principal(const Hypothesis& hypothesis, const Fit& fit) {
  const Index shared = hypothesis.shared(), size = hypothesis.size();
  const MatrixXd covariance = fit.covariance();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(covariance.topLeftCorner(shared, shared));
  Directions d = axes(hypothesis);
  d.axes.topLeftCorner(shared, shared) = eigen.eigenvectors();
  for (Index i = 0; i < size; ++i) {
    const double variance = i < shared ? eigen.eigenvalues()[i] : covariance(i, i);
    d.reach[i] = std::clamp(kReachSd * std::sqrt(variance), kLeastReach, kMostReach);
  }
  return d;
}

Fit Fitter::fit(const Hypothesis& hypothesis, VectorXd start, int iterations) const {
  Fit result;
  result.point = linearise(hypothesis, hypothesis.bounded(std::move(start)), axes(hypothesis));
  return improve(hypothesis, std::move(result), iterations, nullptr, true);
}

Fit Fitter::fit(const Hypothesis& hypothesis, const VectorXd& start, const Fit& parameters, int iterations) const {
  Fit result;
  result.point = linearise(hypothesis, hypothesis.bounded(start), joint_directions(hypothesis, parameters),
                           known(hypothesis, parameters));
  return improve(hypothesis, std::move(result), iterations, &parameters, true);
}

Fit Fitter::fit_beside(const Hypothesis& hypothesis, const VectorXd& start, const Fit& parameters) const {
  Fit result;
  VectorXd at = hypothesis.bounded(start);
  const Index own = hypothesis.size() - hypothesis.shared();
  at.head(hypothesis.shared()) = parameters.point.at.head(hypothesis.shared());
  for (int n = 0;; ++n) {
    result.point = linearise(hypothesis, at, joint_directions(hypothesis, parameters), known(hypothesis, parameters));
    if (result.point.residual.empty()) return result;
    const Columns columns = columns_of(result.point);
    result.posterior = solve(result.point, columns, reduce(result.point, columns));
    const VectorXd there = hypothesis.bounded(result.mean());
    if (n == kMostOwn || (there - at).tail(own).cwiseAbs().maxCoeff() < kFirstReach) return result;
    at.tail(own) = there.tail(own);
  }
}

Fit Fitter::linear(const Hypothesis& hypothesis, const Fit& parameters,
                   const std::vector<BasisCoefficients>& own) const {
  Fit result;
  Linearised& l = result.point;
  l = parameters.point;
  l.residual.clear();
  l.at = hypothesis.start();
  l.at.head(hypothesis.shared()) = parameters.point.at;
  l.directions = joint_directions(hypothesis, parameters);
  l.columns.insert(l.columns.end(), own.begin(), own.end());
  const Columns columns = columns_of(l);
  result.posterior = solve(l, columns, reduce(l, columns));
  return result;
}

Fit Fitter::refit(const Hypothesis& hypothesis, const Fit& before, int iterations) const {
  Fit result = before;
  result.point.statistics = evidence_.statistics(before.point.residual);
  return improve(hypothesis, std::move(result), iterations, nullptr, false);
}

Fit Fitter::alone(const Hypothesis& hypothesis, const Fit& before) const {
  Fitter bare = *this;
  // those of no entry come first
  bare.background_.resize(places_.size());
  bare.scaled_.resize(places_.size());
  bare.means_.resize(places_.size());
  bare.entry_.resize(places_.size());
  bare.tails_.resize(places_.size());
  return bare.improve(hypothesis, before, kMostAlone, &before, true);
}

/// Steps by columns of a point that was passed, as long as they do not lead far from it; those of the last one are its own.
Fit Fitter::improve(const Hypothesis& hypothesis, Fit fit, int iterations, const Fit* parameters, bool own) const {
  if (fit.point.residual.empty()) return fit;  // comes apart
  VectorXd linearised_at = fit.point.at;
  std::vector<Index> of_log;
  for (Index i = hypothesis.shared(); i < hypothesis.size(); ++i)
    if (hypothesis.unknowns()[static_cast<std::size_t>(i)].log) of_log.push_back(i);
  const auto linearise_here = [&](const VectorXd& at) {
    Linearised next = parameters == nullptr
                          ? linearise(hypothesis, at, principal(hypothesis, fit))
                          : linearise(hypothesis, at, fit.point.directions, known(hypothesis, *parameters));
    if (next.residual.empty()) return false;
    fit.point = std::move(next);
    linearised_at = at;
    own = true;
    return true;
  };
  for (int n = 1;; ++n) {
    const Linearised& l = fit.point;
    const Columns columns = columns_of(l);
    const Reduced reduced = reduce(l, columns);
    fit.posterior = solve(l, columns, reduced);
    const VectorXd step = l.directions.axes * fit.posterior.mean;
    bool improved = n < iterations && step.cwiseAbs().maxCoeff() >= kConverged;
    if (improved) {
      // shares of the step, and steps that go less far where little is known; all tried at once
      constexpr double kShares[] = {1.4, 1, 0.7, 0.5, 0.35, 0.25, 0.1, 0.03},
                       kDampings[] = {0.3, 1, 3, 10, 30, 100, 300, 1000};
      std::vector<VectorXd> tries;
      for (const double share : kShares) tries.push_back(hypothesis.bounded(l.at + share * step));
      for (const double damping : kDampings)
        tries.push_back(hypothesis.bounded(l.at + l.directions.axes * solve(l, columns, reduced, damping).mean));
      // flown with the log as it is here, so that all share one; what else they would have the log say is a line
      std::vector<Candidate> candidates;
      for (VectorXd at : tries) {
        at(of_log) = l.at(of_log);
        candidates.push_back(hypothesis.candidate(at));
      }
      std::vector<Residuals> left = residuals(flights_, candidates, threads_);
      left.push_back(l.residual);
      tries.push_back(l.at);
      std::vector<SufficientStatistics> statistics(left.size());
      std::vector<double> costs(left.size(), std::numeric_limits<double>::infinity());
      Columns background;
      add_background(scaled_, background);
      const Index others = static_cast<Index>(background.columns.size()),
                  first = static_cast<Index>(columns.columns.size()) - others;
      const MatrixXd sums = reduced.sums.block(first, first, others, others);
      const auto weigh = [&](std::size_t i, const std::vector<Index>& lines) {
        if (left[i].empty()) return;
        statistics[i] = evidence_.statistics(left[i]);
        for (const Index line : lines)
          if (const BasisCoefficients& column = l.columns[static_cast<std::size_t>(line)]; column.size() > 0)
            evidence_.add(l.at[line] - tries[i][line], column, statistics[i]);
        costs[i] = cost(background, sums, statistics[i], tries[i]);
      };
      io::parallel_for(left.size(), threads_, [&](std::size_t i) { weigh(i, of_log); });
      const auto best = static_cast<std::size_t>(std::ranges::min_element(costs) - costs.begin());
      if (!of_log.empty() && best + 1 < left.size()) {
        left[best] = std::move(residuals(flights_, {hypothesis.candidate(tries[best])}, threads_)[0]);
        costs[best] = std::numeric_limits<double>::infinity();
        weigh(best, {});
      }
      improved =
          costs.back() - costs[best] >= (flights_.front().within_the_beat() ? kWorthwhile : kWorthwhileByTheBeat);
      if (improved) {
        const VectorXd away = l.directions.axes.transpose() * (tries[best] - linearised_at);
        if (away.cwiseAbs().cwiseQuotient(l.directions.reach).maxCoeff() > kFar) {
          if (!linearise_here(tries[best])) return fit;
        } else {
          fit.point.at = tries[best];
          fit.point.residual = std::move(left[best]);
          fit.point.statistics = std::move(statistics[best]);
          own = false;
        }
      }
    }
    if (improved) continue;
    if (own || !linearise_here(fit.point.at)) return fit;
    iterations = n + 1;  // what the new columns say
  }
}

}  // namespace flappy::gap
