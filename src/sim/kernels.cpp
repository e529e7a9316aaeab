#include "sim/kernels.hpp"

#include <algorithm>
#include <stdexcept>

#include "flappy/batch.hpp"

namespace flappy::sim {

FLAPPY_KERNELS(Kernel<float>, kernel_float);
FLAPPY_KERNELS(Kernel<double>, kernel_double);
FLAPPY_KERNELS(Kernel<float>, mean_float);
FLAPPY_KERNELS(Kernel<double>, mean_double);
FLAPPY_KERNELS(Kernel<float>, jointed_float);
FLAPPY_KERNELS(Kernel<double>, jointed_double);

std::vector<std::string> instruction_sets() {
#if defined(__aarch64__)
  const bool has[] = {true, true};  // NEON is part of it
#else
  // clang 14 does not know "x86-64-v2" and so on: the newest extensions of each level stand for it
  const bool has[] = {
      true, __builtin_cpu_supports("ssse3") && __builtin_cpu_supports("sse4.2") && __builtin_cpu_supports("popcnt"),
      __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi") &&
          __builtin_cpu_supports("bmi2"),
      __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512cd") &&
          __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl")};
#endif
  std::vector<std::string> names;
  for (std::size_t i = 0; i < std::size(has) && has[i]; ++i) names.emplace_back(kernel_floats[i]->instruction_set);
  return names;
}

std::string best_instruction_set() { return instruction_sets().back(); }

std::size_t place_of(std::string_view instruction_set) {
  static const std::vector<std::string> names = instruction_sets();
  if (instruction_set.empty()) return names.size() - 1;
  const auto at = std::ranges::find(names, instruction_set);
  if (at == names.end())
    throw std::invalid_argument("no instruction set \"" + std::string(instruction_set) + "\" on this processor");
  return static_cast<std::size_t>(at - names.begin());
}

template <class T>
StepBlock<T> step_kernel(std::string_view instruction_set) {
  return kernel_of<T>(kernel_floats, kernel_doubles, instruction_set).step;
}
template StepBlock<float> step_kernel<float>(std::string_view);
template StepBlock<double> step_kernel<double>(std::string_view);

template <class T>
StepBlock<T> beat_averaged_step_kernel(std::string_view instruction_set) {
  return kernel_of<T>(mean_floats, mean_doubles, instruction_set).step;
}
template StepBlock<float> beat_averaged_step_kernel<float>(std::string_view);
template StepBlock<double> beat_averaged_step_kernel<double>(std::string_view);

template <class T>
StepBlock<T> jointed_step_kernel(std::string_view instruction_set) {
  return kernel_of<T>(jointed_floats, jointed_doubles, instruction_set).step;
}
template StepBlock<float> jointed_step_kernel<float>(std::string_view);
template StepBlock<double> jointed_step_kernel<double>(std::string_view);

}  // namespace flappy::sim
