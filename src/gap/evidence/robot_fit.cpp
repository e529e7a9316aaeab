#include "gap/evidence/robot_fit.hpp"

#include <cmath>
#include <numbers>
#include <string_view>

#include "io/parallel.hpp"
#include "model/effects/registry.hpp"

namespace flappy::gap {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int kMostRounds = 5, kRefitIterations = 6;
/// So many times what is usual of an entry.
constexpr double kWide = 5;
/// Noise and what it lets the catalogue explain, by turns.
constexpr int kRemainderRounds = 3;
/// Nats that another round has to bring; and that a round may lose, as lines are no curves.
constexpr double kWorthwhileNats = 2;

/// How far another law than the entry's may go: sd of the log of its factor, and the largest.
constexpr double kShapeSd = 1, kMostShape = 32;

constexpr const char* kDelay = "delay_s";

/// Whether an entry has a size for each wing, and no other.
bool of_sides(const model::EffectEntry& entry) {
  return entry.info.sizes == 2 && std::string_view(entry.parameters[0].name).starts_with("left_") &&
         std::string_view(entry.parameters[1].name).starts_with("right_");
}

}  // namespace

RobotFit::RobotFit(const std::vector<PredictedFlight>& flights, const sim::Randomisation& uncertain,
                   const ModelDiscrepancy& discrepancy, std::vector<std::string> withheld, int threads)
    : flights_(flights),
      uncertain_(uncertain),
      withheld_(std::move(withheld)),
      threads_(io::thread_count(threads)),
      evidence_(flights, discrepancy, threads_),
      fitter_(flights, evidence_, threads_),
      plain_(uncertain_, {}) {}

void RobotFit::fit_parameters() {
  const Directions none{MatrixXd(plain_.size(), 0), VectorXd(0)};
  nominal_ = fitter_.linearise(plain_, plain_.start(), none);
  evidence_.learn_weights(nominal_.residual);
  parameters_ = fitter_.fit(plain_, plain_.start(), 4);
  evidence_.learn_noise(parameters_.point.residual);
  parameters_.point.statistics = evidence_.statistics(parameters_.point.residual);
  take_scales(plain_, parameters_.point);
  parameters_ = fitter_.refit(plain_, parameters_, 6);
  nominal_.statistics = evidence_.statistics(nominal_.residual);
}

void RobotFit::refit_beside_background() {
  find_sizes();
  find_lines();
  set_background();
  if (evidence_.discrepancy().spread.beside_all) learn_remainder();
  widen_entries();
  parameters_ = fitter_.refit(plain_, parameters_, kRefitIterations);
  take_scales(plain_, parameters_.point);
  for (int round = 0; round < kMostRounds && refit_with_minors(); ++round) continue;
}

/// Parameters that were fitted where a robot may have little of an entry make up for what it has much of, and then nothing tells it: so the
/// first fit is one where it may have much of each.
void RobotFit::widen_entries() {
  if (evidence_.discrepancy().spread.beside_all) return;
  Scales wide = weigh(plain_, parameters_.point).scales;
  for (std::size_t e = 0; e < wide.entries.size(); ++e)
    wide.entries[e] = kWide * wide.usual(evidence_.discrepancy().tail_of(fitter_.entries()[e]));
  set_scales(wide);
}

double RobotFit::beyond_background(const std::string& effect, const VectorXd& sizes) const {
  const Tail tail = evidence_.discrepancy().tail_of(effect);
  const double nu = tail.freedom, f = evidence_.scales().usual(tail);
  const auto improbable = [&](const std::string& entry, const VectorXd& own) {
    const double sd = evidence_.discrepancy().background_sd(entry), n = static_cast<double>(own.size());
    const double times = std::sqrt((own.squaredNorm() / (sd * sd) + nu * f * f) / (n + nu));
    return 0.5 * own.squaredNorm() / std::pow(times * sd, 2) + n * std::log(times * sd) +
           evidence_.price_of(times, tail);
  };
  const double usual = -0.5 * sizes.squaredNorm();
  if (!of_sides(*model::find_effect(uncertain_.nominal(), effect))) return usual + improbable(effect, sizes);
  const double half = std::numbers::sqrt2 / 2;
  return usual + improbable(effect, VectorXd::Constant(1, half * (sizes[0] - sizes[1]))) +
         improbable(effect + kOfBoth, VectorXd::Constant(1, half * (sizes[0] + sizes[1])));
}

/// From now on what the flights say of the minor figures is flown, and parameters are fitted beside it. False where that brought next to
/// nothing, or so much less than nothing that it is taken back.
bool RobotFit::refit_with_minors() {
  const auto log_evidence = [&] { return weigh(plain_, parameters_.point).posterior.log_evidence; };
  const std::vector<double> minors = uncertain_.minors();
  const Fit parameters = parameters_;
  const double before = log_evidence();
  std::vector<double> there = minors;
  for (const Fitter::Beside& b : fitter_.beside(parameters_.point))
    if (b.place >= nuisances_.size()) there[b.place - nuisances_.size()] += b.mean;
  const auto take = [&](const std::vector<double>& variates, Fit fit) {
    uncertain_.set_minors(variates);
    set_background();
    parameters_ = std::move(fit);
  };
  take(there, parameters_);
  // with columns of its own: beside those of another point a fit may stay where it is, a hundred nats below what is near
  parameters_ = fitter_.fit(plain_, parameters_.mean(), kRefitIterations);
  take_scales(plain_, parameters_.point);
  const double gain = log_evidence() - before;
  if (gain < -kWorthwhileNats) {
    take(minors, parameters);
    take_scales(plain_, parameters_.point);
  }
  return gain > kWorthwhileNats;
}

Columns RobotFit::lines() const {
  Columns c;
  for (const BasisCoefficients& n : nuisances_) c.add(n, 0);
  for (std::size_t k = 0; k < minors_.size(); ++k) c.add(minors_[k], -uncertain_.minors()[k]);
  return c;
}

std::vector<Background> RobotFit::background(bool shapes) const {
  std::vector<Background> list;
  for (std::size_t i = 0; i < sizes_.size(); ++i) {
    const std::string& effect = sizes_[i].effect;
    const double sd = evidence_.discrepancy().background_sd(effect);
    if (!of_sides(*model::find_effect(uncertain_.nominal(), effect))) {
      const auto n = static_cast<double>(sizes_[i].near.size());
      for (const BasisCoefficients& near : sizes_[i].near) list.push_back({effect, sd / std::sqrt(n) * near});
      continue;
    }
    if (i + 1 == sizes_.size() || sizes_[i + 1].effect != effect) continue;
    const std::string both = effect + kOfBoth;
    const BasisCoefficients &left = sizes_[i].near[0], &right = sizes_[i + 1].near[0];
    list.push_back({effect, sd * std::numbers::sqrt2 / 2 * (left - right)});
    list.push_back({both, evidence_.discrepancy().background_sd(both) * std::numbers::sqrt2 / 2 * (left + right)});
    ++i;
  }
  for (std::size_t i = 0; shapes && i < shapes_.size(); ++i)
    list.push_back({shapes_[i].effect, evidence_.discrepancy().background_sd(shapes_[i].effect) * shapes_[i].change});
  return list;
}

void RobotFit::set_background() { fitter_.set_background(lines(), background(true), parameters_); }

/// What is left beside every size of the catalogue together is noise to every hypothesis.
void RobotFit::learn_remainder() {
  for (int round = 0; round < kRemainderRounds; ++round) {
    Columns c = Fitter::own_columns_of(parameters_.point);
    for (const SizeColumn& s : sizes_) c.add(s.change, 0);
    const Posterior p =
        Evidence::posterior(evidence_.reduce(evidence_.statistics(parameters_.point.residual), c.columns,
                                             fitter_.all_flights(), evidence_.discrepancy_sd()),
                            c.chosen, c.mean());
    BasisCoefficients all = BasisCoefficients::Zero(kGroups, evidence_.basis().size());
    for (std::size_t k = 0; k < c.columns.size(); ++k) all += p.mean[static_cast<Eigen::Index>(k)] * *c.columns[k];
    Residuals left = parameters_.point.residual;
    for (std::size_t f = 0; f < left.size(); ++f) left[f] = evidence_.without(f, std::move(left[f]), all);
    evidence_.learn_remainder(left);
  }
  parameters_.point.statistics = evidence_.statistics(parameters_.point.residual);
  nominal_.statistics = evidence_.statistics(nominal_.residual);
  fitter_.take_scales();
}

void RobotFit::set_scales(const Scales& scales) {
  evidence_.set_scales(scales);
  fitter_.take_scales();
}

void RobotFit::take_scales(const Hypothesis& hypothesis, const Linearised& at) {
  Weighed best = weigh(hypothesis, at);
  // expectation-maximisation leaves to the blocks what they took first: one entry after another may have it instead
  for (bool better = true; better;) {
    set_scales(best.scales);
    better = false;
    if (evidence_.discrepancy().spread.beside_all) break;
    if (const auto larger = larger_entry(hypothesis, at)) {
      Weighed other = weigh(hypothesis, at, *larger);
      better = other.posterior.log_evidence > best.posterior.log_evidence + kWorthwhileNats;
      if (better) best = std::move(other);
    }
  }
}

/// The scales at hand, but for that entry which gains most where this robot has more of it; none where none gains. Given all else, what the
/// flights say of its coefficients is normal with precision C^-1 - 1 and sum C^-1 m, m and C being their posterior.
std::optional<Scales> RobotFit::larger_entry(const Hypothesis& hypothesis, const Linearised& at) const {
  const Scales& now = evidence_.scales();
  const Columns c = fitter_.columns_of(at);
  const BasisCoefficients own = fitter_.shape_error(hypothesis, at);
  const Posterior p =
      Evidence::posterior(evidence_.reduce(at.statistics, c.columns, fitter_.all_flights(),
                                           (evidence_.discrepancy_sd().cwiseAbs2() + own.cwiseAbs2()).cwiseSqrt()),
                          c.chosen, c.mean());
  std::optional<Scales> best;
  double most = kWorthwhileNats;
  for (std::size_t e = 0; e < now.entries.size(); ++e) {
    std::vector<Eigen::Index> columns;
    for (std::size_t k = 0; k < c.entry.size(); ++k)
      if (c.entry[k] == static_cast<int>(e)) columns.push_back(static_cast<Eigen::Index>(k));
    if (columns.empty()) continue;
    const auto n = static_cast<Eigen::Index>(columns.size());
    const MatrixXd inverse = MatrixXd(p.covariance(columns, columns)).inverse();
    const VectorXd sum = inverse * VectorXd(p.mean(columns));
    const MatrixXd precision = inverse - MatrixXd::Identity(n, n);
    const auto log_evidence = [&](double factor) {
      const Eigen::LLT<MatrixXd> llt(factor * factor * precision + MatrixXd::Identity(n, n));
      return 0.5 * factor * factor * sum.dot(llt.solve(sum)) - llt.matrixLLT().diagonal().array().log().sum() -
             evidence_.price_of(factor * now.entries[e], c.tail[static_cast<std::size_t>(columns[0])]);
    };
    const double before = log_evidence(1);
    for (const double factor : {2.0, 4.0, 8.0, 16.0, 32.0, 64.0}) {
      const double gain = log_evidence(factor) - before;
      if (!(gain > most)) continue;
      most = gain;
      best = now;
      best->entries[e] *= factor;
    }
  }
  return best;
}

Weighed RobotFit::weigh(const Hypothesis& hypothesis, const Linearised& at, const Scales& start,
                        std::optional<double> freeing_nats) const {
  const Columns columns = fitter_.unscaled_columns_of(at);
  const auto with = [&](double shape, const Scales& from) {
    Weighed w = evidence_.weigh(at.statistics, columns, fitter_.all_flights(),
                                fitter_.shape_error(hypothesis, at, shape), from, freeing_nats);
    w.shape = shape;
    w.posterior.log_evidence -= 0.5 * std::pow(std::log(shape) / kShapeSd, 2);
    return w;
  };
  Weighed best = with(1, start);
  // what the effect explains now need not be this robot's own any longer
  Scales usual = start;
  bool differs = false;
  for (const std::string& effect : hypothesis.effects())
    for (const std::string& entry : {effect, effect + kOfBoth})
      if (const auto e = static_cast<std::size_t>(fitter_.entry_of(entry)); e < usual.entries.size()) {
        usual.entries[e] = usual.usual(evidence_.discrepancy().tail_of(entry));
        differs = true;
      }
  if (differs)
    if (Weighed w = with(1, usual); w.posterior.log_evidence > best.posterior.log_evidence) best = std::move(w);
  if (!fitter_.has_shape(hypothesis, at)) return best;
  for (const double step : {2.0, 0.5})
    for (double shape = step; shape <= kMostShape && shape >= 1 / kMostShape; shape *= step) {
      Weighed other = with(shape, best.scales);
      if (other.posterior.log_evidence < best.posterior.log_evidence) break;
      best = std::move(other);
    }
  return best;
}

std::vector<SensorFinding> RobotFit::sensors(const Hypothesis& hypothesis, const Fit& fit) const {
  const Eigen::Index lag = hypothesis.lag();
  const Unknown& late = hypothesis.unknowns()[static_cast<std::size_t>(lag)];
  std::vector<SensorFinding> list = {
      {late.name, late.value(fit.mean()[lag]), late.scale * std::sqrt(fit.covariance()(lag, lag)), late.scale}};
  for (const Fitter::Beside& b : fitter_.beside(fit.point)) {
    if (b.place >= nuisances_.size()) break;  // figures of the vehicle
    const ModelDiscrepancy::Nuisance& n = evidence_.discrepancy().nuisances[b.place];
    list.push_back({n.id + "." + n.value, b.mean * n.sd, b.sd * n.sd, n.sd});
  }
  return list;
}

/// Of a residual `steps` steps away from that of the parameters, for one step.
BasisCoefficients RobotFit::change(Residuals there, double steps) const {
  for (std::size_t f = 0; f < there.size(); ++f)
    for (std::size_t k = 0; k < there[f].size(); ++k)
      there[f][k] = (parameters_.point.residual[f][k] - there[f][k]) / steps;
  return evidence_.basis_coefficients(there);
}

void RobotFit::find_sizes() {
  std::vector<SizeStep> steps = size_steps(uncertain_, parameters_.point.at, withheld_, &evidence_.discrepancy());
  std::vector<Candidate> candidates;
  for (SizeStep& s : steps) {
    candidates.push_back(std::move(s.candidate));
    for (Candidate& c : s.shaped) candidates.push_back(std::move(c));
    for (Candidate& c : s.further) candidates.push_back(std::move(c));
    for (Candidate& c : s.near) candidates.push_back(std::move(c));
  }
  std::vector<Residuals> rows = residuals(flights_, candidates, threads_);
  std::vector<BasisCoefficients> changes(rows.size());  // of all that there is
  io::parallel_for(rows.size(), threads_, [&](std::size_t i) {
    if (!rows[i].empty()) changes[i] = change(std::move(rows[i]), 1);
  });
  sizes_.clear();
  shapes_.clear();
  std::size_t i = 0;
  for (const SizeStep& s : steps) {
    std::vector<BasisCoefficients> along = {changes[i++]};
    const std::size_t shapes = i;
    i += s.shaped.size();
    for (std::size_t n = 0; n < s.further.size(); ++n) along.push_back(changes[i++]);
    const std::size_t near = i;
    i += s.near.size();
    if (along[0].size() == 0) continue;
    sizes_.push_back({static_cast<const EffectSize&>(s), along[0] / kSizeReach, {}, {}});
    for (std::size_t n = 0; n < s.near.size(); ++n) {
      const BasisCoefficients& there = changes[near + n];
      sizes_.back().near.push_back(there.size() > 0 ? BasisCoefficients(there / (n == 0 ? s.reach : -s.reach))
                                                    : sizes_.back().change);
    }
    if (s.near.empty()) sizes_.back().near.push_back(sizes_.back().change);
    for (std::size_t k = shapes; k < shapes + s.shaped.size(); ++k)
      if (changes[k].size() > 0)
        shapes_.push_back({static_cast<const EffectSize&>(s), (changes[k] - along[0]) / kSizeReach, {}, {}});
    for (std::size_t n = 1; n + 1 < along.size() && along[n].size() > 0 && along[n + 1].size() > 0; ++n) {
      const double at = kSizeReach * static_cast<double>(n + 1);
      sizes_.back().large.push_back({at, along[n] / at, (along[n + 1] - along[n - 1]) / (2 * kSizeReach)});
    }
  }
  set_lines();
}

/// What a sensor adds is a line; how late it is turns what it says of a beat.
void RobotFit::set_lines() {
  std::map<std::pair<std::string, std::string>, BasisCoefficients> lines;
  for (const SizeColumn& s : sizes_) {
    const Hypothesis h(uncertain_, {s.effect});
    const Unknown& u = h.unknowns()[static_cast<std::size_t>(h.shared() + s.unknown)];
    if (u.log && u.name != kDelay) lines[{u.effect, u.name}] = s.change;
  }
  fitter_.set_lines(std::move(lines));
}

void RobotFit::find_lines() {
  const std::vector<ModelDiscrepancy::Nuisance>& all = evidence_.discrepancy().nuisances;
  std::vector<Candidate> candidates;
  std::vector<double> steps(all.size(), 1);
  for (const ModelDiscrepancy::Nuisance& n : all) {
    Candidate c = plain_.candidate(parameters_.point.at);
    for (const ModelDiscrepancy::Nuisance& other : all)
      if (other.id == n.id) c.sensors[n.id][other.value] = other.value == n.value ? n.sd : 0;
    candidates.push_back(std::move(c));
  }
  for (std::size_t d = uncertain_.majors(); d < uncertain_.draws(); ++d) {
    // on the side on which its body is possible
    Candidate c = plain_.candidate(parameters_.point.at, std::pair{d, 1.0});
    const bool other = model::physical_fault(c.vehicle).has_value();
    steps.push_back(other ? -1 : 1);
    candidates.push_back(other ? plain_.candidate(parameters_.point.at, std::pair{d, -1.0}) : std::move(c));
  }
  std::vector<Residuals> rows = residuals(flights_, candidates, threads_);
  std::vector<BasisCoefficients> changes(rows.size(), BasisCoefficients::Zero(kGroups, evidence_.basis().size()));
  io::parallel_for(rows.size(), threads_, [&](std::size_t i) {
    if (!rows[i].empty()) changes[i] = change(std::move(rows[i]), steps[i]);
  });
  nuisances_.assign(changes.begin(), changes.begin() + static_cast<std::ptrdiff_t>(all.size()));
  minors_.assign(changes.begin() + static_cast<std::ptrdiff_t>(all.size()), changes.end());
}

}  // namespace flappy::gap
