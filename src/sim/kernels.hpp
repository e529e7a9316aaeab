// What this program has compiled once for each instruction set, and which of it this processor runs.
#pragma once

#include <cstddef>
#include <string_view>

#include "sim/step.hpp"

/// Declares `kernel` as it is compiled for each instruction set (FLAPPY_ISA), and a table of all, `kernel`s, worst first.
#define FLAPPY_KERNELS(Type, kernel) \
  inline namespace scalar {          \
  extern const Type kernel;          \
  }                                  \
  inline namespace v2 {              \
  extern const Type kernel;          \
  }                                  \
  inline namespace v3 {              \
  extern const Type kernel;          \
  }                                  \
  inline namespace v4 {              \
  extern const Type kernel;          \
  }                                  \
  constexpr const Type* kernel##s[] = {&scalar::kernel, &v2::kernel, &v3::kernel, &v4::kernel}

namespace flappy::sim {

/// The place of an instruction set in such tables, of the best one for an empty name; std::invalid_argument where this
/// processor has it not.
std::size_t place_of(std::string_view instruction_set);

/// What T's table has for an instruction set.
template <class T, class Single, class Double>
const auto& kernel_of(const Single* const (&singles)[4], const Double* const (&doubles)[4],
                      std::string_view instruction_set) {
  if constexpr (sizeof(T) == sizeof(float)) return *singles[place_of(instruction_set)];
  else return *doubles[place_of(instruction_set)];
}

/// The simulator's step.
template <class T>
StepBlock<T> step_kernel(std::string_view instruction_set);

}  // namespace flappy::sim
