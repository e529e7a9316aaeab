// What a diagnosis leaves in its folder beside the corrected vehicle.
#pragma once

#include <filesystem>

#include "gap/diagnose/report.hpp"

namespace flappy::gap {

/// residuals.csv: every test of where; candidates.csv: a line for each parameter of each candidate; unexplained.csv: what no entry
/// explains.
void write_tables(const std::filesystem::path& folder, const Report& report);

}  // namespace flappy::gap
