// A flight whose rows are made up, and whose vehicles predict them by a law that a test writes down.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <random>

#include "flappy/vehicle_file.hpp"
#include "gap/fit/robot_fit.hpp"
#include "gap/question/question.hpp"
#include "io/config.hpp"

namespace flappy::gap {

/// Rows are there in the mean and the first cosine of kSpecificForceX, kSpecificForceZ and kAngularAccelerationY. The regime has an amplitude, a velocity, a height and a time.
class SyntheticFlight final : public PredictedFlight {
 public:
  static constexpr double kNoise = 0.01, kSignal = 2;
  /// Adds what a vehicle shows to rows of 0.
  using Law = std::function<void(const SyntheticFlight&, const VehicleHypothesis&, Rows&)>;

  SyntheticFlight(std::string name, std::uint64_t seed, Law law, double height = 0, std::size_t beats = 120)
      : name_(std::move(name)), law_(std::move(law)), beats_(beats), rows_(beats * kRowsPerBeat, 0.0) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    for (auto* v : {&amplitude, &velocity, &height_m, &time}) v->resize(static_cast<Eigen::Index>(beats));
    for (std::size_t j = 0; j < beats; ++j) {
      const auto i = static_cast<Eigen::Index>(j);
      amplitude[i] = normal(random);
      velocity[i] = normal(random);
      height_m[i] = height + normal(random);
      time[i] = static_cast<double>(j) / 34;
    }
    measured_ = noise(seed + 1000);
  }
  /// Measured rows: those of a vehicle, and noise.
  void fly(const VehicleHypothesis& truth) { law_(*this, truth, measured_); }
  void add_measured(int channel, int coefficient, const Eigen::VectorXd& values) {
    add(channel, coefficient, values, measured_);
  }
  /// Rows of white noise.
  Rows noise(std::uint64_t seed, double sd = kNoise) const {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal(0, sd);
    Rows rows = rows_;
    for (std::size_t i = 0; i < rows.size(); ++i)
      if (has_rows(static_cast<int>(i % kRowsPerBeat) / kCoefficients,
                   static_cast<int>(i % kRowsPerBeat) % kCoefficients))
        rows[i] = normal(random);
    return rows;
  }
  /// Adds values, [beat], to one coefficient of a channel.
  void add(int channel, int coefficient, const Eigen::VectorXd& values, Rows& to) const {
    for (std::size_t j = 0; j < beats_; ++j)
      to[j * kRowsPerBeat + static_cast<std::size_t>(channel) * kCoefficients +
         static_cast<std::size_t>(coefficient)] += values[static_cast<Eigen::Index>(j)];
  }

  bool on_bench = false;

  const std::string& name() const override { return name_; }
  bool clamped() const override { return on_bench; }
  bool has_ground() const override { return true; }
  std::size_t beats() const override { return beats_; }
  double beats_Hz() const override { return 34; }
  bool covers(std::size_t /*beat*/, int channel) const override { return has_rows(channel, 0); }
  bool has_rows(int channel, int coefficient) const override {
    return (channel == kSpecificForceX || channel == kSpecificForceZ || channel == kAngularAccelerationY) &&
           coefficient < 2;
  }
  const Rows& measured() const override { return measured_; }
  const Rows& signal() const override {
    if (signal_.empty()) signal_.assign(rows_.size(), kSignal);
    return signal_;
  }
  std::vector<Rows> predict(const std::vector<const VehicleHypothesis*>& vehicles) const override {
    std::vector<Rows> all(vehicles.size(), rows_);
    for (std::size_t i = 0; i < all.size(); ++i) law_(*this, *vehicles[i], all[i]);
    predicted += vehicles.size();
    return all;
  }
  Rows declared_noise(std::uint64_t seed) const override { return noise(seed + 2000); }
  std::vector<RegimeFunction> functions() const override {
    return {{"amplitude", "amplitude", BasisFunction::input, amplitude},
            {"velocity_x", "velocity", BasisFunction::velocity_x, velocity},
            {"height", "height", BasisFunction::place, height_m},
            {"time", "time", BasisFunction::place, time}};
  }
  std::vector<std::pair<std::string, std::string>> products() const override {
    return {{"amplitude", "amplitude"}, {"amplitude", "velocity_x"}};
  }
  std::vector<RegimeQuantity> regimes() const override { return {}; }
  std::vector<RegimeQuantity> inputs() const override { return {}; }
  bool is_averaged() const override { return false; }
  std::shared_ptr<const PredictedFlight> corrected(const EffectValues& /*sensors*/) const override {
    return std::make_shared<SyntheticFlight>(*this);
  }

  Eigen::VectorXd amplitude, velocity, height_m, time;  ///< [beat]
  mutable std::size_t predicted = 0;                    ///< vehicles so far

 private:
  std::string name_;
  Law law_;
  std::size_t beats_;
  Rows rows_, measured_;
  mutable Rows signal_;
};

inline model::Vehicle synthetic_vehicle() {
  return model::read_vehicle(FLAPPY_SOURCE_DIR "/configs/vehicles/hummingbird_nominal.toml");
}

/// The mass of the torso is uncertain by 10 %, and, as a minor draw, its centre of mass by 1 mm.
inline sim::Randomisation synthetic_priors() {
  const io::Config config = io::Config::parse(R"(schema = 1
[[randomise]]
parameters = ["torso.mass_kg"]
law = "scale_normal"
sd = 0.1
[[randomise]]
parameters = ["torso.com_m.x"]
law = "add_normal"
sd = 0.001
minor = true
)",
                                              "priors.toml");
  return sim::read_randomisation(synthetic_vehicle(), config.root());
}

/// A magnitude or shape parameter of a vehicle's effect; 0 where it does not have the effect.
inline double value_of(const VehicleHypothesis& h, const std::string& effect, const std::string& name) {
  const auto at = h.vehicle.effects.find(effect);
  return at == h.vehicle.effects.end() ? 0 : at->second.at(name);
}

/// Flights of one robot, each of another seed.
inline std::vector<std::shared_ptr<SyntheticFlight>> synthetic_flights(std::size_t count,
                                                                       const SyntheticFlight::Law& law) {
  std::vector<std::shared_ptr<SyntheticFlight>> flights;
  for (std::size_t f = 0; f < count; ++f)
    flights.push_back(std::make_shared<SyntheticFlight>("flight_" + std::to_string(f + 1), f + 1, law));
  return flights;
}
/// The first `references` are references.
inline Flights as_flights(const std::vector<std::shared_ptr<SyntheticFlight>>& flights, std::size_t references = 0) {
  const auto first = flights.begin() + static_cast<std::ptrdiff_t>(references);
  return {{flights.begin(), first}, {first, flights.end()}};
}

/// The mass moves the mean vertical force with the amplitude; the centre of mass the pitch torque; wind the forward force with the velocity; the
/// ground the vertical force with the height.
inline void synthetic_law(const SyntheticFlight& f, const VehicleHypothesis& h, Rows& rows) {
  static const model::Vehicle nominal = synthetic_vehicle();
  const double mass = (h.vehicle.torso.mass_kg / nominal.torso.mass_kg - 1) / 0.1;
  const double com = (h.vehicle.torso.com_m.x - nominal.torso.com_m.x) / 0.001;
  f.add(kSpecificForceZ, 0, 0.1 * mass * f.amplitude, rows);
  f.add(kAngularAccelerationY, 0, 0.05 * com * f.amplitude, rows);
  f.add(kSpecificForceX, 0, 5 * value_of(h, "wind", "x_m_s") * f.velocity, rows);
  f.add(kSpecificForceZ, 0, value_of(h, "ground_effect", "gain") * f.height_m, rows);
}

inline int group_index(int channel, int coefficient) { return channel * kCoefficients + coefficient; }

/// What differs between sessions, with spreads that no learning changes.
inline SessionVariation fixed_session_variation() {
  SessionVariation s = read_session_variation();
  s.scale_sd = 1, s.own_scale_sd = 0.3, s.own_offset = 0, s.own_share = 0.05, s.effect_freedom = 6;
  s.law_error.fill(0.2);
  s.law_spread = 1.4, s.law_most = 7;
  for (auto& channel : s.shares)
    for (auto& harmonic : channel) std::ranges::fill(harmonic, 0.0005);
  for (auto& [effect, sd] : s.background) sd = 0.015;
  return s;
}

}  // namespace flappy::gap
