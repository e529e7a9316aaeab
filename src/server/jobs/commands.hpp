// Commands of clients to the queue, over any transport. Strings are bounded, rates limited, every command is answered.
#pragma once

#include <cstdint>
#include <mutex>
#include <string>
#include <vector>

#include "io/log.hpp"
#include "server/jobs/job_types.hpp"
#include "server/jobs/queue.hpp"
#include "server/jobs/rate_limit.hpp"
#include "server/jobs/server_config.hpp"

namespace flappy::server {

struct Command {
  std::string id;            ///< chosen by the client; the same id submitted twice is one job
  std::string client;        ///< the sender, whose rate limit applies; empty: this machine's user, who has none
  std::string verb;          ///< submit, list, pause, resume, cancel, fetch
  std::string kind, config;  ///< for submit
  std::uint64_t job = 0;     ///< for pause, resume, cancel, fetch
  std::vector<std::string> overrides;
};

/// Begins the message of a refusal by the rate limit; the client may send the same command again later.
inline constexpr const char* kTooMany = "too many commands at a time";

/// Begins the message of a refusal of a file that is not, or no longer, there.
inline constexpr const char* kNoSuchFile = "no such file of the job";

struct CommandResult {
  std::string id;  ///< id of the command
  bool accepted = false;
  std::uint64_t job = 0;
  std::string message;  ///< one line: the action taken, or the reason of the refusal
};

struct JobStatus {
  std::uint64_t id = 0;
  std::string kind, config, state;
  int attempts = 0, exit_code = -1;  ///< -1: none yet
  double progress = 0;
  std::string message, folder;
  bool operator==(const JobStatus&) const = default;
};
JobStatus status_of(const Job& job);

struct JobFile {
  std::string name;
  std::uint64_t bytes = 0;
};
inline constexpr std::size_t kMaxFiles = 10'000, kMaxOfChunk = 65'536, kMaxListed = 1000;
/// Lists the regular files below `folder`, sorted by name, without symbolic links and files that are being
/// written; at most kMaxFiles.
std::vector<JobFile> files_of(const std::filesystem::path& folder);

/// Checks and executes commands. Thread-safe.
class Commands {
 public:
  Commands(Queue& queue, const ServerConfig& config, std::filesystem::path programs,
           std::vector<JobType> kinds = server::job_types());

  /// Never throws because of what a client sent. Only accepts list and fetch; the functions below answer them.
  CommandResult execute(const Command& command);

  std::vector<JobStatus> statuses() const;  ///< the newest kMaxListed, newest first
  /// As of Queue: how often the queue has changed, also once that differs from `seen` or `most` has passed.
  std::uint64_t changes() const { return queue_.changes(); }
  std::uint64_t wait_for_change(std::uint64_t seen, std::chrono::milliseconds most) const {
    return queue_.wait_for_change(seen, most);
  }
  std::vector<JobFile> files(std::uint64_t job) const;  ///< throws io::InputError for an unknown job
  /// At most kMaxOfChunk bytes; empty at the end. Throws io::InputError where `file` is no file below the job's folder.
  std::string chunk(std::uint64_t job, const std::string& file, std::uint64_t offset) const;

 private:
  CommandResult refused(const Command& command, const std::string& why, double now_s);
  CommandResult done(const Command& command);
  CommandResult submit(const Command& command);

  Queue& queue_;
  JobsConfig config_;
  std::filesystem::path programs_;
  std::vector<JobType> kinds_;
  std::mutex mutex_;  ///< guards limit_ and log_
  RateLimit limit_;
  io::CalmLog log_;
};

}  // namespace flappy::server
