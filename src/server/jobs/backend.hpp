// Backends run the attempts of jobs: on this machine, or on the nodes that Slurm assigns.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "server/jobs/process.hpp"
#include "server/jobs/queue.hpp"
#include "server/jobs/server_config.hpp"

namespace flappy::server {

enum class Life { alive, gone, unknown };

class Backend {
 public:
  virtual ~Backend() = default;
  /// Starts the supervisor of `job`, which the queue has as running; it inherits `lock`. Tells the queue the process or
  /// the Slurm job. Throws std::system_error or io::InputError where the start fails.
  virtual void start(Queue& queue, const Job& job, const std::filesystem::path& folder,
                     const std::vector<std::string>& supervisor, const JobLock& lock) = 0;
  /// Whether the last attempt of `job` still runs; this server or an earlier one may have started it.
  virtual Life look(Queue& queue, const Job& job, const std::filesystem::path& folder) = 0;
  /// Asks the program to stop cleanly, or kills it. Returns false where it cannot be reached yet.
  virtual bool stop(const Job& job, bool kill) = 0;
  /// Whether its jobs run on this machine, so that they end with the server and with the machine.
  virtual bool is_local() const = 0;
};

std::unique_ptr<Backend> local_backend();
/// `queue`: Queue::name(), which tells its jobs from those of another queue in the same Slurm.
std::unique_ptr<Backend> slurm_backend(const std::string& queue, const JobsConfig& config);

}  // namespace flappy::server
