// Reads text tables of other loggers: PlotJuggler, pandas, NumPy, R, spreadsheets, printf.
//
// Cells are separated by commas, semicolons, tabs or blanks, and may be quoted (RFC 4180). The names of the columns stand in the first
// line, or in the last comment ("# t,x") before the first row. Cells of unwanted columns are ignored. A wanted cell may be
//   a number                                              read; also with a decimal comma, unless commas separate cells or a cell had a point
//   empty, nan, NA, N/A, none, null                       missing: NaN
//   anything else, infinities and dates among them        becomes infinity, which makes the sample unusable
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "flightlog/import/channels.hpp"

namespace flappy::flightlog {

/// Adds the rows of a table to `channel`, without times of receipt and stamps. `name` is the file in messages. Adds a
/// warning for rows whose number of cells differs from the header, for comments among the rows, and for cells that are
/// no numbers. InputError where there are no names, where a wanted name is given twice, or where no row has a cell for
/// each name.
void read_table(std::string_view text, const std::string& name, const std::string& channel, Channels& channels,
                std::vector<std::string>& warnings);

}  // namespace flappy::flightlog
