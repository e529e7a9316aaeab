#pragma once

#include <string>
#include <vector>

#include "gap/result/diagnosis.hpp"

namespace flappy::gap {

/// Largest number of lines. Size: of what is printed.
inline constexpr std::size_t kSummaryLines = 30;

/// The summary for a person, in general fewer than kSummaryLines lines. `out`: folder of the files; empty: none.
std::vector<std::string> summary_of(const Diagnosis& diagnosis, const std::string& out);

}  // namespace flappy::gap
