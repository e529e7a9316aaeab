// flappy-gap diagnose.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "io/installation.hpp"

namespace flappy::gap {

struct DiagnoseCommand {
  std::string vehicle, priors = io::config_path("gap/priors.toml"),
                       discrepancy = io::config_path("gap/model_discrepancy.toml"),
                       verdict = io::config_path("gap/verdict.toml");
  std::string
      manoeuvre;  ///< configuration of flappy-fly that the flights flew; empty: the recorded paths, under our hover's
  std::vector<std::string> flights, withheld;
  std::string out;     ///< folder for all files; empty: none
  int threads = 0;     ///< 0: one for each processor
  bool quiet = false;  ///< prints nothing
};

/// Diagnoses, prints, writes; the machine-readable result.
nlohmann::ordered_json run_diagnose(const DiagnoseCommand& command);

}  // namespace flappy::gap
