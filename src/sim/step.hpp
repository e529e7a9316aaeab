// The step of a block, compiled once for each instruction set.
#pragma once

#include "flappy/vehicle.hpp"
#include "flappy/world.hpp"
#include "sim/block.hpp"
#include "sim/mean_block.hpp"

namespace flappy::sim {

/// Of vehicles with four angles a wing (jointed_block.hpp).
template <class T>
struct JointedRows;

/// How a batch advances; the same for all of its blocks.
struct StepPlan {
  double step_s;
  int steps_per_update;  // physics steps between updates of the driver
  double gravity_m_s2, ground_z_m, ceiling_z_m;
  const Wall* walls;
  std::size_t wall_count;
  const Shape* shapes;
  std::size_t shape_count;
};

/// Points of contact of the flappers in a block: the same points, each flapper with figures and memory of its own.
template <class T>
struct ContactBlock {
  int points = 0;
  const model::ContactPoint::Body* on = nullptr;  // the body that each is on
  const T* rows = nullptr;                        // of model::ContactConstants, point after point
  T* memory = nullptr;                            // of model::Bristle, point after point
  int stride = 0;                                 // numbers of a row
};

/// What the motors of a block draw.
template <class T>
struct alignas(64) MotorRows {
  T rows[4][kLanes<T>];        // of left, then right: 1 / R, and N K / R, the back-EMF's current per stroke rate
  double energy_J[kLanes<T>];  // of both, since a reset; no part of what moves
};

/// Effects in force in a block, and their parameters: rows as in the registry, kLanes wide.
template <class T>
struct BlockEffects {
  std::uint64_t set = 0;  // bit i: entry i of the registry
  const T* rows = nullptr;
  std::uint64_t kept = 0;  // effects whose memory the batch keeps: its rows follow one another in the registry's order
  T* states = nullptr;
  /// Voltages in place of the driver's, where there are any: two rows, left and right, for every update from the first on.
  const T* voltages_V = nullptr;
  /// Where every step is to write what its motors drew, kMeterRows rows, if anywhere. Needs `rows`, whatever the set.
  T* meter = nullptr;
  /// Where energy is metered, if it is.
  MotorRows<T>* motors = nullptr;
  /// Of robots that touch the world with points. Needs `rows`, whatever the set.
  ContactBlock<T> contact;
  /// Of robots that are known by the beat.
  MeanRows<T> mean;
  /// Of vehicles with four angles a wing.
  const JointedRows<T>* jointed = nullptr;
};

/// Rows of a meter: the source's voltage as a share of its nominal one, currents of the left and of the right motor, A.
inline constexpr int kMeterRows = 3;

/// Memory that the next block will need, to be fetched while this one steps.
struct Ahead {
  struct Part {
    const void* at;
    std::size_t bytes;
  } parts[4] = {};
};

/// Advances all lanes of a block by `steps` physics steps, of which the first is number `first` of the batch.
template <class T>
using StepBlock = void (*)(Block<T>&, BlockEffects<T>, const StepPlan&, std::int64_t first, int steps, const Ahead&);

template <class T>
struct Kernel {
  const char* instruction_set;
  StepBlock<T> step;
};

}  // namespace flappy::sim
