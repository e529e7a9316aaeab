// Many cases, several at a time.
#pragma once

#include <cstddef>
#include <functional>
#include <string>

namespace flappy::benchmark {

/// Does `count` jobs on `threads` threads (0: one for each processor), with a line of progress. After Ctrl-C no further one is
/// begun. A job that throws stops none of the others; then the first fault is thrown. False where it was interrupted.
bool work_through(const std::string& what, std::size_t count, int threads, const std::function<void(std::size_t)>& job);

}  // namespace flappy::benchmark
