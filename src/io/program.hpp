// What every program has: --version, --json FILE, --log-level, one line for each mistake of the user, exit codes.
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

/// Commit this program was built from, with "-dirty" where the tree differed.
std::string commit();
/// A hash as results show it: 16 digits.
std::string hexadecimal(std::uint64_t value);

/// What shows results that lie at `path`: a program's last words.
std::string shown_by(const std::string& path);

class Program {
 public:
  /// `facts`: further lines of --version, as "name value".
  Program(const std::string& name, const std::string& description, const std::vector<std::string>& facts);

  ~Program();

  Command app() { return Command(app_.get()); }
  /// Parses, then runs `job`. 0: done; 2: the user's mistake, one line on stderr; 1: ours.
  int run(int argc, char** argv, const std::function<void()>& job);
  /// Several ranks may run the program together: an option --allow-network, the first rank alone speaks, and threads are shared.
  void takes_ranks();
  /// The ranks that run it, none for one: meets them where it is first called. They end together. `agreed` as meet() has it.
  Ranks* ranks(const std::string& agreed);
  /// Whether this is the rank that writes what all of them found.
  bool writes() const { return rank_.rank == 0; }
  /// Writes `result` where --json asked for it; nothing otherwise.
  void write_json(const nlohmann::ordered_json& result) const;
  /// The same, of results that flappy-report shows, which is said then.
  void write_shown_json(const nlohmann::ordered_json& result) const;

 private:
  std::unique_ptr<CLI::App> app_;
  std::string json_path_, progress_path_, log_level_ = "warning";
  bool takes_ranks_ = false, allow_network_ = false;
  Rank rank_;
  std::unique_ptr<Ranks> ranks_;
};

}  // namespace flappy::io
