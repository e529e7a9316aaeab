#include "lab/blind/c/c_drive.hpp"

#include <algorithm>

namespace flappy::blind::c {
namespace {

constexpr double kWindingToAir_K_W = 45, kWinding_J_K = 0.35;  // typical of a 6 mm coreless motor, not measured
constexpr double kHover_A = 0.19;                              // battery current of a hovering nominal robot
constexpr double kInternal_ohm = 1.2, kBuffer_s = 5e-3;

}  // namespace

Inputs clipped(Inputs in, const RobotParameters& parameters) {
  in.amplitude_V = std::clamp(in.amplitude_V, 0.0, parameters.amplitude_limit_V);
  in.difference_V = std::clamp(in.difference_V, -parameters.difference_limit_V, parameters.difference_limit_V);
  in.bias_V = std::clamp(in.bias_V, -parameters.bias_limit_V, parameters.bias_limit_V);
  in.split_cycle = std::clamp(in.split_cycle, -parameters.split_cycle_limit, parameters.split_cycle_limit);
  return in;
}

std::array<double, 2> beat_voltages(const Inputs& in, double phase, const RobotParameters& parameters) {
  std::array<double, 2> volts{};
  for (std::size_t side = 0; side < 2; ++side) {
    const double sign = side == 0 ? 1 : -1, first = 0.5 - sign * in.split_cycle;
    const double half = phase < first ? phase / first : 1 + (phase - first) / (1 - first);  // half periods, from 0 to 2
    const double limit = parameters.sides[side].motor.voltage_limit_V;
    volts[side] =
        std::clamp((in.amplitude_V + sign * in.difference_V) * std::cos(M_PI * half) + in.bias_V, -limit, limit);
  }
  return volts;
}

Drive::Drive(const RobotParameters& parameters, const Magnitudes& magnitudes, std::uint64_t seed, std::size_t flight)
    : parameters_(&parameters),
      dead_zone_V_(0.4 * magnitudes[Effect::kDriverDeadZone]),
      pole_s_(0.5e-3 * magnitudes[Effect::kDriverBandwidth]),
      delay_s_(0.3 / parameters.flapping_Hz * magnitudes[Effect::kCommandDelay]),
      heating_(magnitudes[Effect::kWindingHeating]),
      sag_(magnitudes[Effect::kBatterySag]),
      eccentricity_(0.04 * magnitudes[Effect::kGearEccentricity]),
      ripple_(0.08 * magnitudes[Effect::kCommutatorRipple]),
      shared_ohm_(1.5 * magnitudes[Effect::kSharedSupply]),
      jitter_s_(0.4e-3 * magnitudes[Effect::kDriverJitter]),
      random_(seed, "driver", flight),
      full_V_(kBattery_V * parameters.supply),
      battery_V_(full_V_) {
  Random once(seed, "gears");
  for (double& phase : gear_phase_) phase = once.uniform(0, 2 * M_PI);
}

void Drive::command(double now_s, const std::array<double, 2>& voltages) {
  waiting_.push_back({now_s + delay_s_ + jitter_s_ * random_.uniform(), voltages});
}

std::array<double, 2> Drive::torques(double now_s, double step_s, const std::array<double, 2>& angles,
                                     const std::array<double, 2>& rates) {
  while (!waiting_.empty() && waiting_.front().from_s <= now_s + 1e-9) {
    applied_ = waiting_.front().voltages;
    waiting_.erase(waiting_.begin());
  }
  std::array<double, 2> torques{};
  double drawn_A = 0, bus_A = 0;
  for (std::size_t side = 0; side < 2; ++side) {
    const Motor& motor = parameters_->sides[side].motor;
    double volts = applied_[side];
    if (dead_zone_V_ > 0) volts -= dead_zone_V_ * volts / std::sqrt(volts * volts + dead_zone_V_ * dead_zone_V_);
    if (pole_s_ > 0) {
      const double kept = std::exp(-step_s / pole_s_);
      once_[side] = volts + kept * (once_[side] - volts);
      twice_[side] = once_[side] + kept * (twice_[side] - once_[side]);
      volts = twice_[side];
    }
    volts *= battery_V_ / kBattery_V;
    if (shared_ohm_ > 0) volts *= 1 - std::min(0.5, shared_ohm_ * bus_A_ / kBattery_V);
    const double gear = motor.gear_ratio * (1 + eccentricity_ * std::sin(6 * angles[side] + gear_phase_[side]));
    const double constant =
        motor.torque_constant_Nm_A * (1 + ripple_ * std::cos(2 * motor.gear_ratio * angles[side] + gear_phase_[side]));
    const double resistance = motor.resistance_ohm * (1 + kCopper_1_K * warmth_K_[side]);
    const double current = (volts - constant * gear * rates[side]) / resistance;
    if (heating_ > 0)
      warmth_K_[side] +=
          step_s / kWinding_J_K * (heating_ * current * current * resistance - warmth_K_[side] / kWindingToAir_K_W);
    voltages_[side] = volts;
    currents_[side] = current;
    torques[side] = gear * motor.efficiency * constant * current;
    drawn_A += volts * current / kBattery_V;
    bus_A += std::abs(volts * current) / kBattery_V;
  }
  bus_A_ = bus_A;
  if (sag_ > 0) {
    load_A_ += step_s / kBuffer_s * (drawn_A - load_A_);
    charge_As_ += step_s * load_A_;
    battery_V_ =
        full_V_ * std::max(0.3, 1 - sag_ * 0.05 * charge_As_ / (60 * kHover_A)) - sag_ * kInternal_ohm * load_A_;
  }
  return torques;
}

}  // namespace flappy::blind::c
