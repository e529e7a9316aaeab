// What a job can be: one table. A kind turns names into the command line of one of our programs; nothing that a client sends is ever a
// path, an option or a command.
//
//   kind       config is                                    overrides are
//   train      a configuration below `configs`              --set
//   evaluate   a job, or a run below `output`               episodes=N, seed=N; else --set
//   export     a job, or a run below `output`               int8=true, prove=true
//   diagnose   a vehicle below `configs`                    flight=NAME below `data`, once for each flight
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "server/jobs/job.hpp"

namespace flappy::server {

struct Folders {
  std::filesystem::path configs, output;
  std::filesystem::path data;  ///< empty: none
};

/// An attempt of a job.
struct Launch {
  Folders folders;
  std::filesystem::path programs;  ///< the folder of flappy-train and its like
  std::filesystem::path folder;    ///< the job's own
  Submission asked;
  int threads = 0;
};

struct Progress {
  double share = 0;  ///< 0 to 1
  std::string message;
};

// In the job's folder.
inline constexpr const char* kResult = "result.json";      ///< the last that a program writes
inline constexpr const char* kProgress = "progress.json";  ///< written over as it goes on

struct Kind {
  std::string name;
  /// Goes on from what an earlier attempt left. io::InputError for what is not accepted.
  std::function<std::vector<std::string>(const Launch&)> command;
  /// Whether its result says that the program was stopped before its end; else one that was asked to stop counts as stopped.
  bool says_stopped = false;
};

const std::vector<Kind>& kinds();
/// io::InputError for no kind.
const Kind& kind_named(const std::vector<Kind>& kinds, const std::string& name);

/// Whether an attempt came to its end, by the result that it left.
bool is_complete(const Kind& kind, const std::filesystem::path& folder, bool asked_to_stop);
/// What the job's program told last; nothing before it does.
Progress progress_of(const std::filesystem::path& folder);
/// The last bytes of a file, from the beginning of a line on; empty where there is none.
std::string tail_of(const std::filesystem::path& file, std::size_t most);

}  // namespace flappy::server
