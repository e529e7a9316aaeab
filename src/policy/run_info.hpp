// Origin of an exported policy, for its contract.
#pragma once

#include <string>

namespace flappy::policy {

struct RunInfo {
  std::string config_sha256;  ///< SHA-256 of the resolved configuration
  std::string commit;         ///< commit of the program that made the run, without "-dirty"
  bool dirty = false;         ///< the program had changes that were not committed
  std::string task;
};

}  // namespace flappy::policy
