#include "gap/fit/robot_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string_view>

#include "gap/fit/own_sessions.hpp"
#include "io/parallel.hpp"
#include "model/effects/registry.hpp"

namespace flappy::gap {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// Iterations of the first fit of the parameters. Choice.
constexpr int kFirstIterations = 4;
/// Iterations of a fit after noise, scales or minor draws have changed. Choice.
constexpr int kRefitIterations = 6;
/// Largest number of rounds with minor draws. Choice.
constexpr int kMaxRefits = 5;
/// Scale of background magnitudes over their prior scale, in the first fit with them. Choice.
constexpr double kWideScale = 5;
/// Rounds of linear fits of the catalogue, each followed by learning the noise from what is left. Choice.
constexpr int kRestRounds = 3;
/// Another round and a larger background need this gain; a round is undone at this loss. Choice: smaller changes may be
/// errors of linear models.
constexpr double kMinGain_nats = 2;
/// Factors by which a background is tried larger. Choice.
constexpr double kWidenings[] = {2, 4, 8, 16, 32, 64};
/// Factor between law factors that are tried. Choice.
constexpr double kLawStep = 2;

/// Standard deviation by which the voltage of a battery differs from session to session, as a share of the nominal one.
/// Source: Microchip, MCP73831 data sheet: a charger holds it to 0.75 % at most; half of that.
constexpr double kCharged = 0.004;
/// Standard deviation by which the zero of a force sensor differs from run to run: its temperature drifts. Source: a step
/// of an ATI Nano17 (SI-12-0.12), 1/320 N and 1/64 Nmm; the moment with the force's at 1 cm.
constexpr double kZero_N = 3.1e-3, kZero_Nm = 35e-6;
constexpr const char* kDiverges =
    "the vehicle: its simulation of these flights diverges; accepted: a vehicle that flies what was flown";

/// Whether an effect has a magnitude for each wing, and no other.
bool of_sides(const model::CatalogueEffect& effect) {
  return effect.info.magnitudes == 2 && std::string_view(effect.parameters[0].name).starts_with("left_") &&
         std::string_view(effect.parameters[1].name).starts_with("right_");
}

/// Whether an error of a sensor is one of a bench's force sensor or film.
bool is_of_bench(const std::string& id) { return id.starts_with("forces_") || id.starts_with("wings_"); }

/// Without errors of a bench if there is none.
ModelDiscrepancy of_flights(ModelDiscrepancy discrepancy, const Flights& flights) {
  if (std::ranges::none_of(flights.all(), [](const auto& f) { return f->clamped(); }))
    std::erase_if(discrepancy.nuisances, [](const ModelDiscrepancy::Nuisance& n) { return is_of_bench(n.id); });
  return discrepancy;
}

/// Each background once for flights and once for a bench. The latter moves no vehicle, for a corrected one has to fly.
std::vector<Background> apart_on_bench(const std::vector<Background>& list, const ModelDiscrepancy& discrepancy) {
  std::vector<Background> apart;
  for (const Background& b : list) {
    const std::string name = b.effect + kOnBench;
    Background flown = b,
               clamped{name, discrepancy.background_sd(name) / discrepancy.background_sd(b.effect) * b.column, {}};
    flown.column.bottomRows(kGroups - kFlownGroups).setZero();
    clamped.column.topRows(kFlownGroups).setZero();
    for (Background* part : {&flown, &clamped})
      if (!part->column.isZero(0)) apart.push_back(std::move(*part));
  }
  return apart;
}

/// `withheld`; tether, unless each flight in which effects act has a ground: it would hang down to nowhere; and what
/// surrounds a robot in the air, if all runs are on a bench: a rig stays where it stands.
std::vector<std::string> without_idle(std::vector<std::string> withheld, const Flights& flights) {
  if (std::ranges::all_of(flights.all(), [](const auto& flight) { return flight->clamped(); }))
    withheld.insert(withheld.end(), {model::Wind::kInfo.id, model::GroundEffect::kInfo.id,
                                     model::CeilingEffect::kInfo.id, model::WallEffect::kInfo.id});
  if (!std::ranges::all_of(flights.tests, [](const auto& flight) { return flight->has_ground(); }))
    withheld.emplace_back(model::Tether::kInfo.id);
  return withheld;
}

}  // namespace

RobotFit::RobotFit(Extent extent, const FitRules& rules, const Flights& flights, const sim::Randomisation& uncertain,
                   const ModelDiscrepancy& discrepancy, std::vector<std::string> withheld, int threads)
    : flights_(flights),
      uncertain_(uncertain),
      withheld_(without_idle(std::move(withheld), flights)),
      threads_(io::thread_count(threads)),
      fitter_(rules, flights,
              std::make_shared<const Evidence>(rules, flights, of_flights(discrepancy, flights), threads_), threads_),
      no_effects_(uncertain_, {}) {
  if (extent == Extent::planned) {
    parameters_ = nominal_ = fitter_.linearise(no_effects_, no_effects_.start(), Fitter::axes(no_effects_));
    if (!parameters_.flown()) throw io::InputError(kDiverges);
    find_nuisance_columns();
    return;
  }
  fit_parameters();
  if (extent == Extent::all) refit_with_nuisances();
}

RobotFit::RobotFit(const FitRules& rules, const Flights& flights, const sim::Randomisation& uncertain,
                   const ModelDiscrepancy& discrepancy, std::vector<std::string> withheld, int threads)
    : RobotFit(Extent::all, rules, flights, uncertain, discrepancy, std::move(withheld), threads) {}

RobotFit RobotFit::of_references(const FitRules& rules, const Flights& flights, const sim::Randomisation& uncertain,
                                 const ModelDiscrepancy& discrepancy, std::vector<std::string> withheld, int threads) {
  return RobotFit(Extent::parameters, rules, flights, uncertain, discrepancy, std::move(withheld), threads);
}

RobotFit RobotFit::planned(const FitRules& rules, const Flights& flights, const sim::Randomisation& uncertain,
                           const ModelDiscrepancy& discrepancy, int threads) {
  return RobotFit(Extent::planned, rules, flights, uncertain, discrepancy, {}, threads);
}

RobotFit::RobotFit(const FitRules& rules, const RobotFit& reference, const Flights& flights)
    : flights_(flights),
      uncertain_(reference.uncertain_),
      withheld_(without_idle(reference.withheld_, flights)),
      threads_(reference.threads_),
      fitter_(rules, flights,
              std::make_shared<const Evidence>(rules, flights, reference.evidence().discrepancy(), threads_), threads_),
      no_effects_(uncertain_, {}) {
  linearise_around(reference.parameters_);
  find_nuisance_columns();
  ModelDiscrepancy discrepancy = evidence().discrepancy();
  discrepancy.session.own = own_sessions(fitter_, parameters_);
  take_evidence(evidence().with_discrepancy(std::move(discrepancy)));
  set_nuisances();
  Scales scales;
  scales.centre_tests(evidence().discrepancy().session);
  scales = find_scales(no_effects_, parameters_, scales);
  // what an effect explains is no difference between sessions
  scales.centre_tests(evidence().discrepancy().session);
  for (std::size_t e = 0; e < scales.effects.size(); ++e)
    if (fitter_.effects()[e].starts_with(kSessionOf))
      scales.effects[e] = scales.prior_scale(evidence().discrepancy().scale_prior(fitter_.effects()[e]));
  fitter_ = fitter_.with_scales(scales);
}

Fitter RobotFit::fitter_given(const ModelDiscrepancy& discrepancy) const {
  return fitter_.with_evidence(std::make_shared<const Evidence>(evidence().with_discrepancy(discrepancy)))
      .with_nuisances(nuisance_regressors(), rules().backgrounds(*this, discrepancy), parameters_);
}

/// Learns the noise; fits nothing.
void RobotFit::linearise_around(const Fit& parameters) {
  const Directions none{MatrixXd(no_effects_.size(), 0), VectorXd(0)};
  nominal_ = fitter_.linearise(no_effects_, no_effects_.start(), none);
  if (nominal_.residual.empty()) throw io::InputError(kDiverges);
  const Residuals residual = fitter_.linearise(no_effects_, parameters.at, none).residual;
  if (residual.empty()) throw io::InputError(kDiverges);
  take_evidence(evidence().with_weights(residual));
  take_evidence(evidence().with_noise(residual));
  nominal_.statistics = evidence().statistics(nominal_.residual);
  parameters_ = fitter_.linearise(no_effects_, parameters.at, parameters.directions);
  parameters_.posterior = parameters.posterior;
}

std::vector<Background> RobotFit::session_changes(const SessionVariation& session) const {
  const RegimeBasis& basis = evidence().basis();
  std::vector<Background> list;
  for (Eigen::Index j = 0; j < no_effects_.shared(); ++j) {
    const double sd = session.parameter_sd(no_effects_.unknowns()[static_cast<std::size_t>(j)].name);
    if (sd == 0) continue;
    BasisCoefficients change = BasisCoefficients::Zero(kGroups, basis.size());
    for (std::size_t d = 0; d < parameters_.columns.size(); ++d)
      if (parameters_.columns[d].size() > 0)
        change += parameters_.directions.axes(j, static_cast<Eigen::Index>(d)) * *parameters_.columns[d];
    list.push_back({kSessionParameters, sd * basis.in_tests(change), {{"", j, sd}}});
  }
  for (std::size_t i = 0; i < sensor_errors_.size(); ++i) {
    const ModelDiscrepancy::Nuisance& n = evidence().discrepancy().nuisances[i];
    if (const double sd = session.parameter_sd(n.id + "." + n.value); sd > 0)
      list.push_back({kSessionParameters, sd * basis.in_tests(sensor_errors_[i])});
  }
  const auto add_level = [&](std::initializer_list<int> groups, double sd) {
    BasisCoefficients level = BasisCoefficients::Zero(kGroups, basis.size());
    for (const int g : groups) level(g, 0) = sd;
    list.push_back({kSessionParameters, basis.in_tests(level)});
  };
  const FlightList all = fitter_.flights().all();
  const auto metered = std::ranges::find_if(
      all, [](const auto& f) { return f->recording() != nullptr && f->recording()->log.header.power.has_value(); });
  if (metered != all.end())
    add_level({first_group(false, kBattery), first_group(true, kBattery)},
              kCharged * (*metered)->recording()->log.header.power->battery_nominal_V);
  if (const auto bench = std::ranges::find_if(all, [](const auto& f) { return f->clamped(); }); bench != all.end()) {
    const Recording& r = *(*bench)->recording();
    for (int i = 0; i < 3; ++i) {
      add_level({first_group(true, kSpecificForceX + i)}, kZero_N / r.mass_kg);
      add_level({first_group(true, kAngularAccelerationX + i)}, kZero_Nm / r.inertia_kg_m2[i]);
    }
  }
  for (const MagnitudeColumn& m : magnitudes_) {
    const double sd = session.background_sd(m.effect) / std::sqrt(static_cast<double>(m.near.size()));
    for (const BasisCoefficients& near : m.near)
      if (sd > 0) list.push_back({kSessionOf + m.effect, sd * near});
  }
  return list;
}

void RobotFit::fit_parameters() {
  const Directions none{MatrixXd(no_effects_.size(), 0), VectorXd(0)};
  nominal_ = fitter_.linearise(no_effects_, no_effects_.start(), none);
  if (nominal_.residual.empty()) throw io::InputError(kDiverges);
  take_evidence(evidence().with_weights(nominal_.residual));
  parameters_ = fitter_.fit(no_effects_, no_effects_.start(), kFirstIterations);
  take_evidence(evidence().with_noise(parameters_.residual));
  parameters_.statistics = evidence().statistics(parameters_.residual);
  take_scales();
  parameters_ = fitter_.refit(no_effects_, parameters_, kRefitIterations);
  nominal_.statistics = evidence().statistics(nominal_.residual);
}

void RobotFit::find_nuisance_columns() {
  find_magnitudes();
  find_nuisances();
  set_nuisances();
}

void RobotFit::refit_with_nuisances() {
  find_nuisance_columns();
  rules().describe_rest(*this);
  parameters_ = fitter_.refit(no_effects_, parameters_, kRefitIterations);
  take_scales();
  for (int round = 0; round < kMaxRefits && refit_with_minors(); ++round) continue;
}

/// Parameters fitted with small backgrounds compensate for a large one, which no later fit finds; so each may be large
/// at first.
void RobotFit::widen_backgrounds() {
  Scales wide = weigh(no_effects_, parameters_, fitter_.scales()).scales;
  for (std::size_t e = 0; e < wide.effects.size(); ++e)
    wide.effects[e] = kWideScale * wide.prior_scale(evidence().discrepancy().scale_prior(fitter_.effects()[e]));
  fitter_ = fitter_.with_scales(wide);
}

double RobotFit::beyond_background(const std::string& effect, const VectorXd& magnitudes, const Scales& scales) const {
  const ScalePrior prior = evidence().discrepancy().scale_prior(effect);
  const double nu = prior.freedom, f = scales.prior_scale(prior);
  const auto improbable = [&](const std::string& in_flight, const VectorXd& m) {
    // a bench shows a magnitude most precisely, so it counts what that is there
    const std::string name = fitter_.place_of(in_flight + kOnBench) < 0 ? in_flight : in_flight + kOnBench;
    const double sd = evidence().discrepancy().background_sd(name), n = static_cast<double>(m.size());
    const double times = std::sqrt((m.squaredNorm() / (sd * sd) + nu * f * f) / (n + nu));
    return 0.5 * m.squaredNorm() / std::pow(times * sd, 2) + n * std::log(times * sd) +
           Evidence::scale_cost_nats(times, prior, scales);
  };
  const double as_effect = -0.5 * magnitudes.squaredNorm();
  if (!of_sides(*model::find_effect(uncertain_.nominal(), effect))) return as_effect + improbable(effect, magnitudes);
  const double half = std::numbers::sqrt2 / 2;
  return as_effect + improbable(effect, VectorXd::Constant(1, half * (magnitudes[0] - magnitudes[1]))) +
         improbable(effect + kOfBoth, VectorXd::Constant(1, half * (magnitudes[0] + magnitudes[1])));
}

/// Moves the minor draws to their estimates and refits. Undone if it loses; false if it gains little or is undone.
bool RobotFit::refit_with_minors() {
  const auto log_evidence = [&] { return weigh(no_effects_, parameters_, fitter_.scales()).posterior.log_evidence; };
  const std::vector<double> minors = uncertain_.minors();
  const Fit parameters = parameters_;
  const double before = log_evidence();
  const std::vector<double> there = minors_moved_by(fitter_.nuisances(parameters_));
  const auto take = [&](const std::vector<double>& variates, Fit fit) {
    uncertain_.set_minors(variates);
    parameters_ = std::move(fit);  // before set_nuisances(), which reads them
    set_nuisances();
  };
  take(there, parameters_);
  // new columns: with those of another point a fit may stop a hundred nats below a better point nearby
  parameters_ = fitter_.fit(no_effects_, parameters_.mean(), kRefitIterations);
  double gain = -std::numeric_limits<double>::infinity();
  if (parameters_.flown()) {
    take_scales();
    gain = log_evidence() - before;
  }
  if (gain < -kMinGain_nats) {
    take(minors, parameters);
    take_scales();
  }
  return gain > kMinGain_nats;
}

Regressors RobotFit::nuisance_regressors() const {
  Regressors r;
  for (const BasisCoefficients& e : sensor_errors_) r.add(e, 0);
  for (std::size_t k = 0; k < minors_.size(); ++k) r.add(minors_[k], -uncertain_.minors()[k]);
  return r;
}

std::vector<Background> RobotFit::background(const ModelDiscrepancy& discrepancy, bool shapes) const {
  std::vector<Background> list;
  for (std::size_t i = 0; i < magnitudes_.size(); ++i) {
    const std::string& effect = magnitudes_[i].effect;
    const double sd = discrepancy.background_sd(effect);
    if (!of_sides(*model::find_effect(uncertain_.nominal(), effect))) {
      const double each = sd / std::sqrt(static_cast<double>(magnitudes_[i].near.size()));
      for (const BasisCoefficients& near : magnitudes_[i].near)
        list.push_back({effect, each * near, {{effect, magnitudes_[i].unknown, each}}});
      continue;
    }
    if (i + 1 == magnitudes_.size() || magnitudes_[i + 1].effect != effect) continue;
    const std::string both = effect + kOfBoth;
    const BasisCoefficients &left = magnitudes_[i].near[0], &right = magnitudes_[i + 1].near[0];
    const double apart = std::numbers::sqrt2 / 2 * sd,
                 shared = std::numbers::sqrt2 / 2 * discrepancy.background_sd(both);
    list.push_back({effect, apart * (left - right), {{effect, 0, apart}, {effect, 1, -apart}}});
    list.push_back({both, shared * (left + right), {{effect, 0, shared}, {effect, 1, shared}}});
    ++i;
  }
  for (std::size_t i = 0; shapes && i < shapes_.size(); ++i)
    list.push_back({shapes_[i].effect, discrepancy.background_sd(shapes_[i].effect) * shapes_[i].change});
  const FlightList all = flights_.all();
  const auto on_bench = std::ranges::count_if(all, [](const auto& f) { return f->clamped(); });
  return on_bench > 0 && on_bench < std::ssize(all) ? apart_on_bench(list, discrepancy) : list;
}

void RobotFit::set_nuisances() {
  fitter_ =
      fitter_.with_nuisances(nuisance_regressors(), rules().backgrounds(*this, evidence().discrepancy()), parameters_);
}

/// Takes what all magnitudes of the catalogue together leave as noise, under every hypothesis.
void RobotFit::learn_rest_as_noise() {
  for (int round = 0; round < kRestRounds; ++round) {
    Regressors r = Fitter::own_regressors(parameters_);
    for (const MagnitudeColumn& m : magnitudes_) r.add(m.change, 0);
    const Posterior p =
        Evidence::posterior(evidence().reduce(evidence().statistics(parameters_.residual), r.columns,
                                              fitter_.all_flights(), evidence().discrepancy_sd(fitter_.scales())),
                            r.all, r.prior_mean());
    BasisCoefficients all = BasisCoefficients::Zero(kGroups, evidence().basis().size());
    for (std::size_t k = 0; k < r.columns.size(); ++k) all += p.mean[static_cast<Eigen::Index>(k)] * *r.columns[k];
    Residuals rest = parameters_.residual;
    for (std::size_t f = 0; f < rest.size(); ++f) rest[f] = evidence().without(f, std::move(rest[f]), all);
    take_evidence(evidence().with_rest_as_noise(rest));
    fitter_ = fitter_.with_scales({});
  }
  parameters_.statistics = evidence().statistics(parameters_.residual);
  nominal_.statistics = evidence().statistics(nominal_.residual);
}

Scales RobotFit::find_scales(const Hypothesis& hypothesis, const Fit& fit, const Scales& start) const {
  ScaledEvidence best = weigh(hypothesis, fit, start);
  // expectation-maximisation stays where blocks explain what a background may explain better, so try larger ones
  while (const std::optional<Scales> larger = rules().larger_background(*this, hypothesis, fit, best.scales)) {
    ScaledEvidence other = weigh(hypothesis, fit, *larger);
    if (!(other.posterior.log_evidence > best.posterior.log_evidence + kMinGain_nats)) break;
    best = std::move(other);
  }
  return best.scales;
}

/// The scales with the largest gain from a larger background of one effect; none if none gains. With posterior mean m
/// and covariance C, the likelihood of its coefficients is normal with precision C^-1 - 1 and sum C^-1 m.
std::optional<Scales> RobotFit::larger_background(const Hypothesis& hypothesis, const Fit& fit,
                                                  const Scales& now) const {
  const Fitter fitter = fitter_.with_scales(now);
  const Regressors r = fitter.regressors(fit);
  const BasisCoefficients law_sd = fitter.law_sd(hypothesis, fit);
  const Posterior p = Evidence::posterior(
      evidence().reduce(fit.statistics, r.columns, fitter.all_flights(),
                        (evidence().discrepancy_sd(now).cwiseAbs2() + law_sd.cwiseAbs2()).cwiseSqrt()),
      r.all, r.prior_mean());
  std::optional<Scales> best;
  double most = kMinGain_nats;
  for (std::size_t e = 0; e < now.effects.size(); ++e) {
    std::vector<Eigen::Index> columns;
    for (std::size_t k = 0; k < r.effects.size(); ++k)
      if (r.effects[k] == static_cast<int>(e)) columns.push_back(static_cast<Eigen::Index>(k));
    if (columns.empty()) continue;
    const auto n = static_cast<Eigen::Index>(columns.size());
    const MatrixXd inverse = MatrixXd(p.covariance(columns, columns)).inverse();
    const VectorXd sum = inverse * VectorXd(p.mean(columns));
    const MatrixXd precision = inverse - MatrixXd::Identity(n, n);
    const auto log_evidence = [&](double factor) {
      const Eigen::LLT<MatrixXd> llt(factor * factor * precision + MatrixXd::Identity(n, n));
      return 0.5 * factor * factor * sum.dot(llt.solve(sum)) - llt.matrixLLT().diagonal().array().log().sum() -
             Evidence::scale_cost_nats(factor * now.effects[e], r.priors[static_cast<std::size_t>(columns[0])], now);
    };
    const double before = log_evidence(1);
    for (const double factor : kWidenings) {
      const double gain = log_evidence(factor) - before;
      if (!(gain > most)) continue;
      most = gain;
      best = now;
      best->effects[e] *= factor;
    }
  }
  return best;
}

ScaledEvidence RobotFit::weigh(const Hypothesis& hypothesis, const Fit& fit, const Scales& start,
                               std::optional<double> unknown_penalty_nats) const {
  const Regressors regressors = fitter_.unscaled_regressors(fit);
  const LawPrior law = rules().law_prior(evidence().discrepancy());
  const Evidence::Weigher weigh_from =
      evidence().weigher(fit.statistics, regressors, fitter_.all_flights(), unknown_penalty_nats);
  // another law factor starts from the best scales so far, in a contrast also from further starts
  const std::vector<Scales> starts = further_starts(hypothesis, start), none;
  const auto best_of = [&](double law_factor, const Scales& from, const std::vector<Scales>& others) {
    const BasisCoefficients law_sd = fitter_.law_sd(hypothesis, fit, law_factor);
    ScaledEvidence best = weigh_from(law_sd, from);
    for (const Scales& further : others)
      if (ScaledEvidence w = weigh_from(law_sd, further); w.posterior.log_evidence > best.posterior.log_evidence)
        best = std::move(w);
    best.law_factor = law_factor;
    best.posterior.log_evidence -= 0.5 * std::pow(std::log(law_factor) / law.spread, 2);
    return best;
  };
  ScaledEvidence best = best_of(1, start, starts);
  if (!fitter_.law_may_deviate(hypothesis, fit)) return best;
  for (const double step : {std::min(kLawStep, law.most), 1 / std::min(kLawStep, law.most)})
    for (double law_factor = step; law_factor <= law.most && law_factor >= 1 / law.most; law_factor *= step) {
      ScaledEvidence other = best_of(law_factor, best.scales, rules().weighs_from_priors() ? starts : none);
      if (other.posterior.log_evidence < best.posterior.log_evidence) break;
      best = std::move(other);
    }
  return best;
}

/// Expectation-maximisation finds the nearest maximum: what other scales explain, a hypothesis may explain itself.
std::vector<Scales> RobotFit::further_starts(const Hypothesis& hypothesis, const Scales& start) const {
  const ModelDiscrepancy& d = evidence().discrepancy();
  std::vector<Scales> starts;
  Scales without_background = start;
  bool differs = false;
  for (const std::string& effect : hypothesis.effects())
    for (const std::string& name : backgrounds_of(effect))
      if (const auto e = static_cast<std::size_t>(fitter_.place_of(name)); e < start.effects.size()) {
        without_background.effects[e] = start.prior_scale(d.scale_prior(name));
        differs = true;
      }
  if (differs) starts.push_back(without_background);
  if (!rules().weighs_from_priors()) return starts;
  Scales prior = start;
  prior.centre_tests(d.session);
  for (std::size_t e = 0; e < std::min(prior.effects.size(), fitter_.effects().size()); ++e)
    prior.effects[e] = prior.prior_scale(d.scale_prior(fitter_.effects()[e]));
  starts.push_back(prior);
  return starts;
}

std::vector<SensorFinding> RobotFit::sensors(const Fitter& fitter, const Hypothesis& hypothesis, const Fit& fit) const {
  const Eigen::Index lag = hypothesis.lag();
  const Unknown& late = hypothesis.unknowns()[static_cast<std::size_t>(lag)];
  std::vector<SensorFinding> list = {
      {late.name, late.value(fit.mean()[lag]), late.scale * std::sqrt(fit.covariance()(lag, lag)), late.scale}};
  for (const Fitter::NuisanceEstimate& e : fitter.nuisances(fit)) {
    if (e.place >= sensor_errors_.size()) break;  // minor draws of the vehicle
    const ModelDiscrepancy::Nuisance& n = evidence().discrepancy().nuisances[e.place];
    list.push_back({n.id + "." + n.value, e.mean * n.sd, e.sd * n.sd, n.sd});
  }
  return list;
}

/// For one step. `there`: residual of a vehicle `steps` steps from that of the parameters.
BasisCoefficients RobotFit::change(Residuals there, double steps) const {
  for (std::size_t f = 0; f < there.size(); ++f)
    for (std::size_t k = 0; k < there[f].size(); ++k) there[f][k] = (parameters_.residual[f][k] - there[f][k]) / steps;
  return evidence().basis_coefficients(there);
}

void RobotFit::find_magnitudes() {
  std::vector<MagnitudeStep> steps =
      magnitude_steps(uncertain_, parameters_.at, withheld_, rules().near_steps(evidence().discrepancy()));
  std::vector<VehicleHypothesis> vehicles;
  for (MagnitudeStep& s : steps) {
    vehicles.push_back(std::move(s.vehicle));
    for (VehicleHypothesis& v : s.shaped) vehicles.push_back(std::move(v));
    for (VehicleHypothesis& v : s.further) vehicles.push_back(std::move(v));
    for (VehicleHypothesis& v : s.near) vehicles.push_back(std::move(v));
  }
  std::vector<BasisCoefficients> changes(vehicles.size());  // [vehicle] for the whole step
  for_residuals(flights_, vehicles, threads_, [&](std::size_t i, Residuals rows) {
    if (!rows.empty()) changes[i] = change(std::move(rows), 1);
  });
  std::size_t i = 0;
  for (const MagnitudeStep& s : steps) {
    const BasisCoefficients& whole_step = changes[i];
    std::vector<BasisCoefficients> along = {changes[i++]};
    const std::size_t shapes = i;
    i += s.shaped.size();
    for (std::size_t n = 0; n < s.further.size(); ++n) along.push_back(changes[i++]);
    const std::size_t near = i;
    i += s.near.size();
    if (along[0].size() == 0) continue;
    magnitudes_.push_back({static_cast<const Magnitude&>(s), along[0] / kMagnitudeReach, {}, {}});
    MagnitudeColumn& m = magnitudes_.back();
    for (std::size_t n = 0; n < s.near.size(); ++n) {
      const BasisCoefficients& there = changes[near + n];
      m.near.push_back(there.size() > 0 ? BasisCoefficients(there / (n == 0 ? s.near_reach : -s.near_reach))
                                        : whole_step / kMagnitudeReach);
    }
    if (s.near.empty()) m.near.push_back(whole_step / kMagnitudeReach);
    for (std::size_t k = shapes; k < shapes + s.shaped.size(); ++k)
      if (changes[k].size() > 0)
        shapes_.push_back({static_cast<const Magnitude&>(s), (changes[k] - whole_step) / kMagnitudeReach, {}, {}});
    for (std::size_t n = 1; n + 1 < along.size() && along[n].size() > 0 && along[n + 1].size() > 0; ++n) {
      const double at = kMagnitudeReach * static_cast<double>(n + 1);
      m.large.push_back({at, along[n] / at, (along[n + 1] - along[n - 1]) / (2 * kMagnitudeReach)});
    }
  }
  find_linear_magnitudes();
}

void RobotFit::find_linear_magnitudes() {
  Fitter::LinearMagnitudes linear;
  for (const MagnitudeColumn& m : magnitudes_) {
    const Hypothesis h(uncertain_, {m.effect});
    const Unknown& u = h.unknowns()[static_cast<std::size_t>(h.shared() + m.unknown)];
    if (u.linear()) linear[{u.effect, u.name}] = m.change;
  }
  fitter_ = fitter_.with_linear_magnitudes(std::move(linear));
}

void RobotFit::find_nuisances() {
  const std::vector<ModelDiscrepancy::Nuisance>& all = evidence().discrepancy().nuisances;
  std::vector<VehicleHypothesis> vehicles;
  std::vector<double> steps(all.size(), 1);
  for (const ModelDiscrepancy::Nuisance& n : all) {
    VehicleHypothesis v = no_effects_.vehicle(parameters_.at);
    if (!is_of_bench(n.id))
      for (const ModelDiscrepancy::Nuisance& other : all)
        if (other.id == n.id) v.sensors[n.id][other.value] = other.value == n.value ? n.sd : 0;
    vehicles.push_back(std::move(v));
  }
  const std::size_t minors = rules().minors(uncertain_);
  for (std::size_t d = uncertain_.majors(); d < uncertain_.majors() + minors; ++d) {
    // a step in the direction in which the vehicle is physical
    VehicleHypothesis v = no_effects_.vehicle(parameters_.at, std::pair{d, 1.0});
    const bool other = model::physical_fault(v.vehicle).has_value();
    steps.push_back(other ? -1 : 1);
    vehicles.push_back(other ? no_effects_.vehicle(parameters_.at, std::pair{d, -1.0}) : std::move(v));
  }
  std::vector<BasisCoefficients> changes(vehicles.size(), BasisCoefficients::Zero(kGroups, evidence().basis().size()));
  for_residuals(flights_, vehicles, threads_, [&](std::size_t i, Residuals rows) {
    if (!rows.empty()) changes[i] = change(std::move(rows), steps[i]);
  });
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (!is_lateness(all[i].id)) continue;
    Residuals late;
    bool moved = false;
    for (std::size_t f = 0; f < flights_.size(); ++f) {
      moved = moved || flights_[f]->clamped();
      late.push_back(flights_[f]->clamped() ? late_rows(*flights_[f], all[i].id, all[i].value, all[i].sd)
                                            : Rows(flights_[f]->measured().size(), 0.0));
    }
    if (moved) changes[i] += evidence().basis_coefficients(late);
  }
  sensor_errors_.assign(changes.begin(), changes.begin() + static_cast<std::ptrdiff_t>(all.size()));
  minors_.assign(changes.begin() + static_cast<std::ptrdiff_t>(all.size()), changes.end());
}

}  // namespace flappy::gap
