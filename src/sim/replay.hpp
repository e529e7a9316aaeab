// Windows of recorded flights, flown again: every window is a lane with its own start and recorded voltages, without a
// driver. Its result does not depend on other windows or the number of threads.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "flappy/batch.hpp"

namespace flappy::sim {

/// Voltages of the two motors; each pair holds until the next, the first also before its time, the last for ever.
struct VoltageScript {
  std::vector<double> t_s, left_V, right_V;
};

/// Means of a script over each of `steps` steps, the first of which begins at `begin_s`.
void step_voltages(const VoltageScript& script, double begin_s, double step_s, std::size_t steps,
                   std::vector<double>& left_V, std::vector<double>& right_V);

struct ReplayWindow {
  double start_s = 0;
  const model::Vehicle* vehicle = nullptr;
  const VoltageScript* voltages = nullptr;
};

/// The recorded state of a window's flapper at a time: its torso, and its wings where they are known.
using RecordedState = std::function<FlapperState(std::size_t window, double t_s)>;

struct ReplayOptions {
  double step_s = kDefaultStep_s;
  int threads = 0;  ///< 0: one for each processor
  World world;
  std::string instruction_set;  ///< as in BatchOptions
  /// Spin-up, which brings the wings into phase: they start at rest this many steps before a window and move with the
  /// voltages of that time, while the torso follows its record. Every `carry_steps` it is put back onto it, except its
  /// body rate, corrected only by the turn in excess of the record: no gyro resolves its jumps when wings meet their
  /// stops. 0: recorded wings.
  int spin_up_steps = 0;
  int carry_steps = 10;  ///< 0: the torso stays welded at the window's first state, which leaves the wings wrong
  /// Share of a stroke's deviation from its record that is corrected whenever the torso is, where the record has the
  /// stroke (NaN elsewhere). Its rate is corrected as in an alpha-beta filter, beta = alpha^2 / (2 - alpha) (Benedict
  /// and Bordner 1962). Rotations follow by themselves.
  double stroke_share = 0;
};

struct Replayed {
  std::vector<FlapperState> states;  ///< at the checkpoints
  std::uint32_t status = 0;          ///< bits of Status
};

/// Flies every window to its checkpoints: steps after its start, ascending; each rounds, as a call of Batch::step does.
/// `recorded` is called from several threads, for a window's start and its spin-up. A voltage that changes within a
/// step counts by its share. Throws std::invalid_argument for invalid options or checkpoints.
std::vector<Replayed> replay(const std::vector<ReplayWindow>& windows, const std::vector<int>& checkpoints,
                             const RecordedState& recorded, const ReplayOptions& options);

}  // namespace flappy::sim
