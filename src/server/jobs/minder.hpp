// What stands between the server and a job's program: a process that starts the program, waits for it, and leaves its exit code on the
// disk. A server that is killed cannot wait for children it no longer has, and whoever starts after it is not their parent; the minder
// outlives it, so that no exit code is ever lost. The program dies with its minder, and the minder lives as long as its program.
//
//   JOB/job.log          what the program and its minder print, up to kMostOfLog
//   JOB/attempt_N.began  {"pid", "start_ticks", "boot_id"} of the minder, before the program starts
//   JOB/attempt_N.exit   {"code" or "signal", "message"}, once the program is gone; the last line of its stderr
//
// SIGINT is handed on to the program, which stops cleanly; SIGTERM kills it and its group.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "server/jobs/job.hpp"

namespace flappy::server {

inline constexpr std::uint64_t kMostOfLog = 64'000'000;  ///< bytes, of all attempts together
inline constexpr const char* kLogName = "job.log";

/// How a program ended.
struct Exit {
  int code = 0;    ///< of its own
  int signal = 0;  ///< that ended it; 0: none
  std::string message;
};

/// How flappy-server is called to be a minder: `server` --child FOLDER ATTEMPT -- COMMAND...
std::vector<std::string> minder_command(const std::string& server, const std::filesystem::path& folder, int attempt,
                                        const std::vector<std::string>& command);
/// Whether a command line is such a call; then does all of it, and ends the process.
void mind_if_asked(int argc, char** argv);

/// What an attempt left; nothing where it did not come to that.
std::optional<Process> began(const std::filesystem::path& folder, int attempt);
std::optional<Exit> exit_of(const std::filesystem::path& folder, int attempt);

}  // namespace flappy::server
