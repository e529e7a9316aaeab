// A job: what a client asked for, its state, and the states that may follow.
//
//   queued --> running --> done
//     |  ^        |------> failed --> queued       (resume)
//     |  |        |------> cancelled
//     |  '--------|                                (a crash, a stop of the server)
//     v           v
//   paused <------'        paused --> queued       (resume)
//
// A queued or paused job may be cancelled; a queued job that cannot be started fails. done and cancelled are final.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace flappy::server {

// Limits, in bytes and in number, of what a client sends.
inline constexpr std::size_t kMaxOfId = 64, kMaxOfVerb = 16, kMaxOfKind = 64, kMaxOfConfig = 256;
inline constexpr std::size_t kMaxOverrides = 32, kMaxOfOverride = 256, kMaxOfMessage = 1024;

enum class State { queued, running, paused, done, failed, cancelled };
inline constexpr State kStates[] = {State::queued, State::running, State::paused,
                                    State::done,   State::failed,  State::cancelled};
const char* name_of(State state);
State state_named(const std::string& name);  ///< throws std::invalid_argument for any other name

/// Whether the table above allows the transition.
bool may_become(State from, State to);

/// What a running job has to do: go on, or ask its program to stop and become paused, cancelled or queued again.
enum class Wanted { run, pause, cancel, stop };

/// Identifies a process for good: the kernel reuses a pid, but not with the same start time in the same boot.
struct Process {
  std::int64_t pid = 0;           ///< 0: not known
  std::uint64_t start_ticks = 0;  ///< start time in clock ticks since boot
  std::string boot_id;
  bool operator==(const Process&) const = default;
};

struct Submission {
  std::string client_id;  ///< chosen by the client; submitted twice, it is the same job
  std::string kind, config;
  std::vector<std::string> overrides;
  bool operator==(const Submission&) const = default;
};

struct Job {
  std::uint64_t id = 0;
  Submission asked;
  State state = State::queued;
  Wanted wanted = Wanted::run;
  int attempts = 0;      ///< how many times it was started
  int crashes = 0;       ///< attempts that ended on their own without finishing, since the job was submitted or resumed
  Process process;       ///< supervisor of the last attempt
  std::string batch_id;  ///< Slurm's id of the last attempt; empty: local
  std::optional<int> exit_code;
  double progress = 0;  ///< 0 to 1
  std::string message;
  std::string folder;                                  ///< name below the output folder
  double submitted_s = 0, started_s = 0, ended_s = 0;  ///< Unix time; 0: not yet
};

/// An item of a job's history: the state, when the job came to it, and why.
struct Transition {
  double time_s = 0;
  State state = State::queued;
  int attempt = 0;
  std::string why;
};

/// Makes a text safe to show: at most `most` bytes, control characters replaced by blanks, no UTF-8 character cut.
std::string shown(const std::string& text, std::size_t most = kMaxOfMessage);

}  // namespace flappy::server
