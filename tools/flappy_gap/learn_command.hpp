#pragma once

#include <string>
#include <vector>

namespace flappy::gap {

struct LearnCommand {
  std::string vehicle, priors, discrepancy, out;
  std::vector<std::string> robots;  ///< folders, each with the flights of one robot
  std::vector<std::string> pairs;   ///< REFERENCE:TEST, folders with two sessions of one robot each
  std::string sessions;             ///< what is believed to differ between sessions, to begin with
  int threads = 0;
};
/// Writes the learnt model discrepancy to `out`, or from pairs what differs between sessions. io::InputError if a log has a fault.
void run_learn_discrepancy(const LearnCommand& command);

}  // namespace flappy::gap
