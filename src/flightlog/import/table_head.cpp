#include "flightlog/import/table_head.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "flightlog/import/recorded_units.hpp"
#include "flightlog/import/text_cells.hpp"
#include "io/files.hpp"

namespace flappy::flightlog {
namespace {

/// Lines in which names are looked for, and rows by which a line of names is judged. Heads of known programs have less
/// than 20 lines.
constexpr std::size_t kHeadLines = 300, kRowsLooked = 50;
/// Rows of groups beyond these are no labels: each of them doubles their number. Motive has 5.
constexpr std::size_t kMaxGroups = 6;

struct Contents {
  std::size_t words = 0, numbers = 0;
};

Contents contents(const Cells& cells, char separator) {
  Contents c;
  for (const std::string& cell : cells) {
    c.numbers += std::isfinite(to_number(cell, separator != ',')) || to_time_s(cell);
    c.words += is_word(cell, separator != ',');
  }
  return c;
}

/// Whether a line is a row of empty cells.
bool holds_separators(std::string_view line) { return used(split(line, separator_of(line))) == 0; }

/// The unit in brackets at the end of a name, as in "x (mm)" or "time [us]"; empty where it has none that is known.
std::string unit_in(const std::string& name) {
  const std::size_t open = name.find_last_of("([");
  if (open == 0 || open == std::string::npos || (name.back() != ')' && name.back() != ']')) return {};
  const std::string unit = name.substr(open + 1, name.size() - open - 2);
  return recorded_unit(unit) ? unit : "";
}

/// Whether a row of so many cells belongs to these names; separators at its end do not count.
bool fits(const Cells& row, const Cells& names) {
  const std::size_t named = used(names);
  return row.size() >= named && std::max(used(row), named) <= std::max(named, names.size());
}

class HeadFinder {
 public:
  HeadFinder(std::string_view text, std::size_t above) {
    Lines lines(text, above);
    while (const auto line = lines.next()) {
      if (is_blank(line->text) || is_comment(line->text) || holds_separators(line->text)) continue;
      lines_.push_back(*line);
      if (lines_.size() == kHeadLines + kRowsLooked) break;
    }
  }

  /// The line of names among the lines, of which there is one at least: the first, where none is clear. A first line that
  /// begins with an empty cell may be a row of groups above one of numbers, as IDs: then names further below count.
  std::size_t names() const {
    for (std::size_t i = 0; i < std::min(kHeadLines, lines_.size()); ++i)
      if (are_names(i) && (i > 0 || !split(lines_[0].text, separator_of(lines_[0].text)).front().empty())) return i;
    return 0;
  }

  TableHead head(std::size_t i) const {
    const char separator = separator_of(lines_[i].text);
    const Cells names = split(lines_[i].text, separator);
    TableHead head{separator, lines_[i].number, lines_[i].number, {}};
    for (const std::string& name : names) head.columns.push_back({name, {}, unit_in(name)});
    const std::vector<Cells> groups = groups_above(i, names, separator);
    for (const Cells& row : groups) head.columns.resize(std::max(head.columns.size(), row.size()));
    for (std::size_t k = 0; k < head.columns.size(); ++k)
      for (std::size_t g = 0; g < groups.size(); ++g) {
        const bool own = k < groups[g].size() && !groups[g][k].empty();
        const bool repeats = !own && k > 0 && !head.columns[k].name.empty();
        head.columns[k].groups.push_back(own ? groups[g][k] : repeats ? head.columns[k - 1].groups[g] : "");
      }
    if (const Cells units = units_below(i, names, separator); !units.empty()) {
      head.end = lines_[i + 1].number;
      for (std::size_t k = 0; k < std::min(units.size(), head.columns.size()); ++k) head.columns[k].unit = units[k];
    }
    return head;
  }

  std::string_view line(std::size_t i) const { return lines_[i].text; }
  std::size_t number(std::size_t i) const { return lines_[i].number; }
  bool empty() const { return lines_.empty(); }

 private:
  /// Names are words, most of them, and rows of more numbers than words follow: at once, and most of the lines below are such.
  bool are_names(std::size_t i) const {
    const char separator = separator_of(lines_[i].text);
    const Cells names = split(lines_[i].text, separator);
    const Contents said = contents(names, separator);
    if (said.words <= said.numbers) return false;
    const std::size_t first = i + (units_below(i, names, separator).empty() ? 1 : 2);
    // A first line may have one faulty row at once; below it, a line of words and numbers above words is a group.
    const std::size_t needed = i == 0 ? 1 : std::clamp<std::size_t>(lines_.size() - first, 1, 2);
    std::size_t rows = 0, others = 0;
    for (std::size_t j = first; j < std::min(first + kRowsLooked, lines_.size()); ++j) {
      if (j == first + 2 && rows < needed) return false;
      const Cells row = split(lines_[j].text, separator);
      const Contents c = contents(row, separator);
      ++(fits(row, names) && c.numbers > c.words && c.numbers > said.numbers ? rows : others);
    }
    return rows >= std::max(others, needed);
  }

  /// The cells of the line below the names, if they are units: words alone, above a row with numbers, and most of them
  /// known. Below a first name, a first cell that is empty says so, too: rows and names have something there.
  Cells units_below(std::size_t i, const Cells& names, char separator) const {
    if (i + 2 >= lines_.size()) return {};
    Cells units = split(lines_[i + 1].text, separator);
    std::size_t filled = 0, known = 0;
    for (const std::string& unit : units)
      if (!unit.empty()) ++filled, known += recorded_unit(unit).has_value();
    const Cells row = split(lines_[i + 2].text, separator);
    const bool are = filled > 0 && contents(units, separator).words == filled && used(units) <= names.size() &&
                     contents(row, separator).numbers > 0 && fits(row, names) &&
                     (2 * known >= filled || (units.front().empty() && !names.front().empty()));
    return are ? units : Cells();
  }

  /// The rows of groups in the lines directly above the names, from the top.
  std::vector<Cells> groups_above(std::size_t i, const Cells& names, char separator) const {
    std::vector<Cells> rows;
    for (std::size_t j = i; j > 0 && lines_[j - 1].number + 1 == lines_[j].number && rows.size() < kMaxGroups; --j) {
      Cells cells = split(lines_[j - 1].text, separator);
      if (cells.size() < 2 || (!cells.front().empty() && used(cells) < used(names))) break;
      rows.push_back(std::move(cells));
    }
    std::ranges::reverse(rows);
    return rows;
  }

  std::vector<Line> lines_;  ///< neither blank nor comments
};

/// The last comment before the first line that is none; empty if there is none.
std::string_view comment_above(std::string_view text) {
  std::string_view comment;
  Lines lines(text);
  while (const auto line = lines.next()) {
    if (is_blank(line->text)) continue;
    if (!is_comment(line->text)) break;
    if (const std::string_view said = uncommented(line->text); !said.empty()) comment = said;
  }
  return comment;
}

}  // namespace

TableHead head_of(std::string_view text, const std::string& name, std::size_t above) {
  const HeadFinder finder(text, above);
  if (finder.empty())
    throw io::InputError(name + ": " + (text.empty() && above == 0 ? "is empty" : "holds no table") +
                         "; accepted: a line of column names, then rows of numbers");
  const std::string_view comment = comment_above(text);
  const char of_comment = separator_of(comment);
  const bool alike = !comment.empty() && of_comment != ' ' && finder.line(0).find(of_comment) != std::string_view::npos;
  const char separator = alike ? of_comment : separator_of(finder.line(0));
  const Cells first = split(finder.line(0), separator), said = split(comment, of_comment);
  const auto is_number = [&](const std::string& cell) { return std::isfinite(to_number(cell, separator != ',')); };
  if (said.size() == first.size() && std::ranges::any_of(first, is_number)) {
    TableHead head{separator, 0, 0, {}};
    for (const std::string& column : said) head.columns.push_back({column, {}, unit_in(column)});
    return head;
  }
  const std::size_t names = finder.names();
  if (names == 0 && std::ranges::all_of(first, is_number))
    throw io::InputError(name + ":" + std::to_string(finder.number(0)) +
                         ":1: holds numbers; accepted: a line of column names before them");
  return finder.head(names);
}

ColumnLabels::ColumnLabels(const std::vector<TableColumn>& columns) {
  std::map<std::string, std::size_t> count;
  for (std::size_t k = 0; k < columns.size(); ++k) {
    std::vector<std::string>& labels = labels_.emplace_back();
    const auto& [name, groups, unit] = columns[k];
    for (unsigned chosen = 0; chosen < 1u << groups.size(); ++chosen) {
      std::string label;
      for (std::size_t g = 0; g < groups.size(); ++g)
        if ((chosen >> g & 1) && !groups[g].empty()) label += groups[g] + " ";
      label += name;
      while (label.ends_with(' ')) label.pop_back();
      if (!label.empty() && std::ranges::find(labels, label) == labels.end()) labels.push_back(label);
    }
    std::ranges::stable_sort(labels, {}, &std::string::size);
    for (const std::string& label : labels) columns_[label].push_back(k);
    place_.push_back(name.empty() ? "" : name + " " + std::to_string(++count[name]));
    if (!name.empty()) places_[place_.back()].push_back(k);
  }
}

std::vector<std::size_t> ColumnLabels::find(const std::string& label) const {
  const auto found = columns_.find(label), place = places_.find(label);
  if (found != columns_.end() && (found->second.size() == 1 || place == places_.end())) return found->second;
  return place == places_.end() ? std::vector<std::size_t>() : place->second;
}

std::string ColumnLabels::own(std::size_t column) const {
  for (const std::string& label : labels_[column])
    if (columns_.at(label).size() == 1) return label;
  return place_[column];
}

}  // namespace flappy::flightlog
