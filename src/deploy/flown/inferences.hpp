// What an exported policy got and gave on a robot with inputs, whose autopilot estimates: nothing is to be replayed there
// but the policy itself, and the inputs that follow from what it gave.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "deploy/flown/exported_c.hpp"
#include "deploy/flown/onboard_log.hpp"

namespace flappy::deploy {

/// An input of the log: the first value at or after each inference, in the order of OnboardLog::inferences.
struct LoggedInput {
  std::string name;
  std::vector<double> value;
};

struct Inferences {
  struct Input {
    std::string name;
    double share = 0;   ///< of the inferences after which it is within 1 % of its range of what they asked for
    double offset = 0;  ///< median of what was set less what was asked for

    /// Whether 95 % of the inferences are followed.
    bool follows() const;
  };
  std::size_t rows = 0, same = 0;  ///< inferences of the log, and those with the exported policy's outputs
  std::string output;              ///< the output that differs most, and by how much of its range; empty: none
  double largest = 0;
  std::vector<Input> inputs;

  /// Whether 99 % of the inferences are the exported policy's, and each input follows.
  bool as_exported() const;
};

/// `folder`: what flappy-export wrote. io::InputError where the log lacks a number of the policy.
Inferences check_inferences(const std::filesystem::path& folder, const Contract& contract, const OnboardLog& log,
                            const std::vector<LoggedInput>& inputs);

}  // namespace flappy::deploy
