// flappy-gap learn-discrepancy.
#pragma once

#include <string>
#include <vector>

namespace flappy::gap {

struct LearnCommand {
  std::string vehicle, priors, discrepancy, out;
  std::vector<std::string> robots;  ///< folders, each with the flights of one robot
  int threads = 0;
};
/// Learns what models get wrong (gap/evidence/learn_discrepancy.hpp) and writes it. InputError where a log is at fault.
void run_learn_discrepancy(const LearnCommand& command);

}  // namespace flappy::gap
