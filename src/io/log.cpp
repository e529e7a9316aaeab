#include "io/log.hpp"

#include <spdlog/logger.h>
#include <spdlog/sinks/basic_file_sink.h>
#include <spdlog/sinks/stdout_sinks.h>

#include <algorithm>
#include <cstdio>
#include <memory>

#include "io/files.hpp"
#include "io/progress.hpp"
#include "io/text.hpp"

namespace flappy::io {
namespace {

constexpr spdlog::level::level_enum kLevels[] = {spdlog::level::debug, spdlog::level::info, spdlog::level::warn,
                                                 spdlog::level::err};

struct Log {
  Log() {
    screen->set_pattern("%l: %v");
    screen->set_level(spdlog::level::warn);
    logger.set_level(spdlog::level::info);
    logger.flush_on(spdlog::level::info);
  }
  std::shared_ptr<spdlog::sinks::sink> screen = std::make_shared<spdlog::sinks::stderr_sink_mt>();
  spdlog::logger logger{"", screen};
  std::string heading;
};

Log& the_log() {
  static Log log;
  return log;
}

}  // namespace

void start_log(LogLevel on_stderr, const std::string& heading) {
  const auto level = kLevels[static_cast<int>(on_stderr)];
  the_log().screen->set_level(level);
  the_log().logger.set_level(std::min(level, spdlog::level::info));
  the_log().heading = heading;
}

void log_into(const std::filesystem::path& folder) {
  std::shared_ptr<spdlog::sinks::sink> file;
  try {
    file = std::make_shared<spdlog::sinks::basic_file_sink_mt>((folder / "log.txt").string());
  } catch (const spdlog::spdlog_ex& e) {
    const std::string what = e.what();  // "Failed opening file ... for writing: cause"
    throw InputError((folder / "log.txt").string() + ": cannot be written: " + what.substr(what.rfind(": ") + 2));
  }
  file->set_pattern("%Y-%m-%dT%H:%M:%S.%e%z %l: %v");
  the_log().logger.sinks() = {the_log().screen, file};
  file->log({"", spdlog::level::info, the_log().heading});
  file->flush();
}

void log(LogLevel level, std::string_view text) {
  Log& log = the_log();
  const auto at = kLevels[static_cast<int>(level)];
  if (log.screen->should_log(at)) clear_progress();
  log.logger.log(at, printable(text));
}

void log_error(std::string_view text) {
  Log& log = the_log();
  clear_progress();
  std::fprintf(stderr, "%.*s\n", static_cast<int>(text.size()), text.data());
  for (const auto& sink : log.logger.sinks())
    if (sink != log.screen) sink->log({"", spdlog::level::err, text}), sink->flush();
}

void CalmLog::warn(const std::string& line, double now_s) {
  if (now_s < said_s_ + 1) {
    ++unsaid_;
    return;
  }
  log(LogLevel::warning,
      line + (unsaid_ > 0 ? " (and " + std::to_string(unsaid_) + " more since the last such line)" : ""));
  said_s_ = now_s;
  unsaid_ = 0;
}

}  // namespace flappy::io
