// Processes that outlive the server that started them: identifies them, and signals them and no others.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "server/jobs/job.hpp"

namespace flappy::server {

std::string boot_id();
std::optional<Process> process_of(std::int64_t pid);  ///< nothing where there is none
/// Signals exactly this process. Returns false where it is gone, even if another process has its pid by now.
bool signal_process(const Process& process, int signal);

/// An exclusive lock of a job's folder. All processes of an attempt inherit the descriptor and so share the lock, which
/// is released when the last of them ends, however it ends.
class JobLock {
 public:
  /// Nothing where another process holds the lock. Throws io::InputError where the folder cannot be opened or locked.
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

/// Starts a program, found along PATH, in a process group of its own; returns its pid. It has no input, appends its
/// output to `log`, has `lock` (if any) as descriptor 3, and SIGINT and SIGTERM blocked. Throws std::system_error.
std::int64_t start_process(const std::vector<std::string>& command, const JobLock* lock,
                           const std::filesystem::path& log);
/// Whether a child process has ended. Reaps it, so call it no more once it returned true.
bool has_ended(std::int64_t pid);

}  // namespace flappy::server
