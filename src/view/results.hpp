// Results as other programs wrote them: JSON, and tables whose cells are texts.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace flappy::view {

/// io::InputError with line and column where it is no JSON.
nlohmann::ordered_json read_results(const std::filesystem::path& file);

/// Calls `make`; what a result lacks becomes io::InputError that names the file and who writes such.
template <class Make>
auto of_results(const std::filesystem::path& file, const char* writer, Make make);
[[noreturn]] void refuse_results(const std::filesystem::path& file, const char* writer, const std::string& what);

/// Rows by column name; the last column takes what is left of a line. Nothing where there is no such file.
using TextRow = std::vector<std::string>;
struct TextTable {
  std::vector<std::string> names;
  std::vector<TextRow> rows;
  /// Of a column that may not be there: "".
  std::string cell(const TextRow& row, const std::string& name) const;
  /// NaN where it is empty.
  double number(const TextRow& row, const std::string& name) const;
};
TextTable read_text_table(const std::filesystem::path& file);

/// "body_drag" -> "body drag".
std::string spoken(std::string identifier);
/// "a, b and c".
std::string spoken_list(const std::vector<std::string>& words, const char* last = "and");
/// "force_x" -> "forward force".
std::string channel_words(const std::string& channel);
/// "m/s^2" -> "m/s²".
std::string in_print(std::string unit);
/// An effect's size without its unit: "wind.speed_m_s" in "m/s" -> "wind (speed)".
std::string size_words(const std::string& name, const std::string& unit);

template <class Make>
auto of_results(const std::filesystem::path& file, const char* writer, Make make) {
  try {
    return make();
  } catch (const nlohmann::json::exception& e) {
    refuse_results(file, writer, e.what());
  }
}

}  // namespace flappy::view
