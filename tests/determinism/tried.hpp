// The instruction sets, numbers of threads and batch sizes that the contract is tried with: at -O0, which is slow to compile and
// to run, one of each.
#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <vector>

#include "flappy/batch.hpp"
#include "full.hpp"

namespace flappy::test {

#ifdef FLAPPY_UNOPTIMISED
inline const std::vector<int> kThreads = {3};
inline const std::vector<std::size_t> kBatchSizes = {17};

/// The one that is compiled at -O0, where the processor has it.
inline std::vector<std::string> instruction_sets() {
  std::vector<std::string> sets = sim::instruction_sets();
  return std::ranges::count(sets, "x86-64-v3") > 0 ? std::vector<std::string>{"x86-64-v3"} : sets;
}
#else
inline const std::vector<int> kThreads = {1, 3, 16};
inline const std::vector<std::size_t> kBatchSizes = {1, 17};

inline std::vector<std::string> instruction_sets() { return sim::instruction_sets(); }
#endif

/// Batch sizes to try with an instruction set. Batches of one step a whole block for each flapper: without --full, of one set alone.
inline std::vector<std::size_t> batch_sizes(const std::string& set) {
  std::vector<std::size_t> sizes = kBatchSizes;
  if (!full() && set != instruction_sets().back()) std::erase(sizes, 1U);
  return sizes;
}

}  // namespace flappy::test
