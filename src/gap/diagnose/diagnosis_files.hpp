// The files of a diagnosis in its folder.
#pragma once

#include <filesystem>

#include "gap/result/diagnosis.hpp"

namespace flappy::gap {

inline constexpr const char *kDiagnosisFile = "diagnosis.json", *kVehicleFile = "vehicle_corrected.toml",
                            *kResidualsFile = "residuals.csv", *kHypothesesFile = "hypotheses.csv";

/// diagnosis.json with all of it; for a spreadsheet residuals.csv, a line for each test of a residual, and hypotheses.csv, a line for each
/// parameter of each hypothesis.
void write_diagnosis(const std::filesystem::path& folder, const Diagnosis& diagnosis);

}  // namespace flappy::gap
