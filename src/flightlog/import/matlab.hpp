// Reads MATLAB's .mat files of version 5 to 7.3.
//
// A struct is a channel, as "mocap"; its fields are "t", "position[0]", "signals.values[2]". An element of an array of
// structs is one, too, as "trial[1]". Arrays outside structs are fields of a channel that is named by the file's stem.
// The longest side of an array is its rows, the first of equal ones; the other sides longer than 1 give indices from 0.
// Fields shorter than others of their channel end with missing values. Single numbers and texts are no fields.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "flightlog/import/channels.hpp"

namespace flappy::flightlog {

bool is_matlab(std::string_view bytes);
/// Whether bytes are a file of version 4, which begins with its first variable: five integers and a name.
bool is_matlab_4(std::string_view bytes);

/// Adds the channels of a file that has these bytes, without times of receipt and stamps. Warns of what holds no plain
/// numbers, as a datetime, and of what is damaged. InputError where the file cannot be read.
void read_matlab(const std::filesystem::path& file, std::string_view bytes, Channels& channels,
                 std::vector<std::string>& warnings);

}  // namespace flappy::flightlog
