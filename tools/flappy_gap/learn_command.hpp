#pragma once

#include <nlohmann/json.hpp>
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

struct LearnSessionsCommand {
  std::vector<std::string>
      robots;  ///< VEHICLE:DIR or VEHICLE:DIR:DIR..., folders of flights in which the robot flew the same
  std::string sessions, out;  ///< to begin with; the file
  int threads = 0;
};
/// Writes how much sessions differ to `out`; returns how well each robot's sessions are foretold by what the others say.
nlohmann::ordered_json run_learn_sessions(const LearnSessionsCommand& command);

}  // namespace flappy::gap
