// Torques of hinges and drives; the equations are in plant.hpp.
#include <algorithm>
#include <cmath>

#include "lab/blind/b/b_laws.hpp"
#include "lab/blind/b/plant.hpp"

namespace flappy::blind::b {
namespace {

constexpr double kGearLossOver_rad_s = 10;

}  // namespace

double Plant::hinge_torque(const Hinge& h, double angle, double rate, double stiffness, double restitution,
                           double shift, double pad) const {
  double torque = 0;
  const double above = angle - h.upper_rad - shift, below = h.lower_rad + shift - angle;
  if (pad != 0) torque += pad_torque(stiffness, below, -rate, pad) - pad_torque(stiffness, above, rate, pad);
  else if (above > 0) torque -= stiffness * above * std::sqrt(above) * std::max(0.0, 1 + 1.5 * restitution * rate);
  if (pad == 0 && below > 0)
    torque += stiffness * below * std::sqrt(below) * std::max(0.0, 1 - 1.5 * restitution * rate);
  if (has_friction) torque -= h.damping_Nm_s * rate + h.friction_Nm * smooth_sign(rate, kFrictionOver_rad_s);
  return torque;
}

double Plant::spring_torque(std::size_t side, const State& x, double stiffness) const {
  const Side& s = f_.side[side];
  const double d = x[kStroke + side] - s.rest_angle_rad;
  const double k = stiffness * (d > 0 ? s.stiffness_positive_Nm_rad : s.stiffness_negative_Nm_rad);
  double deflection = d;
  if (a_.any(kSpringHardening)) deflection += hardening(d, a_[kSpringHardening]);
  if (a_.any(kSpringSlip)) deflection += kSlipShare * a_[kSpringSlip] * (x[kSlip + side] - d);
  return -k * deflection;
}

double Plant::spring_energy(std::size_t side, const State& x) const {
  const Side& s = f_.side[side];
  const double d = x[kStroke + side] - s.rest_angle_rad, e = x[kSlip + side];
  const double k = d > 0 ? s.stiffness_positive_Nm_rad : s.stiffness_negative_Nm_rad;
  return k *
         (d * d / 2 + hardening_energy(d, a_[kSpringHardening]) + kSlipShare * a_[kSpringSlip] * (e * e - d * d) / 2);
}

double Plant::stroke_torque(const State& x, std::size_t side, double current_A, const Slow& slow, State& rate) const {
  const Side& s = f_.side[side];
  const double n = s.motor.gear_ratio, stroke = x[kStroke + side], stroke_rate = x[kStrokeRate + side];
  const bool play = a_.any(kGearBacklash);
  const double turning = play ? x[kRotorRate + side] : stroke_rate;  // rotor rate over gear ratio
  double torque_constant = slow.torque_constant_Nm_A[side];
  if (a_.any(kMagnetSaturation))
    torque_constant /= 1 + kSaturation * a_[kMagnetSaturation] * std::pow(current_A / kSaturates_A, 2);
  double motor = n * torque_constant * current_A;
  if (has_friction) {
    motor -= (1 - s.motor.efficiency) * std::abs(motor) * smooth_sign(turning, kGearLossOver_rad_s);
    motor -=
        n * s.motor.friction_Nm * smooth_sign(turning, kFrictionOver_rad_s) + s.motor.damping_Nm_s * n * n * turning;
  }
  if (a_.any(kCoulombFriction)) {
    // bristles that are soft enough for the step
    const double z = x[kBristle + side];
    rate[kBristle + side] = bristle_rate(turning, z);
    motor += bristle_torque(z, a_[kCoulombFriction]);
  }
  if (a_.any(kMotorCogging))
    motor -= kCogging_Nm * a_[kMotorCogging] * n *
             std::sin(kCoggingSteps * n * (play ? x[kRotor + side] : stroke) + a_.cogging_phase_rad[side]);
  double torque = motor;
  if (play) {
    const double contact = backlash_torque(x[kRotor + side] - stroke, turning - stroke_rate, a_[kGearBacklash]);
    rate[kRotor + side] = turning;
    rate[kRotorRate + side] = (motor - contact) / (n * n * s.motor.rotor_inertia_kg_m2);
    torque = contact;
  }
  torque += spring_torque(side, x, slow.stiffness[side]);
  if (a_.any(kSpringSlip)) rate[kSlip + side] = clamp_rate(stroke_rate, x[kSlip + side]);
  if (slow.extra_damping != 0)
    torque -= slow.extra_damping * 2 * std::sqrt(s.stiffness_positive_Nm_rad * 2.7e-7) * stroke_rate;
  torque += hinge_torque(s.stroke, stroke, stroke_rate, kStrokeStop, kStopLoss, 0, 0);
  return torque;
}

}  // namespace flappy::blind::b
