// The only parallel loop of the project. Its jobs share no data, so results do not depend on the number of threads.
#pragma once

#include <concepts>
#include <cstddef>
#include <filesystem>

namespace flappy::io {

/// The processors that this process may use, by its affinity mask, its control group and share_processors().
int processors();
/// Tells processors() that `processes` such processes share the machine.
void share_processors(int processes);
/// The limit of a process's control group, from `membership` (/proc/self/cgroup) and the files below `root`; 0: none.
int processors_of_group(const std::filesystem::path& membership, const std::filesystem::path& root);

inline int thread_count(int threads) { return threads > 0 ? threads : processors(); }

namespace detail {
using Call = void (*)(const void* job, std::size_t i, int thread);
void parallel_for(std::size_t count, int threads, const void* job, Call call);
void together(int threads, const void* body, void (*call)(const void*));
}  // namespace detail

/// Calls body() on this thread. All parallel loops in it use one team of at most `threads` threads.
template <class Body>
void together(int threads, const Body& body) {
  detail::together(threads, &body, [](const void* it) { (*static_cast<const Body*>(it))(); });
}

/// Calls job(i) or job(i, thread) for every i below `count`, on at most `threads` threads (0: one for each processor);
/// thread 0 is the caller. If calls throw, the others still run, and the exception of the lowest index is rethrown. A
/// loop inside a job, or while another thread runs a loop, runs on its caller alone.
template <class Job>
void parallel_for(std::size_t count, int threads, const Job& job) {
  detail::parallel_for(count, threads, &job, [](const void* it, std::size_t i, int thread) {
    const Job& call = *static_cast<const Job*>(it);
    if constexpr (std::invocable<const Job&, std::size_t, int>) call(i, thread);
    else call(i);
  });
}

}  // namespace flappy::io
