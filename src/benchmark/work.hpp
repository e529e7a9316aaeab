// Jobs on many cases, several at a time.
#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include "io/ranks.hpp"

namespace flappy::benchmark {

/// Does `count` jobs on `threads` threads (0: one for each processor), and shows the progress. After Ctrl-C, no further job begins. A job that throws
/// does not stop the others; the first exception is rethrown at the end. If there are several `ranks`, each does its share, and all return together.
/// False if any was interrupted.
bool work_through(const std::string& what, std::size_t count, int threads, io::Ranks* ranks,
                  const std::function<void(std::size_t)>& job);

}  // namespace flappy::benchmark
