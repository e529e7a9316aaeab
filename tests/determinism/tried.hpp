// The numbers of threads and the batch sizes that the contract is tried with: at -O0, which is slow, one of each.
#pragma once

#include <cstddef>
#include <vector>

namespace flappy::test {

#ifdef FLAPPY_UNOPTIMISED
inline const std::vector<int> kThreads = {3};
inline const std::vector<std::size_t> kBatchSizes = {17};
#else
inline const std::vector<int> kThreads = {1, 3, 16};
inline const std::vector<std::size_t> kBatchSizes = {1, 17};
#endif

}  // namespace flappy::test
