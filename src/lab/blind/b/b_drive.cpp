// Torques of hinges and drives; the equations are in plant.hpp.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "lab/blind/b/plant.hpp"

namespace flappy::blind::b {
namespace {

constexpr double kGearLossOver_rad_s = 10;

}  // namespace

double Plant::ratio(const State& x, std::size_t side) const {
  const double n = f_.side[side].motor.gear_ratio;
  if (!a_.any(kGearEccentricity)) return n;
  return n * (1 + 0.04 * a_[kGearEccentricity] * std::sin(1.5 * x[kStroke + side] + a_.gear_phase_rad[side]));
}

double Plant::hinge_torque(const Hinge& h, double angle, double rate, double stiffness, double restitution,
                           double shift) const {
  double torque = 0;
  const double above = angle - h.upper_rad - shift, below = h.lower_rad + shift - angle;
  if (above > 0) torque -= stiffness * above * std::sqrt(above) * std::max(0.0, 1 + 1.5 * restitution * rate);
  if (below > 0) torque += stiffness * below * std::sqrt(below) * std::max(0.0, 1 - 1.5 * restitution * rate);
  if (has_friction) torque -= h.damping_Nm_s * rate + h.friction_Nm * smooth_sign(rate, kFrictionOver_rad_s);
  return torque;
}

double Plant::spring_torque(std::size_t side, double stroke, double stiffness) const {
  const Side& s = f_.side[side];
  const double d = stroke - s.rest_angle_rad;
  const double k = stiffness * (d > 0 ? s.stiffness_positive_Nm_rad : s.stiffness_negative_Nm_rad);
  // A hyperbolic sine hardens the spring: d + d^3 / (6 spread^2) + ...
  if (spread_rad_[side] != 0) return -k * spread_rad_[side] * std::sinh(d / spread_rad_[side]);
  return -k * d;
}

double Plant::spring_energy(std::size_t side, double stroke) const {
  const Side& s = f_.side[side];
  const double d = stroke - s.rest_angle_rad, w = spread_rad_[side];
  const double k = d > 0 ? s.stiffness_positive_Nm_rad : s.stiffness_negative_Nm_rad;
  return w != 0 ? k * w * w * (std::cosh(d / w) - 1) : k * d * d / 2;
}

double Plant::stroke_torque(const State& x, std::size_t side, double current_A, const Slow& slow, State& rate) const {
  const Side& s = f_.side[side];
  const double n = ratio(x, side), stroke = x[kStroke + side], stroke_rate = x[kStrokeRate + side];
  const bool play = a_.any(kGearBacklash);
  const double turning = play ? x[kRotorRate + side] : stroke_rate;  // rotor rate over gear ratio
  double torque_constant = slow.torque_constant_Nm_A[side];
  if (a_.any(kMagnetSaturation))
    torque_constant /= 1 + 0.05 * a_[kMagnetSaturation] * (current_A / 0.5) * (current_A / 0.5);
  double motor = n * torque_constant * current_A;
  if (has_friction) {
    motor -= (1 - s.motor.efficiency) * std::abs(motor) * smooth_sign(turning, kGearLossOver_rad_s);
    motor -=
        n * s.motor.friction_Nm * smooth_sign(turning, kFrictionOver_rad_s) + s.motor.damping_Nm_s * n * n * turning;
  }
  if (a_.any(kCoulombFriction)) {
    // LuGre bristles (1995), soft enough for the step. Strength Fc + (Fs - Fc) exp(-(v / vs)^2), from 1.4 to 1 times
    // the motor's friction beyond the Stribeck speed.
    constexpr double kReach_rad = 1.5 * std::numbers::pi / 180, kStribeck_rad_s = 30;
    const double v = turning / kStribeck_rad_s;
    const double strength = 1 + 0.4 * std::exp(-v * v);
    const double z = x[kBristle + side];
    rate[kBristle + side] = turning / kReach_rad - std::abs(turning) / kReach_rad * z / strength;
    motor -= a_[kCoulombFriction] * n * s.motor.friction_Nm * z;
  }
  if (a_.any(kMotorCogging))
    motor -= 7.6e-5 * a_[kMotorCogging] * n *
             std::sin(6 * n * (play ? x[kRotor + side] : stroke) + a_.cogging_phase_rad[side]);
  double torque = motor;
  if (play) {
    // Nordin, Galic, Gutman (1997): a damped elastic shaft behind a gap, which transmits no pull.
    constexpr double kShaft_Nm_rad = 0.5, kShaftDamping_Nm_s = 6e-5;
    const double gap = 0.5 * std::numbers::pi / 180 * a_[kGearBacklash];
    const double apart = x[kRotor + side] - stroke, closing = turning - stroke_rate;
    double contact = 0;
    if (apart > gap) contact = std::max(0.0, kShaft_Nm_rad * (apart - gap) + kShaftDamping_Nm_s * closing);
    if (apart < -gap) contact = std::min(0.0, kShaft_Nm_rad * (apart + gap) + kShaftDamping_Nm_s * closing);
    rate[kRotor + side] = turning;
    rate[kRotorRate + side] = (motor - contact) / (n * n * s.motor.rotor_inertia_kg_m2);
    torque = contact;
  }
  torque += spring_torque(side, stroke, slow.stiffness[side]);
  if (slow.extra_damping != 0)
    torque -= slow.extra_damping * 2 * std::sqrt(s.stiffness_positive_Nm_rad * 2.7e-7) * stroke_rate;
  torque += hinge_torque(s.stroke, stroke, stroke_rate, kStrokeStop, kStopLoss, 0);
  return torque;
}

}  // namespace flappy::blind::b
