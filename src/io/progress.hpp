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
/// Resets interrupted(), for a process that goes on.
void forget_interrupt();

/// Estimates the remaining time as (1 - done) / rate. The rate is that of the last 20 s, or of the last
/// three advances where those took longer.
class TimeLeft {
 public:
  /// `done`: 0 to 1; `now_s` must not decrease. A smaller `done` than before starts the estimate anew.
  void add(double now_s, double done);
  /// Returns nothing before three advances.
  std::optional<double> seconds(double now_s) const;

 private:
  struct Point {
    double at_s, done;
  };
  std::deque<Point> points_;  ///< at least a tenth of a second apart
  double done_ = 0;
};

/// Seconds of a monotonic clock with an arbitrary origin.
double steady_seconds();
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

  /// Whether show() would write now.
  bool due() const;
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

/// Clears the progress line that is visible, if any.
void clear_progress();
/// Progress lines made from now on are also written to `file`, at most once a second: {"share": 0.43, "message": "flown 43 %, 12 s left"}.
void write_progress(const std::filesystem::path& file);
/// Progress lines made from now on show nothing, because another process shows the progress.
void silence_progress();

}  // namespace flappy::io
