// Reads text tables of other loggers: PlotJuggler, pandas, NumPy, R, spreadsheets, printf.
//
// Cells are separated by commas, semicolons, tabs or blanks, and may be quoted (RFC 4180). What stands above the rows:
// table_head.hpp. A cell of a wanted column may be
//   a number                                              read; also 1,5 unless commas separate or a cell had 1.5
//   a list, as "[0.1, 0.2]"                               its elements are the fields NAME[0], NAME[1]
//   a date, a time of day, or both, by ISO 8601           s from 1970 or midnight, where a time is wanted
//   empty, nan, NA, N/A, none, null                       missing: NaN
//   anything else, infinities among them                  becomes infinity, which makes the sample unusable
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "flightlog/import/channels.hpp"

namespace flappy::flightlog {

/// Adds a table's rows to `channel`, without times of receipt, and stamps alone of exports of motion capture
/// (mocap_export.hpp), whose bodies and markers are fields; a file of several blocks has a channel `channel`/TITLE for each. `name` is the
/// file in messages. Warns of rows /// whose number of cells differs from the names, of comments among rows, and of cells that are no numbers. InputError
/// without names, for a wanted name given twice, or where no row has a cell for each name.
void read_table(std::string_view text, const std::string& name, const std::string& channel, Channels& channels,
                std::vector<std::string>& warnings);

}  // namespace flappy::flightlog
