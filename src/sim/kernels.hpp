// What this program has compiled once for each instruction set, and which of it this processor runs.
#pragma once

#include <cstddef>
#include <string_view>

#include "sim/step.hpp"

/// Declares `kernel` as it is compiled for each instruction set (FLAPPY_ISA), and a table of all, `kernel`s, worst first.
#if defined(__aarch64__)
#define FLAPPY_KERNELS(Type, kernel) \
  inline namespace scalar {          \
  extern const Type kernel;          \
  }                                  \
  inline namespace neon {            \
  extern const Type kernel;          \
  }                                  \
  constexpr const Type* kernel##s[] = {&scalar::kernel, &neon::kernel}
#else
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
#endif

namespace flappy::sim {

/// The place of an instruction set in such tables, of the best one for an empty name; std::invalid_argument where this
/// processor has it not.
std::size_t place_of(std::string_view instruction_set);

/// What T's table has for an instruction set.
template <class T, class Single, class Double, std::size_t sets>
const auto& kernel_of(const Single* const (&singles)[sets], const Double* const (&doubles)[sets],
                      std::string_view instruction_set) {
  if constexpr (sizeof(T) == sizeof(float)) return *singles[place_of(instruction_set)];
  else return *doubles[place_of(instruction_set)];
}

/// The simulator's step, that of robots that are known by the beat, and that of vehicles with four angles a wing.
template <class T>
StepBlock<T> step_kernel(std::string_view instruction_set);
template <class T>
StepBlock<T> mean_step_kernel(std::string_view instruction_set);
template <class T>
StepBlock<T> jointed_step_kernel(std::string_view instruction_set);

}  // namespace flappy::sim
