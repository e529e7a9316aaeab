#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include "io/ranks.hpp"

namespace flappy::benchmark {

/// Does `count` jobs on `threads` threads (0: one for each processor), and shows progress. After Ctrl-C no further job
/// begins. The first exception is rethrown at the end. `ranks` each do a share and return together. False if any was
/// interrupted.
bool work_through(const std::string& what, std::size_t count, int threads, io::Ranks* ranks,
                  const std::function<void(std::size_t)>& job);

}  // namespace flappy::benchmark
