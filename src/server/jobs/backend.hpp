// Where attempts of jobs run: on this machine, or wherever Slurm puts them.
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
  /// Starts the minder of a job that the queue has as running, in the job's folder, which `lock` holds; the queue is told what is known of
  /// it. std::system_error or io::InputError where that fails.
  virtual void start(Queue& queue, const Job& job, const std::filesystem::path& folder,
                     const std::vector<std::string>& minder, const JobLock& lock) = 0;
  /// Of an attempt that this server or one before it started.
  virtual Life look(Queue& queue, const Job& job, const std::filesystem::path& folder) = 0;
  /// Asks the program to stop cleanly, or kills it. False where it cannot be reached yet.
  virtual bool stop(const Job& job, bool kill) = 0;
  /// Whether its jobs end with the server, and with the machine.
  virtual bool is_local() const = 0;
};

std::unique_ptr<Backend> local_backend();
/// `queue`: the name that tells its jobs from those of another queue in the same Slurm.
std::unique_ptr<Backend> slurm_backend(const std::string& queue, const JobsConfig& config);

}  // namespace flappy::server
