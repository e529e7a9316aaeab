#include "io/csv.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>

namespace flappy::io {
namespace {

struct Cell {
  std::string_view text;
  std::size_t column;  ///< column of the first character, counted from 1
};

struct Line {
  const std::string& file;
  std::size_t number;
  std::string_view text;

  [[noreturn]] void refuse(std::size_t column, const std::string& what) const {
    throw InputError(file + ":" + std::to_string(number) + ":" + std::to_string(column) + ": " + what);
  }
};

Cell trimmed(std::string_view text, std::size_t begin, std::size_t end) {
  const auto blank = [&](std::size_t i) { return text[i] == ' ' || text[i] == '\t'; };
  while (begin < end && blank(begin)) ++begin;
  while (begin < end && blank(end - 1)) --end;
  return {text.substr(begin, end - begin), begin + 1};
}

void split(std::string_view text, std::vector<Cell>& cells) {
  cells.clear();
  for (std::size_t begin = 0;;) {
    const std::size_t comma = text.find(',', begin);
    cells.push_back(trimmed(text, begin, std::min(comma, text.size())));
    if (comma == std::string_view::npos) return;
    begin = comma + 1;
  }
}

std::string_view take_line(std::string_view& rest) {
  const std::size_t newline = rest.find('\n');
  std::string_view line = rest.substr(0, newline);
  rest.remove_prefix(newline == std::string_view::npos ? rest.size() : newline + 1);
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

std::vector<std::string> column_names(const Line& line, const std::vector<Cell>& cells) {
  std::vector<std::string> names;
  std::set<std::string_view> seen;
  for (const Cell& cell : cells) {
    if (cell.text.empty()) line.refuse(cell.column, "column name is empty; accepted: one name for each column");
    const std::string name(cell.text);
    if (!seen.insert(cell.text).second) line.refuse(cell.column, name + ": column name is given twice");
    names.push_back(name);
  }
  return names;
}

/// The number in a cell; NaN for anything else.
double number_or_nan(const Line&, const Cell& cell, const std::string&) {
  double value = 0;
  const char* const end = cell.text.data() + cell.text.size();
  const auto [stop, error] = std::from_chars(cell.text.data(), end, value);
  return error == std::errc() && stop == end && std::isfinite(value) ? value : std::numeric_limits<double>::quiet_NaN();
}

double to_number(const Line& line, const Cell& cell, const std::string& name) {
  const auto refuse = [&](const std::string& what) {
    line.refuse(cell.column, name + ": " + what + "; accepted: a number");
  };
  if (cell.text.empty()) refuse("is empty");
  double value = 0;
  const char* const end = cell.text.data() + cell.text.size();
  const auto [stop, error] = std::from_chars(cell.text.data(), end, value);
  const std::string shown(cell.text.substr(0, 40));
  if (error == std::errc::invalid_argument || stop != end) refuse("\"" + shown + "\" is not a number");
  if (error == std::errc::result_out_of_range) refuse(shown + " does not fit a double");
  if (!std::isfinite(value)) refuse(shown + " is not finite");
  return value;
}

using ReadCell = double (*)(const Line&, const Cell&, const std::string& name);

void add_row(const Line& line, const std::vector<Cell>& cells, ReadCell read, CsvTable& table) {
  const std::size_t width = table.names.size();
  if (line.text.empty()) line.refuse(1, "is an empty line; accepted: " + std::to_string(width) + " cells");
  if (cells.size() != width) {
    const std::size_t column = cells.size() < width ? line.text.size() + 1 : cells[width].column;
    line.refuse(column, "row has " + std::to_string(cells.size()) + " cells; accepted: " + std::to_string(width) +
                            ", as in the header");
  }
  for (std::size_t i = 0; i < width; ++i) {
    table.columns[i].push_back(read(line, cells[i], table.names[i]));
  }
}

CsvTable parse(std::string_view text, const std::string& name, ReadCell read) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  if (text.empty()) throw InputError(name + ": is empty; accepted: a line of column names, then rows of numbers");

  CsvTable table{name, {}, {}};
  std::vector<Cell> cells;
  for (std::size_t number = 1; !text.empty(); ++number) {
    const Line line{name, number, take_line(text)};
    split(line.text, cells);
    if (number == 1) {
      table.names = column_names(line, cells);
      table.columns.resize(cells.size());
    } else {
      add_row(line, cells, read, table);
    }
  }
  return table;
}

std::string header_text(const std::vector<std::string>& names) {
  std::string line;
  for (const auto& name : names) line += (line.empty() ? "" : ",") + name;
  return line + '\n';
}

void append_number(std::string& text, double value) {
  std::array<char, 32> digits;
  text.append(digits.data(), std::to_chars(digits.begin(), digits.end(), value).ptr);
}

}  // namespace

const std::vector<double>& CsvTable::column(std::string_view column_name) const {
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (names[i] == column_name) return columns[i];
  }
  throw InputError(name + ": " + std::string(column_name) + ": column is missing; columns here: " + joined(names) +
                   did_you_mean(column_name, names));
}

CsvTable read_csv(const std::filesystem::path& path) { return parse_csv(read_text(path), path.string()); }

CsvTable parse_csv(std::string_view text, const std::string& name) { return parse(text, name, to_number); }

CsvTable parse_csv(std::string_view text, const std::string& name, const std::vector<std::string>& wanted,
                   std::vector<std::string>& others) {
  CsvTable all = parse(text, name, number_or_nan), table{name, {}, {}};
  for (std::size_t i = 0; i < all.names.size(); ++i) {
    if (std::ranges::count(wanted, all.names[i]) == 0) {
      others.push_back(all.names[i]);
      continue;
    }
    table.names.push_back(all.names[i]);
    table.columns.push_back(std::move(all.columns[i]));
  }
  return table;
}

std::string csv_text(const std::vector<std::string>& names, const std::vector<std::vector<double>>& columns) {
  const std::size_t rows = columns.empty() ? 0 : columns.front().size();
  const bool even = std::ranges::all_of(columns, [&](const auto& column) { return column.size() == rows; });
  if (columns.size() != names.size() || !even) throw std::invalid_argument("csv_text: columns must have one length");
  std::string text = header_text(names);
  for (std::size_t i = 0; i < rows; ++i) {
    for (std::size_t j = 0; j < columns.size(); ++j) {
      if (j > 0) text += ',';
      append_number(text, columns[j][i]);
    }
    text += '\n';
  }
  return text;
}

CsvWriter::CsvWriter(const std::filesystem::path& path, const std::vector<std::string>& names)
    : file_(path), width_(names.size()) {
  file_.write(header_text(names));
}

void CsvWriter::row(std::span<const double> values) {
  if (values.size() != width_) throw std::invalid_argument("CsvWriter: a row must have one value for each column");
  line_.clear();
  for (const double value : values) {
    if (!line_.empty()) line_ += ',';
    append_number(line_, value);
  }
  line_ += '\n';
  file_.write(line_);
}

void CsvWriter::close() { file_.commit(); }

}  // namespace flappy::io
