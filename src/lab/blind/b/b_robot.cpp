#include "lab/blind/b/b_robot.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flappy::blind::b {

std::array<double, 2> waveform(const RobotParameters& parameters, const Beat& b, double time_s) {
  const double phase = time_s * parameters.flapping_Hz;
  const double t = phase - std::floor(phase);
  const double amplitude = std::clamp(b.amplitude_V, 0.0, parameters.amplitude_limit_V);
  const double difference = std::clamp(b.difference_V, -parameters.difference_limit_V, parameters.difference_limit_V);
  const double bias = std::clamp(b.bias_V, -parameters.bias_limit_V, parameters.bias_limit_V);
  const double split = std::clamp(b.split_cycle, -parameters.split_cycle_limit, parameters.split_cycle_limit);
  std::array<double, 2> volts{};
  for (std::size_t j = 0; j < 2; ++j) {
    const double sign = j == 0 ? 1 : -1, first = 0.5 - sign * split;
    const double angle = t < first ? std::numbers::pi * t / first : std::numbers::pi * (t - 1) / (1 - first);
    const double limit = parameters.side[j].motor.voltage_limit_V;
    volts[j] = std::clamp((amplitude + sign * difference) * std::cos(angle) + bias, -limit, limit);
  }
  return volts;
}

Robot::Robot(RobotParameters parameters, const EffectMagnitudes& effect_magnitudes, const Surroundings& room,
             std::uint64_t seed, std::uint64_t flight)
    : plant_(std::move(parameters), effect_magnitudes),
      room_(room),
      gusts_(seed, flight, Stream::kEffect, kWind),
      slow_(plant_.fresh()) {
  supply_ = plant_.parameters().full_supply;
  felt_.acceleration = {Vector3d::Zero(), Vector3d::Zero()};
  felt_.support = {Vector3d::Zero(), Vector3d::Zero()};
  felt_.motion = {Vector3d::Zero(), Vector3d::Zero()};
}

void Robot::put(const Vector3d& position, double heading) {
  x_.fill(0);
  for (std::size_t k = 0; k < 3; ++k) x_[k] = position[static_cast<Eigen::Index>(k)];
  x_[kQuaternion] = std::cos(heading / 2);
  x_[kQuaternion + 3] = std::sin(heading / 2);
}

void Robot::drive(const std::array<double, 2>& voltage) {
  steps_ = 0;
  wanted_ = voltage;
  if (plant_.effect_magnitudes().any(kCommandDelay)) history_.push_back(voltage);
  advance_slow();
  ++tick_;
}

void Robot::advance_slow() {
  const EffectMagnitudes& a = plant_.effect_magnitudes();
  const RobotParameters& f = plant_.parameters();
  const double t = static_cast<double>(tick_) * kTick_s;
  if (a.any(kWindingHeating)) {
    // Thermal network of two nodes, winding and housing, with parameters typical of an 8 mm motor.
    constexpr double kWinding_J_K = 0.12, kHousing_J_K = 1.0, kInside_K_W = 14, kOutside_K_W = 50;
    for (std::size_t j = 0; j < 2; ++j) {
      const double inside = (winding_K_[j] - housing_K_[j]) / kInside_K_W;
      winding_K_[j] += (heat_J_[j] - inside * kTick_s) / kWinding_J_K;
      housing_K_[j] += (inside - housing_K_[j] / kOutside_K_W) * kTick_s / kHousing_J_K;
      slow_.resistance_ohm[j] = f.side[j].motor.resistance_ohm * (1 + 0.00393 * a[kWindingHeating] * winding_K_[j]);
      slow_.torque_constant_Nm_A[j] =
          f.side[j].motor.torque_constant_Nm_A * (1 - 0.002 * a[kWindingHeating] * housing_K_[j]);
      heat_J_[j] = 0;
    }
  }
  if (a.any(kBatterySag)) {
    // Thevenin circuit as in Suti, Di Rito, Mattei, Energies 15 (2022): charge, resistance, one relaxation.
    constexpr double kHover_A = 0.5, kRelaxes_s = 1.5;
    const double load = load_As_ / kTick_s;
    charge_As_ += load_As_;
    relaxed_A_ += (load - relaxed_A_) * kTick_s / kRelaxes_s;
    const double sags = a[kBatterySag] * (0.01 * load + 0.01 * relaxed_A_ + 0.05 / 60 * charge_As_) / kHover_A;
    supply_ = std::max(0.2, f.full_supply - sags);
  }
  load_As_ = 0;
  if (a.any(kWind)) {
    // Dryden's first-order longitudinal filter, with the length scale of a room.
    constexpr double kGust_m_s = 0.06, kStays_s = 0.8;
    const double keep = std::exp(-kTick_s / kStays_s);
    for (double& g : gust_) g = keep * g + kGust_m_s * std::sqrt(1 - keep * keep) * gusts_.normal();
    slow_.wind_m_s =
        a[kWind] * (0.3 * Vector3d(std::cos(a.wind_direction_rad), std::sin(a.wind_direction_rad), 0) + gust_);
  }
  for (std::size_t j = 0; j < 2; ++j) {
    if (a.any(kHingeCreep))
      slow_.stop_shift_rad[j] = a.creep_sign[j] * 2 * std::numbers::pi / 180 * a[kHingeCreep] * (1 - std::exp(-t / 8));
    if (a.any(kBandAgeing)) slow_.stiffness[j] = 1 - 0.04 * a[kBandAgeing] * a.ageing[j] * (1 - std::exp(-t / 6));
  }
  if (a.any(kBandAgeing)) slow_.extra_damping = 0.03 * a[kBandAgeing];
}

void Robot::set_voltages(double h) {
  const EffectMagnitudes& a = plant_.effect_magnitudes();
  std::array<double, 2> volts = wanted_;
  if (a.any(kCommandDelay)) {
    // The delay is 0.3 beats, plus and minus 0.25 ms in alternate beats.
    const double beat = std::floor(static_cast<double>(tick_) * kTick_s * plant_.parameters().flapping_Hz);
    const double late =
        a[kCommandDelay] * (0.3 / plant_.parameters().flapping_Hz + 0.25e-3 * (std::fmod(beat, 2) < 1 ? 1 : -1));
    const double now =
        static_cast<double>(history_.size() - 1) + static_cast<double>(steps_) / kStepsPerTick - late / kTick_s;
    volts = now < 0 ? std::array<double, 2>{} : history_[static_cast<std::size_t>(now)];
  }
  for (std::size_t j = 0; j < 2; ++j) {
    double v = volts[j];
    if (a.any(kDriverDeadZone)) {
      const double zone = 0.4 * a[kDriverDeadZone];
      v -= zone * v / std::sqrt(v * v + zone * zone);
    }
    v *= supply_;
    if (a.any(kCommonSupply)) {
      const double together = std::abs(current_[0]) + std::abs(current_[1]);
      v -= std::clamp(v / 2, -1.0, 1.0) * 0.8 * a[kCommonSupply] * together;
    }
    if (a.any(kDriverBandwidth)) {
      const double keep = std::exp(-h / (0.5e-3 * a[kDriverBandwidth]));
      pole_1_[j] = keep * pole_1_[j] + (1 - keep) * v;
      pole_2_[j] = keep * pole_2_[j] + (1 - keep) * pole_1_[j];
      v = pole_2_[j];
    }
    applied_[j] = v;
  }
}

std::array<double, 2> Robot::back(const State& x) const {
  const std::size_t at = plant_.effect_magnitudes().any(kGearBacklash) ? kRotorRate : kStrokeRate;
  return {plant_.ratio(x, 0) * x[at], plant_.ratio(x, 1) * x[at + 1]};
}

std::array<double, 2> Robot::currents(double h, const std::array<double, 2>& from,
                                      const std::array<double, 2>& to) const {
  std::array<double, 2> out{};
  for (std::size_t j = 0; j < 2; ++j) {
    const double r = slow_.resistance_ohm[j], tau = kInductance_H / r;
    const double e = std::exp(-h / tau);
    const double emf = from[j] * (1 - e) + (to[j] - from[j]) * (1 - (1 - e) * tau / h);
    out[j] = current_[j] * e + applied_[j] / r * (1 - e) - slow_.torque_constant_Nm_A[j] / r * emf;
  }
  return out;
}

void Robot::integrate(double h, const Prescribed* from, const Prescribed* to) {
  set_voltages(h);
  Prescribed middle;
  if (from) middle.acceleration = (from->acceleration + to->acceleration) * 0.5;
  const auto moved = [&](const State& rate, double t) {
    State out = x_;
    for (std::size_t k = 0; k < kStates; ++k) out[k] += t * rate[k];
    return out;
  };
  const std::array<double, 2> u0 = back(x_);
  State k1, k2, k3, k4;
  Felt feels = felt_;
  plant_.rates(x_, current_, slow_, room_, from, k1, feels);
  felt_ = feels;
  const State x2 = moved(k1, h / 2);
  plant_.rates(x2, currents(h / 2, u0, back(x2)), slow_, room_, from ? &middle : nullptr, k2, feels);
  const State x3 = moved(k2, h / 2);
  plant_.rates(x3, currents(h / 2, u0, back(x3)), slow_, room_, from ? &middle : nullptr, k3, feels);
  const State x4 = moved(k3, h);
  plant_.rates(x4, currents(h, u0, back(x4)), slow_, room_, to, k4, feels);
  for (std::size_t k = 0; k < kStates; ++k) x_[k] += h / 6 * (k1[k] + 2 * k2[k] + 2 * k3[k] + k4[k]);
  double square = 0;
  for (std::size_t k = 0; k < 4; ++k) square += x_[kQuaternion + k] * x_[kQuaternion + k];
  for (std::size_t k = 0; k < 4; ++k) x_[kQuaternion + k] /= std::sqrt(square);
  current_ = currents(h, u0, back(x_));
  for (std::size_t j = 0; j < 2; ++j) heat_J_[j] += current_[j] * current_[j] * slow_.resistance_ohm[j] * h;
  load_As_ += (std::abs(current_[0]) + std::abs(current_[1])) * h;
  ++steps_;
}

void Robot::step(double h) { integrate(h, nullptr, nullptr); }

void Robot::led_step(const Path& path, std::size_t at) {
  std::copy(path.pose[at].begin(), path.pose[at].end(), x_.begin());
  const Prescribed from{path.acceleration[at]}, to{path.acceleration[at + 1]};
  integrate(kStep_s, &from, &to);
}

Felt Robot::felt_now() const {
  State rate;
  Felt feels = felt_;
  plant_.rates(x_, current_, slow_, room_, nullptr, rate, feels);
  return feels;
}

std::string Robot::crash(bool may_tumble) const {
  const RobotParameters& f = plant_.parameters();
  for (const double x : x_)
    if (!std::isfinite(x) || std::abs(x) > 1e6) return "its motion ran away";
  const double up = 1 - 2 * (x_[kQuaternion + 1] * x_[kQuaternion + 1] + x_[kQuaternion + 2] * x_[kQuaternion + 2]);
  if (x_[2] - f.below_m < room_.ground_z_m) return "it struck the ground";
  if (x_[2] + f.above_m > room_.ceiling_z_m) return "it struck the ceiling";
  if (x_[1] + f.around_m > room_.wall_y_m) return "it struck the wall";
  if (!may_tumble && up < -0.2) return "it turned over";
  return {};
}

}  // namespace flappy::blind::b
