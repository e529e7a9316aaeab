// flappy-gap diagnose.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace flappy::gap {

struct DiagnoseCommand {
  std::string vehicle, priors = FLAPPY_CONFIGS "/gap/priors.toml",
                       discrepancy = FLAPPY_CONFIGS "/gap/model_discrepancy.toml",
                       verdict = FLAPPY_CONFIGS "/gap/verdict.toml";
  std::string
      manoeuvre;  ///< configuration of flappy-fly that the flights flew; empty: the recorded paths, under our hover's
  std::vector<std::string> flights, withheld;
  std::string out;  ///< folder for all files; empty: none
  int threads = 0;  ///< 0: one for each processor
};

/// Diagnoses, prints, writes; the machine-readable result.
nlohmann::ordered_json run_diagnose(const DiagnoseCommand& command);

}  // namespace flappy::gap
