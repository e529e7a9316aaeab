// The queue: every job that was ever submitted, and every state that it came to, in one SQLite file. A change is on the disk when the
// call returns, or it did not happen.
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

inline constexpr std::size_t kMostWaiting = 1000;  ///< jobs that are not over

/// How an attempt ended.
struct Ending {
  State state = State::done;
  std::optional<int> exit_code;
  std::string message;
  bool crashed = false;
};

/// Any thread may call it. io::InputError for what a job's state forbids, and where the file cannot be written.
class Queue {
 public:
  /// Takes `folder`/queue.sqlite for this process alone.
  explicit Queue(const std::filesystem::path& folder);

  /// The new job, or the one that this client_id already is. io::InputError where that one asked for something else, and where
  /// kMostWaiting jobs are not over.
  std::uint64_t submit(const Submission& asked);
  void pause(std::uint64_t id);
  /// Goes on with a paused or failed job, which may crash as often as before.
  void resume(std::uint64_t id);
  void cancel(std::uint64_t id);

  /// io::InputError where there is none.
  Job job(std::uint64_t id) const;
  /// The newest ones, newest first.
  std::vector<Job> jobs(std::size_t most) const;
  /// Oldest first.
  std::vector<Job> jobs_in(State state) const;
  std::vector<Transition> history(std::uint64_t id) const;
  /// Tells this queue from any other: 16 hexadecimal digits.
  const std::string& name() const { return name_; }

  // What runs the jobs tells.
  /// queued -> running: one attempt more, and nothing known of its process.
  Job start(std::uint64_t id);
  void minded_by(std::uint64_t id, const Process& process);
  void batched_as(std::uint64_t id, const std::string& batch_id);
  /// A job that runs is to stop, for the server goes.
  void want_stop(std::uint64_t id);
  void report(std::uint64_t id, double progress, const std::string& message);
  void end(std::uint64_t id, const Ending& ending);

  /// Counts changes; waits for another count than `seen`, at most so long.
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
