// A block: kLanes flappers side by side, one row for each number of a flapper. It is the unit of work: one
// block steps a whole control period with its state in registers and L1 before the next block starts, and
// nothing in a block depends on another.
#pragma once

#include <cstdint>

#include "model/flapper.hpp"
#include "model/wing_beat.hpp"

namespace flappy::sim {

inline namespace FLAPPY_ISA {

/// At the motors, held between driver updates.
template <class T>
struct Voltages {
  T left_V, right_V;
};

/// What drives a flapper between its control updates, as rows.
template <class T>
struct Drive {
  model::WingBeat<T> input;  // as commanded
  model::WingBeat<T> limit;  // |input| is clipped to it
  Voltages<T> voltages;
};

}  // namespace FLAPPY_ISA

/// Flappers in a block: one cache line for each row.
template <class T>
inline constexpr int kLanes = 64 / sizeof(T);

inline constexpr int kParameterRows = model::kRows<model::Parameters>;
inline constexpr int kStateRows = model::kRows<model::State>;
inline constexpr int kDriveRows = model::kRows<Drive>;

/// Of a flapper whose voltages stay as they were set, where others have those of their wing beat: a bit beside those of Status, for
/// a row of its own would take every flapper beyond its 2 kB.
inline constexpr std::uint32_t kDirect = std::uint32_t{1} << 31;

template <class T>
struct alignas(64) Block {
  T parameters[kParameterRows][kLanes<T>];
  T state[kStateRows][kLanes<T>];
  T drive[kDriveRows][kLanes<T>];
  std::uint32_t phase[kLanes<T>];  // of the wing beat: fraction x 2^32
  std::uint32_t phase_per_update[kLanes<T>];
  std::uint32_t status[kLanes<T>];  // bits of Status, and kDirect
};

}  // namespace flappy::sim
