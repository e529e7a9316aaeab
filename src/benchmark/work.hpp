// Many cases, several at a time.
#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include "io/ranks.hpp"

namespace flappy::benchmark {

/// Does `count` jobs on `threads` threads (0: one for each processor), with a line of progress. After Ctrl-C no further one is
/// begun. A job that throws stops none of the others; then the first fault is thrown. False where it was interrupted. `ranks`, if there
/// are several, do their shares of it; it ends when all of them have.
bool work_through(const std::string& what, std::size_t count, int threads, io::Ranks* ranks,
                  const std::function<void(std::size_t)>& job);

}  // namespace flappy::benchmark
