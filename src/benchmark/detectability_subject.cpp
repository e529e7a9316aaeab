// Flights of a robot without effects, and what moves their rows.
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "benchmark/detectability.hpp"
#include "flappy/vehicle.hpp"
#include "gap/evidence/fit.hpp"
#include "io/files.hpp"
#include "io/parallel.hpp"
#include "model/effects/registry.hpp"

namespace flappy::benchmark {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using gap::BasisCoefficients;
using gap::Residuals;

/// Reach of a parameter's difference to either side, in standard deviations; of a size's, from none.
constexpr double kReach = 0.5, kSizeReach = 0.4;
/// How well a header says when a sample of the IMU was taken (gap/hypothesis.cpp), in steps of the record.
constexpr int kLagSteps = 1;

/// a - b, or empty where either is.
Residuals difference(Residuals a, const Residuals& b) {
  if (a.empty() || b.empty()) return {};
  for (std::size_t f = 0; f < a.size(); ++f)
    for (std::size_t i = 0; i < a[f].size(); ++i) a[f][i] -= b[f][i];
  return a;
}

}  // namespace

bool acts_on_sensors(blind::Effect effect) {
  for (const blind::Effect e :
       {blind::Effect::gyro_bias, blind::Effect::accelerometer_misalignment, blind::Effect::vibration_rectification,
        blind::Effect::mocap_tilt, blind::Effect::marker_offset, blind::Effect::mocap_delay,
        blind::Effect::outside_mocap_lens})
    if (e == effect) return true;
  return false;
}

std::vector<blind::RobotFlight> fly_all(const blind::Case& c, int threads) {
  std::vector<blind::RobotFlight> flights(blind::kFlights);
  io::parallel_for(blind::kFlights, threads, [&](std::size_t k) { flights[k] = fly(c, k); });
  return flights;
}

Subject::Subject(blind::Case c, std::vector<blind::RobotFlight> flights, int threads)
    : case_(std::move(c)), threads_(io::thread_count(threads)) {
  for (std::size_t k = 0; k < flights.size(); ++k) {
    const std::string name = "flight_" + std::to_string(k + 1);
    if (flights[k].crashed)
      throw io::InputError("seed " + std::to_string(case_.seed) + ": " + name + " " + flights[k].how +
                           "; accepted: robots that fly");
    flights_.emplace_back(gap::Recording(name, std::move(flights[k].log), case_.vehicle));
  }
  evidence_ = std::make_unique<gap::Evidence>(flights_, gap::read_model_discrepancy(), threads_);
  std::vector<double> declared;
  for (int g = 0; g < gap::kGroups; ++g) declared.push_back(evidence_->noise_sd(g));

  unperturbed_ = predict_perturbed_flights(flights_, {{case_.vehicle, {}, case_.seed, 0}}, threads_)[0];
  if (unperturbed_.empty()) throw std::logic_error("the robot comes apart along its own flight");
  Residuals measured;
  for (const gap::PredictedFlight& f : flights_) measured.push_back(f.measured());
  evidence_->learn_noise(difference(std::move(measured), unperturbed_));
  left_ = gap::residuals(flights_, {{case_.vehicle}}, threads_)[0];

  std::vector<double> ratios;
  for (int g = 0; g < gap::kGroups; ++g)
    if (const int channel = g / gap::kCoefficients; channel != gap::kStrokeLeft && channel != gap::kStrokeRight)
      if (flights_.front().has_rows(channel, g % gap::kCoefficients))
        ratios.push_back(evidence_->noise_sd(g) / declared[static_cast<std::size_t>(g)]);
  std::ranges::sort(ratios);
  noise_ratio_ = ratios[ratios.size() / 2];
}

std::vector<BasisCoefficients> Subject::added(const std::vector<Added>& list) const {
  std::vector<Perturbation> perturbations;
  std::vector<Added> of_sensors;
  for (const Added& a : list) {
    if (acts_on_sensors(a.effect)) of_sensors.push_back(a);
    else
      perturbations.push_back(
          {case_.vehicle, blind::Sizes({{blind::effect_names()[static_cast<std::size_t>(a.effect)], a.size}}), a.seed});
  }
  std::vector<Residuals> rows = predict_perturbed_flights(flights_, perturbations, threads_);
  const std::vector<BasisCoefficients> sensors = sensed(of_sensors);
  std::vector<BasisCoefficients> result;
  std::size_t perturbation = 0, sensor = 0;
  for (const Added& a : list) {
    if (acts_on_sensors(a.effect)) {
      result.push_back(sensors[sensor++]);
      continue;
    }
    const Residuals change = difference(std::move(rows[perturbation++]), unperturbed_);
    result.push_back(change.empty() ? BasisCoefficients() : evidence_->basis_coefficients(change));
  }
  return result;
}

/// Who flies the robot looks at no sensor of the log, so that the same seed flies the same motion with worse sensors, and draws
/// the same noise.
std::vector<BasisCoefficients> Subject::sensed(const std::vector<Added>& list) const {
  std::vector<std::vector<flightlog::FlightLog>> logs(list.size(), std::vector<flightlog::FlightLog>(blind::kFlights));
  io::parallel_for(list.size() * blind::kFlights, threads_, [&](std::size_t job) {
    const Added& a = list[job / blind::kFlights];
    blind::Case c = case_;
    c.sizes = blind::Sizes({{blind::effect_names()[static_cast<std::size_t>(a.effect)], a.size}});
    logs[job / blind::kFlights][job % blind::kFlights] = fly(c, job % blind::kFlights).log;
  });
  std::vector<BasisCoefficients> result;
  for (std::vector<flightlog::FlightLog>& seen : logs) {
    std::vector<gap::PredictedFlight> flights;
    for (std::size_t k = 0; k < blind::kFlights; ++k) flights.push_back(flights_[k].with_log(std::move(seen[k])));
    const Residuals left = gap::residuals(flights, {{case_.vehicle}}, threads_)[0];
    result.push_back(evidence_->basis_coefficients(difference(left, left_)));
  }
  return result;
}

/// By as much as any vehicle's figures are moved: a law that replaces knows nothing of this one's.
model::Vehicle Subject::moved(const sim::Randomisation& uncertain, std::size_t draw, double variate) const {
  std::vector<double> variates(uncertain.draws(), 0);
  model::Vehicle middle = uncertain.at(variates);
  variates[draw] = variate;
  model::Vehicle there = uncertain.at(variates), own = case_.vehicle;
  const auto from = model::parameters(middle), to = model::parameters(there), changed = model::parameters(own);
  for (std::size_t i = 0; i < changed.size(); ++i) *changed[i].value += *to[i].value - *from[i].value;
  return own;
}

std::vector<BasisCoefficients> Subject::parameters(const sim::Randomisation& uncertain) const {
  std::vector<Perturbation> perturbations;
  for (std::size_t d = 0; d < uncertain.draws(); ++d)
    for (const double to : {kReach, -kReach}) perturbations.push_back({moved(uncertain, d, to), {}, case_.seed});
  for (const int late : {kLagSteps, -kLagSteps}) perturbations.push_back({case_.vehicle, {}, case_.seed, late});
  std::vector<Residuals> rows = predict_perturbed_flights(flights_, perturbations, threads_);
  std::vector<BasisCoefficients> result;
  for (std::size_t i = 0; i < rows.size(); i += 2) {
    const Residuals change = difference(std::move(rows[i]), rows[i + 1]);
    if (change.empty()) continue;  // nobody can know it then
    const bool lag = i + 2 == rows.size();
    result.push_back(evidence_->basis_coefficients(change) / (lag ? 2 * kLagSteps : 2 * kReach));
  }
  return result;
}

std::vector<BasisCoefficients> Subject::simulated_parameters(const sim::Randomisation& uncertain) const {
  std::vector<gap::Candidate> candidates;
  for (std::size_t d = 0; d < uncertain.draws(); ++d)
    for (const double to : {kReach, -kReach}) candidates.push_back({moved(uncertain, d, to)});
  for (const double to : {kReach, -kReach})
    candidates.push_back({case_.vehicle, to * kLagSteps * gap::kPredictionStep_s});
  std::vector<Residuals> left = gap::residuals(flights_, candidates, threads_);
  std::vector<BasisCoefficients> result;
  for (std::size_t i = 0; i < left.size(); i += 2)
    if (const Residuals change = difference(std::move(left[i + 1]), left[i]); !change.empty())
      result.push_back(evidence_->basis_coefficients(change) / (2 * kReach));
  return result;
}

std::vector<BasisCoefficients> Subject::catalogue(const std::string& effect,
                                                  const std::vector<Eigen::VectorXd>& coordinates) const {
  const std::vector<gap::Unknown> unknowns = gap::unknowns_of(effect);
  std::vector<gap::Candidate> candidates;
  for (const Eigen::VectorXd& at : coordinates) {
    gap::Candidate c{case_.vehicle};
    for (std::size_t i = 0; i < unknowns.size(); ++i)
      c.vehicle.effects[effect][unknowns[i].name] = unknowns[i].value(at[static_cast<Index>(i)]);
    candidates.push_back(std::move(c));
  }
  std::vector<BasisCoefficients> result;
  for (Residuals& left : gap::residuals(flights_, candidates, threads_)) {
    const Residuals change = difference(left_, left);
    result.push_back(change.empty() ? BasisCoefficients() : evidence_->basis_coefficients(change));
  }
  return result;
}

std::vector<BasisCoefficients> Subject::background() const {
  std::vector<BasisCoefficients> result;
  for (const model::EffectEntry& e : model::effects()) {
    const std::vector<gap::Unknown> unknowns = gap::unknowns_of(e.info.id);
    const auto n = static_cast<Index>(unknowns.size());
    std::vector<Eigen::VectorXd> axes;
    for (Index i = 0; i < n; ++i)
      if (unknowns[static_cast<std::size_t>(i)].size) axes.emplace_back(kSizeReach * Eigen::VectorXd::Unit(n, i));
    for (const BasisCoefficients& s : catalogue(e.info.id, axes))
      if (s.size() > 0) result.emplace_back(evidence_->discrepancy().background_sd(e.info.id) / kSizeReach * s);
  }
  return result;
}

MatrixXd Subject::information(const std::vector<BasisCoefficients>& parameters,
                              const std::vector<BasisCoefficients>& columns) const {
  std::vector<const BasisCoefficients*> all;
  for (const BasisCoefficients& c : parameters) all.push_back(&c);
  for (const BasisCoefficients& c : columns) all.push_back(&c);
  const auto p = static_cast<Index>(parameters.size()), n = static_cast<Index>(columns.size());
  const Index q = evidence_->basis().size();
  const gap::SufficientStatistics nothing{
      {flights_.size(), std::vector<Eigen::VectorXd>(gap::kGroups, Eigen::VectorXd::Zero(q))}};
  const MatrixXd s =
      evidence_->reduce(nothing, all, std::vector<char>(flights_.size(), 1), evidence_->discrepancy_sd()).sums;
  const MatrixXd known = s.topLeftCorner(p, p) + MatrixXd::Identity(p, p);
  const MatrixXd half = Eigen::LLT<MatrixXd>(known).matrixL().solve(s.block(0, p, p, n));
  return s.block(p, p, n, n) - half.transpose() * half;
}

}  // namespace flappy::benchmark
