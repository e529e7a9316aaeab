// A job: what was asked for, where it stands, and what may become of it.
//
//   queued --> running --> done
//     |  ^        |------> failed --> queued       (resume)
//     |  |        |------> cancelled
//     |  '--------|                                (a crash, a stop of the server)
//     v           v
//   paused <------'        paused --> queued       (resume)
//
// From queued and paused it may be cancelled, too. done and cancelled are for good.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace flappy::server {

// Whatever a client sends is no longer than this.
inline constexpr std::size_t kMostOfId = 64, kMostOfVerb = 16, kMostOfKind = 64, kMostOfConfig = 256;
inline constexpr std::size_t kMostOverrides = 32, kMostOfOverride = 256, kMostOfMessage = 1024;

enum class State { queued, running, paused, done, failed, cancelled };
inline constexpr State kStates[] = {State::queued, State::running, State::paused,
                                    State::done,   State::failed,  State::cancelled};
const char* name_of(State state);
/// std::invalid_argument for no name of a state.
State state_named(const std::string& name);

/// The table above.
bool may_become(State from, State to);

/// What is to become of a job that runs: it goes on, or its program is asked to stop.
enum class Wanted { run, pause, cancel, stop };

/// A process that a number alone does not name, as numbers are given again.
struct Process {
  std::int64_t pid = 0;           ///< 0: not known
  std::uint64_t start_ticks = 0;  ///< since the boot
  std::string boot_id;
  bool operator==(const Process&) const = default;
};

/// What a client asks for.
struct Submission {
  std::string client_id;  ///< the client's own; the same one twice is the same job
  std::string kind, config;
  std::vector<std::string> overrides;
  bool operator==(const Submission&) const = default;
};

struct Job {
  std::uint64_t id = 0;
  Submission asked;
  State state = State::queued;
  Wanted wanted = Wanted::run;
  int attempts = 0;      ///< how often it was started
  int crashes = 0;       ///< how often it ended of itself without being done, since it was submitted or resumed
  Process process;       ///< that minds the last attempt
  std::string batch_id;  ///< the last attempt's, where another queue runs it
  std::optional<int> exit_code;
  double progress = 0;  ///< 0 to 1
  std::string message;
  std::string folder;  ///< its name below the output folder
  // since 1970; 0: not yet
  double submitted_s = 0, started_s = 0, ended_s = 0;
};

/// A state that a job came to, and why.
struct Transition {
  double time_s = 0;
  State state = State::queued;
  int attempt = 0;
  std::string why;
};

/// At most `most` bytes of a text that a person is shown: control characters are blanks, and no character of UTF-8 is cut.
std::string shown(const std::string& text, std::size_t most = kMostOfMessage);

}  // namespace flappy::server
