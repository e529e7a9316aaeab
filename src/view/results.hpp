// Reads results of other programs (JSON, and tables whose cells are texts), and turns their identifiers into words.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "gap/result/sentences.hpp"

namespace flappy::view {

/// Throws io::InputError with line and column where the file is not JSON.
nlohmann::ordered_json read_results(const std::filesystem::path& file);

/// Turns a missing or mistyped part of the results into an io::InputError that names the file and its program `writer`.
template <class Make>
auto of_results(const std::filesystem::path& file, const char* writer, Make make);
[[noreturn]] void refuse_results(const std::filesystem::path& file, const char* writer, const std::string& what);

/// A table of texts; the last column takes the rest of a line. Empty where there is no such file.
using TextRow = std::vector<std::string>;
struct TextTable {
  std::vector<std::string> names;
  std::vector<TextRow> rows;
  std::string cell(const TextRow& row, const std::string& name) const;  ///< "" where there is no such column
  double number(const TextRow& row, const std::string& name) const;     ///< NaN where it is no number
};
TextTable read_text_table(const std::filesystem::path& file);

std::string spoken(std::string identifier);  ///< "body_drag" -> "body drag"
using gap::spoken_list;
std::string channel_words(const std::string& channel);  ///< "specific_force_x" -> "forward specific force"
std::string in_print(std::string unit);                 ///< "m/s^2" -> "m/s²"
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
