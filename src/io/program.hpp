// What every program has: --version, --json FILE, --log-level, one line for each mistake of the user, exit codes.
#pragma once

#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "io/command_line.hpp"

namespace flappy::io {

/// Commit this program was built from, with "-dirty" where the tree differed.
std::string commit();

class Program {
 public:
  /// `facts`: further lines of --version, as "name value".
  Program(const std::string& name, const std::string& description, const std::vector<std::string>& facts);

  ~Program();

  Command app() { return Command(app_.get()); }
  /// Parses, then runs `job`. 0: done; 2: the user's mistake, one line on stderr; 1: ours.
  int run(int argc, char** argv, const std::function<void()>& job);
  /// Writes `result` where --json asked for it; nothing otherwise.
  void write_json(const nlohmann::ordered_json& result) const;

 private:
  std::unique_ptr<CLI::App> app_;
  std::string json_path_, log_level_ = "warning";
};

}  // namespace flappy::io
