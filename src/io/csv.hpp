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
  std::string name;  ///< file name, for messages
  std::vector<std::string> names;
  std::vector<std::vector<double>> columns;  ///< [name][row]

  /// Throws InputError where there is no such column.
  const std::vector<double>& column(std::string_view column_name) const;
};

/// Reads a file of finite numbers. Accepts spaces around a cell, CRLF and a missing last newline; throws InputError,
/// with file, line and column, for anything else that is not a plain table.
CsvTable read_csv(const std::filesystem::path& path);

/// read_csv() for text; `name` is the file name for messages.
CsvTable parse_csv(std::string_view text, const std::string& name);

/// A table of measurements: of its columns those of `wanted` alone, where cells that are no finite numbers are NaN. The
/// names of other columns, whose cells may hold anything, are put in `others`.
CsvTable parse_csv(std::string_view text, const std::string& name, const std::vector<std::string>& wanted,
                   std::vector<std::string>& others);

/// Text that parse_csv() reads as the same table. Throws std::invalid_argument unless all columns have the same length.
std::string csv_text(const std::vector<std::string>& names, const std::vector<std::vector<double>>& columns);

/// Writes rows with the shortest digits that read back as the same doubles. The file appears on close().
class CsvWriter {
 public:
  /// Throws InputError where the file cannot be written.
  CsvWriter(const std::filesystem::path& path, const std::vector<std::string>& names);
  /// Takes one value for each column; throws std::invalid_argument for any other number.
  void row(std::span<const double> values);
  /// Call it once, last; without it no file is left.
  void close();

 private:
  AtomicFile file_;
  std::size_t width_;
  std::string line_;
};

}  // namespace flappy::io
