// The configuration of flappy-server.
#pragma once

#include <string>
#include <vector>

#include "io/config.hpp"
#include "io/dds_config.hpp"
#include "server/jobs/kinds.hpp"

namespace flappy::server {

enum class BackendKind { local, slurm };

struct JobsConfig {
  Folders folders;  ///< absolute; `output` is made where it is missing
  BackendKind backend = BackendKind::local;
  int at_once = 1;
  int threads = 0;                  ///< of each job; 0: one for each processor
  int attempts = 3;                 ///< so many crashes fail a job
  double grace_s = 30;              ///< between the request to stop and the end of patience
  std::vector<std::string> sbatch;  ///< further options of sbatch, as the site needs them
};

struct HttpConfig {
  std::string listen;              ///< ADDRESS:PORT; empty: nothing listens
  std::vector<std::string> hosts;  ///< names in the Host header that are ours besides
  int streams = 4;                 ///< most clients of /events at a time
  double patience_s = 5;           ///< with a request, and with a client that is to take an answer
};

/// What a client may ask per second, and at once after a pause.
struct RateConfig {
  double per_client_hz = 5, all_hz = 50;
  double burst_s = 4;  ///< so many seconds of it
};

struct ServerConfig {
  JobsConfig jobs;
  HttpConfig http;
  RateConfig rates;
  io::DdsConfig dds;
};

ServerConfig read_server_config(const std::filesystem::path& path, const std::vector<std::string>& overrides = {});

}  // namespace flappy::server
