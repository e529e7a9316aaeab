#include "benchmark/work.hpp"

#include <mutex>

#include "io/parallel.hpp"
#include "io/progress.hpp"

namespace flappy::benchmark {

bool work_through(const std::string& what, std::size_t count, int threads,
                  const std::function<void(std::size_t)>& job) {
  io::stop_on_interrupt();
  io::ProgressLine line(what, 60);
  line.show(0);
  std::size_t done = 0;
  std::mutex mutex;
  io::parallel_for(count, threads, [&](std::size_t i) {
    if (io::interrupted()) return;
    job(i);
    const std::scoped_lock lock(mutex);
    ++done;
    line.show(static_cast<double>(done) / static_cast<double>(count),
              std::to_string(done) + " of " + std::to_string(count));
  });
  return done == count;
}

}  // namespace flappy::benchmark
