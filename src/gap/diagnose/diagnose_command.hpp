#pragma once

#include <nlohmann/json.hpp>

#include "gap/diagnose/diagnose.hpp"

namespace flappy::gap {

struct DiagnoseCommand {
  DiagnosisSettings settings;  ///< a withheld effect withholds its whole group
  std::string out;             ///< folder for all files; empty: no files are written
  bool quiet = false;          ///< prints nothing
};

/// Diagnoses, writes the files and returns the content of diagnosis.json. After Ctrl-C it is incomplete, or lacks the
/// closed-loop check or the proposed flight. io::InputError as from read_request and diagnose.
nlohmann::ordered_json run_diagnose(const DiagnoseCommand& command);

}  // namespace flappy::gap
