// Processes that outlive the server that started them: how to identify them, see whether they live, and signal them and no others.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "server/jobs/job.hpp"

namespace flappy::server {

/// Identifies the current boot of this machine.
std::string boot_id();
/// Identifies the process that has this pid now; nothing where there is none.
std::optional<Process> process_of(std::int64_t pid);
/// Signals exactly this process. Returns false where it is gone, even if another process has its pid by now.
bool signal_process(const Process& process, int signal);

/// An exclusive lock of a job's folder, held by one attempt. Every process that is started with the descriptor shares the lock, which is
/// released when the last of them ends, however it ends. So no process of an attempt can live without holding the lock.
class JobLock {
 public:
  /// Returns nothing where another process holds the lock. Throws io::InputError where the folder cannot be opened or
  /// locked.
  static std::optional<JobLock> take(const std::filesystem::path& folder);
  ~JobLock();
  JobLock(JobLock&& other) noexcept;
  JobLock(const JobLock&) = delete;
  JobLock& operator=(const JobLock&) = delete;
  int descriptor() const { return descriptor_; }

 private:
  explicit JobLock(int descriptor) : descriptor_(descriptor) {}
  int descriptor_;
};

/// Starts a program, found along PATH, in a process group of its own; returns its pid. It has no input, appends its output to `log`, has
/// `lock` (if not null) as descriptor 3, and has SIGINT and SIGTERM blocked. Throws std::system_error where the start fails.
std::int64_t start_process(const std::vector<std::string>& command, const JobLock* lock,
                           const std::filesystem::path& log);
/// Whether a child process has ended. Reaps it, so call it no more once it returned true.
bool has_ended(std::int64_t pid);

}  // namespace flappy::server
