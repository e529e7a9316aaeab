#include "gap/fit/hypothesis.hpp"

#include <algorithm>

#include "model/effects/registry.hpp"

namespace flappy::gap {
namespace {

/// Prior standard deviation of the lag of the sensors against the inputs. Choice: a header does not say whether a
/// sample is instantaneous, averaged, or held.
constexpr double kLagSd_s = 5e-4;
/// Largest deviation of a parameter, in prior standard deviations. Choice.
constexpr double kMaxDeviation = 4;

}  // namespace

double Unknown::value(double coordinate) const { return std::clamp(centre + scale * coordinate, low, high); }

std::vector<Unknown> unknowns_of(const std::string& effect) { return unknowns_of(model::effect_within_beat(effect)); }

std::vector<Unknown> unknowns_of(const model::CatalogueEffect& effect) {
  std::vector<Unknown> list;
  for (std::size_t k = 0; k < effect.parameters.size(); ++k) {
    const model::EffectParameter& p = effect.parameters[k];
    if (p.prior_low == p.prior_high) continue;  // known
    Unknown u{effect.info.id, p.name, 0, 1, p.low, p.high, static_cast<int>(k) < effect.info.magnitudes};
    if (u.magnitude) u.scale = std::max(-p.prior_low, p.prior_high) / kHalf90;
    else u.centre = p.typical, u.scale = (p.prior_high - p.prior_low) / (2 * kHalf90);
    u.in_log = effect.info.stage == model::Stage::sensor;
    list.push_back(std::move(u));
  }
  return list;
}

Hypothesis::Hypothesis(const sim::Randomisation& uncertain, std::vector<std::string> effects)
    : uncertain_(&uncertain), effects_(std::move(effects)) {
  for (std::size_t d = 0; d < uncertain.majors(); ++d)
    unknowns_.push_back({"", uncertain.name(d), 0, 1, uncertain.is_uniform(d) ? -1.0 : -kMaxDeviation,
                         uncertain.is_uniform(d) ? 1.0 : kMaxDeviation, false});
  // The motion of a beat-averaged vehicle is that of motion capture, whose samples are no older for it: its inputs act
  // later.
  unknowns_.push_back({"", uncertain.nominal().beat_averaged ? "command.delay_s" : "imu.latency_s", 0, kLagSd_s,
                       -kMaxDeviation * kLagSd_s, kMaxDeviation * kLagSd_s, false});
  for (const std::string& e : effects_)
    for (Unknown& u : unknowns_of(*model::find_effect(uncertain.nominal(), e))) {
      u.in_log = u.in_log && !uncertain.nominal().beat_averaged;  // beat-averaged vehicles predict effects of sensors
      unknowns_.push_back(std::move(u));
    }
}

Eigen::Index Hypothesis::first_of(const std::string& effect) const {
  return std::ranges::find(unknowns_, effect, &Unknown::effect) - unknowns_.begin();
}

Eigen::VectorXd Hypothesis::start(const model::Vehicle& vehicle) const {
  Eigen::VectorXd at = Eigen::VectorXd::Zero(size());
  const auto& effects = vehicle.effects;
  for (Eigen::Index i = shared(); i < size(); ++i) {
    const Unknown& u = unknowns_[static_cast<std::size_t>(i)];
    if (const auto effect = effects.find(u.effect); effect != effects.end())
      at[i] = u.coordinate(effect->second.at(u.name));
  }
  return at;
}

Eigen::VectorXd Hypothesis::bounded(Eigen::VectorXd coordinates) const {
  for (Eigen::Index i = 0; i < size(); ++i) {
    const Unknown& u = unknowns_[static_cast<std::size_t>(i)];
    coordinates[i] = u.coordinate(u.value(coordinates[i]));
  }
  return coordinates;
}

VehicleHypothesis Hypothesis::vehicle(const Eigen::VectorXd& coordinates,
                                      std::optional<std::pair<std::size_t, double>> minor) const {
  std::vector<double> variates(static_cast<std::size_t>(parameters()));
  for (std::size_t d = 0; d < variates.size(); ++d)
    variates[d] = unknowns_[d].value(coordinates[static_cast<Eigen::Index>(d)]);
  if (minor) {
    variates.insert(variates.end(), uncertain_->minors().begin(), uncertain_->minors().end());
    variates[minor->first] += minor->second;
  }
  VehicleHypothesis h{uncertain_->at(variates), unknowns_[static_cast<std::size_t>(lag())].value(coordinates[lag()])};
  h.variates = std::move(variates);
  h.file_effects = h.vehicle.effects;
  for (Eigen::Index i = shared(); i < size(); ++i) {
    const Unknown& u = unknowns_[static_cast<std::size_t>(i)];
    h.vehicle.effects[u.effect][u.name] = u.value(coordinates[i]);
  }
  return h;
}

}  // namespace flappy::gap
