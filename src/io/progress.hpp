// What long work tells the person who waits, and how it is asked to stop.
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
/// As if none had come: for a process that goes on.
void forget_interrupt();

/// How long work that goes on as it did lately will take: (1 - done) / rate, the rate that of the last 20 s, or of the last
/// three advances where those took longer.
class TimeLeft {
 public:
  /// `done`: 0 to 1, at a time that does not go back. Where `done` goes back, what was before says nothing any more.
  void add(double now_s, double done);
  /// Nothing before three advances.
  std::optional<double> seconds(double now_s) const;

 private:
  struct Point {
    double at_s, done;
  };
  std::deque<Point> points_;  ///< at least a tenth of a second apart
  double done_ = 0;
};

/// Seconds since some moment, on a clock that nobody sets.
double steady_seconds();
/// On that clock; returns at once where it has passed, and early upon an interrupt.
void sleep_until(double steady_s);

/// "flown 43 %, 12 s left": one line on a terminal that is written over at most 5 times a second; elsewhere a line of its
/// own at most every `plain_every_s`, none with infinity.
class ProgressLine {
 public:
  explicit ProgressLine(std::string what, double plain_every_s = 10, std::FILE* stream = stderr,
                        std::function<double()> clock_s = steady_seconds);
  /// Clears the line.
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  /// Whether show() would write now.
  bool due() const;
  /// `done`: 0 to 1. `more` is written behind the time left.
  void show(double done, const std::string& more = "");
  /// Call it before anything else is printed on stdout.
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

/// Clears the line that is visible, if any is.
void clear_progress();
/// From now on every line also stands in `file`, at most once a second: {"share": 0.43, "message": "flown 43 %, 12 s left"}.
void write_progress(const std::filesystem::path& file);
/// Lines that are made from now on stay silent: another process speaks for this one.
void silence_progress();

}  // namespace flappy::io
