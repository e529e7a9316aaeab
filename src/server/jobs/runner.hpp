// Runs each job of a queue in a process of its own, so that a crash costs one job. All state is in the queue and in the
// jobs' folders, so a new runner can take over from one that was killed at any moment:
//
//   start  the runner locks the folder, marks the job as running, then starts the supervisor, which inherits the lock
//   alive  a process holds the lock: our child, or one that a killed server started and that we adopt
//   end    the lock is free; attempt_N.exit and result.json say how the attempt ended; then the queue records it
//
// If the runner is killed before the supervisor starts, the next runner starts the job again; if later, it adopts the
// job or reads its end.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <vector>

#include "server/jobs/backend.hpp"
#include "server/jobs/job_types.hpp"
#include "server/jobs/queue.hpp"
#include "server/jobs/server_config.hpp"

namespace flappy::server {

struct RunnerOptions {
  JobsConfig config;
  std::filesystem::path server;    ///< the program flappy-server, which also serves as supervisor
  std::filesystem::path programs;  ///< folder of flappy-train and the other programs
  std::vector<JobType> kinds = server::job_types();
};

/// Only one thread may use it.
class Runner {
 public:
  Runner(Queue& queue, RunnerOptions options);

  /// Updates all running jobs and starts as many queued ones as config.at_once allows.
  void step();
  /// Calls step() while keep_going(). Then stops local jobs cleanly and queues them again; jobs in Slurm go on.
  void run(const std::function<bool()>& keep_going);

 private:
  struct Request {
    int attempt = 0;
    double asked_s = 0;
    bool killed = false;
  };

  struct Delay {
    double length_s = 0, until_s = 0;
  };

  std::filesystem::path folder_of(const Job& job) const;
  Launch launch_of(const Job& job) const;
  bool look_after_all();
  void look_after(const Job& job);
  void ask_to_stop(const Job& job);
  void record_progress(const Job& job);
  Ending ending_of(const Job& job) const;
  Ending crash(const Job& job, std::optional<int> code, const std::string& what) const;
  void put_off(const Job& job, const std::string& why);
  void start(const Job& queued);

  Queue& queue_;
  RunnerOptions options_;
  std::unique_ptr<Backend> backend_;
  std::set<std::uint64_t> started_here_;        ///< jobs whose last attempt this runner started
  std::map<std::uint64_t, Request> requests_;   ///< [job] request to stop
  std::map<std::uint64_t, double> reported_s_;  ///< [job] time of the last progress report
  std::map<std::uint64_t, Delay> delays_;       ///< [job] wait after a failed start
};

}  // namespace flappy::server
