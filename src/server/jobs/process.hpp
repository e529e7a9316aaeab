// Processes that outlive the one that started them: who they are, whether they live, and how to signal them and nobody else.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "server/jobs/job.hpp"

namespace flappy::server {

/// This boot of this machine.
std::string boot_id();
/// Nothing where no process has this number.
std::optional<Process> process_of(std::int64_t pid);
/// False, and nobody is signalled, where that very process is gone.
bool signal_process(const Process& process, int signal);

/// A folder that belongs to one attempt of a job. The lock is handed down to whoever is started with its descriptor, and stands
/// until the last of them is gone, however they end: there is no moment in which a process lives that nobody knows of.
class JobLock {
 public:
  /// Nothing where somebody has the folder. io::InputError where it cannot be opened.
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

/// Starts a program, found along PATH, in a process group of its own, with `lock` as descriptor 3 (where there is one), no input, its
/// output at the end of `log`, and SIGINT and SIGTERM held back. std::system_error where that fails.
std::int64_t start_process(const std::vector<std::string>& command, const JobLock* lock,
                           const std::filesystem::path& log);
/// Whether a child of ours has ended; then it is gone for good.
bool has_ended(std::int64_t pid);

}  // namespace flappy::server
