// Where an exported header comes from, as its contract names it.
#pragma once

#include <string>

namespace flappy::policy {

struct RunInfo {
  std::string config_sha256;  ///< of the resolved configuration
  std::string commit;         ///< of the program that made the run, without "-dirty"
  bool dirty = false;         ///< the program was built from more than that commit
  std::string task;
};

}  // namespace flappy::policy
