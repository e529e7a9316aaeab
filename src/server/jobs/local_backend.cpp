#include <csignal>
#include <map>

#include "server/jobs/backend.hpp"
#include "server/jobs/supervisor.hpp"

namespace flappy::server {
namespace {

namespace fs = std::filesystem;

class LocalBackend : public Backend {
 public:
  void start(Queue& queue, const Job& job, const fs::path& folder, const std::vector<std::string>& supervisor,
             const JobLock& lock) override {
    const std::int64_t pid = start_process(supervisor, &lock, folder / kLogName);
    children_[job.id] = pid;
    if (const auto process = process_of(pid)) queue.supervised_by(job.id, *process);
  }

  /// An attempt is alive while any process holds the lock of its folder, whichever server started that process.
  Life look(Queue& queue, const Job& job, const fs::path& folder) override {
    if (const auto child = children_.find(job.id); child != children_.end() && has_ended(child->second))
      children_.erase(child);
    if (JobLock::take(folder)) return Life::gone;
    if (job.process.pid == 0)
      if (const auto process = began(folder, job.attempts)) queue.supervised_by(job.id, *process);
    return Life::alive;
  }

  bool stop(const Job& job, bool kill) override { return signal_process(job.process, kill ? SIGTERM : SIGINT); }
  bool is_local() const override { return true; }

 private:
  std::map<std::uint64_t, std::int64_t> children_;  ///< [job] pid of its supervisor, which has to be reaped
};

}  // namespace

std::unique_ptr<Backend> local_backend() { return std::make_unique<LocalBackend>(); }

}  // namespace flappy::server
