#include "benchmark/work.hpp"

#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include "io/progress.hpp"

namespace flappy::benchmark {

bool work_through(const std::string& what, std::size_t count, int threads,
                  const std::function<void(std::size_t)>& job) {
  io::stop_on_interrupt();
  io::ProgressLine line(what, 60);
  line.show(0);
  std::atomic<std::size_t> next = 0;
  std::size_t done = 0;
  std::exception_ptr fault;
  std::mutex mutex;
  const auto work = [&] {
    while (!io::interrupted()) {
      const std::size_t i = next++;
      if (i >= count) return;
      std::exception_ptr thrown;
      try {
        job(i);
      } catch (...) {
        thrown = std::current_exception();
      }
      const std::scoped_lock lock(mutex);
      if (thrown && !fault) fault = thrown;
      ++done;
      line.show(static_cast<double>(done) / static_cast<double>(count),
                std::to_string(done) + " of " + std::to_string(count));
    }
  };
  const unsigned workers =
      threads > 0 ? static_cast<unsigned>(threads) : std::max(1U, std::thread::hardware_concurrency());
  {
    std::vector<std::jthread> team;
    for (unsigned k = 1; k < workers; ++k) team.emplace_back(work);
    work();
  }
  line.clear();
  if (fault) std::rethrow_exception(fault);
  return done == count;
}

}  // namespace flappy::benchmark
