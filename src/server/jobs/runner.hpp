// Runs the jobs of a queue, each as a process of its own: a crash costs one job. The queue and the jobs' folders say all there is to know,
// so that a runner which is killed at any moment is followed by one that goes on:
//
//   taken     the job's folder is locked, then the queue has it as running, then the minder starts with the lock
//   living    somebody has the folder's lock: our child, or what a killed server started, which is adopted
//   ended     the folder is free, and says by .exit and result.json how it ended; then the queue does
//
// Killed before the minder starts, the job begins again, for nothing has begun; killed later, it is adopted or its end is read.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <vector>

#include "server/jobs/backend.hpp"
#include "server/jobs/kinds.hpp"
#include "server/jobs/queue.hpp"
#include "server/jobs/server_config.hpp"

namespace flappy::server {

struct RunnerOptions {
  JobsConfig config;
  std::filesystem::path server;    ///< flappy-server, which is every job's minder
  std::filesystem::path programs;  ///< the folder of flappy-train and its like
  std::vector<Kind> kinds = server::kinds();
};

/// One thread.
class Runner {
 public:
  Runner(Queue& queue, RunnerOptions options);

  /// Looks after all that runs, and starts what may.
  void step();
  /// step() for as long as it is told to; then what runs on this machine stops cleanly and is queued again. What Slurm runs goes on.
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
  void tell_progress(const Job& job);
  Ending ending_of(const Job& job) const;
  Ending crash(const Job& job, std::optional<int> code, const std::string& what) const;
  void put_off(const Job& job, const std::string& why);
  void start(const Job& queued);

  Queue& queue_;
  RunnerOptions options_;
  std::unique_ptr<Backend> backend_;
  std::set<std::uint64_t> started_here_;        ///< jobs whose last attempt this runner started
  std::map<std::uint64_t, Request> requests_;   ///< by job: how it was asked to stop
  std::map<std::uint64_t, double> reported_s_;  ///< by job
  std::map<std::uint64_t, Delay> delays_;       ///< by job that could not be started
};

}  // namespace flappy::server
