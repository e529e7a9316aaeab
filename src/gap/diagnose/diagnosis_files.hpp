#pragma once

#include <filesystem>

#include "gap/result/diagnosis.hpp"

namespace flappy::gap {

inline constexpr const char *kDiagnosisFile = "diagnosis.json", *kVehicleFile = "vehicle_corrected.toml",
                            *kResidualsFile = "residuals.csv", *kHypothesesFile = "hypotheses.csv";

/// Writes diagnosis.json, residuals.csv (a row for each test) and hypotheses.csv (a row for each parameter of each
/// hypothesis).
void write_diagnosis(const std::filesystem::path& folder, const Diagnosis& diagnosis);

}  // namespace flappy::gap
