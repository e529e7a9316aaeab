// flappy-gap diagnose: a diagnosis (diagnose.hpp) with its progress line, its files and its summary. The program (also
// in jobs of the server) and the Python module call it; the blind benchmark calls diagnose() itself.
#pragma once

#include <nlohmann/json.hpp>

#include "gap/diagnose/diagnose.hpp"

namespace flappy::gap {

struct DiagnoseCommand {
  DiagnosisSettings settings;  ///< each withheld effect withholds its whole group of the catalogue
  /// Folder for diagnosis.json, log.txt and vehicle_corrected.toml; the last is not written if the data are faulty or
  /// the diagnosis was stopped. Files of an earlier diagnosis are removed. Empty: no files are written.
  std::string out;
  bool quiet = false;  ///< prints no summary
};

/// Diagnoses, writes the files, prints the summary and returns the content of diagnosis.json. After Ctrl-C the result
/// is incomplete, or lacks the closed-loop check or the proposed flight. io::InputError as from read_request and
/// diagnose, and for a folder that cannot be written.
nlohmann::ordered_json run_diagnose(const DiagnoseCommand& command);

}  // namespace flappy::gap
