// The lines of a text table, their cells, and what a cell holds: a number, a time, a list.
#pragma once

#include <csv.h>

#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace flappy::flightlog {

inline constexpr double kMissing = std::numeric_limits<double>::quiet_NaN(),
                        kNoNumber = std::numeric_limits<double>::infinity();

using Cells = std::vector<std::string>;

/// Splits lines into cells by libcsv, which handles quotes, blanks around cells and line ends within quotes.
class RowSplitter {
 public:
  explicit RowSplitter(char separator);
  ~RowSplitter() { csv_free(&parser_); }
  RowSplitter(const RowSplitter&) = delete;
  RowSplitter& operator=(const RowSplitter&) = delete;

  /// Parses a line without its line end. True if the row is complete, false if quotes are still open.
  bool take(std::string_view line);
  /// Ends a row whose quotes are never closed.
  void end_row();
  /// The cells of the current row; valid until the next take().
  Cells cells() const { return {cells_.begin(), cells_.begin() + static_cast<std::ptrdiff_t>(count_)}; }
  std::size_t size() const { return count_; }
  const std::string& operator[](std::size_t i) const { return cells_[i]; }

 private:
  void parse(std::string_view text);
  static void on_cell(void* text, std::size_t size, void* self);
  static void on_row(int, void* self) { static_cast<RowSplitter*>(self)->whole_ = true; }

  csv_parser parser_ = {};
  bool merges_, whole_ = true;
  Cells cells_;  ///< reused by all rows; the first count_ cells are valid
  std::size_t count_ = 0;
};

struct Line {
  std::string_view text;
  std::size_t number = 0;  ///< from 1
};

class Lines {
 public:
  /// `above` lines stand before the text.
  explicit Lines(std::string_view text, std::size_t above = 0) : rest_(text), number_(above) {}
  std::optional<Line> next();
  /// The text below the lines that were taken.
  std::string_view rest() const { return rest_; }

 private:
  std::string_view rest_;
  std::size_t number_;
};

bool is_blank(std::string_view line);
bool is_comment(std::string_view line);
/// A comment without its mark.
std::string_view uncommented(std::string_view line);

/// The separator of cells in a line: the most frequent of comma, semicolon and tab outside quotes, or else the blank.
char separator_of(std::string_view line);

/// The cells of a line that is a row of its own.
Cells split(std::string_view line, char separator);

/// The number of cells up to the last that holds something.
std::size_t used(const Cells& cells);

/// The value of a cell, or kMissing, or kNoNumber.
double to_number(std::string_view text, bool decimal_comma);

/// A cell that holds a date, a time of day, or both, by ISO 8601: s from 1970 in UTC, or from midnight. "2026-05-04",
/// "10:15:00.25", "2026-05-04T10:15:00+02:00", also with a blank in place of T; without a zone it is taken as UTC. Dates
/// may also be "2026/05/04" and "04.05.2026"; "04/05/2026" is not told from the 5th of April.
/// Nothing where it holds something else.
std::optional<double> to_time_s(std::string_view text);

/// Element `index`, from 0, of a list in a cell: "[0.1, 0.2]", "(0.1; 0.2)", "{0.1 0.2}", "array([0.1, 0.2])", of rows one
/// after the other "[[0.1, 0.2]]"; of an empty cell kMissing, of a cell that is no list, or of a list without it, kNoNumber.
double list_element(std::string_view text, std::size_t index);

/// Whether a cell is neither empty nor a number, a time or a list.
bool is_word(std::string_view text, bool decimal_comma);

}  // namespace flappy::flightlog
