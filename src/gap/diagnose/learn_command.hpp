#pragma once

#include <string>
#include <vector>

namespace flappy::gap {

struct LearnCommand {
  std::string vehicle, priors, discrepancy, out;
  std::vector<std::string> robots;  ///< folders, each with the flights of one robot
  int threads = 0;
};
/// Writes the learnt model discrepancy to `out`. io::InputError if a log has a fault.
void run_learn_discrepancy(const LearnCommand& command);

}  // namespace flappy::gap
