// Serves the queue of jobs over DDS. All topics are reliable, and every string of their types has a greatest length.
// The rate of commands is limited for each client process.
//
// The topics of the namespace "flappy" (DdsConfig::name_space):
//
//   /flappy/jobs             JobStatus       each job within 0.1 s of a change; after the verb "list" the newest 1000
//   /flappy/command          Command         only if DdsConfig::commands; "fetch" asks for file `config` of the
//                                            job, or for the list of its files if it is empty
//   /flappy/command_result   CommandResult   answer to every command; for "list", `job` is the number of JobStatus sent
//   /flappy/files            FileChunk       a piece of a fetched file, or without data for each file of the list
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
  /// Starts to answer, in a thread of its own, until destroyed; does not look at config.enabled. The thread also reads
  /// the topics pose, imu and battery of the namespace into `watched`. `commands` and `watched` must outlive it.
  CommandServer(const io::DdsConfig& config, Commands& commands, LiveState& watched);
  ~CommandServer();

 private:
  struct Transfer {
    std::string id;
    std::uint64_t job, size, offset;
    std::string name;
    double moved_s;  ///< when it was begun, or its last piece was taken
  };

  void run();
  void take_commands();
  void answer(const Command& command);
  CommandResult fetch(const Command& command);
  void send_pieces();
  void show_changes(bool all);
  void read_watched();

  Commands& commands_;
  LiveState& watched_;
  Participant participant_;
  Writer<JobStatusMessage> jobs_;
  std::optional<Reader<CommandMessage>> asked_;  // empty if commands are disabled
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
