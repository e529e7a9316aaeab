// Sends commands to flappy-server over DDS (command_server.hpp).
#pragma once

#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "server/dds/participant.hpp"
#include "server/jobs/job_client.hpp"

namespace flappy::server {

class CommandClient : public JobClient {
 public:
  /// Throws io::InputError where no server answers within `timeout_s`.
  CommandClient(const io::DdsConfig& config, double timeout_s);

  CommandResult ask(Command command) override;
  std::vector<JobStatus> list() override;
  void watch(const std::function<bool(const JobStatus& job)>& see, const std::function<bool()>& keep_going) override;

 private:
  std::vector<JobFile> list_files(std::uint64_t job) override;
  Download download(std::uint64_t job, const std::string& name,
                    const std::function<void(std::string_view)>& write) override;
  /// A FileChunk that has been received.
  struct Piece {
    std::string name, data;
    std::uint64_t size = 0, offset = 0;
    std::uint32_t left = 0;
  };
  CommandResult await(const std::string& id);
  /// Asks for a file, or "" for the list of files, and passes its pieces on. False: there is no such file, or no longer.
  bool ask_for(std::uint64_t job, const std::string& name, const std::function<void(const Piece&)>& see);
  void take_jobs();
  /// Keeps the pieces that answer command `id`. Others, which another client has asked for, are dropped, for a reader that
  /// is full holds up the server.
  void take_pieces(const std::string& id);

  double timeout_s_;
  Participant participant_;
  Writer<CommandMessage> command_;
  Reader<CommandResultMessage> results_;
  Reader<JobStatusMessage> jobs_;
  std::string files_topic_;
  std::optional<Reader<FileChunk>> files_;  // from the first fetch on
  std::deque<Piece> pieces_;
  WaitSet waiting_;
  std::vector<JobStatus> heard_;  // received, not yet passed on
};

}  // namespace flappy::server
