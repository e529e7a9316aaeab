#include "benchmark/true_values.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "benchmark/robot_prediction.hpp"
#include "flappy/vehicle.hpp"
#include "gap/evidence/fit.hpp"
#include "gap/evidence/hypothesis.hpp"
#include "gap/replay/reset_prediction.hpp"
#include "io/parallel.hpp"

namespace flappy::benchmark {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using gap::BasisCoefficients;
using gap::Residuals;

/// Half the step of a parameter's difference, in standard deviations.
constexpr double kParameterReach = 0.5;
/// Prior standard deviation of the lag of the IMU (gap/evidence/hypothesis.cpp), in steps of the record.
constexpr int kLagSteps = 1;
/// An effect of the catalogue that leaves this share of a change or more is not alike.
constexpr double kMaxMisfit = 0.5;

/// a - b; empty if either is empty.
Residuals difference(Residuals a, const Residuals& b) {
  if (a.empty() || b.empty()) return {};
  for (std::size_t f = 0; f < a.size(); ++f)
    for (std::size_t i = 0; i < a[f].size(); ++i) a[f][i] -= b[f][i];
  return a;
}

std::vector<blind::RobotFlight> fly_all(const blind::Case& c, int threads) {
  std::vector<blind::RobotFlight> flights(blind::kFlights);
  io::parallel_for(blind::kFlights, threads, [&](std::size_t k) { flights[k] = fly(c, k); });
  return flights;
}

class Subject {
 public:
  /// All flights of `c`, which has no effects; none crashed.
  Subject(blind::Case c, std::vector<blind::RobotFlight> flights, int threads);

  /// Change of the rows; empty if the simulation diverges.
  BasisCoefficients added(blind::Effect effect, double magnitude) const;
  /// Change of the rows for one standard deviation of each uncertain parameter and the IMU's lag.
  std::vector<BasisCoefficients> parameters(const sim::Randomisation& uncertain) const;
  /// Change in the simulator's rows, at each of `coordinates`; empty if the simulation diverges.
  std::vector<BasisCoefficients> catalogue(const std::string& effect,
                                           const std::vector<Eigen::VectorXd>& coordinates) const;

  /// d' C^-1 d for all pairs of `columns`, with the parameters integrated out.
  MatrixXd information(const std::vector<BasisCoefficients>& parameters,
                       const std::vector<BasisCoefficients>& columns) const;

 private:
  BasisCoefficients sensed(const blind::Magnitudes& magnitudes) const;
  model::Vehicle moved(const sim::Randomisation& uncertain, std::size_t draw, double variate) const;

  blind::Case case_;
  int threads_;
  gap::Flights flights_;
  Residuals unperturbed_, left_;  ///< rows that the robot predicts without effects; residuals of the simulator
  std::unique_ptr<const gap::Evidence> evidence_;
};

Subject::Subject(blind::Case c, std::vector<blind::RobotFlight> flights, int threads)
    : case_(std::move(c)), threads_(io::thread_count(threads)) {
  for (std::size_t k = 0; k < flights.size(); ++k) {
    flights_.push_back(std::make_shared<gap::ResetPrediction>(
        gap::Recording("flight_" + std::to_string(k + 1), std::move(flights[k].log), case_.vehicle)));
  }
  unperturbed_ = predict_perturbed_flights(flights_, {{case_.vehicle, {}, case_.seed}}, threads_)[0];
  if (unperturbed_.empty()) throw std::logic_error("the robot comes apart along its own flight");
  Residuals measured;
  for (const auto& f : flights_) measured.push_back(f->measured());
  evidence_ = std::make_unique<const gap::Evidence>(gap::Evidence(flights_, gap::read_model_discrepancy(), threads_)
                                                        .with_noise(difference(std::move(measured), unperturbed_)));
  left_ = gap::residuals(flights_, {{case_.vehicle}}, threads_)[0];
}

BasisCoefficients Subject::added(blind::Effect effect, double magnitude) const {
  const blind::Magnitudes magnitudes({{blind::effect_names()[static_cast<std::size_t>(effect)], magnitude}});
  if (acts_on_sensors(effect)) return sensed(magnitudes);
  const Residuals change = difference(
      predict_perturbed_flights(flights_, {{case_.vehicle, magnitudes, case_.seed}}, threads_)[0], unperturbed_);
  return change.empty() ? BasisCoefficients() : evidence_->basis_coefficients(change);
}

/// The controller uses no sensor of the log, so the same seed gives the same motion and noise with the effect.
BasisCoefficients Subject::sensed(const blind::Magnitudes& magnitudes) const {
  blind::Case c = case_;
  c.magnitudes = magnitudes;
  const std::vector<blind::RobotFlight> seen = fly_all(c, threads_);
  gap::Flights flights;
  for (std::size_t k = 0; k < blind::kFlights; ++k) flights.push_back(flights_[k]->with_log(seen[k].log));
  return evidence_->basis_coefficients(difference(gap::residuals(flights, {{case_.vehicle}}, threads_)[0], left_));
}

/// Moved by the amount that a draw moves the nominal vehicle: a law that replaces values ignores the vehicle's.
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
  std::vector<gap::VehicleHypothesis> candidates;
  for (std::size_t d = 0; d < uncertain.draws(); ++d)
    for (const double to : {kParameterReach, -kParameterReach}) candidates.push_back({moved(uncertain, d, to)});
  for (const double to : {kParameterReach, -kParameterReach})
    candidates.push_back({case_.vehicle, to * kLagSteps * gap::kPredictionStep_s});
  std::vector<Residuals> left = gap::residuals(flights_, candidates, threads_);
  std::vector<BasisCoefficients> result;
  for (std::size_t i = 0; i < left.size(); i += 2)
    if (const Residuals change = difference(std::move(left[i + 1]), left[i]); !change.empty())
      result.push_back(evidence_->basis_coefficients(change) / (2 * kParameterReach));
  return result;
}

std::vector<BasisCoefficients> Subject::catalogue(const std::string& effect,
                                                  const std::vector<Eigen::VectorXd>& coordinates) const {
  const std::vector<gap::Unknown> unknowns = gap::unknowns_of(effect);
  std::vector<gap::VehicleHypothesis> candidates;
  for (const Eigen::VectorXd& at : coordinates) {
    gap::VehicleHypothesis c{case_.vehicle};
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
      evidence_->reduce(nothing, all, std::vector<char>(flights_.size(), 1), evidence_->discrepancy_sd({})).sums;
  const MatrixXd known = s.topLeftCorner(p, p) + MatrixXd::Identity(p, p);
  const MatrixXd half = Eigen::LLT<MatrixXd>(known).matrixL().solve(s.block(0, p, p, n));
  return s.block(p, p, n, n) - half.transpose() * half;
}

constexpr int kIterations = 8;
/// Half the step of differences; last step of the search. Coordinates: 90 % of the prior is within 1.645.
constexpr double kReach = 0.1, kConverged = 0.002;
/// A typical magnitude; shape parameters in mid-prior, or one of them near an end.
constexpr double kStart = 0.5, kShapeStart = 1.5;

class Likeness {
 public:
  Likeness(const Subject& subject, const std::vector<BasisCoefficients>& parameters, std::string entry,
           BasisCoefficients wanted)
      : subject_(subject),
        parameters_(parameters),
        entry_(std::move(entry)),
        unknowns_(gap::unknowns_of(entry_)),
        wanted_(std::move(wanted)) {}

  /// The magnitudes, and the share of the change that they leave (a ratio of rms, at most 1).
  std::pair<std::map<std::string, double>, double> find() {
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
    std::map<std::string, double> values;
    for (Index i = 0; i < size(); ++i)
      if (of(i).magnitude) values[entry_ + "." + of(i).name] = of(i).value(at[i]);
    const BasisCoefficients left = left_at({at})[0];
    const double misfit =
        left.size() > 0 ? std::sqrt(std::min(1.0, measure({left})(0, 0) / measure({wanted_})(0, 0))) : 1;
    return {values, misfit};
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
      if (!of(i).magnitude) sum += at[i] * at[i];
    return sum;
  }

  /// Where changes by single magnitudes are most alike; two-sided magnitudes start at 0.
  VectorXd start() const {
    std::vector<VectorXd> shapes = {VectorXd::Zero(size())};
    for (Index i = 0; i < size(); ++i)
      if (!of(i).magnitude)
        for (const double to : {-kShapeStart, kShapeStart}) shapes.emplace_back(to * VectorXd::Unit(size(), i));
    std::vector<VectorXd> places;
    std::vector<std::size_t> shape_of;
    for (std::size_t k = 0; k < shapes.size(); ++k)
      for (Index i = 0; i < size(); ++i)
        if (of(i).magnitude) {
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
      if (of(i).magnitude && of(i).low >= 0) at[i] = kStart;
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
      normal(k, k) += of(i).magnitude ? 1e-9 : 1;
      if (!of(i).magnitude) right[k] -= at[i];
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

bool acts_on_sensors(blind::Effect effect) {
  for (const blind::Effect e :
       {blind::Effect::gyro_bias, blind::Effect::accelerometer_misalignment, blind::Effect::vibration_rectification,
        blind::Effect::mocap_tilt, blind::Effect::marker_offset, blind::Effect::mocap_delay,
        blind::Effect::outside_mocap_lens})
    if (e == effect) return true;
  return false;
}

std::map<std::string, std::optional<double>> true_values(const blind::Case& c,
                                                         const std::vector<blind::BlindEffect>& effects,
                                                         const sim::Randomisation& uncertain, int threads) {
  const blind::Magnitudes magnitudes(effects);  // throws if an effect is unknown
  std::map<std::string, std::optional<double>> result;
  blind::Case plain = c;
  plain.magnitudes = {};
  plain.power = plain.wings = false;
  plain.programme = blind::Programme::rich;
  std::vector<blind::RobotFlight> flights = fly_all(plain, threads);
  std::unique_ptr<const Subject> subject;
  std::vector<BasisCoefficients> parameters;
  if (std::ranges::none_of(flights, &blind::RobotFlight::crashed)) {
    subject = std::make_unique<const Subject>(plain, std::move(flights), threads);
    parameters = subject->parameters(uncertain);
  }
  for (std::size_t e = 0; e < blind::kBlindEffects; ++e) {
    const auto effect = static_cast<blind::Effect>(e);
    if (!magnitudes.has(effect) || effect >= blind::Effect::outside_magnetic_torque) continue;
    const std::string& id = blind::effect_names()[e];
    for (const gap::Unknown& u : gap::unknowns_of(id))
      if (u.magnitude) result[id + "." + u.name] = std::nullopt;
    if (!subject) continue;
    BasisCoefficients wanted = subject->added(effect, magnitudes[effect]);
    if (wanted.size() == 0) continue;
    const auto [found, misfit] = Likeness(*subject, parameters, id, std::move(wanted)).find();
    if (misfit >= kMaxMisfit) continue;
    for (const auto& [name, value] : found) result[name] = value;
  }
  return result;
}

}  // namespace flappy::benchmark
