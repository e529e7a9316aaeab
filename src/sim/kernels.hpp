// The kernels this program was built with, and which of them this processor runs.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "sim/step.hpp"

namespace flappy::sim {

struct KernelSet {
  Kernel<float> single;
  Kernel<double> twice;

  template <class T>
  const Kernel<T>& of() const {
    if constexpr (sizeof(T) == sizeof(float)) return single;
    else return twice;
  }
};

/// All that this processor can run, best last.
const std::vector<KernelSet>& kernels();
/// The named one, the best one for an empty name; std::invalid_argument where this processor has it not.
const KernelSet& kernel_named(std::string_view instruction_set);

}  // namespace flappy::sim
