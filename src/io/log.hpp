// What a program notes beside its results: on stderr from a level up, and in the log.txt of the folder that it leaves. The
// lines there carry the time of day and are outside the determinism contract.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace flappy::io {

enum class LogLevel { debug, info, warning, error };

/// Once, before anything is noted: the least level that stderr shows (warning until then; log.txt has at least info), and
/// what the first line of each log.txt says.
void start_log(LogLevel on_stderr, const std::string& heading);
/// From now on `folder`/log.txt has it all, after what is in it. InputError when it cannot be written.
void log_into(const std::filesystem::path& folder);

/// "warning: text" on stderr, after a progress line is cleared.
void log(LogLevel level, std::string_view text);
/// The user's mistake or ours: the text alone on stderr.
void log_error(std::string_view text);

/// Says what happens often once a second at most, and how often it did.
class CalmLog {
 public:
  void warn(const std::string& line, double now_s);

 private:
  double said_s_ = -1e9;
  std::uint64_t unsaid_ = 0;
};

}  // namespace flappy::io
