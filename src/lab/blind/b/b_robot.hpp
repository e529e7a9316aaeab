// Integrates a robot's state, and models its drivers and slow states. Classical Runge-Kutta at 50 us. Windings are
// faster (L / R = 16 us), so currents are exact, as in exponential integrators, for a back voltage linear over a (half)
// step:
//
//   i(c h) = i e + V/R (1 - e) - N K / R (u_0 (1 - e) + (u_1 - u_0) (1 - (1 - e) tau / (c h)))
//   e = exp(-c h / tau), tau = L / R
//
// Half the step moves a free robot by a few micrometres after four beats; the test has the values.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "lab/blind/b/b_laws.hpp"
#include "lab/blind/b/b_random.hpp"
#include "lab/blind/b/plant.hpp"

namespace flappy::blind::b {

inline constexpr int kStepsPerTick = 20;
inline constexpr double kTick_s = 1e-3;  ///< period of the drivers' updates
inline constexpr double kStep_s = kTick_s / kStepsPerTick;

/// Gusts of the wind's spectrum: cosines in bins of frequency, each with a random phase.
class Gusts {
 public:
  explicit Gusts(Random random);
  /// m/s: along the mean wind, across, up; of magnitude 1.
  Vector3d at(double time_s) const;

 private:
  static constexpr std::size_t kLines = 40;
  struct Line {
    double amplitude_m_s, rate_rad_s, phase_rad;
  };
  std::array<std::array<Line, kLines>, 3> line_;
};

struct Beat {
  double amplitude_V = 0, difference_V = 0, bias_V = 0, split_cycle = 0;
};

/// Factors on the pilot's proportional gains, which somebody tunes between sessions.
struct PilotGains {
  double position = 1, height = 1, velocity = 1, climb = 1;
  double roll = 1, pitch = 1, yaw = 1, roll_rate = 1, pitch_rate = 1, yaw_rate = 1;
};

/// Voltages of the drivers (left, right) at a time since the start of any beat: two half periods of a cosine, whose
/// durations differ by the split cycle.
std::array<double, 2> waveform(const RobotParameters& parameters, const Beat& beat, double time_s);

/// Motion of the torso at the start of each step.
struct Path {
  std::vector<std::array<double, 13>> pose;  ///< the first 13 elements of a State, up to kVelocity
  std::vector<Twist> acceleration;
};

class Robot {
 public:
  Robot(RobotParameters parameters, const EffectMagnitudes& effect_magnitudes, const Surroundings& room,
        std::uint64_t seed, std::uint64_t flight);

  /// Places the robot at rest, with all hinge angles 0.
  void put(const Vector3d& position_m, double heading_rad);
  /// Begins a tick and commands the drivers' voltages (V; left, right).
  void drive(const std::array<double, 2>& voltage_V);
  /// Begins a tick at `time_s` with the inputs of a beat. The driver takes a voltage from their waveform and holds it
  /// for the file's driver.hold_s.
  void drive(const Beat& beat, double time_s);
  void step(double h = kStep_s);
  /// Advances one step with the torso led along a path; `at`: index of the step in the path.
  void led_step(const Path& path, std::size_t at);
  /// Accelerations of a free torso in the present state.
  Felt felt_now() const;

  const State& state() const { return x_; }
  State& state() { return x_; }
  const Plant& plant() const { return plant_; }
  Plant& plant() { return plant_; }
  const Surroundings& room() const { return room_; }
  const std::array<double, 2>& current_A() const { return current_; }
  /// Motion and accelerations at the start of the last step.
  const Felt& felt() const { return felt_; }
  Vector3d position() const { return {x_[0], x_[1], x_[2]}; }
  Vector3d rate() const { return {x_[kRate], x_[kRate + 1], x_[kRate + 2]}; }
  Vector3d velocity_W() const {
    return rotation_matrix(x_) * Vector3d(x_[kVelocity], x_[kVelocity + 1], x_[kVelocity + 2]);
  }
  /// Supply voltage over its nominal value.
  double supply() const { return supply_; }
  /// Voltages at the motors during the last step.
  const std::array<double, 2>& voltage_V() const { return applied_; }
  /// How the robot crashed; empty while it flies.
  std::string crash(bool may_tumble) const;

 private:
  void advance_slow();
  void set_voltages(double h);
  void integrate(double h, const Prescribed* from, const Prescribed* to);
  std::array<double, 2> currents(double h, const std::array<double, 2>& from, const std::array<double, 2>& to) const;
  std::array<double, 2> back(const State& x) const;

  Plant plant_;
  Surroundings room_;
  Gusts gusts_;
  State x_{};
  std::array<double, 2> current_{}, wanted_{}, applied_{};
  std::array<RunningMean, 2> mean_;
  std::optional<Beat> beat_;  ///< what the driver's waveform is made of; none: voltages
  double clock_s_ = 0, tick_begins_s_ = 0, in_tick_s_ = 0, next_hold_s_ = -1e9;
  std::vector<std::pair<double, std::array<double, 2>>> history_;  ///< commanded voltages, for the command delay
  Slow slow_;
  Felt felt_;
  std::array<Heat, 2> heat_;
  std::array<double, 2> heat_J_{};
  Sag sag_;
  double supply_ = 1, load_As_ = 0;
  long tick_ = 0;
  int steps_ = 0;
};

}  // namespace flappy::blind::b
