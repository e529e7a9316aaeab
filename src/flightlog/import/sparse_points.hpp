// Points in DLTdv8's sparse form (xyzpts.tsv): a title; the numbers of rows (frames), columns and entries; then row, column and
// value of each entry, from 1, column by column, separated by tabs (its sparseSave.m). What is not listed was not digitised:
// also a coordinate of 0, which DLTdv cannot tell from it. Columns are pt1_X, pt1_Y, pt1_Z, pt2_X, ..., as in its xyzpts.csv.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "flightlog/import/channels.hpp"

namespace flappy::flightlog {

bool is_sparse_points(std::string_view text);

/// Adds the frames to `channel`, NaN where a point was not digitised, in the units of the file. `name` is the file in
/// messages. Warns where entries are missing. InputError for points of pictures (xypts.tsv), and for more than two million
/// frames.
void read_sparse_points(std::string_view text, const std::string& name, const std::string& channel, Channels& channels,
                        std::vector<std::string>& warnings);

}  // namespace flappy::flightlog
