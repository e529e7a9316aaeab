#include "sim/kernels.hpp"

#include <stdexcept>

#include "flappy/batch.hpp"

namespace flappy::sim {

#define FLAPPY_DECLARE_KERNELS(isa)          \
  inline namespace isa {                     \
  extern const Kernel<float> kernel_float;   \
  extern const Kernel<double> kernel_double; \
  }
FLAPPY_DECLARE_KERNELS(scalar)
FLAPPY_DECLARE_KERNELS(v2)
FLAPPY_DECLARE_KERNELS(v3)
FLAPPY_DECLARE_KERNELS(v4)
#undef FLAPPY_DECLARE_KERNELS

const std::vector<KernelSet>& kernels() {
  static const std::vector<KernelSet> all = [] {
    std::vector<KernelSet> k{{scalar::kernel_float, scalar::kernel_double}};
    // clang 14 does not know "x86-64-v2" and so on: the youngest extensions of each level stand for it
    const bool has_v2 =
        __builtin_cpu_supports("ssse3") && __builtin_cpu_supports("sse4.2") && __builtin_cpu_supports("popcnt");
    const bool has_v3 = has_v2 && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
                        __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2");
    const bool has_v4 = has_v3 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                        __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
                        __builtin_cpu_supports("avx512vl");
    if (has_v2) k.push_back({v2::kernel_float, v2::kernel_double});
    if (has_v3) k.push_back({v3::kernel_float, v3::kernel_double});
    if (has_v4) k.push_back({v4::kernel_float, v4::kernel_double});
    return k;
  }();
  return all;
}

const KernelSet& kernel_named(std::string_view instruction_set) {
  if (instruction_set.empty()) return kernels().back();
  for (const KernelSet& k : kernels())
    if (instruction_set == k.single.instruction_set) return k;
  throw std::invalid_argument("no instruction set \"" + std::string(instruction_set) + "\" on this processor");
}

std::string best_instruction_set() { return kernels().back().single.instruction_set; }

std::vector<std::string> instruction_sets() {
  std::vector<std::string> names;
  for (const KernelSet& k : kernels()) names.emplace_back(k.single.instruction_set);
  return names;
}

}  // namespace flappy::sim
