// A diagnosis in fewer than kSummaryLines lines that a person can act on.
#pragma once

#include <string>
#include <vector>

#include "gap/diagnose/report.hpp"

namespace flappy::gap {

inline constexpr std::size_t kSummaryLines = 30;

/// `out`: where the files are, empty where none were written.
std::vector<std::string> summary_of(const Report& report, const std::string& out);

}  // namespace flappy::gap
