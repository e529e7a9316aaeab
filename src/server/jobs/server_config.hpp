// The configuration of flappy-server.
#pragma once

#include <string>
#include <vector>

#include "io/config.hpp"
#include "io/dds_config.hpp"
#include "server/jobs/job_types.hpp"

namespace flappy::server {

/// Where jobs go, in the folder in which flappy-server is started, unless its configuration says so.
inline constexpr const char* kJobsFolder = "runs/server";

enum class BackendKind { local, slurm };

struct JobsConfig {
  Folders folders;  ///< absolute paths; `output` is created where it is missing
  BackendKind backend = BackendKind::local;
  int at_once = 1;
  int threads = 0;                  ///< of each job; 0: processors / at_once, or all that Slurm gives
  int attempts = 3;                 ///< number of crashes after which a job fails
  double grace_s = 30;              ///< time from the request to stop until the job is killed
  std::vector<std::string> sbatch;  ///< additional options of sbatch
};

struct HttpConfig {
  std::string listen;              ///< ADDRESS:PORT; empty: no dashboard
  std::vector<std::string> hosts;  ///< additional names accepted in the Host header
  int streams = 4;                 ///< most simultaneous clients of /events
  double patience_s = 5;           ///< time limit for a whole request, and for each piece of an answer to be taken
};

struct RateConfig {
  double per_client_hz = 5, all_hz = 50;
  double burst_s = 4;  ///< a bucket holds the tokens of this many seconds
};

struct ServerConfig {
  JobsConfig jobs;
  HttpConfig http;
  RateConfig rates;
  io::DdsConfig dds;
};

ServerConfig read_server_config(const std::filesystem::path& path, const std::vector<std::string>& overrides = {});

}  // namespace flappy::server
