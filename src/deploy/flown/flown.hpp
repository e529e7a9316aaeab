// Says whether a robot flew what was exported: its log, replayed through the exported C, gives the voltages that it
// logged, or which mistake of its firmware explains them.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "deploy/flown/mistakes.hpp"
#include "deploy/flown/onboard_log.hpp"

namespace flappy::deploy {

struct FlownMistake {
  Stage stage = Stage::sensor;
  std::string id, words;
};

struct Flown {
  bool as_exported = false;
  double share = 0;         ///< share of the commands that are within tolerance of the exported C
  double tolerance_V = 0;   ///< median over commands
  double from_s = 0;        ///< first command that differs, on the log's clock
  OnboardLog::Mode mode{};  ///< this and begin_s: as logged, or else as they explain the log best
  std::optional<double> begin_s;
  std::vector<FlownMistake> mistakes;  ///< that explain it together; empty: none does
  double explained = 0;                ///< share of the commands within tolerance with these mistakes
  std::string unexplained;             ///< where nothing explains it: what differs
};

/// Checks one flight. `folder`: what flappy-export wrote. io::InputError for a folder without headers or contract.json.
class FlownCheck {
 public:
  explicit FlownCheck(const std::filesystem::path& folder);
  Flown check(const OnboardLog& log) const;
  const Contract& contract() const { return contract_; }
  /// Numbers that a start_memory of a log has to have.
  std::size_t remembered() const { return library(Build::exact).remembered(); }
  const std::filesystem::path& folder() const { return folder_; }

 private:
  const ExportedC& library(Build build) const;
  std::filesystem::path folder_;
  Contract contract_;
  bool has_int8_;
  mutable std::map<Build, std::unique_ptr<const ExportedC>> libraries_;  ///< compiled when first used
  mutable bool no_clang_ = false;                                        ///< contracted products are not tried
  std::vector<Mistake> mistakes_;
};

}  // namespace flappy::deploy
