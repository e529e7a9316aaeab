// Serves the queue of jobs to the user of this machine: HTTP on a Unix socket, jobs.sock, in the folder of the jobs, which
// its owner alone may open. Bodies are JSON.
//   POST /command        {id, verb, kind, config, job, overrides} -> {id, accepted, job, message}
//   GET /jobs?since=N    {changes, jobs}: the newest first; waits up to half a second for `changes` to differ from N
//   GET /files?job=N             [{name, bytes}]
//   GET /files?job=N&name=NAME   the file
#pragma once

#include <filesystem>
#include <memory>

#include "server/jobs/commands.hpp"

namespace flappy::server {

inline constexpr const char* kSocketName = "jobs.sock";

/// A short path to the socket of a folder, as long as this exists: an address of a Unix socket has at most 107 bytes.
class SocketPath {
 public:
  explicit SocketPath(const std::filesystem::path& folder);  ///< throws io::InputError for what is no folder
  ~SocketPath();
  SocketPath(const SocketPath&) = delete;
  SocketPath& operator=(const SocketPath&) = delete;
  std::string text() const;

 private:
  int folder_;
};

class CommandSocket {
 public:
  /// Answers, in threads of its own, until destroyed. The caller has locked `folder` (Queue). `commands` must outlive it.
  CommandSocket(Commands& commands, const std::filesystem::path& folder);
  ~CommandSocket();

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace flappy::server
