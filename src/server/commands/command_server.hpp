// Serves the queue of jobs over DDS. All topics are reliable; their types bound every string. Rates are limited per
// client process, whatever ids its commands have.
//
//   /flappy/jobs             JobStatus       each job when it changes, and all jobs after the command "list"
//   /flappy/command          Command         where enabled; for "fetch", config is a file of the job; empty: list them
//   /flappy/command_result   CommandResult   answer to every command; for "list", job is the number of JobStatus sent
//   /flappy/files            FileChunk       answer to "fetch"
#pragma once

#include <atomic>
#include <deque>
#include <map>
#include <optional>
#include <thread>

#include "server/dds/participant.hpp"
#include "server/jobs/commands.hpp"
#include "server/live_state.hpp"

namespace flappy::server {

class CommandServer {
 public:
  /// Starts to answer, in a thread of its own. Also sets `watched` from the topics of the watched flapper.
  CommandServer(const io::DdsConfig& config, Commands& commands, LiveState& watched);
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
  LiveState& watched_;
  Participant participant_;
  Writer<JobStatusMessage> jobs_;
  std::optional<Reader<CommandMessage>> asked_;  // empty where commands are disabled
  Writer<CommandResultMessage> results_;
  Writer<FileChunk> files_;
  Reader<PoseStamped> pose_;
  Reader<Imu> imu_;
  Reader<BatteryState> battery_;
  WaitSet waiting_;
  std::map<std::uint64_t, JobStatus> shown_;
  std::deque<Transfer> transfers_;
  ShownState state_;
  std::atomic<bool> over_ = false;
  std::thread thread_;  // last member, because the thread uses the others
};

}  // namespace flappy::server
