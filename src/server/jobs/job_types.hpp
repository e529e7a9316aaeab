// The job types. Each turns the names that a client sends into the command line of one of our programs; nothing that a
// client sends is used as a path, an option or a command.
//
//   job type   config                                       overrides
//   train      a configuration below `configs`              --set
//   evaluate   a job, or a run below `output`               episodes=N, seed=N; else --set
//   export     a job, or a run below `output`               int8=true, prove=true
//   diagnose   a vehicle below `configs`                    flight=NAME below `data`, once for each flight; likewise reference=NAME
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "server/jobs/job.hpp"

namespace flappy::server {

struct Folders {
  std::filesystem::path configs, output;
  std::filesystem::path data;  ///< flight logs; empty: none
};

/// Everything that determines the command line of an attempt.
struct Launch {
  Folders folders;
  std::filesystem::path programs;  ///< folder of flappy-train and the other programs
  std::filesystem::path folder;    ///< the job's folder
  Submission asked;
  int threads = 0;
};

struct Progress {
  double share = 0;  ///< 0 to 1
  std::string message;
};

// Names of files in the job's folder.
inline constexpr const char* kResult = "result.json";      ///< a program writes it last
inline constexpr const char* kProgress = "progress.json";  ///< overwritten while the program runs

struct JobType {
  std::string name;
  /// Makes an attempt's command line; train resumes an earlier run. io::InputError for a refused config or override.
  std::function<std::vector<std::string>(const Launch&)> command;
  /// Whether result.json says that the program stopped early; otherwise every attempt that was asked to stop did.
  bool says_stopped = false;
  /// Exit code besides 0 with which it has answered, if its result is there: a diagnosis of faulty data ends with 1.
  int also_done = 0;
};

const std::vector<JobType>& job_types();
/// Throws io::InputError where no job type has this name.
const JobType& job_type_named(const std::vector<JobType>& kinds, const std::string& name);

/// Whether an attempt finished, judged by the result.json that it left.
bool is_complete(const JobType& kind, const std::filesystem::path& folder, bool asked_to_stop);
/// The last progress that the job's program wrote; zero and empty where it wrote none yet.
Progress progress_of(const std::filesystem::path& folder);
/// The last `most` bytes of a file, without a line that begins before them; empty where there is no such file.
std::string tail_of(const std::filesystem::path& file, std::size_t most);

}  // namespace flappy::server
