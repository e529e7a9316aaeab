// A block: kLanes flappers next to each other, one row for each number of a flapper. It is the unit of work: a block steps a whole control period
// with its state in registers and L1 before the next block starts, and blocks do not depend on each other.
#pragma once

#include <cstdint>

#include "model/flapper.hpp"
#include "model/wing_beat.hpp"

namespace flappy::sim {

inline namespace FLAPPY_ISA {

/// Voltages of the motors, held between driver updates.
template <class T>
struct Voltages {
  T left_V, right_V;
};

/// Inputs, limits and voltages of a flapper between its control updates, as rows.
template <class T>
struct Drive {
  model::WingBeat<T> input;  // as commanded
  model::WingBeat<T> limit;  // bounds of |input|
  Voltages<T> voltages;
};

}  // namespace FLAPPY_ISA

/// Number of flappers in a block: a row fills one cache line.
template <class T>
inline constexpr int kLanes = 64 / sizeof(T);

inline constexpr int kParameterRows = model::kRows<model::Parameters>;
inline constexpr int kStateRows = model::kRows<model::State>;
inline constexpr int kDriveRows = model::kRows<Drive>;

/// Status bit of a flapper whose voltages were set directly and stay, while others have those of their wing beat. It is
/// kept in the word of Status, because a row of its own would make every flapper larger than 2 kB.
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
