// Compares the counted arithmetic of a step with the measured peak rate of the core.
#pragma once

namespace flappy::bench {

/// Arithmetic of one physics step of one flapper in free flight, no wing on a stroke stop.
struct Operations {
  long multiply = 0, fused = 0, add = 0, divide = 0, root = 0,
       other = 0;  // other: min, max, select, compare, negate

  long on_multiply_pipes() const { return multiply + fused; }
  long flops() const { return multiply + 2 * fused + add + divide + root; }
};
Operations count_operations();

/// Fused multiply-adds per second of one core in float, in the widest registers this processor has.
double peak_multiply_adds_per_s();

}  // namespace flappy::bench
