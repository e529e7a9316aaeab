#include "flightlog/import/table.hpp"

#include <csv.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <new>
#include <optional>

#include "io/files.hpp"

namespace flappy::flightlog {
namespace {

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN(),
                 kNoNumber = std::numeric_limits<double>::infinity();

using Cells = std::vector<std::string>;

/// Splits lines into cells by libcsv, which handles quotes, blanks around cells and line ends within quotes.
class RowSplitter {
 public:
  explicit RowSplitter(char separator) : merges_(separator == ' ') {
    if (csv_init(&parser_, CSV_EMPTY_IS_NULL) != 0) throw std::bad_alloc();
    csv_set_delim(&parser_, static_cast<unsigned char>(separator));
  }
  ~RowSplitter() { csv_free(&parser_); }
  RowSplitter(const RowSplitter&) = delete;
  RowSplitter& operator=(const RowSplitter&) = delete;

  /// Parses a line without its line end. True if the row is complete, false if quotes are still open.
  bool take(std::string_view line) {
    if (whole_) count_ = 0;
    whole_ = false;
    parse(line);
    parse("\n");
    return whole_;
  }
  /// Ends a row whose quotes are never closed.
  void end_row() {
    csv_fini(&parser_, on_cell, on_row, this);
    whole_ = true;
  }
  /// The cells of the current row; valid until the next take().
  Cells cells() const { return {cells_.begin(), cells_.begin() + static_cast<std::ptrdiff_t>(count_)}; }
  std::size_t size() const { return count_; }
  const std::string& operator[](std::size_t i) const { return cells_[i]; }

 private:
  void parse(std::string_view text) {
    if (csv_parse(&parser_, text.data(), text.size(), on_cell, on_row, this) != text.size()) throw std::bad_alloc();
  }
  static void on_cell(void* text, std::size_t size, void* self) {
    auto& own = *static_cast<RowSplitter*>(self);
    if (own.merges_ && text == nullptr) return;  // empty cell between two blanks
    if (own.count_ == own.cells_.size()) own.cells_.emplace_back();
    own.cells_[own.count_++].assign(text == nullptr ? "" : static_cast<const char*>(text), size);
  }
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
  explicit Lines(std::string_view text) : rest_(text) {}
  std::optional<Line> next() {
    if (rest_.empty()) return std::nullopt;
    const std::size_t end = rest_.find_first_of("\r\n");
    const std::string_view line = rest_.substr(0, end);
    const bool both = end != std::string_view::npos && rest_.substr(end, 2) == "\r\n";
    rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + (both ? 2 : 1));
    return Line{line, ++number_};
  }

 private:
  std::string_view rest_;
  std::size_t number_ = 0;
};

bool is_blank(std::string_view line) { return line.find_first_not_of(" \t") == std::string_view::npos; }
bool is_comment(std::string_view line) {
  return line.substr(std::min(line.find_first_not_of(" \t"), line.size())).starts_with('#');
}

std::string_view uncommented(std::string_view line) {
  line.remove_prefix(std::min(line.find_first_not_of("# \t"), line.size()));
  return line;
}

/// The separator of cells in a line: the most frequent of comma, semicolon and tab outside quotes, or else the blank.
char separator_of(std::string_view line) {
  std::array<std::size_t, 3> counts = {};
  constexpr std::string_view kSeparators = ",;\t";
  bool quoted = false, blanks = false;
  for (const char c : line) {
    if (c == '"') quoted = !quoted;
    if (quoted) continue;
    if (const std::size_t k = kSeparators.find(c); k != std::string_view::npos) ++counts[k];
    blanks |= c == ' ';
  }
  const auto most = std::ranges::max_element(counts);
  if (*most > 0) return kSeparators[static_cast<std::size_t>(most - counts.begin())];
  return blanks ? ' ' : ',';
}

bool is_one_of(std::string_view text, std::initializer_list<std::string_view> words) {
  const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
  return std::ranges::any_of(words, [&](std::string_view word) { return std::ranges::equal(text, word, {}, lower); });
}

/// The value of a cell, or kMissing, or kNoNumber.
double to_number(std::string_view text, bool decimal_comma) {
  std::string with_point;
  if (decimal_comma && std::ranges::count(text, ',') == 1) {
    with_point = text;
    std::ranges::replace(with_point, ',', '.');
    text = with_point;
  }
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error == std::errc::result_out_of_range)
    value = std::strtod(std::string(text).c_str(), nullptr);  // underflow gives 0, overflow infinity
  if (error != std::errc::invalid_argument && stop == text.data() + text.size()) return value;
  if (is_one_of(text, {"", "na", "n/a", "none", "null"})) return kMissing;
  return kNoNumber;
}

/// The names of the columns, and where the rows begin.
struct Header {
  Cells names;
  char separator;
  std::size_t line;  ///< line of the names; 0 if they stand in a comment
};

Cells split(std::string_view line, char separator) {
  RowSplitter splitter(separator);
  if (!splitter.take(line)) splitter.end_row();
  return splitter.cells();
}

Header header_of(std::string_view text, const std::string& name) {
  std::string_view comment;
  Lines lines(text);
  while (const auto line = lines.next()) {
    if (is_blank(line->text)) continue;
    if (is_comment(line->text)) {
      if (const std::string_view said = uncommented(line->text); !said.empty()) comment = said;
      continue;
    }
    const char of_comment = separator_of(comment);
    const bool alike = !comment.empty() && of_comment != ' ' && line->text.find(of_comment) != std::string_view::npos;
    const char separator = alike ? of_comment : separator_of(line->text);
    Header header{split(line->text, separator), separator, line->number};
    const auto is_number = [&](const std::string& cell) { return std::isfinite(to_number(cell, separator != ',')); };
    Cells said = split(comment, of_comment);
    if (said.size() == header.names.size() && std::ranges::any_of(header.names, is_number))
      return {std::move(said), separator, 0};
    if (std::ranges::all_of(header.names, is_number))
      throw io::InputError(name + ":" + std::to_string(line->number) +
                           ":1: holds numbers; accepted: a line of column names before them");
    return header;
  }
  throw io::InputError(name + ": " + (text.empty() ? "is empty" : "holds no table") +
                       "; accepted: a line of column names, then rows of numbers");
}

/// The columns of a line up to the last that holds something.
std::size_t used(const Cells& cells) {
  std::size_t width = cells.size();
  while (width > 0 && cells[width - 1].empty()) --width;
  return width;
}

/// The first line below `above` that looks like names: it holds words, and the next line as many numbers. 0 if there is none.
std::size_t line_of_names(std::string_view text, std::size_t above) {
  Lines lines(text);
  Cells names;  // of the line before, if it holds words
  std::size_t at = 0;
  while (const auto line = lines.next()) {
    if (line->number <= above || is_blank(line->text) || is_comment(line->text)) continue;
    const char separator = separator_of(line->text);
    Cells cells = split(line->text, separator);
    const auto is_word = [&](const std::string& cell) { return std::isinf(to_number(cell, separator != ',')); };
    if (std::ranges::any_of(cells, is_word)) {
      names = std::move(cells);
      at = line->number;
    } else {
      const std::size_t named = used(names), width = used(cells);
      if (named > 1 && width >= named && width <= names.size()) return at;
      names.clear();
    }
  }
  return 0;
}

struct LeftOut {
  std::size_t count = 0, first_line = 0;
  std::string first;
  void add(std::size_t line, const std::string& what) {
    if (count++ == 0) first_line = line, first = what;
  }
};

class TableReader {
 public:
  TableReader(std::string_view text, std::string name, std::string channel, Channels& channels)
      : text_(text),
        name_(std::move(name)),
        channel_(std::move(channel)),
        channels_(channels),
        header_(header_of(text, name_)) {
    for (std::size_t k = 0; k < header_.names.size(); ++k) {
      const std::string& field = header_.names[k];
      if (field.empty()) continue;
      named_ = k + 1;
      if (!channels_.wants(channel_, field)) continue;
      if (std::ranges::find(row_, field, &Item::name) != row_.end())
        throw io::InputError(name_ + ":" + std::to_string(std::max<std::size_t>(header_.line, 1)) + ":1: " + field +
                             ": column name is given twice");
      row_.push_back({field, 0});
      columns_.push_back(k);
    }
    not_numbers_.resize(row_.size());
    channels_.add(channel_, header_.names);
  }

  void read(std::vector<std::string>& warnings) {
    constexpr std::size_t kMaxLinesOfARow = 50;
    RowSplitter splitter(header_.separator);
    Lines lines(text_);
    std::vector<Line> row;  // lines of the current row: several if a quoted cell contains line ends
    for (auto line = lines.next(); line; line = lines.next()) {
      if (line->number <= header_.line || is_blank(line->text)) continue;
      if (row.empty() && is_comment(line->text)) {
        if (rows_ > 0) comments_.add(line->number, "");
        continue;
      }
      row.push_back(*line);
      if (splitter.take(line->text)) {
        add(splitter, row.front().number);
        row.clear();
      } else if (row.size() == kMaxLinesOfARow) {
        split_apart(splitter, row);
      }
    }
    if (!row.empty()) split_apart(splitter, row);
    refuse_other_widths();
    warn(warnings);
  }

 private:
  /// InputError where no row has the cells of the names, or few have, and names stand below a head.
  void refuse_other_widths() const {
    if (other_width_.count <= rows_) return;
    const std::size_t below = line_of_names(text_, header_.line);
    if (rows_ > 0 && below == 0) return;
    std::string accepted = "rows of as many cells";
    if (below > 0) accepted = "names in the first line, as made by: tail -n +" + std::to_string(below) + " FILE";
    throw io::InputError(name_ + ":" + std::to_string(other_width_.first_line) + ":1: " + other_width_.first +
                         (rows_ == 0 ? ", and no row is otherwise" : ", and most rows are otherwise") +
                         "; accepted: " + accepted);
  }

  /// Treats each line as a row of its own, because one opens quotes that are never closed; leaves that one out.
  void split_apart(RowSplitter& splitter, std::vector<Line>& lines) {
    splitter.end_row();
    for (const Line& line : lines) {
      const bool whole = splitter.take(line.text);
      if (whole) {
        add(splitter, line.number);
      } else {
        splitter.end_row();
        other_width_.add(line.number, "quotes that are not closed");
      }
    }
    lines.clear();
  }

  void add(const RowSplitter& cells, std::size_t line) {
    std::size_t width = cells.size();
    while (width > named_ && cells[width - 1].empty()) --width;  // ignore separators at the end
    if (width < named_ || width > std::max(named_, header_.names.size()))
      return other_width_.add(line, std::to_string(width) + (width == 1 ? " cell for " : " cells for ") +
                                        std::to_string(named_) + " names");
    ++rows_;
    for (std::size_t k = 0; k < row_.size(); ++k) {
      const std::string& cell = cells[columns_[k]];
      points_ |= cell.find('.') != std::string::npos;
      row_[k].value = to_number(cell, header_.separator != ',' && !points_);
      if (std::isinf(row_[k].value)) not_numbers_[k].add(line, cell);
    }
    channels_.add(channel_, kNoTime, kNoTime, row_);
  }

  void warn(std::vector<std::string>& warnings) const {
    const auto say = [&](const std::string& what) { warnings.push_back(name_ + ": " + what); };
    const auto first = [](const LeftOut& left) {
      return std::string(left.count > 1 ? ", the first in line " : ", in line ") + std::to_string(left.first_line);
    };
    if (other_width_.count > 0)
      say(std::to_string(other_width_.count) + " of " + std::to_string(rows_ + other_width_.count) + " rows left out" +
          first(other_width_) + ": " + other_width_.first);
    if (comments_.count > 0)
      say(std::to_string(comments_.count) + " comments among the rows left out" + first(comments_));
    for (std::size_t k = 0; k < row_.size(); ++k)
      if (const LeftOut& left = not_numbers_[k]; left.count > 0)
        say(row_[k].name + ": " + std::to_string(left.count) + " of " + std::to_string(rows_) +
            " cells are no numbers" + first(left) + ": \"" + left.first.substr(0, 40) + "\"");
  }

  std::string_view text_;
  std::string name_, channel_;
  Channels& channels_;
  Header header_;
  Row row_;                           ///< wanted cells of the current row
  std::vector<std::size_t> columns_;  ///< column of each wanted cell
  std::size_t named_ = 0;             ///< number of columns up to the last that has a name
  std::size_t rows_ = 0;
  bool points_ = false;             ///< whether a cell had a point: then a comma is no decimal comma
  LeftOut other_width_, comments_;  ///< other_width_ includes rows with quotes that are never closed
  std::vector<LeftOut> not_numbers_;
};

}  // namespace

void read_table(std::string_view text, const std::string& name, const std::string& channel, Channels& channels,
                std::vector<std::string>& warnings) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  TableReader(text, name, channel, channels).read(warnings);
}

}  // namespace flappy::flightlog
