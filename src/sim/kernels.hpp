// Selection of the code that this program has compiled once for each instruction set.
#pragma once

#include <cstddef>
#include <string_view>

#include "sim/step.hpp"

/// Declares `kernel` for each instruction set (FLAPPY_ISA), and a table `kernel`s of all, worst first.
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

/// Index of an instruction set in these tables; the best for an empty name. std::invalid_argument if the processor
/// lacks it.
std::size_t place_of(std::string_view instruction_set);

/// The element for an instruction set of T's table.
template <class T, class Single, class Double, std::size_t sets>
const auto& kernel_of(const Single* const (&singles)[sets], const Double* const (&doubles)[sets],
                      std::string_view instruction_set) {
  if constexpr (sizeof(T) == sizeof(float)) return *singles[place_of(instruction_set)];
  else return *doubles[place_of(instruction_set)];
}

/// Steps of vehicles with motors, of beat-averaged robots, and of vehicles with articulated wings.
template <class T>
StepBlock<T> step_kernel(std::string_view instruction_set);
template <class T>
StepBlock<T> beat_averaged_step_kernel(std::string_view instruction_set);
template <class T>
StepBlock<T> jointed_step_kernel(std::string_view instruction_set);

}  // namespace flappy::sim
