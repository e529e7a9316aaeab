// The one parallel loop. What it calls shares nothing, so results depend neither on the number of threads nor on who else
// wants the processors.
#pragma once

#include <concepts>
#include <cstddef>
#include <filesystem>

namespace flappy::io {

/// How many processors this process may use: those of its affinity mask, at most what its control group is allowed, and its share of
/// the machine's where share_processors() was told of others.
int processors();
/// So many processes like this one share the machine.
void share_processors(int processes);
/// The processors that the control group of a process pays for, by `membership` (the kernel's /proc/self/cgroup) and the
/// files below `root`; 0 where there is no limit.
int processors_of_group(const std::filesystem::path& membership, const std::filesystem::path& root);

/// `threads`, or one for each processor where it is 0.
inline int thread_count(int threads) { return threads > 0 ? threads : processors(); }

namespace detail {
using Call = void (*)(const void* job, std::size_t i, int thread);
void parallel_for(std::size_t count, int threads, const void* job, Call call);
void together(int threads, const void* body, void (*call)(const void*));
}  // namespace detail

/// Calls body() on this thread. Loops that it runs share one team of at most `threads` threads, which stays together between them.
template <class Body>
void together(int threads, const Body& body) {
  detail::together(threads, &body, [](const void* it) { (*static_cast<const Body*>(it))(); });
}

/// Calls job(i) or job(i, thread) for every i below `count`, on at most `threads` threads (0: one for each processor), which
/// have the numbers from 0 on; 0 is the caller. If some throw, all are called nevertheless, and what the first of them by
/// index threw is thrown again. A loop in a job, and one beside a loop of another thread, runs on its caller alone.
template <class Job>
void parallel_for(std::size_t count, int threads, const Job& job) {
  detail::parallel_for(count, threads, &job, [](const void* it, std::size_t i, int thread) {
    const Job& call = *static_cast<const Job*>(it);
    if constexpr (std::invocable<const Job&, std::size_t, int>) call(i, thread);
    else call(i);
  });
}

}  // namespace flappy::io
