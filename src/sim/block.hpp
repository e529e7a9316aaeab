// A block: kLanes flappers next to each other, one row for each number of a flapper. The unit of work: a block steps a
// whole control period with its state in registers and L1, independent of other blocks.
#pragma once

#include <cstdint>

#include "model/flapper.hpp"
#include "model/wing_beat.hpp"

namespace flappy::sim {

inline namespace FLAPPY_ISA {

template <class T>
struct Voltages {
  T left_V, right_V;
};

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

/// Status bit: voltages were set directly and stay. In the word of Status, because a row would exceed 2 kB per flapper.
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
