// The drive, from commanded voltages to the stroke hinges: driver, battery, wiring, windings, gears. Inductance is
// neglected (0.1 mH settle within 10 us); friction, damping and inertia are part of the hinge:
//   i = (V - K N psidot) / R,  torque behind the gear = N eta K i
#pragma once

#include <array>
#include <vector>

#include "lab/blind/c/c_effects.hpp"
#include "lab/blind/c/c_random.hpp"
#include "lab/blind/c/c_robot_parameters.hpp"

namespace flappy::blind::c {

inline constexpr double kCopper_1_K = 0.00393;  ///< temperature coefficient of copper at 20 degC, IEC 60028

struct Inputs {
  double amplitude_V = 0, difference_V = 0, bias_V = 0, split_cycle = 0;
};

/// Limits the inputs to the ranges that the driver accepts.
Inputs clipped(Inputs inputs, const RobotParameters& parameters);
/// Voltages of the left and the right motor; `phase`: of the beat, from 0 to 1.
std::array<double, 2> beat_voltages(const Inputs& inputs, double phase, const RobotParameters& parameters);

class Drive {
 public:
  static constexpr double kBattery_V = 18.5;

  Drive(const RobotParameters& parameters, const Magnitudes& magnitudes, std::uint64_t seed, std::size_t flight);

  /// Hands the driver new voltages (V; left, right), which act after its delay and jitter.
  void command(double now_s, const std::array<double, 2>& voltages);
  /// Torques behind the gears (Nm; left, right) for the next step, at these stroke angles and rates.
  std::array<double, 2> torques(double now_s, double step_s, const std::array<double, 2>& angles,
                                const std::array<double, 2>& rates);
  /// Speed of the torso through the air, which cools the motors.
  void fan(double airspeed_m_s);
  const std::array<double, 2>& currents() const { return currents_; }
  /// Voltages at the motors, after all losses.
  const std::array<double, 2>& voltages() const { return voltages_; }
  /// Behind the battery's losses, and before the drivers.
  double battery_V() const { return battery_V_; }

 private:
  struct Update {
    double from_s;
    std::array<double, 2> voltages;
  };

  const RobotParameters* parameters_;
  double bridge_, slew_, delay_, heating_, sag_, ripple_, hunting_, jitter_s_;
  std::array<double, 2> gear_phase_{};
  double task_phase_, hunting_phase_;
  Random random_;
  std::vector<Update> waiting_;
  std::array<double, 2> applied_{}, slewed_{}, voltages_{}, currents_{}, warmth_K_{};
  double full_V_, battery_V_, charge_As_ = 0, load_A_ = 0, airspeed_m_s_ = 0;
};

/// Phase of the slow task of a robot, from 0 to 1.
double task_phase(std::uint64_t seed);
/// Current for a voltage less the back-EMF, through a winding and, where `bridge` is not 0, a lossy bridge.
double winding_A(double drive_V, double command_V, double resistance_ohm, double bridge, double battery_V);

}  // namespace flappy::blind::c
