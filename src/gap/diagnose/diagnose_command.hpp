// flappy-gap diagnose.
#pragma once

#include <nlohmann/json.hpp>

#include "gap/diagnose/diagnose.hpp"

namespace flappy::gap {

struct DiagnoseCommand {
  DiagnosisSettings settings;  ///< of a withheld effect the whole group is withheld
  std::string out;             ///< folder for all files; empty: none
  bool quiet = false;          ///< prints nothing
};

/// Diagnoses, prints, writes; returns the content of diagnosis.json. After Ctrl-C the diagnosis is incomplete, or what is ahead is left out.
nlohmann::ordered_json run_diagnose(const DiagnoseCommand& command);

}  // namespace flappy::gap
