// Measures the core's peak rate. Built with contraction on, so that each assignment in the loop is one fused multiply-add.
#include <algorithm>

#include "roof.hpp"
#include "speed.hpp"

namespace flappy::bench {
namespace {

typedef float Wide __attribute__((vector_size(64)));
constexpr int kLanes = 16, kChains = 12;  // enough independent chains to fill two pipes of latency 4

__attribute__((target_clones("avx512f", "fma", "default"))) float multiply_add(float seed, int times) {
  const Wide a = Wide{} + 0.999999f, b = Wide{} + 1e-6f;
  Wide c0 = b * seed, c1 = c0 + 1, c2 = c0 + 2, c3 = c0 + 3, c4 = c0 + 4, c5 = c0 + 5, c6 = c0 + 6, c7 = c0 + 7,
       c8 = c0 + 8, c9 = c0 + 9, c10 = c0 + 10,
       c11 = c0 + 11;  // all different; otherwise the compiler merges the chains
  for (int i = 0; i < times; ++i) {
    c0 = c0 * a + b, c1 = c1 * a + b, c2 = c2 * a + b, c3 = c3 * a + b;
    c4 = c4 * a + b, c5 = c5 * a + b, c6 = c6 * a + b, c7 = c7 * a + b;
    c8 = c8 * a + b, c9 = c9 * a + b, c10 = c10 * a + b, c11 = c11 * a + b;
  }
  const Wide sum = c0 + c1 + c2 + c3 + c4 + c5 + c6 + c7 + c8 + c9 + c10 + c11;
  return sum[0] + sum[15];
}

}  // namespace

double peak_multiply_adds_per_s() {
  constexpr int kTimes = 2'000'000;
  double best = 0;
  for (int i = 0; i < 10; ++i) {
    const double start = processor_seconds();
    volatile float keep = multiply_add(static_cast<float>(i), kTimes);
    (void)keep;
    best = std::max(best, double{kTimes} * kChains * kLanes / (processor_seconds() - start));
  }
  return best;
}

}  // namespace flappy::bench
