// The summary of a diagnosis that flappy-gap diagnose prints.
#pragma once

#include <string>
#include <vector>

#include "gap/result/diagnosis.hpp"

namespace flappy::gap {

/// Largest number of lines. Size: of what is printed.
inline constexpr std::size_t kSummaryLines = 30;

/// Returns the lines of the summary for a person. They are kSummaryLines or fewer, unless warnings or sets are many.
/// `out`: folder of the files, which the last line names; empty: none were written.
std::vector<std::string> summary_of(const Diagnosis& diagnosis, const std::string& out);

}  // namespace flappy::gap
