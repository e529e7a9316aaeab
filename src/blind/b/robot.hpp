// A robot that moves: its state over time, its drivers and what changes slowly in it.
//
// The mechanics are integrated by Runge and Kutta's classical method at 50 us. Windings are faster than that (L / R = 16 us), so their
// currents are solved exactly for a back voltage that is linear over a step or half of it, as exponential integrators do:
//
//   i(c h) = i e + V/R (1 - e) - N K / R (u_0 (1 - e) + (u_1 - u_0) (1 - (1 - e) tau / (c h))),   e = exp(-c h / tau), tau = L / R
//
// Halving the step from 50 us changes where a free robot is after four beats by a few micrometres; the test has the figures.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "blind/b/plant.hpp"
#include "blind/b/random.hpp"

namespace flappy::blind::b {

inline constexpr int kStepsPerTick = 20;
inline constexpr double kTick_s = 1e-3;  ///< the drivers' update
inline constexpr double kStep_s = kTick_s / kStepsPerTick;

/// Inputs of the wing beat.
struct Beat {
  double amplitude_V = 0, difference_V = 0, bias_V = 0, split_cycle = 0;
};

/// The drivers' waveform at a time since a beat began: a cosine of one half period, then of the other.
std::array<double, 2> waveform(const Figures& figures, const Beat& beat, double time_s);

/// The torso as it went, at each step.
struct Path {
  std::vector<std::array<double, 13>> pose;  ///< the first places of a state
  std::vector<Twist> acceleration;
};

class Robot {
 public:
  Robot(Figures figures, const Ailments& ailments, const Surroundings& room, std::uint64_t seed, std::uint64_t flight);

  /// At rest, wings hanging, at a place and heading.
  void put(const Vector3d& position_m, double heading_rad);
  /// Begins a tick with these voltages at the drivers.
  void drive(const std::array<double, 2>& voltage_V);
  /// One step within the tick.
  void step(double h = kStep_s);
  /// The same with the torso led along a path, of which this is step `at`.
  void led_step(const Path& path, std::size_t at);
  /// Rates of the present state.
  Felt felt_now() const;

  const State& state() const { return x_; }
  State& state() { return x_; }
  const Plant& plant() const { return plant_; }
  Plant& plant() { return plant_; }
  const Surroundings& room() const { return room_; }
  const std::array<double, 2>& current_A() const { return current_; }
  /// What was felt at the beginning of the last step.
  const Felt& felt() const { return felt_; }
  Vector3d position() const { return {x_[0], x_[1], x_[2]}; }
  Vector3d rate() const { return {x_[kRate], x_[kRate + 1], x_[kRate + 2]}; }
  Vector3d velocity_W() const {
    return rotation_matrix(x_) * Vector3d(x_[kVelocity], x_[kVelocity + 1], x_[kVelocity + 2]);
  }
  /// Of the source, over nominal.
  double supply() const { return supply_; }
  /// Voltage at a motor during the last step.
  const std::array<double, 2>& voltage_V() const { return applied_; }
  /// How it crashed; empty where it flies.
  std::string crash(bool may_tumble) const;

 private:
  void advance_slow();
  void set_voltages(double h);
  void integrate(double h, const Prescribed* from, const Prescribed* to);
  std::array<double, 2> currents(double h, const std::array<double, 2>& from, const std::array<double, 2>& to) const;
  std::array<double, 2> back(const State& x) const;

  Plant plant_;
  Surroundings room_;
  Random gusts_;
  State x_{};
  std::array<double, 2> current_{}, wanted_{}, applied_{}, pole_1_{}, pole_2_{};
  std::vector<std::array<double, 2>> history_;  ///< of voltages, where they arrive late
  Slow slow_;
  Felt felt_;
  std::array<double, 2> winding_K_{}, housing_K_{}, heat_J_{};
  double supply_ = 1, charge_As_ = 0, relaxed_A_ = 0, load_As_ = 0;
  Vector3d gust_ = Vector3d::Zero();
  long tick_ = 0;
  int steps_ = 0;
};

}  // namespace flappy::blind::b
