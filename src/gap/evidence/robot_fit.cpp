#include "gap/evidence/robot_fit.hpp"

#include <cmath>

#include "io/parallel.hpp"

namespace flappy::gap {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int kMostRounds = 5;
/// Noise and what it lets the catalogue explain, by turns.
constexpr int kRemainderRounds = 3;
/// Nats that another round has to bring; and that a round may lose, as lines are no curves.
constexpr double kWorthwhile = 2;

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
  take_scales(plain_, parameters_.point);
  parameters_ = fitter_.refit(plain_, parameters_, 4);
  take_scales(plain_, parameters_.point);
  for (int round = 0; round < kMostRounds && fly_minors(); ++round) continue;
}

/// From now on what the flights say of the minor figures is flown, and parameters are fitted beside it. False where that brought next to
/// nothing, or so much less than nothing that it is taken back.
bool RobotFit::fly_minors() {
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
  parameters_ = fitter_.fit(plain_, parameters_.mean(), parameters_, 6);
  take_scales(plain_, parameters_.point);
  const double gain = log_evidence() - before;
  if (gain < -kWorthwhile) {
    take(minors, parameters);
    take_scales(plain_, parameters_.point);
  }
  return gain > kWorthwhile;
}

Columns RobotFit::lines() const {
  Columns c;
  for (const BasisCoefficients& n : nuisances_) c.add(n, 0);
  for (std::size_t k = 0; k < minors_.size(); ++k) c.add(minors_[k], -uncertain_.minors()[k]);
  return c;
}

void RobotFit::set_background() {
  std::vector<BasisCoefficients> background;
  for (const auto* list : {&sizes_, &shapes_})
    for (const SizeColumn& c : *list) background.push_back(evidence_.discrepancy().background_sd(c.effect) * c.change);
  fitter_.set_background(lines(), background, parameters_);
}

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
    evidence_.learn_remainder(evidence_.without(parameters_.point.residual, all));
  }
  parameters_.point.statistics = evidence_.statistics(parameters_.point.residual);
  nominal_.statistics = evidence_.statistics(nominal_.residual);
  fitter_.take_scale();
}

void RobotFit::take_scales(const Hypothesis& hypothesis, const Linearised& at) {
  evidence_.set_scales(weigh(hypothesis, at).scales);
  fitter_.take_scale();
}

Weighed RobotFit::weigh(const Hypothesis& hypothesis, const Linearised& at, const Scales& start,
                        std::optional<double> freeing_nats) const {
  const Columns c = fitter_.unscaled_columns_of(at);
  return evidence_.weigh(at.statistics, c.columns, c.mean(), c.with_robot, fitter_.all_flights(),
                         fitter_.form_error(hypothesis, at), start, freeing_nats);
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
  std::vector<SizeStep> steps = size_steps(uncertain_, parameters_.point.at, withheld_);
  std::vector<Candidate> candidates;
  for (SizeStep& s : steps) {
    candidates.push_back(std::move(s.candidate));
    for (Candidate& c : s.shaped) candidates.push_back(std::move(c));
    for (Candidate& c : s.further) candidates.push_back(std::move(c));
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
    if (along[0].size() == 0) continue;
    sizes_.push_back({s, along[0] / kSizeReach, {}});
    for (std::size_t k = shapes; k < shapes + s.shaped.size(); ++k)
      if (changes[k].size() > 0) shapes_.push_back({s, (changes[k] - along[0]) / kSizeReach, {}});
    for (std::size_t n = 1; n + 1 < along.size() && along[n].size() > 0 && along[n + 1].size() > 0; ++n) {
      const double at = kSizeReach * static_cast<double>(n + 1);
      sizes_.back().large.push_back({at, along[n] / at, (along[n + 1] - along[n - 1]) / (2 * kSizeReach)});
    }
  }
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
