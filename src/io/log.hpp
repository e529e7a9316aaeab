// Messages on stderr from a chosen level on, and in log.txt, whose times of day are outside the determinism contract.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace flappy::io {

enum class LogLevel { debug, info, warning, error };

/// Call it once, before anything is logged. `on_stderr`: lowest level that stderr shows (until then warning; log.txt
/// has at least info). `heading`: first line of each log.txt.
void start_log(LogLevel on_stderr, const std::string& heading);
/// From now on also appends all messages to `folder`/log.txt. Throws InputError where it cannot be written.
void log_into(const std::filesystem::path& folder);

/// Logs "warning: text", for example; clears a visible progress line first.
void log(LogLevel level, std::string_view text);
/// Logs an error of the user or of the program; stderr shows the text without its level.
void log_error(std::string_view text);

/// Logs frequent warnings at most once a second, with the number of those left out.
class CalmLog {
 public:
  void warn(const std::string& line, double now_s);

 private:
  double said_s_ = -1e9;
  std::uint64_t unsaid_ = 0;
};

}  // namespace flappy::io
