#include <csignal>
#include <map>

#include "server/jobs/backend.hpp"
#include "server/jobs/minder.hpp"

namespace flappy::server {
namespace {

namespace fs = std::filesystem;

class LocalBackend : public Backend {
 public:
  void start(Queue& queue, const Job& job, const fs::path& folder, const std::vector<std::string>& minder,
             const JobLock& lock) override {
    const std::int64_t pid = start_process(minder, &lock, folder / kLogName);
    children_[job.id] = pid;
    if (const auto process = process_of(pid)) queue.minded_by(job.id, *process);
  }

  /// An attempt lives as long as somebody has its folder, be it our child or a stranger's.
  Life look(Queue& queue, const Job& job, const fs::path& folder) override {
    if (const auto child = children_.find(job.id); child != children_.end() && has_ended(child->second))
      children_.erase(child);
    if (JobLock::take(folder)) return Life::gone;
    if (job.process.pid == 0)
      if (const auto process = began(folder, job.attempts)) queue.minded_by(job.id, *process);
    return Life::alive;
  }

  bool stop(const Job& job, bool kill) override { return signal_process(job.process, kill ? SIGTERM : SIGINT); }
  bool is_local() const override { return true; }

 private:
  std::map<std::uint64_t, std::int64_t> children_;  ///< by job; each is to be waited for
};

}  // namespace

std::unique_ptr<Backend> local_backend() { return std::make_unique<LocalBackend>(); }

}  // namespace flappy::server
