// What every program shares: --version, --json, --progress, --log-level, one line for each user error, exit codes.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "io/command_line.hpp"
#include "io/ranks.hpp"

namespace flappy::io {

/// The commit that this program was built from, with "-dirty" where the source tree had changes.
std::string commit();
std::string hexadecimal(std::uint64_t value);  ///< 16 digits

/// The last line of a program's output: the command that shows the results at `path`.
std::string shown_by(const std::string& path);

class Program {
 public:
  /// `facts`: additional lines of --version, each "name value".
  Program(const std::string& name, const std::string& description, const std::vector<std::string>& facts);

  ~Program();

  Command app() { return Command(app_.get()); }
  /// Parses, then runs `job`. Returns the exit code: 0 done; 1 our fault; 2 error of the user, one line on stderr.
  int run(int argc, char** argv, const std::function<void()>& job);
  /// Allows several ranks: adds --allow-network, lets only rank 0 print, and divides the processors.
  void takes_ranks();
  /// The ranks; null where there is only one process. The first call meets the other ranks, with `agreed` as in meet().
  Ranks* ranks(const std::string& agreed);
  bool writes() const { return rank_.rank == 0; }  ///< the common results
  /// Writes `result` to the file of --json; does nothing without that option.
  void write_json(const nlohmann::ordered_json& result) const;
  /// write_json() for results that flappy-report shows; prints that command.
  void write_shown_json(const nlohmann::ordered_json& result) const;

 private:
  std::unique_ptr<CLI::App> app_;
  std::string json_path_, progress_path_, log_level_ = "warning";
  bool takes_ranks_ = false, allow_network_ = false;
  Rank rank_;
  std::unique_ptr<Ranks> ranks_;
};

}  // namespace flappy::io
