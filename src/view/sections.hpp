// Makes a section of a page from the results of each program. Throws io::InputError where the file is something else.
#pragma once

#include <filesystem>

#include "gap/result/diagnosis.hpp"
#include "view/page.hpp"

namespace flappy::view {

/// The section of a diagnosis: where the gap lies, which effect causes it, how far it shrinks, what to fly next; words
/// first. `file`: diagnosis.json. The block "anatomy": {"parts": [{"channel", "name", "short", "ratio", "text"}],
/// "wings", "note"}: the ratio of each channel's residual to its noise, and whether the robot is drawn with wings.
Section diagnosis_section(const std::filesystem::path& file);

/// Adds the validation of a diagnosis that has one: held-out flights, controls, and fits to single flights.
void add_validation(Section& section, const gap::Diagnosis& diagnosis);

/// A design study of flappy-design: what the published robot gives away, the designs beside it, what they are sensitive
/// to. `file`: design.json; designs' vehicles are read beside it. The block "robots": {"robots": [{"name",
/// "shape": shape.hpp, "limits": [text], "worth": [[name, text]], "built": [[name, text]]}], "note"}; the first robot is
/// the published one, and all have the same names.
Section design_section(const std::filesystem::path& file);

Section evaluation_section(const std::filesystem::path& file);  ///< of flappy-eval, with or without --effects

Section identification_section(const std::filesystem::path& file);  ///< of flappy-identify forces

Section plan_section(const std::filesystem::path& file);  ///< of flappy-gap plan

/// Figures of flappy-bench --figures over commits, a plot each, machines by colour.
Section speed_section(const std::filesystem::path& file);

Section run_section(const std::filesystem::path& folder);  ///< a run of flappy-train, or several (--seeds)

/// A scored blind benchmark: its folder, or score.csv alone, such as docs/results/blind_alone.csv; reads predictions
/// next to it. The block "cases": {"cases": [{"number", "part", "truth", "verdict", "named",
/// "probability", "right", "details": [[name, text]], "rivals": [[name, probability]]}]}.
Section benchmark_section(const std::filesystem::path& path);

}  // namespace flappy::view
