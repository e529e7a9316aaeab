// A loop is open while its caller works on it. Threads that help enter it when the scheduler lets them, and the caller waits
// only for those that have entered: one that others keep from its processor holds nobody up. (OpenMP waits for every thread
// of a team, and its threads spin meanwhile.)
#include "io/parallel.hpp"

#include <sched.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <exception>
#include <fstream>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace flappy::io {
namespace {

/// Who waits looks on for so long before it sleeps. Training on two threads beside a busy loop on each of two processors
/// took 3.8 s with 10 us, as helpers were woken too late to help, 3.0 s with 50, and 3.2 s and a fifth more processor time
/// with 200.
constexpr std::chrono::microseconds kPatience{50};

/// Waits until `word` is no longer `old`.
void wait_while(const std::atomic<unsigned>& word, unsigned old) {
  const auto until = std::chrono::steady_clock::now() + kPatience;
  while (word.load(std::memory_order_acquire) == old)
    if (std::chrono::steady_clock::now() > until) return word.wait(old, std::memory_order_acquire);
}

/// A stretch of the loop. Its thread takes it from the front, as do those that have finished their own.
struct alignas(64) Stretch {
  std::atomic<std::size_t> next = 0;
  std::size_t end = 0;
};

struct Loop {
  const void* job;
  detail::Call call;
  std::vector<Stretch>* stretches;
  std::size_t threads;
  std::mutex mutex;
  std::size_t failed_at = 0;
  std::exception_ptr failed;

  void run(std::size_t i, std::size_t thread) {
    try {
      call(job, i, static_cast<int>(thread));
    } catch (...) {
      const std::scoped_lock lock(mutex);
      if (!failed || i < failed_at) failed = std::current_exception(), failed_at = i;
    }
  }

  void work(std::size_t thread) {
    for (std::size_t k = 0; k < threads; ++k) {
      Stretch& s = (*stretches)[(thread + k) % threads];
      if (s.next.load(std::memory_order_relaxed) >= s.end) continue;
      for (std::size_t i; (i = s.next.fetch_add(1, std::memory_order_relaxed)) < s.end;) run(i, thread);
    }
  }
};

/// The threads of this process that help, as many as were ever asked for. They sleep between loops and end with the process.
class Team {
 public:
  /// False where another loop has them.
  bool run(Loop& loop, std::size_t count) {
    if (busy_.test_and_set(std::memory_order_acquire)) return false;
    const auto free = [](std::atomic_flag* busy) { busy->clear(std::memory_order_release); };
    const std::unique_ptr<std::atomic_flag, decltype(free)> until_done(&busy_, free);
    if (stretches_.size() < loop.threads) stretches_ = std::vector<Stretch>(loop.threads);
    for (std::size_t k = 0; k < loop.threads; ++k) {
      stretches_[k].next.store(count * k / loop.threads, std::memory_order_relaxed);
      stretches_[k].end = count * (k + 1) / loop.threads;
    }
    loop.stretches = &stretches_;
    for (; helpers_ + 1 < loop.threads; ++helpers_)
      std::thread([this, thread = helpers_ + 1] { help(thread); }).detach();
    loop_ = &loop;
    gate_.store(kOpen, std::memory_order_release);
    round_.fetch_add(1, std::memory_order_release);
    round_.notify_all();
    loop.work(0);
    for (unsigned inside = gate_.fetch_and(~kOpen, std::memory_order_acq_rel) & ~kOpen; inside > 0;
         inside = gate_.load(std::memory_order_acquire))
      wait_while(gate_, inside);
    return true;
  }

 private:
  static constexpr unsigned kOpen = 1U << 31;

  void help(std::size_t thread) {
    for (unsigned round = 0;;) {
      wait_while(round_, round);
      round = round_.load(std::memory_order_acquire);
      unsigned inside = gate_.load(std::memory_order_relaxed);
      while ((inside & kOpen) && !gate_.compare_exchange_weak(inside, inside + 1, std::memory_order_acquire)) continue;
      if (!(inside & kOpen)) continue;
      if (thread < loop_->threads) loop_->work(thread);
      if (gate_.fetch_sub(1, std::memory_order_acq_rel) == 1) gate_.notify_one();
    }
  }

  std::atomic_flag busy_;
  std::vector<Stretch> stretches_;
  std::size_t helpers_ = 0;
  Loop* loop_ = nullptr;
  alignas(64) std::atomic<unsigned> gate_ = 0;   // kOpen, and how many helpers are inside
  alignas(64) std::atomic<unsigned> round_ = 0;  // loops so far
};

}  // namespace

int processors_of_group(const std::filesystem::path& membership, const std::filesystem::path& root) {
  std::ifstream in(membership);
  double least = 0;
  for (std::string line; std::getline(in, line);) {
    if (!line.starts_with("0::/")) continue;
    // a limit of any folder above holds as well
    for (std::filesystem::path folder = line.substr(4);; folder = folder.parent_path()) {
      double quota = 0, period = 0;
      if (std::ifstream(root / folder / "cpu.max") >> quota >> period && period > 0 && quota > 0)  // else it says "max"
        least = least > 0 ? std::min(least, quota / period) : quota / period;
      if (folder.empty()) break;
    }
  }
  return static_cast<int>(std::ceil(least));
}

namespace {
int sharing = 1;  // processes on this machine
}

void share_processors(int processes) { sharing = processes; }

int processors() {
  static const int of_group = processors_of_group("/proc/self/cgroup", "/sys/fs/cgroup");
  cpu_set_t mask;
  const int allowed = sched_getaffinity(0, sizeof mask, &mask) == 0
                          ? CPU_COUNT(&mask)
                          : static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  // a launcher may have given each process a mask of its own, but they share machine and group
  const auto share = [](int all) { return std::max(1, all / sharing); };
  const int own = std::min(allowed, share(static_cast<int>(std::max(1U, std::thread::hardware_concurrency()))));
  return of_group > 0 ? std::min(share(of_group), own) : own;
}

void detail::parallel_for(std::size_t count, int threads, const void* job, Call call) {
  Loop loop{job, call, nullptr, std::min(count, static_cast<std::size_t>(thread_count(threads))), {}, 0, nullptr};
  static Team& team = *new Team;  // never deleted: its threads outlive whoever would do it
  if (loop.threads < 2 || !team.run(loop, count))
    for (std::size_t i = 0; i < count; ++i) loop.run(i, 0);
  if (loop.failed) std::rethrow_exception(loop.failed);
}

}  // namespace flappy::io
