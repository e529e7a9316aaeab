// A diagnosis in fewer than kSummaryLines lines that a person can act on.
#pragma once

#include <string>
#include <vector>

#include "gap/result/diagnosis.hpp"

namespace flappy::gap {

inline constexpr std::size_t kSummaryLines = 30;

/// `out`: folder of the files; empty: none were written.
std::vector<std::string> summary_of(const Diagnosis& diagnosis, const std::string& out);

}  // namespace flappy::gap
