// Another program as a function from text to text.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace flappy::io {

struct Finished {
  int exit_code;  ///< -1: it did not end by itself
  std::string out, err;
  double peak_bytes;  ///< of memory
};
/// Runs a program (found along PATH, no shell) with `input` on its stdin. std::system_error where it cannot be run.
Finished run(const std::vector<std::string>& command, std::string_view input = {});

/// The same, for its stdout. `result` is what it
/// is to make; InputError "result: is not written: ..." when the program is missing or fails.
std::string run_program(const std::vector<std::string>& command, std::string_view input, const std::string& result);

}  // namespace flappy::io
