// diagnosis.json: the one writer and reader of a diagnosis (docs/reference/formats.md).
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "gap/result/diagnosis.hpp"

namespace flappy::gap {

/// Schema of diagnosis.json. Size: a number of the format.
inline constexpr int kDiagnosisSchema = 3;
/// Files of a diagnosis in its folder.
inline constexpr const char *kDiagnosisFile = "diagnosis.json", *kVehicleFile = "vehicle_corrected.toml";

nlohmann::ordered_json to_json(const Diagnosis& diagnosis);
/// Writes kDiagnosisFile into the folder, atomically.
void write_diagnosis(const std::filesystem::path& folder, const Diagnosis& diagnosis);

/// Reads what to_json wrote. `file`: named in errors. io::InputError if `json` is not a diagnosis, or has another
/// schema.
Diagnosis diagnosis_from(const nlohmann::ordered_json& json, const std::filesystem::path& file);

}  // namespace flappy::gap
