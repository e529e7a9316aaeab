// Runs another program as a function from text to text.
#pragma once

#include <sys/types.h>

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace flappy::io {

/// Starts a program (along PATH, no shell), whose file descriptor i is `streams[i]`. Throws std::system_error where it
/// cannot be started.
pid_t start_program(const std::vector<std::string>& command, std::span<const int> streams);

struct Finished {
  int exit_code;  ///< -1: a signal ended it
  std::string out, err;
  double peak_bytes;  ///< peak memory, as looked at every 2 ms
};
/// Runs a program (along PATH, no shell) with `input` on stdin. Throws std::system_error where it cannot be started.
Finished run(const std::vector<std::string>& command, std::string_view input = {});

/// run() for its stdout. Throws InputError "result: is not written: ..." where the program is missing or fails.
std::string run_program(const std::vector<std::string>& command, std::string_view input, const std::string& result);

}  // namespace flappy::io
