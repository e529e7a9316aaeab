// Asks a server of jobs over DDS (command_server.hpp).
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "server/dds/participant.hpp"
#include "server/jobs/commands.hpp"

namespace flappy::server {

class CommandClient {
 public:
  /// io::InputError, here and below, where no server answers within the time.
  CommandClient(const io::DdsConfig& config, double timeout_s);

  /// What the server says of it; its id is made here where it has none.
  CommandResult ask(Command command);
  /// All jobs, newest first.
  std::vector<JobStatus> list();
  /// Jobs as they change, until `see` says false.
  void watch(const std::function<bool(const JobStatus& job)>& see, const std::function<bool()>& keep_going);
  /// Files of a job into a folder, under their names; how many. `see` is told of each before it comes.
  std::size_t fetch(std::uint64_t job, const std::filesystem::path& folder,
                    const std::function<void(const JobFile&)>& see);

 private:
  CommandResult await(const std::string& id, const std::function<void()>& meanwhile);
  void take_jobs();

  double timeout_s_;
  Participant participant_;
  Writer<CommandMessage> command_;
  Reader<CommandResultMessage> results_;
  Reader<JobStatusMessage> jobs_;
  Reader<FileChunk> files_;
  WaitSet waiting_;
  std::vector<JobStatus> heard_;  // that nobody has looked at
};

}  // namespace flappy::server
