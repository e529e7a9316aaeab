// Results as sections of a page. Each reads what its program wrote, and is io::InputError where the file is something else.
#pragma once

#include <filesystem>

#include "gap/result/diagnosis.hpp"
#include "view/page.hpp"

namespace flappy::view {

/// Where the gap lies, which effect causes it, how far it shrinks, what to fly next; words first, then the picture. `file`:
/// diagnosis.json.
///
/// The block "anatomy": {"parts": [{"channel", "name", "short", "ratio", "text"}], "wings", "note"}: how far each channel's residual is
/// above noise, and whether the robot is drawn with wings.
Section diagnosis_section(const std::filesystem::path& file);

/// Adds the validation of a diagnosis, which has one: flights held out, controls, and each flight alone.
void add_validation(Section& section, const gap::Diagnosis& diagnosis);

/// Of flappy-eval, with or without --effects.
Section evaluation_section(const std::filesystem::path& file);

/// Of flappy-identify forces.
Section identification_section(const std::filesystem::path& file);

/// Of a run folder of flappy-train, or the folder of several that --seeds leaves.
Section run_section(const std::filesystem::path& folder);

/// Of a scored blind benchmark: its folder, or score.csv alone, as docs/blind_reported.csv. Predictions and sealed labels are
/// read where they lie beside it.
///
/// The block "cases": {"cases": [{"number", "part", "truth", "verdict", "named", "probability", "right", "details": [[name, text]],
/// "rivals": [[name, probability]]}]}.
Section benchmark_section(const std::filesystem::path& path);

}  // namespace flappy::view
