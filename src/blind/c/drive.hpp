// What is between the commanded voltages and the stroke hinges: driver, battery, wiring, windings and gears.
//
//   i = (V - K N psidot) / R,  torque behind the gear = N eta K i;  friction, damping and inertia are those of the hinge
//
// The windings' inductance is left out: with some 0.1 mH it would settle within 10 us.
#pragma once

#include <array>
#include <vector>

#include "blind/c/effects.hpp"
#include "blind/c/figures.hpp"
#include "blind/c/random.hpp"

namespace flappy::blind::c {

/// The inputs of the wing beat.
struct Inputs {
  double amplitude_V = 0, difference_V = 0, bias_V = 0, split_cycle = 0;
};

/// Clipped to what the driver takes.
Inputs clipped(Inputs inputs, const Figures& figures);
/// Voltages of the left and right motor at a phase of the beat from 0 to 1.
std::array<double, 2> beat_voltages(const Inputs& inputs, double phase, const Figures& figures);

class Drive {
 public:
  static constexpr double kBattery_V = 18.5;

  Drive(const Figures& figures, const Sizes& sizes, std::uint64_t seed, std::size_t flight);

  /// The driver's update.
  void command(double now_s, const std::array<double, 2>& voltages);
  /// Torques behind the gears over the next step of `step_s`.
  std::array<double, 2> torques(double now_s, double step_s, const std::array<double, 2>& angles,
                                const std::array<double, 2>& rates);
  const std::array<double, 2>& currents() const { return currents_; }
  /// At the motors, after all losses.
  const std::array<double, 2>& voltages() const { return voltages_; }
  double battery_V() const { return battery_V_; }

 private:
  struct Update {
    double from_s;
    std::array<double, 2> voltages;
  };

  const Figures* figures_;
  double dead_zone_V_, pole_s_, delay_s_, heating_, sag_, eccentricity_, ripple_, shared_ohm_, jitter_s_;
  std::array<double, 2> gear_phase_{};
  Random random_;
  std::vector<Update> waiting_;
  std::array<double, 2> applied_{}, once_{}, twice_{}, voltages_{}, currents_{}, warmth_K_{};
  double battery_V_ = kBattery_V, charge_As_ = 0, load_A_ = 0, bus_A_ = 0;
};

}  // namespace flappy::blind::c
