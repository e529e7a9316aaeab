// The step of a block, compiled once for each instruction set.
#pragma once

#include "flappy/vehicle.hpp"
#include "flappy/world.hpp"
#include "sim/beat_averaged_block.hpp"
#include "sim/block.hpp"

namespace flappy::sim {

template <class T>
struct JointedRows;

/// Settings of a step; the same for all blocks of a batch.
struct StepPlan {
  double step_s;
  int steps_per_update;  // physics steps between updates of the driver
  double gravity_m_s2, ground_z_m, ceiling_z_m;
  const Wall* walls;
  std::size_t wall_count;
  const Shape* shapes;
  std::size_t shape_count;
};

/// All flappers of a block have the same points, with their own constants and memory.
template <class T>
struct ContactBlock {
  int points = 0;
  const model::ContactPoint::Body* on = nullptr;  // body of each point
  const T* rows = nullptr;                        // model::ContactConstants, point after point
  T* memory = nullptr;                            // model::Bristle, point after point
  int stride = 0;                                 // distance of two rows
};

template <class T>
struct alignas(64) MotorRows {
  T rows[4][kLanes<T>];        // left, then right: 1 / R, and N K / R, the current of the back-EMF per stroke rate
  double energy_J[kLanes<T>];  // of both motors, since a reset; does not influence motion
};

/// Effects in force in a block, and their parameters: rows as in the registry, kLanes wide; further inputs of a kernel.
template <class T>
struct BlockEffects {
  std::uint64_t set = 0;  // bit i: effect i of the registry
  const T* rows = nullptr;
  std::uint64_t kept = 0;  // effects with memory in the batch: their rows follow one another in the registry's order
  T* states = nullptr;
  /// Voltages in place of the driver's, or null: two rows, left and right, for every driver update.
  const T* voltages_V = nullptr;
  /// Every step writes kMeterRows rows here; null: none. Requires `rows`, for any set.
  T* meter = nullptr;
  /// Energy meter, or null.
  MotorRows<T>* motors = nullptr;
  /// Points of contact, if there are any. Requires `rows`, for any set.
  ContactBlock<T> contact;
  BeatAveragedRows<T> beat_averaged;
  const JointedRows<T>* jointed = nullptr;
};

/// Rows of `meter`: the source's voltage as a share of its nominal one, currents of the left and of the right motor, A.
inline constexpr int kMeterRows = 3;

/// Memory of the next block, which is prefetched during the steps of this one.
struct Ahead {
  struct Part {
    const void* at;
    std::size_t bytes;
  } parts[4] = {};
};

/// Advances all lanes of a block by `steps` physics steps. `first`: number of the first step, counted in the batch.
template <class T>
using StepBlock = void (*)(Block<T>&, BlockEffects<T>, const StepPlan&, std::int64_t first, int steps, const Ahead&);

template <class T>
struct Kernel {
  const char* instruction_set;
  StepBlock<T> step;
};

}  // namespace flappy::sim
