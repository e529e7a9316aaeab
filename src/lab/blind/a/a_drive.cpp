// From the command to the torque at a wing: command -> delay -> limit, dead zone, lag -> battery -> motor -> gear.
//   torque = N eta (K i - J N a - b N psidot - f sgn psidot)      i = (V - K N psidot) / R
#include "lab/blind/a/a_robot.hpp"

namespace flappy::blind {

void Robot::drive(double left_V, double right_V) {
  std::array<double, 2> command = {left_V, right_V};
  if (const double magnitude = magnitudes_[Effect::command_delay]; magnitude > 0) {
    if (command != told_V_) {
      told_V_ = command;
      // 0.3 beats at 34 Hz on average; a packet cannot overtake an earlier one
      const double late_s = magnitude * (8.8e-3 + 0.4e-3 * std::clamp(delay_random_.normal(), -2.0, 2.0));
      pending_.push_back({std::max(x_.t_s + late_s, pending_.empty() ? 0.0 : pending_.back().at_s), command});
    }
    while (!pending_.empty() && pending_.front().at_s <= x_.t_s) {
      applied_V_ = pending_.front().volts;
      pending_.pop_front();
    }
    command = applied_V_;
  }
  for (const std::size_t k : {0u, 1u}) {
    const double limit = side_[k].motor.voltage_limit_V;
    RobotSideState& s = x_.side[k];
    double volts = std::clamp(command[k], -limit, limit);
    if (const double magnitude = magnitudes_[Effect::driver_dead_zone]; magnitude > 0) {
      const double knee = 0.4 * magnitude;  // loss by the half bridges' dead time, smoothed
      volts -= knee * hyperbolic_tangent(volts / knee);
    }
    if (const double magnitude = magnitudes_[Effect::driver_bandwidth]; magnitude > 0) {
      // second-order output filter with a delay of 1 ms; backward Euler
      const double w = 1400 / magnitude, h = step_s_;
      s.driver_V_s = (s.driver_V_s + h * w * w * (volts - s.driver_V)) / (1 + 1.4 * w * h + w * w * h * h);
      s.driver_V += h * s.driver_V_s;
      volts = s.driver_V;
    }
    s.motor_V = volts * (x_.battery_V / kBattery_V);
    if (magnitudes_.has(Effect::outside_amplitude_hysteresis) || magnitudes_.has(Effect::outside_wing_interference))
      s.envelope_V += step_s_ / 0.03 * (kPi / 2 * std::abs(command[k]) - s.envelope_V);
  }
}

double Robot::motor_torque(std::size_t k) {
  const Side& side = side_[k];
  RobotSideState& s = x_.side[k];
  const model::Motor& m = side.motor;
  const bool backlash = magnitudes_.has(Effect::gear_backlash);
  const double rate = backlash ? s.rotor_rad_s : s.wing.stroke_rad_s, geared = m.gear_ratio * rate;
  const double resistance = m.resistance_ohm * s.resistance_gain;
  s.current_A = (s.motor_V - m.torque_constant_Nm_A * geared) / resistance;
  x_.drawn_C += step_s_ * s.current_A * s.motor_V / x_.battery_V;
  s.heat_J += step_s_ * s.current_A * s.current_A * resistance;

  double friction = m.friction_Nm * hyperbolic_tangent(rate / 0.5);
  if (const double magnitude = magnitudes_[Effect::coulomb_friction]; magnitude > 0)
    friction += magnitude * m.friction_Nm * (1 + 0.8 * exponential(-rate * rate / 64)) * hyperbolic_tangent(rate / 0.3);
  const double gain = m.gear_ratio * m.efficiency;
  const double inertia = gain * m.gear_ratio * m.rotor_inertia_kg_m2;
  const double torque =
      gain * (m.torque_constant_Nm_A * s.current_A * s.drive_gain - m.damping_Nm_s * geared - friction);
  if (!backlash) {
    mass_matrix_(6 + 2 * static_cast<int>(k), 6 + 2 * static_cast<int>(k)) += inertia;
    return torque;
  }
  // The rotor turns freely between two tooth flanks; each flank is a stiff spring with a damper and only pushes.
  constexpr double kFlank_Nm_rad = 40, kFlank_Nm_s = 2.7e-3;
  const double half_gap = 0.5 * kPi / 180 * magnitudes_[Effect::gear_backlash];
  const double ahead = s.rotor_rad - s.wing.stroke_rad;
  const double pressed = ahead > half_gap ? ahead - half_gap : ahead < -half_gap ? ahead + half_gap : 0;
  double contact = 0;
  if (pressed != 0) contact = kFlank_Nm_rad * pressed + kFlank_Nm_s * (s.rotor_rad_s - s.wing.stroke_rad_s);
  if (contact * pressed < 0) contact = 0;
  s.rotor_rad_s += step_s_ * (torque - contact) / inertia;
  s.rotor_rad += step_s_ * s.rotor_rad_s;
  return contact;
}

/// Slow states of battery, windings and brushes; called each millisecond.
void Robot::update_drive(double dt_s) {
  if (const double magnitude = magnitudes_[Effect::battery_sag]; magnitude > 0) {
    // Cells behind a series resistor and one RC element; their voltage falls by 5 % a minute at hover.
    constexpr double kSeries_ohm = 0.8, kSlow_ohm = 0.9, kSlow_s = 2, kSlope_V_C = 0.06;
    const double current = x_.drawn_C / dt_s;
    x_.charge_C += x_.drawn_C;
    x_.battery_rc_V += dt_s / kSlow_s * (kSlow_ohm * current - x_.battery_rc_V);
    x_.battery_V = full_V_ - magnitude * (kSlope_V_C * x_.charge_C + x_.battery_rc_V + kSeries_ohm * current);
  }
  x_.drawn_C = 0;
  bool brush_open = false;
  if (const double magnitude = magnitudes_[Effect::outside_brush_contact]; magnitude > 0) {
    // a worn brush loses contact for 20 ms on average, six times a second
    x_.brush_left_s -= dt_s;
    if (x_.brush_left_s <= 0 && brush_random_.uniform() < 6 * dt_s)
      x_.brush_left_s = -0.02 * logarithm(brush_random_.uniform());
    brush_open = x_.brush_left_s > 0;
  }
  for (const std::size_t k : {0u, 1u}) {
    RobotSideState& s = x_.side[k];
    s.resistance_gain = 1;
    if (const double magnitude = magnitudes_[Effect::winding_heating]; magnitude > 0) {
      // 6 mm motor: winding of 0.3 J/K, 12 K/W to the case; case of 3 J/K, 30 K/W to the air
      const double across = (s.winding_K - s.case_K) / 12;
      s.winding_K += (magnitude * s.heat_J - dt_s * across) / 0.3;
      s.case_K += dt_s * (across - s.case_K / 30) / 3;
      s.resistance_gain += 0.00393 * s.winding_K;  // copper
    }
    s.heat_J = 0;
    if (k == 0 && brush_open) s.resistance_gain += 0.35 * magnitudes_[Effect::outside_brush_contact];
    if (const double magnitude = magnitudes_[Effect::outside_amplitude_hysteresis]; magnitude > 0) {
      constexpr double kWidth_V = 0.5;
      s.play_V = std::clamp(s.play_V, s.envelope_V - kWidth_V, s.envelope_V + kWidth_V);
      s.drive_gain = 1 + 0.04 * magnitude * (s.play_V - s.envelope_V) / kWidth_V;
    }
  }
}

}  // namespace flappy::blind
