// What a client asks of a flappy-server, over whatever it is reached by.
#pragma once

#include <filesystem>
#include <functional>
#include <string_view>
#include <vector>

#include "server/jobs/commands.hpp"

namespace flappy::server {

/// All throw io::InputError where the server does not answer in time.
class JobClient {
 public:
  virtual ~JobClient() = default;
  /// Sends a command and returns the server's answer. An empty id is replaced by a random one.
  virtual CommandResult ask(Command command) = 0;
  virtual std::vector<JobStatus> list() = 0;  ///< newest first
  /// Calls `see` with each job that changes, until `see` or `keep_going` returns false.
  virtual void watch(const std::function<bool(const JobStatus& job)>& see, const std::function<bool()>& keep_going) = 0;
  /// Downloads a job's files into `folder`, under their names, and returns their number. Calls `see` before each. A file
  /// that is removed after the list was made, as a training does with old checkpoints, is left out with a warning.
  std::size_t fetch(std::uint64_t job, const std::filesystem::path& folder,
                    const std::function<void(const JobFile&)>& see);

 protected:
  virtual std::vector<JobFile> list_files(std::uint64_t job) = 0;
  /// changed: the file was replaced while it came, as a training that goes on does with its files.
  enum class Download { whole, changed, gone };
  /// Downloads a file once, and calls `write` with its pieces in order.
  virtual Download download(std::uint64_t job, const std::string& name,
                            const std::function<void(std::string_view)>& write) = 0;
};

/// 32 random hexadecimal digits.
std::string fresh_id();

/// Where a file that the server names goes below `folder`; the folder is made. Throws io::InputError for a name that
/// would leave it: a server need not be trusted.
std::filesystem::path place_of(const std::filesystem::path& folder, const std::string& name);

}  // namespace flappy::server
