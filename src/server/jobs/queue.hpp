// The queue: every job that was ever submitted and the history of its states, in one SQLite file. When a call that
// changes it returns, the change is on the disk; when it throws, nothing has changed.
#pragma once

#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <memory>
#include <mutex>

#include "io/append_file.hpp"
#include "server/jobs/database.hpp"
#include "server/jobs/job.hpp"

namespace flappy::server {

inline constexpr std::size_t kMaxWaiting = 1000;  ///< most jobs that are queued, running or paused

/// How an attempt ended.
struct Ending {
  State state = State::done;
  std::optional<int> exit_code;
  std::string message;
  bool crashed = false;
};

/// Thread-safe. Throws io::InputError for an unknown job, a change that its state forbids, and a failure to write.
class Queue {
 public:
  /// Opens `folder`/queue.sqlite, or creates it, and locks `folder` for this process.
  explicit Queue(const std::filesystem::path& folder);

  /// Returns the id of the new job, or of the job that already has this client_id. Throws io::InputError where that job
  /// asked for something else, and where kMaxWaiting jobs are queued, running or paused.
  std::uint64_t submit(const Submission& asked);
  void pause(std::uint64_t id);
  /// Queues a paused or failed job again and resets its number of crashes.
  void resume(std::uint64_t id);
  void cancel(std::uint64_t id);

  Job job(std::uint64_t id) const;
  std::vector<Job> jobs(std::size_t most) const;  ///< newest first
  std::vector<Job> jobs_in(State state) const;    ///< oldest first
  std::vector<Transition> history(std::uint64_t id) const;
  const std::string& name() const { return name_; }  ///< 16 random hexadecimal digits

  // Calls of the runner and its backend.
  /// Moves a job from queued to running: counts an attempt, and forgets the process of the last one.
  Job start(std::uint64_t id);
  void supervised_by(std::uint64_t id, const Process& process);
  void batched_as(std::uint64_t id, const std::string& batch_id);
  /// Asks a running job to stop because the server stops; it is queued again afterwards.
  void want_stop(std::uint64_t id);
  void report(std::uint64_t id, double progress, const std::string& message);
  void end(std::uint64_t id, const Ending& ending);

  /// Changes since this object was made. wait_for_change returns once it differs from `seen`, or after `most`.
  std::uint64_t changes() const;
  std::uint64_t wait_for_change(std::uint64_t seen, std::chrono::milliseconds most) const;

 private:
  std::optional<Job> find(std::uint64_t id) const;
  Job existing(std::uint64_t id) const;
  Job existing(std::uint64_t id, State wanted) const;
  void move(const Job& job, State to, const std::string& why);
  void want(const Job& job, Wanted wanted, const std::string& why);
  void note(std::uint64_t id, State state, int attempt, const std::string& why);
  void changed();

  std::unique_ptr<io::FolderLock> lock_;
  mutable Database database_;
  std::string name_;
  mutable std::mutex mutex_;
  mutable std::condition_variable change_;
  std::uint64_t changes_ = 0;
};

}  // namespace flappy::server
