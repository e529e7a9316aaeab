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

Gusts::Gusts(Random random) {
  // bins of equal width in the logarithm of frequency; the variance of a cosine is half its amplitude's square
  constexpr double kLow_hz = 0.02, kHigh_hz = 25;
  const double ratio = std::pow(kHigh_hz / kLow_hz, 1.0 / kLines);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    double low = kLow_hz;
    for (Line& line : line_[axis]) {
      const double frequency = low * std::pow(ratio, random.uniform()), width = low * (ratio - 1);
      line.amplitude_m_s = kGust_m_s * kGustShare[axis] * std::sqrt(2 * gust_density(frequency, axis) * width);
      line.rate_rad_s = 2 * std::numbers::pi * frequency;
      line.phase_rad = random.uniform(0, 2 * std::numbers::pi);
      low *= ratio;
    }
  }
}

Vector3d Gusts::at(double time) const {
  Vector3d sum = Vector3d::Zero();
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (const Line& line : line_[axis])
      sum[static_cast<Eigen::Index>(axis)] += line.amplitude_m_s * std::cos(line.rate_rad_s * time + line.phase_rad);
  return sum;
}

Robot::Robot(RobotParameters parameters, const EffectMagnitudes& effect_magnitudes, const Surroundings& room,
             std::uint64_t seed, std::uint64_t flight)
    : plant_(std::move(parameters), effect_magnitudes),
      room_(room),
      gusts_(Random(seed, flight, Stream::kEffect, kWind)),
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
  beat_.reset();
  wanted_ = voltage;
  steps_ = 0;
  advance_slow();
  ++tick_;
}

void Robot::drive(const Beat& beat, double time) {
  beat_ = beat;
  tick_begins_s_ = time;
  in_tick_s_ = 0;
  steps_ = 0;
  advance_slow();
  ++tick_;
}

void Robot::advance_slow() {
  const EffectMagnitudes& a = plant_.effect_magnitudes();
  const RobotParameters& f = plant_.parameters();
  const double t = static_cast<double>(tick_) * kTick_s;
  if (a.any(kWindingHeating)) {
    for (std::size_t j = 0; j < 2; ++j) {
      const Motor& motor = f.side[j].motor;
      heat_[j].take(heat_J_[j], kTick_s);
      slow_.resistance_ohm[j] = motor.resistance_ohm * (1 + heat_[j].resistance(a[kWindingHeating]));
      slow_.torque_constant_Nm_A[j] = motor.torque_constant_Nm_A * (1 + heat_[j].torque_constant(a[kWindingHeating]));
      heat_J_[j] = 0;
    }
  }
  if (a.any(kBatterySag)) {
    sag_.take(load_As_ / kTick_s, kTick_s);
    supply_ = std::max(0.2, f.full_supply - sag_.loss_V(a[kBatterySag]) / f.side[0].motor.voltage_limit_V);
  }
  load_As_ = 0;
  if (a.any(kWind)) {
    const double c = std::cos(a.wind_direction_rad), s = std::sin(a.wind_direction_rad);
    Vector3d along = gusts_.at(t);
    along.x() += kWind_m_s * wind_profile(x_[2] - room_.ground_z_m);
    slow_.wind_m_s = a[kWind] * Vector3d(c * along.x() - s * along.y(), s * along.x() + c * along.y(), along.z());
  }
  for (std::size_t j = 0; j < 2; ++j) {
    if (a.any(kHingeCreep))
      slow_.stop_shift_rad[j] = a.creep_sign[j] * kCreep_rad * a[kHingeCreep] * (1 - std::exp(-t / kCreeps_s));
    if (a.any(kBandAgeing))
      slow_.stiffness[j] = 1 - kAgeing * a[kBandAgeing] * a.ageing[j] * (1 - std::exp(-t / kAges_s));
  }
  if (a.any(kBandAgeing)) slow_.extra_damping = kAgedDamping * a[kBandAgeing];
}

void Robot::set_voltages(double h) {
  const EffectMagnitudes& a = plant_.effect_magnitudes();
  const RobotParameters& f = plant_.parameters();
  if (const double now = tick_begins_s_ + in_tick_s_; beat_ && now >= next_hold_s_ - 1e-9) {
    wanted_ = waveform(f, *beat_, now);
    // the hold's clock has begun with the waveform's
    next_hold_s_ = (std::floor(now / f.hold_s + 1e-6) + 1) * f.hold_s;
  }
  std::array<double, 2> volts = wanted_;
  if (a.any(kCommandDelay)) {
    if (history_.empty() || history_.back().second != wanted_) history_.emplace_back(clock_s_, wanted_);
    const long beat = std::lround(std::floor(clock_s_ * f.flapping_Hz));
    const double then = clock_s_ - command_delay_s(beat, a[kCommandDelay]) + 1e-9;
    const auto later =
        std::find_if(history_.rbegin(), history_.rend(), [&](const auto& from) { return from.first <= then; });
    volts = later == history_.rend() ? std::array<double, 2>{} : later->second;
  }
  for (std::size_t j = 0; j < 2; ++j) {
    double v = volts[j];
    if (a.any(kDriverDeadZone)) v += dead_time_V(v, a[kDriverDeadZone]);
    v *= supply_;
    if (a.any(kDriverBandwidth)) v = mean_[j].take(v, h, kMean_s * a[kDriverBandwidth]);
    applied_[j] = v;
  }
  in_tick_s_ += h;
  clock_s_ += h;
}

std::array<double, 2> Robot::back(const State& x) const {
  const std::size_t at = plant_.rotor_rate();
  return {plant_.parameters().side[0].motor.gear_ratio * x[at],
          plant_.parameters().side[1].motor.gear_ratio * x[at + 1]};
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
