#include <algorithm>
#include <array>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "deploy/proof/file_proof.hpp"
#include "deploy/proof/proof.hpp"

namespace flappy::deploy {
namespace {

constexpr std::size_t kColumns = 100, kGap = 2;

/// One line of a table; a `rest` that is not empty replaces the remaining columns.
struct Line {
  std::vector<std::string> cells;
  std::string rest;
};

/// Aligns the lines: columns as wide as their cells need, text to the left, from column `numbers` on to the right.
std::string text_of(const std::vector<Line>& lines, std::size_t numbers) {
  std::vector<std::size_t> widths;
  for (const auto& line : lines) {
    widths.resize(std::max(widths.size(), line.cells.size()));
    for (std::size_t i = 0; i < line.cells.size(); ++i) widths[i] = std::max(widths[i], line.cells[i].size());
  }
  std::string text;
  for (const auto& line : lines) {
    std::string row;
    for (std::size_t i = 0; i < line.cells.size(); ++i) {
      const std::string padding(widths[i] - line.cells[i].size(), ' ');
      row += i < numbers ? line.cells[i] + padding : padding + line.cells[i];
      row.append(kGap, ' ');
    }
    row += line.rest;
    row.erase(row.find_last_not_of(' ') + 1);
    if (row.size() > kColumns) row = row.substr(0, kColumns - 3) + "...";
    text += row + '\n';
  }
  return text;
}

std::string short_number(double value) {
  std::array<char, 32> text;
  std::snprintf(text.data(), text.size(), "%.2g", value);
  return text.data();
}

/// "passed", or the part that failed with its code.
std::string selftest_of(const Parity& row) {
  if (row.policy_selftest != 0) return "policy: " + std::to_string(row.policy_selftest);
  if (row.controller_selftest != 0) return "control: " + std::to_string(row.controller_selftest);
  return "passed";
}

}  // namespace

std::string table_of(const std::vector<Parity>& rows) {
  std::vector<Line> lines = {{{"compiler", "target", "options", "self-test", "differ", "of", "by"}, ""}};
  std::string counted;
  for (const auto& row : rows) {
    const std::string compiler = row.compiler + (row.version.empty() ? "" : " " + row.version);
    const std::string options = row.options.starts_with("-std=") ? row.options.substr(5) : row.options;
    if (!row.why_not.empty()) {
      lines.push_back({{compiler, row.target, options}, row.why_not});
      continue;
    }
    lines.push_back({{compiler, row.target, options, selftest_of(row), std::to_string(row.differing),
                      std::to_string(row.outputs), short_number(row.largest_difference)},
                     ""});
    if (row.instructions_per_inference > 0) {
      std::array<char, 32> number;
      std::snprintf(number.data(), number.size(), "%.0f", row.instructions_per_inference);
      counted += row.target + ": " + number.data() + " instructions per inference\n";
    }
  }
  return text_of(lines, 4) + counted;
}

std::string table_of(const std::vector<Footprint>& rows) {
  std::vector<Line> lines = {{{"function", "target", "options", "flash B", "RAM B", "stack B"}, ""}};
  for (const auto& row : rows) {
    Line line{{row.function, row.target, row.options}, row.why_not};
    if (row.why_not.empty())
      for (const long bytes : {row.flash_bytes, row.ram_bytes, row.stack_bytes})
        line.cells.push_back(std::to_string(bytes));
    lines.push_back(line);
  }
  return text_of(lines, 3) + "stack: without the frames of the compiler's own arithmetic (libgcc)\n";
}

std::string table_of(const std::vector<Agreement>& rows) {
  std::vector<Line> lines = {
      {{"file", "runtime", "differ", "of", "median ulp", "99 %", "most", "range", "alike", "apart"}, ""}};
  for (const auto& row : rows)
    lines.push_back(
        {{row.file, row.runtime, std::to_string(row.differing), std::to_string(row.outputs),
          short_number(row.median_ulp), short_number(row.percentile_99_ulp), short_number(row.largest_ulp),
          short_number(row.largest_ulp_of_range), std::to_string(row.ended_alike) + "/" + std::to_string(row.flights),
          short_number(row.largest_distance_m)},
         ""});
  return text_of(lines, 2) + "range: largest in ulp of half the range; flights that end alike; how far apart, m\n";
}

nlohmann::ordered_json json_of(const std::vector<Agreement>& rows) {
  auto all = nlohmann::ordered_json::array();
  for (const auto& row : rows)
    all.push_back({{"file", row.file},
                   {"runtime", row.runtime},
                   {"outputs", row.outputs},
                   {"differing", row.differing},
                   {"median_ulp", row.median_ulp},
                   {"percentile_99_ulp", row.percentile_99_ulp},
                   {"largest_ulp", row.largest_ulp},
                   {"largest_ulp_of_range", row.largest_ulp_of_range},
                   {"saturated", row.saturated},
                   {"beyond_range", row.beyond_range},
                   {"flights", row.flights},
                   {"ended_alike", row.ended_alike},
                   {"largest_distance_m", row.largest_distance_m}});
  return all;
}

nlohmann::ordered_json json_of(const std::vector<Parity>& rows) {
  auto all = nlohmann::ordered_json::array();
  for (const auto& row : rows)
    all.push_back({{"compiler", row.compiler},
                   {"version", row.version},
                   {"options", row.options},
                   {"machine", row.machine},
                   {"target", row.target},
                   {"available", row.available},
                   {"failed", row.failed()},
                   {"why_not", row.why_not},
                   {"policy_selftest", row.policy_selftest},
                   {"controller_selftest", row.controller_selftest},
                   {"policy_error", row.policy_error},
                   {"controller_error", row.controller_error},
                   {"outputs", row.outputs},
                   {"differing", row.differing},
                   {"largest_difference", row.largest_difference},
                   {"instructions_per_inference", row.instructions_per_inference}});
  return all;
}

nlohmann::ordered_json json_of(const std::vector<Footprint>& rows) {
  auto all = nlohmann::ordered_json::array();
  for (const auto& row : rows)
    all.push_back({{"function", row.function},
                   {"target", row.target},
                   {"options", row.options},
                   {"machine", row.machine},
                   {"available", row.available},
                   {"failed", row.failed()},
                   {"why_not", row.why_not},
                   {"flash_bytes", row.flash_bytes},
                   {"ram_bytes", row.ram_bytes},
                   {"stack_bytes", row.stack_bytes}});
  return all;
}

}  // namespace flappy::deploy
