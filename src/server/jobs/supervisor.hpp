// The supervisor of a job: a process that starts the job's program, waits for it, and writes its exit code to the disk.
// It outlives the server, because a killed server cannot wait for its children, and its successor is not their parent.
// The program is killed when its supervisor dies; the supervisor ends when its program does.
//
//   JOB/job.log          output of the program and its supervisor, up to kMaxOfLog
//   JOB/attempt_N.began  {"pid", "start_ticks", "boot_id"} of the supervisor, written before the program starts
//   JOB/attempt_N.exit   {"code" or "signal", "message": last line of its stderr}, written once the program ended
//
// The supervisor passes SIGINT on to the program, which stops cleanly; on SIGTERM it kills the program and its process
// group.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "server/jobs/job.hpp"

namespace flappy::server {

inline constexpr std::uint64_t kMaxOfLog = 64'000'000;  ///< bytes, all attempts together
inline constexpr const char* kLogName = "job.log";

struct Exit {
  int code = 0;    ///< exit code
  int signal = 0;  ///< signal that ended it; 0: none
  std::string message;
};

/// The command line that runs flappy-server as a supervisor: `server` --child FOLDER ATTEMPT -- COMMAND...
std::vector<std::string> supervisor_command(const std::string& server, const std::filesystem::path& folder, int attempt,
                                            const std::vector<std::string>& command);
/// Where the command line is one of supervisor_command(), runs the supervisor and exits; returns otherwise.
void supervise_if_asked(int argc, char** argv);

// Contents of attempt_N.began and attempt_N.exit; nothing where the attempt did not write the file.
std::optional<Process> began(const std::filesystem::path& folder, int attempt);
std::optional<Exit> exit_of(const std::filesystem::path& folder, int attempt);

}  // namespace flappy::server
