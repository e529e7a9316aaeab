// A loop runs as OpenMP tasks: the caller and each helper work through a stretch of jobs, then take jobs from the
// others. The caller waits only for helpers that have begun, so a helper that gets no processor delays nobody.
#include "io/parallel.hpp"

#include <omp.h>
#include <pthread.h>
#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <fstream>
#include <latch>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace flappy::io {
namespace {

int sharing = 1;  // number of processes that share this machine

/// Set while a thread of this process has a team; there is at most one team.
std::atomic_flag team_taken;
enum class Place { outside, with_team, in_job };
thread_local Place place = Place::outside;

/// Sets `place` during its lifetime.
class At {
 public:
  explicit At(Place now) : before_(std::exchange(place, now)) {}
  ~At() { place = before_; }
  At(const At&) = delete;
  At& operator=(const At&) = delete;

 private:
  Place before_;
};

struct Loop {
  /// From `next` to before `end`. Its own thread, and threads that have finished their own, take jobs from the front.
  struct alignas(64) Stretch {
    std::atomic<std::size_t> next;
    std::size_t end;
  };

  Loop(std::size_t count, std::size_t threads, const void* what, detail::Call how)
      : job(what), call(how), stretches(threads) {
    for (std::size_t k = 0; k < threads; ++k) {
      stretches[k].next.store(count * k / threads, std::memory_order_relaxed);
      stretches[k].end = count * (k + 1) / threads;
    }
  }

  void run(std::size_t i, std::size_t thread) {
    try {
      call(job, i, static_cast<int>(thread));
    } catch (...) {
      const std::scoped_lock lock(mutex);
      if (!failed || i < failed_at) failed = std::current_exception(), failed_at = i;
    }
  }

  void work() {
    const At job_runs(Place::in_job);
    const std::size_t thread = entered.fetch_add(1, std::memory_order_relaxed), threads = stretches.size();
    for (std::size_t k = 0; k < threads; ++k) {
      Stretch& s = stretches[(thread + k) % threads];
      if (s.next.load(std::memory_order_relaxed) >= s.end) continue;
      for (std::size_t i; (i = s.next.fetch_add(1, std::memory_order_relaxed)) < s.end;) run(i, thread);
    }
  }

  const void* job;
  detail::Call call;
  std::vector<Stretch> stretches;
  std::atomic<std::size_t> entered = 0;
  std::mutex mutex;
  std::size_t failed_at = 0;
  std::exception_ptr failed;
};

void share(Loop& loop) {
#pragma omp taskgroup
  {
    for (std::size_t k = 1; k < loop.stretches.size(); ++k) {
#pragma omp task default(none) shared(loop)
      loop.work();
    }
    loop.work();
  }
}

/// GNU's OpenMP threads spin for milliseconds before they sleep, which takes processors from other programs; only for
/// microseconds where there are more threads than processors. So this starts that many, which sleep forever. (The
/// environment variable may come too late.) https://gcc.gnu.org/onlinedocs/libgomp/GOMP_005fSPINCOUNT.html
void let_waiting_threads_sleep() {
  static std::once_flag once;
  std::call_once(once, [] {
    std::latch started(1);
    std::thread([&] {
      std::atomic<int> team = 0;
#pragma omp parallel num_threads(omp_get_num_procs() + 1) default(none) shared(team)
      ++team;  // without a body, gcc would start no threads
      started.count_down();
      for (;;) pause();  // the team lives as long as this thread
    }).detach();
    started.wait();
  });
}

/// A forked child has no threads of its parent's team: end the team before the fork; parent and child start new ones.
void before_fork() {
  if (place == Place::outside) omp_pause_resource_all(omp_pause_soft);
}
/// Clears the flag, because it may stand for the team of another thread of the parent, which the child does not have.
void in_child() {
  if (place == Place::outside) team_taken.clear();
}

}  // namespace

int processors_of_group(const std::filesystem::path& membership, const std::filesystem::path& root) {
  std::ifstream in(membership);
  double least = 0;
  for (std::string line; std::getline(in, line);) {
    if (!line.starts_with("0::/")) continue;
    // a limit of any parent group holds as well
    for (std::filesystem::path folder = line.substr(4);; folder = folder.parent_path()) {
      double quota = 0, period = 0;
      if (std::ifstream(root / folder / "cpu.max") >> quota >> period && period > 0 && quota > 0)  // "max": no limit
        least = least > 0 ? std::min(least, quota / period) : quota / period;
      if (folder.empty()) break;
    }
  }
  return static_cast<int>(std::ceil(least));
}

void share_processors(int processes) { sharing = processes; }

int processors() {
  static const int of_group = processors_of_group("/proc/self/cgroup", "/sys/fs/cgroup");
  cpu_set_t mask;
  const int allowed = sched_getaffinity(0, sizeof mask, &mask) == 0
                          ? CPU_COUNT(&mask)
                          : static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  // even where a launcher gave each process an affinity mask of its own, they share the machine and the control group
  const auto share = [](int all) { return std::max(1, all / sharing); };
  const int own = std::min(allowed, share(static_cast<int>(std::max(1U, std::thread::hardware_concurrency()))));
  return of_group > 0 ? std::min(share(of_group), own) : own;
}

void detail::together(int threads, const void* body, void (*call)(const void*)) {
  let_waiting_threads_sleep();
  static const int fork_error = pthread_atfork(before_fork, nullptr, in_child);
  const int count = thread_count(threads);
  if (fork_error != 0 || count < 2 || place != Place::outside || team_taken.test_and_set(std::memory_order_acquire))
    return call(body);
  std::exception_ptr failed;
#pragma omp parallel num_threads(count) default(none) shared(body, call, failed)
#pragma omp masked
  {
    const At with_team(Place::with_team);
    try {
      call(body);
    } catch (...) {
      failed = std::current_exception();
    }
  }
  team_taken.clear(std::memory_order_release);
  if (failed) std::rethrow_exception(failed);
}

void detail::parallel_for(std::size_t count, int threads, const void* job, Call call) {
  Loop loop(count, std::min(count, static_cast<std::size_t>(thread_count(threads))), job, call);
  if (loop.stretches.size() < 2) {
    for (std::size_t i = 0; i < count; ++i) loop.run(i, 0);
  } else {
    io::together(threads, [&] {
      if (place == Place::with_team) return share(loop);
      const At job_runs(Place::in_job);
      for (std::size_t i = 0; i < count; ++i) loop.run(i, 0);
    });
  }
  if (loop.failed) std::rethrow_exception(loop.failed);
}

}  // namespace flappy::io
