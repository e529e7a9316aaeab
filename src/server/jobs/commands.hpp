// What clients may ask of the queue, whatever brings it here. Every string is bounded, rates are limited, and every command is answered; a
// refusal is besides a line in the log.
#pragma once

#include <cstdint>
#include <mutex>
#include <string>
#include <vector>

#include "io/log.hpp"
#include "server/jobs/kinds.hpp"
#include "server/jobs/queue.hpp"
#include "server/jobs/rate_limit.hpp"
#include "server/jobs/server_config.hpp"

namespace flappy::server {

struct Command {
  std::string id;            ///< the client's own; submitted twice, it is one job
  std::string client;        ///< who sends it: whose rate it counts against
  std::string verb;          ///< submit, list, pause, resume, cancel, fetch
  std::string kind, config;  ///< of submit
  std::uint64_t job = 0;     ///< of pause, resume, cancel, fetch
  std::vector<std::string> overrides;
};

/// Where a client came too often: the same command is accepted later.
inline constexpr const char* kTooMany = "too many commands at a time";

struct CommandResult {
  std::string id;  ///< of the command
  bool accepted = false;
  std::uint64_t job = 0;
  std::string message;  ///< what was done, or why not, in one line
};

/// A job as clients see it.
struct JobStatus {
  std::uint64_t id = 0;
  std::string kind, config, state;
  int attempts = 0, exit_code = -1;  ///< -1: none yet
  double progress = 0;
  std::string message, folder;
  bool operator==(const JobStatus&) const = default;
};
JobStatus status_of(const Job& job);

/// A file that a job left, by its name below the job's folder.
struct JobFile {
  std::string name;
  std::uint64_t bytes = 0;
};
inline constexpr std::size_t kMostFiles = 10'000, kMostOfChunk = 65'536, kMostListed = 1000;
/// The files of a job's folder by name, links left out; at most kMostFiles.
std::vector<JobFile> files_of(const std::filesystem::path& folder);

/// Any thread may call it.
class Commands {
 public:
  Commands(Queue& queue, const ServerConfig& config, std::filesystem::path programs,
           std::vector<Kind> kinds = server::kinds());

  /// Never throws for what a client sent. list and fetch are accepted here, and answered by what follows.
  CommandResult execute(const Command& command);

  /// The newest kMostListed ones, newest first.
  std::vector<JobStatus> statuses() const;
  /// io::InputError where there is no such job.
  std::vector<JobFile> files(std::uint64_t job) const;
  /// At most kMostOfChunk bytes from `offset` on; none at the end. io::InputError for a name that is none of files().
  std::string chunk(std::uint64_t job, const std::string& file, std::uint64_t offset) const;

 private:
  CommandResult refused(const Command& command, const std::string& why, double now_s);
  CommandResult done(const Command& command);
  CommandResult submit(const Command& command);

  Queue& queue_;
  JobsConfig config_;
  std::filesystem::path programs_;
  std::vector<Kind> kinds_;
  std::mutex mutex_;  ///< of what follows
  RateLimit limit_;
  io::CalmLog log_;
};

}  // namespace flappy::server
