// Tables of numbers as comma-separated text: one header line of column names, then rows; no quoting.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "io/files.hpp"

namespace flappy::io {

struct CsvTable {
  std::string name;  ///< the file, for messages
  std::vector<std::string> names;
  std::vector<std::vector<double>> columns;  ///< one for each name, all of one length, finite

  /// InputError when there is no such column.
  const std::vector<double>& column(std::string_view column_name) const;
};

/// Reads a file of finite numbers. Spaces around a cell, CRLF and a missing last newline are accepted;
/// anything else that is not a plain table is an InputError with file, line and character column.
CsvTable read_csv(const std::filesystem::path& path);

/// The same from text; `name` stands for the file in messages.
CsvTable parse_csv(std::string_view text, const std::string& name);

/// The text that reads back to the same table. std::invalid_argument unless all columns have one length.
std::string csv_text(const std::vector<std::string>& names, const std::vector<std::vector<double>>& columns);

/// Writes rows in the shortest digits that read back to the same doubles. The file appears on close().
class CsvWriter {
 public:
  /// InputError when the file cannot be written.
  CsvWriter(const std::filesystem::path& path, const std::vector<std::string>& names);
  /// One value for each column; std::invalid_argument for any other number of them.
  void row(std::span<const double> values);
  /// Call it once, last; without it no file is left.
  void close();

 private:
  AtomicFile file_;
  std::size_t width_;
  std::string line_;
};

}  // namespace flappy::io
