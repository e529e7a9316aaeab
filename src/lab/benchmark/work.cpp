#include "lab/benchmark/work.hpp"

#include <mutex>
#include <vector>

#include "io/parallel.hpp"
#include "io/progress.hpp"

namespace flappy::benchmark {

bool work_through(const std::string& what, std::size_t count, int threads, io::Ranks* ranks,
                  const std::function<void(std::size_t)>& job) {
  io::stop_on_interrupt();
  io::wait(ranks);  // no rank writes files before all ranks have seen which jobs are open
  std::vector<std::size_t> own;
  for (std::size_t i = 0; i < count; ++i)
    if (io::is_own(ranks, i)) own.push_back(i);
  io::ProgressLine line(what, 60);
  line.show(0);
  std::size_t done = 0;
  std::mutex mutex;
  io::parallel_for(own.size(), threads, [&](std::size_t i) {
    if (io::interrupted()) return;
    job(own[i]);
    const std::scoped_lock lock(mutex);
    ++done;
    line.show(static_cast<double>(done) / static_cast<double>(own.size()),
              std::to_string(done) + " of " + std::to_string(own.size()));
  });
  return !io::any(ranks, done < own.size());
}

}  // namespace flappy::benchmark
