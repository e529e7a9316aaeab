// What long work tells the person who waits, and how it is asked to stop.
#pragma once

#include <chrono>
#include <cstdio>
#include <string>

namespace flappy::io {

/// From now on the first Ctrl-C (or SIGTERM) makes interrupted() true, the second ends the program.
void stop_on_interrupt();
bool interrupted();

/// "flown 43 %, 12 s left": one line on a terminal that is written over at most 5 times a second; elsewhere a line of its
/// own at most every `plain_every_s`, none with infinity.
class ProgressLine {
 public:
  explicit ProgressLine(std::string what, double plain_every_s = 10, std::FILE* stream = stderr);
  /// Clears the line.
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  /// Whether show() would write now.
  bool due() const;
  /// `done`: 0 to 1; the time left goes by what was done since the first call. `more` is written behind it.
  void show(double done, const std::string& more = "");
  /// Call it before anything else is printed.
  void clear();

 private:
  using Clock = std::chrono::steady_clock;

  std::string what_;
  std::FILE* stream_;
  bool terminal_;
  std::chrono::duration<double> every_;
  Clock::time_point start_, shown_;
  double done_at_start_ = -1;
  bool visible_ = false;
};

}  // namespace flappy::io
