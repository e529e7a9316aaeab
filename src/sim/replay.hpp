// Pieces of recorded flights, flown once more: every window is a lane that starts from its own state and takes its own
// recorded voltages, with no driver. A window's bytes depend on itself alone: not on its neighbours or the threads.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "flappy/batch.hpp"

namespace flappy::sim {

/// Voltages at the two motors; each pair holds until the next, the first from ever, the last for ever.
struct VoltageScript {
  std::vector<double> t_s, left_V, right_V;
};

/// Means of a script over `steps` steps from a time on.
void step_voltages(const VoltageScript& script, double begin_s, double step_s, std::size_t steps,
                   std::vector<double>& left_V, std::vector<double>& right_V);

struct ReplayWindow {
  double start_s = 0;
  const model::Vehicle* vehicle = nullptr;
  const VoltageScript* voltages = nullptr;
};

/// The state of a window's flapper at a time: its torso, and its wings where they are known.
using RecordedState = std::function<FlapperState(std::size_t window, double t_s)>;

struct ReplayOptions {
  double step_s = kDefaultStep_s;
  int threads = 0;  ///< 0: one for each processor
  World world;
  std::string instruction_set;  ///< as in BatchOptions
  /// How the wings come into phase: they start at rest this many steps before a window does, and fly the voltages of
  /// that time while the torso is carried along its recorded motion: every `carry_steps` it is put back onto it, but for
  /// its body rate, from which only the turn that it made too much is taken back: no gyro resolves how the rate jumps
  /// where wings meet their stops, so within that time the flapper's own motion stays. 0: the recorded wings.
  int spin_up_steps = 0;
  int carry_steps = 10;  ///< 0: the torso stays welded as it is when the window starts, which leaves the wings wrong
  /// Of what a stroke is off its record where the record has one (not a number elsewhere), the share that is taken back
  /// whenever the torso is; its rate is corrected as in an alpha-beta filter, beta = alpha^2 / (2 - alpha) (Benedict and
  /// Bordner 1962). Rotations follow by themselves.
  double stroke_share = 0;
};

/// What became of a window.
struct Replayed {
  std::vector<FlapperState> states;  ///< at the checkpoints
  std::uint32_t status = 0;          ///< frozen or touched something
};

/// Flies every window to its checkpoints: steps after its start, ascending. `recorded` is called from several threads, at
/// the start of a window and, where it is carried, before. Every checkpoint rounds, as every call of Batch::step does. A
/// voltage that changes within a step counts by its share of it.
/// std::invalid_argument where options or checkpoints make no sense.
std::vector<Replayed> replay(const std::vector<ReplayWindow>& windows, const std::vector<int>& checkpoints,
                             const RecordedState& recorded, const ReplayOptions& options);

}  // namespace flappy::sim
