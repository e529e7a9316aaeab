// The queue of jobs over DDS. All topics are reliable; strings are bounded by their types.
//
//   /flappy/jobs             JobStatus       each job when it changes, and all of them upon "list"
//   /flappy/command          Command         taken, where commands are; pieces of a file are asked for by verb "fetch": config is its
//                                            name below the job's folder, nothing asks for the names
//   /flappy/command_result   CommandResult   in answer to every command; of "list", job is how many JobStatus came
//   /flappy/files            FileChunk       in answer to "fetch"
//
// A client's rate is counted by its process, whatever id it gives its commands.
#pragma once

#include <atomic>
#include <deque>
#include <map>
#include <optional>
#include <thread>

#include "server/dds/participant.hpp"
#include "server/jobs/commands.hpp"
#include "server/watched.hpp"

namespace flappy::server {

class CommandServer {
 public:
  /// Answers from now on, in a thread of its own; shows who looks at the watched flapper what its topics say.
  CommandServer(const io::DdsConfig& config, Commands& commands, Watched& watched);
  ~CommandServer();

 private:
  struct Transfer {
    std::string id;
    std::uint64_t job, size, offset;
    std::string name;
  };

  void run();
  void take_commands();
  void answer(const Command& command);
  CommandResult fetch(const Command& command);
  void send_pieces();
  void show_changes(bool all);
  void look();

  Commands& commands_;
  Watched& watched_;
  Participant participant_;
  Writer<JobStatusMessage> jobs_;
  std::optional<Reader<CommandMessage>> asked_;  // where commands are taken
  Writer<CommandResultMessage> results_;
  Writer<FileChunk> files_;
  Reader<PoseStamped> pose_;
  Reader<Imu> imu_;
  Reader<BatteryState> battery_;
  WaitSet waiting_;
  std::map<std::uint64_t, JobStatus> shown_;
  std::deque<Transfer> transfers_;
  WatchedState state_;
  std::atomic<bool> over_ = false;
  std::thread thread_;  // last: it uses the others
};

}  // namespace flappy::server
