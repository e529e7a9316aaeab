#include "benchmark/work.hpp"

#include <mutex>
#include <vector>

#include "io/parallel.hpp"
#include "io/progress.hpp"

namespace flappy::benchmark {

bool work_through(const std::string& what, std::size_t count, int threads, io::Ranks* ranks,
                  const std::function<void(std::size_t)>& job) {
  io::stop_on_interrupt();
  if (ranks != nullptr) ranks->wait();  // before any of them leaves what others would find
  std::vector<std::size_t> own;
  const std::size_t stride = ranks != nullptr ? static_cast<std::size_t>(ranks->size()) : 1;
  for (std::size_t i = ranks != nullptr ? static_cast<std::size_t>(ranks->rank()) : 0; i < count; i += stride)
    own.push_back(i);
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
  const bool open = done < own.size();
  return !(ranks != nullptr ? ranks->any(open) : open);
}

}  // namespace flappy::benchmark
