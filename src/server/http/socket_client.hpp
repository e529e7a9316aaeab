// Sends commands to the flappy-server of a folder of jobs on this machine (command_socket.hpp).
#pragma once

#include <memory>

#include "server/http/command_socket.hpp"
#include "server/jobs/job_client.hpp"

namespace httplib {
class Client;
}

namespace flappy::server {

class SocketClient : public JobClient {
 public:
  /// Throws io::InputError where no server listens in `folder`.
  SocketClient(const std::filesystem::path& folder, double timeout_s);
  ~SocketClient() override;

  CommandResult ask(Command command) override;
  std::vector<JobStatus> list() override;
  void watch(const std::function<bool(const JobStatus& job)>& see, const std::function<bool()>& keep_going) override;

 private:
  std::vector<JobFile> list_files(std::uint64_t job) override;
  Download download(std::uint64_t job, const std::string& name,
                    const std::function<void(std::string_view)>& write) override;
  struct Listed {
    std::uint64_t changes;
    std::vector<JobStatus> jobs;
  };
  Listed ask_for_jobs(const std::string& query);

  std::filesystem::path folder_;
  SocketPath path_;
  std::unique_ptr<httplib::Client> client_;
  Listed seen_{UINT64_MAX, {}};  ///< what was listed last
};

}  // namespace flappy::server
