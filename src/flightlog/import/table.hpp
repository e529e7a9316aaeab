// Tables as other people's loggers write them: PlotJuggler, pandas, NumPy, R, spreadsheets, printf.
//
// Cells are separated by commas, semicolons, tabs or blanks, and may be quoted (RFC 4180). The names of the columns stand in the first line, or
// in the last comment ("# t,x") before the first row. A column that nobody wants may hold anything. A wanted cell may be
//   a number                                              read, with a decimal comma too where commas separate nothing and no cell has a point
//   empty, nan, NA, N/A, none, null                       missing: NaN
//   anything else, infinities and dates among them        no number: infinity, which makes the sample unusable
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "flightlog/import/channels.hpp"

namespace flappy::flightlog {

/// Adds the rows of a table to `channel`; rows have no times but those in their columns. `name` stands for the file in messages. `warnings` get what
/// was left out: rows with another number of cells than the header has names, comments among the rows, and cells that are no numbers. InputError where there are no names,
/// where a wanted name is given twice, or where no row has a cell for each name.
void read_table(std::string_view text, const std::string& name, const std::string& channel, Channels& channels,
                std::vector<std::string>& warnings);

}  // namespace flappy::flightlog
