// The summary of a diagnosis for a person: the verdict, its reasons, and what to do next.
#pragma once

#include <string>
#include <vector>

#include "gap/result/diagnosis.hpp"

namespace flappy::gap {

inline constexpr std::size_t kSummaryLines = 30;

/// Lines of the summary, in general fewer than kSummaryLines. `out`: folder of the files; empty: none were written.
std::vector<std::string> summary_of(const Diagnosis& diagnosis, const std::string& out);

}  // namespace flappy::gap
