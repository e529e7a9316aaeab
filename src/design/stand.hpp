// A robot on a stand: held in still air, driven at amplitudes from a quarter of what its driver gives to all of it, then
// at the amplitude of hover with each input to both sides. Means over whole beats, after the beat has settled.
#pragma once

#include <array>
#include <vector>

#include "design/robot.hpp"

namespace flappy::design {

/// One amplitude.
struct StandPoint {
  double amplitude_V = 0;
  double lift_N = 0;                  ///< along z of B
  std::array<double, 3> moment_Nm{};  ///< about the centre of mass, in B
  double power_W = 0;                 ///< electrical, of both motors
  double winding_C = 0;               ///< temperature of the hotter winding after Workshop::flight_s
  double current_A = 0;               ///< largest, of either motor
  double stroke_rad = 0;              ///< largest angle from the middle, of either wing
  double gear_Nm = 0;                 ///< largest torque of the gear on a wing
  double stop_J = 0;                  ///< largest energy of rotation with which a wing can meet its stop
};

enum class Axis { roll, pitch, yaw };
inline constexpr std::size_t kAxes = 3;

struct Stand {
  std::vector<StandPoint> sweep;  ///< by amplitude
  bool hovers = false;            ///< the lift reaches the weight; else what follows is 0
  StandPoint hover;               ///< at the amplitude of hover
  double lift_per_V_N = 0;        ///< about it
  /// Moments per input (V, V, share of a beat), [axis of the input][axis of the moment].
  std::array<std::array<double, kAxes>, kAxes> moment_per_input{};
  std::array<double, kAxes> authority_Nm{};  ///< moment at the limit of the input, about its own axis
  double most_lift_N = 0;                    ///< within the motors' limits of current and temperature, and the voltage
};

/// `limits`: what the robot's motors stand. Flies on this thread; adds the flapper-seconds flown to `flown_s`.
Stand measure(const Robot& robot, const Workshop& workshop, double step_s, double gravity_m_s2, double& flown_s);

/// Temperature of a winding after `seconds` of a current: two bodies, winding and housing,
///   T = T0 + I^2 R (1 + a (T - 25)) (Rw (1 - exp(-t/tw)) + Rh (1 - exp(-t/th)))        a = 0.0039 for copper, R at 25
/// degrees. The losses are those of the end, which are the largest. Infinite where they grow faster than the cooling.
double winding_C(double current_rms_A, const MotorType& motor, double ambient_C, double seconds);

}  // namespace flappy::design
