// From the command to the torque at a wing: command -> delay -> limit, dead zone, lag -> battery -> motor -> gear.
//   torque = N eta (K i - J N a - b N psidot - f sgn psidot)      i = (V - K N psidot) / R
#include "lab/blind/a/a_robot.hpp"

namespace flappy::blind {

void Robot::drive(double left_V, double right_V) {
  std::array<double, 2> command = {left_V, right_V};
  if (const double magnitude = magnitudes_[Effect::command_delay]; magnitude > 0) {
    if (command != told_V_) {
      told_V_ = command;
      const double late_s = magnitude * laws::packet_delay(delay_random_);  // a packet cannot overtake an earlier one
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
      // the winding's inductance lets the current follow within 0.1 ms, which keeps the loop of voltage and current stable
      s.winding_A += step_s_ / (1e-4 + step_s_) * (s.current_A - s.winding_A);
      volts += magnitude * laws::dead_time(s.winding_A);
    }
    if (const double magnitude = magnitudes_[Effect::driver_bandwidth]; magnitude > 0)
      volts = laws::filter_step(s.driver, magnitude, volts, step_s_);
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
  const double resistance = m.resistance_ohm * s.resistance_gain, constant = m.torque_constant_Nm_A * s.flux_gain;
  s.current_A = (s.motor_V - constant * geared) / resistance;
  x_.drawn_C += step_s_ * s.current_A * s.motor_V / x_.battery_V;
  s.heat_J += step_s_ * s.current_A * s.current_A * resistance;

  double friction = m.friction_Nm * hyperbolic_tangent(rate / 0.5);
  if (const double magnitude = magnitudes_[Effect::coulomb_friction]; magnitude > 0)
    friction += magnitude * laws::motor_friction(rate);
  const double gain = m.gear_ratio * m.efficiency;
  const double inertia = gain * m.gear_ratio * m.rotor_inertia_kg_m2;
  const double torque = gain * (constant * s.current_A * s.drive_gain - m.damping_Nm_s * geared - friction);
  if (!backlash) {
    mass_matrix_(6 + 2 * static_cast<int>(k), 6 + 2 * static_cast<int>(k)) += inertia;
    return torque;
  }
  // The rotor turns freely between two tooth flanks. It is light and they are stiff: its step is implicit.
  const laws::GearForce f = laws::gear_contact(magnitudes_[Effect::gear_backlash] * laws::kGearGap_rad / 2,
                                               s.rotor_rad - s.wing.stroke_rad, s.rotor_rad_s - s.wing.stroke_rad_s);
  const double slope = f.damping_Nm_s + step_s_ * f.stiffness_Nm_rad;
  const double gained = step_s_ * (torque - f.torque_Nm) / (inertia + step_s_ * slope);
  const double contact = f.torque_Nm + slope * gained;
  s.rotor_rad_s += gained;
  s.rotor_rad += step_s_ * s.rotor_rad_s;
  return contact;
}

/// Slow states of battery, windings and brushes; called each millisecond.
void Robot::update_drive(double dt_s) {
  if (const double magnitude = magnitudes_[Effect::battery_sag]; magnitude > 0)
    x_.battery_V = full_V_ - magnitude * laws::sag_step(x_.battery, x_.drawn_C / dt_s, dt_s);
  x_.drawn_C = 0;
  bool brush_open = false;
  if (const double magnitude = magnitudes_[Effect::outside_brush_contact]; magnitude > 0) {
    // a worn brush loses contact for 20 ms on average, six times a second
    x_.brush_left_s -= dt_s;
    if (x_.brush_left_s <= 0 && brush_random_.uniform() < laws::kBrush_Hz * dt_s)
      x_.brush_left_s = -laws::kBrushOpen_s * logarithm(brush_random_.uniform());
    brush_open = x_.brush_left_s > 0;
  }
  for (const std::size_t k : {0u, 1u}) {
    RobotSideState& s = x_.side[k];
    s.resistance_gain = s.flux_gain = 1;
    if (const double magnitude = magnitudes_[Effect::winding_heating]; magnitude > 0) {
      laws::heat_step(s.heat, magnitude * s.heat_J, dt_s);
      s.resistance_gain += laws::kCopper_1_K * s.heat.winding_K;
      s.flux_gain += laws::kMagnet_1_K * s.heat.magnet_K;
    }
    s.heat_J = 0;
    if (k == 0 && brush_open) s.resistance_gain += laws::kBrush * magnitudes_[Effect::outside_brush_contact];
    if (const double magnitude = magnitudes_[Effect::outside_amplitude_hysteresis]; magnitude > 0) {
      s.play_V = std::clamp(s.play_V, s.envelope_V - laws::kPlay_V, s.envelope_V + laws::kPlay_V);
      s.drive_gain = 1 + laws::kHysteresis * magnitude * (s.play_V - s.envelope_V) / laws::kPlay_V;
    }
  }
}

}  // namespace flappy::blind
