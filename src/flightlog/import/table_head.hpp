// The head of a text table: what stands above its rows, and what its columns are called.
//
// Names stand in the last comment ("# t,x") before the first row, or in the first line that rows of as many numbers
// follow. What is above them is skipped: text, or rows of groups, which tell columns of one name apart; such a row
// begins with an empty cell or is as wide as the names, and an empty cell in it repeats the group to its left. A row of
// words right below the names holds their units, or a name ends with its own in brackets.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace flappy::flightlog {

struct TableColumn {
  std::string name;
  std::vector<std::string> groups;  ///< from the top; empty where a row of groups has none for the column
  std::string unit;                 ///< empty where the table says none
};

struct TableHead {
  char separator;
  std::size_t line;  ///< line of the names; 0 if they stand in a comment
  std::size_t end;   ///< the last line of the head; 0 if it consists of comments
  std::vector<TableColumn> columns;
};

/// InputError for a table without names. `name` is the file in messages, `above` the number of its lines before the text.
TableHead head_of(std::string_view text, const std::string& name, std::size_t above = 0);

/// How the columns of a table may be called: "X", or, where several have that name, with groups that tell them apart,
/// "Position X", "robot Position X", or by its place among them, "X 2".
class ColumnLabels {
 public:
  explicit ColumnLabels(const std::vector<TableColumn>& columns);
  /// The columns that are called so: none, one, or several that `label` does not tell apart.
  std::vector<std::size_t> find(const std::string& label) const;
  /// The shortest label that is the column's own; empty where the column has neither name nor groups.
  std::string own(std::size_t column) const;

 private:
  std::vector<std::vector<std::string>> labels_;  ///< of each column, the shortest first
  std::map<std::string, std::vector<std::size_t>> columns_, places_;
  std::vector<std::string> place_;  ///< of each column, as "X 2"
};

}  // namespace flappy::flightlog
