// Reads results of other programs (JSON, and tables whose cells are texts), and turns their identifiers into words.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace flappy::view {

/// Throws io::InputError with line and column where the file is not JSON.
nlohmann::ordered_json read_results(const std::filesystem::path& file);

/// Calls `make`. A missing or mistyped part of the results becomes an io::InputError that names the file and `writer`, the program that writes it.
template <class Make>
auto of_results(const std::filesystem::path& file, const char* writer, Make make);
[[noreturn]] void refuse_results(const std::filesystem::path& file, const char* writer, const std::string& what);

/// A table of texts; the last column takes the rest of a line. Empty where there is no such file.
using TextRow = std::vector<std::string>;
struct TextTable {
  std::vector<std::string> names;
  std::vector<TextRow> rows;
  /// "" where there is no such column.
  std::string cell(const TextRow& row, const std::string& name) const;
  /// NaN where the cell is not a number.
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
/// The words of an effect's magnitude without its unit: "wind.speed_m_s" in "m/s" -> "wind (speed)".
std::string magnitude_words(const std::string& name, const std::string& unit);

template <class Make>
auto of_results(const std::filesystem::path& file, const char* writer, Make make) {
  try {
    return make();
  } catch (const nlohmann::json::exception& e) {
    refuse_results(file, writer, e.what());
  }
}

}  // namespace flappy::view
