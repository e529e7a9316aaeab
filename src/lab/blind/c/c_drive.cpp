#include "lab/blind/c/c_drive.hpp"

#include <algorithm>

#include "lab/blind/c/c_laws.hpp"

namespace flappy::blind::c {

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

double task_phase(std::uint64_t seed) { return Random(seed, "slow task").uniform(); }

double winding_A(double drive_V, double command_V, double resistance_ohm, double bridge, double battery_V) {
  if (bridge == 0) return drive_V / resistance_ohm;
  // the drop grows with the current, so the root is between 0 and what flows without it
  double none = 0, all = drive_V / resistance_ohm;
  for (int i = 0; i < 40; ++i) {
    const double mid = (none + all) / 2;
    const double over_V = resistance_ohm * mid + bridge * laws::bridge_loss_V(command_V, mid, battery_V) - drive_V;
    (over_V * drive_V > 0 ? all : none) = mid;
  }
  return (none + all) / 2;
}

Drive::Drive(const RobotParameters& parameters, const Magnitudes& magnitudes, std::uint64_t seed, std::size_t flight)
    : parameters_(&parameters),
      bridge_(magnitudes[Effect::kDriverDeadZone]),
      slew_(magnitudes[Effect::kDriverBandwidth]),
      delay_(magnitudes[Effect::kCommandDelay]),
      heating_(magnitudes[Effect::kWindingHeating]),
      sag_(magnitudes[Effect::kBatterySag]),
      ripple_(0.08 * magnitudes[Effect::kCommutatorRipple]),
      hunting_(magnitudes[Effect::kConverterHunting]),
      jitter_s_(0.4e-3 * magnitudes[Effect::kDriverJitter]),
      task_phase_(task_phase(seed)),
      random_(seed, "driver", flight),
      full_V_(kBattery_V * parameters.supply),
      battery_V_(full_V_) {
  fan(0);
  Random once(seed, "gears");
  for (double& phase : gear_phase_) phase = once.uniform(0, 2 * M_PI);
  hunting_phase_ = once.uniform(0, 2 * M_PI);
}

void Drive::fan(double airspeed_m_s) { airspeed_m_s_ = std::hypot(laws::kWash_m_s, airspeed_m_s); }

void Drive::command(double now_s, const std::array<double, 2>& voltages) {
  const double delay_s = delay_ > 0 ? laws::task_delay_s(now_s, task_phase_, delay_) : 0;
  waiting_.push_back({now_s + delay_s + jitter_s_ * random_.uniform(), voltages});
}

std::array<double, 2> Drive::torques(double now_s, double step_s, const std::array<double, 2>& angles,
                                     const std::array<double, 2>& rates) {
  while (!waiting_.empty() && waiting_.front().from_s <= now_s + 1e-9) {
    applied_ = waiting_.front().voltages;
    waiting_.erase(waiting_.begin());
  }
  std::array<double, 2> torques{};
  double drawn_A = 0;
  for (std::size_t side = 0; side < 2; ++side) {
    const Motor& motor = parameters_->sides[side].motor;
    double volts = applied_[side];
    if (slew_ > 0) volts = slewed_[side] = laws::slewed_V(slewed_[side], volts, step_s, slew_);
    const double command = volts;
    volts *= battery_V_ / kBattery_V;
    const double constant =
        motor.torque_constant_Nm_A * (1 + ripple_ * std::cos(2 * motor.gear_ratio * angles[side] + gear_phase_[side]));
    const double resistance = motor.resistance_ohm * (1 + kCopper_1_K * warmth_K_[side]);
    const double back_V = constant * motor.gear_ratio * rates[side];
    const double current = winding_A(volts - back_V, command, resistance, bridge_, kBattery_V);
    drawn_A += volts * current / kBattery_V;
    if (bridge_ > 0) volts -= bridge_ * laws::bridge_loss_V(command, current, kBattery_V);
    if (heating_ > 0)
      warmth_K_[side] =
          laws::warmed_K(warmth_K_[side], heating_ * current * current * resistance, airspeed_m_s_, step_s);
    voltages_[side] = volts;
    currents_[side] = current;
    torques[side] = motor.gear_ratio * motor.efficiency * constant * current;
  }
  double source_V = full_V_;
  if (sag_ > 0) {
    load_A_ += step_s / laws::kBuffer_s * (drawn_A - load_A_);
    charge_As_ += step_s * load_A_;
    source_V = std::max(0.3 * full_V_, full_V_ - sag_ * laws::sag_V(charge_As_, load_A_));
  }
  battery_V_ = source_V;
  if (hunting_ > 0)
    battery_V_ *= 1 + hunting_ * laws::kHunting * std::sin(2 * M_PI * laws::kHunting_Hz * now_s + hunting_phase_);
  return torques;
}

}  // namespace flappy::blind::c
