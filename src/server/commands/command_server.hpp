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
//
// Answers wait for the asking process's readers: up to 3 s on command_result (and jobs, for "list"), up to 10 s on files.
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
  /// The list of a job's files, or one of them, on its way to a client.
  struct Transfer {
    std::string id, client;
    std::uint64_t job = 0;
    std::vector<JobFile> files = {};  ///< of the list; empty for a file
    std::string name = {};
    std::uint64_t size = 0, offset = 0;  ///< bytes; of a list, `offset` files are sent
    double moved_s = 0;                  ///< when it was asked for, or its last piece was taken
    bool begun = false, over = false;    ///< whether the first piece, and the last, are taken
  };
  /// An answer that is not sent yet.
  struct Answer {
    std::string client;
    CommandResult result;
    bool lists;
    double asked_s;
  };

  void run();
  void take_commands();
  void answer(const Command& command);
  bool send(Answer& a);
  void send_answers();
  CommandResult fetch(const Command& command);
  bool send_pieces();
  bool send_item(Transfer& t);
  bool send_piece(Transfer& t);
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
  std::uint64_t shown_changes_ = UINT64_MAX;  ///< Commands::changes() when jobs were shown last
  std::deque<Answer> answers_;
  std::deque<Transfer> transfers_;
  ShownState state_;
  std::atomic<bool> over_ = false;
  std::thread thread_;  // last member, because the thread uses the others
};

}  // namespace flappy::server
