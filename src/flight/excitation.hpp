// Excitation: offsets to the controller's output that make a flight more informative about its vehicle. [[excitation]]
// tables:
//   kind = "step"       input, start_s, duration_s, height
//   kind = "sweep"      input, start_s, duration_s, from_hz, to_hz, amplitude: a sine whose frequency grows linearly
//   kind = "multisine"  input, from_hz, to_hz, count, rms, period_s; start_s and duration_s if not the whole flight:
//                         sum of rms sqrt(2/count) cos(2 pi h_k t/period_s - pi k (k-1)/count)      k = 1 .. count
//   kind = "script"     file: t_s, amplitude_V, difference_V, bias_V, split_cycle; each row holds until the next
// Multisine (Schroeder 1970): rms over a period. The m-th of M in a flight has only harmonics with h mod M = m, evenly
// spread from from_hz to to_hz, so over a period no two multisines correlate, and no two responses of a linear system.
#pragma once

#include <vector>

#include "flappy/batch.hpp"
#include "io/config.hpp"

namespace flappy::flight {

struct Wave {
  enum class Kind { step, sweep, multisine } kind = Kind::step;
  int input = 0;  ///< index of the wing-beat input, in the order of sim::Input
  double start_s = 0, duration_s = 0;
  double amplitude = 0;  ///< height of the step, or amplitude of each sine
  double from_hz = 0, to_hz = 0;
  double period_s = 0;
  std::vector<int> harmonics;
};

struct Script {
  std::vector<double> t_s;
  std::vector<sim::Input> input;
};

class Excitation {
 public:
  sim::Input constant;
  std::vector<Wave> waves;
  std::vector<Script> scripts;

  /// The offset at time `t_s` since the start of the flight. The same bits on every processor.
  sim::Input at(double t_s) const;
  bool changes() const { return !waves.empty() || !scripts.empty(); }
  bool acts() const;
};

/// Reads [constant_input] and [[excitation]]. `flight_s`: default duration of a multisine. Throws io::InputError.
Excitation read_excitation(const io::Table& root, double flight_s);

}  // namespace flappy::flight
