// flappy-gap diagnose.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "io/installation.hpp"

namespace flappy::gap {

struct DiagnoseCommand {
  std::string vehicle;
  /// Empty: priors.toml, model_discrepancy.toml and verdict.toml of configs/gap, or of its beat_averaged for such a vehicle.
  std::string priors, discrepancy, verdict;
  std::string
      manoeuvre;  ///< configuration of flappy-fly that the flights flew; empty: the recorded paths, under our hover's
  std::vector<std::string> flights, withheld;
  std::vector<std::string> channels;  ///< that alone are looked at, of a robot that is known by the beat; none: all
  std::string out;                    ///< folder for all files; empty: none
  int threads = 0;                    ///< 0: one for each processor
  bool quiet = false;                 ///< prints nothing
};

/// Diagnoses, prints, writes; the machine-readable result.
nlohmann::ordered_json run_diagnose(const DiagnoseCommand& command);

}  // namespace flappy::gap
