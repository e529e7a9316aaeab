// What a clamped robot of family C is driven with: 37 points over three runs, each held for two seconds, then a sweep.
#pragma once

#include "lab/blind/c/c_pilot.hpp"

namespace flappy::blind::c {

/// Amplitude over that of hover, and shares of the declared limits of the other inputs.
struct BenchPoint {
  double amplitude, difference, bias, split_cycle;
  bool filmed;
};

class BenchProgramme {
 public:
  static constexpr double kPoint_s = 2, kSweep_s = 2.5;

  BenchProgramme(const Assignment& a, std::size_t run, const RobotParameters& parameters);
  const std::vector<BenchPoint>& points() const { return points_; }
  double lasts_s() const { return kPoint_s * static_cast<double>(points_.size()) + kSweep_s; }
  /// Zero before t = 0.
  Inputs inputs(double t_s) const;
  bool filmed(double t_s) const;

 private:
  struct Tone {
    double frequency_Hz, phase;
  };
  BenchPoint sweep(double t_s) const;

  std::size_t run_;
  const RobotParameters* parameters_;
  std::vector<BenchPoint> points_;
  std::vector<double> levels_;                ///< amplitudes of the third sweep
  std::array<std::array<Tone, 2>, 3> tones_;  ///< of its other inputs
};

}  // namespace flappy::blind::c
