// Progress display of long work, and the request to stop it.
#pragma once

#include <cstdio>
#include <deque>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

namespace flappy::io {

/// From now on the first Ctrl-C (or SIGTERM) makes interrupted() true, the second ends the program.
void stop_on_interrupt();
bool interrupted();
void forget_interrupt();

/// Estimates the remaining time as (1 - done) / rate, with the rate of the last 20 s, or of the last three advances if
/// those took longer.
class TimeLeft {
 public:
  /// `done`: 0 to 1; `now_s` must not decrease. A smaller `done` than before starts the estimate anew.
  void add(double now_s, double done);
  std::optional<double> seconds(double now_s) const;  ///< nothing before three advances

 private:
  struct Point {
    double at_s, done;
  };
  std::deque<Point> points_;  ///< at least a tenth of a second apart
  double done_ = 0;
};

double steady_seconds();  ///< monotonic, with an arbitrary origin
/// Sleeps until a time of steady_seconds(); returns early upon an interrupt.
void sleep_until(double steady_s);

/// Shows "flown 43 %, 12 s left": on a terminal one line that is overwritten at most 5 times a second; elsewhere a new
/// line at most every `plain_every_s` (infinity: none).
class ProgressLine {
 public:
  explicit ProgressLine(std::string what, double plain_every_s = 10, std::FILE* stream = stderr,
                        std::function<double()> clock_s = steady_seconds);
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  bool due() const;  ///< whether show() would write now
  /// `done`: 0 to 1. `more` is appended after the time left.
  void show(double done, const std::string& more = "");
  /// Clears the line; call it before printing anything else on stdout.
  void clear();

 private:
  std::string what_;
  std::filesystem::path file_;
  std::FILE* stream_;
  bool terminal_;
  double every_s_;
  std::function<double()> clock_s_;
  double shown_s_, filed_s_;
  TimeLeft left_;
  bool visible_ = false;
};

void clear_progress();
/// Later progress lines also go to `file`, at most once a second: {"share": 0.43, "message": "flown 43 %, 12 s left"}.
void write_progress(const std::filesystem::path& file);
/// Later progress lines show nothing, because another process shows the progress.
void silence_progress();

}  // namespace flappy::io
