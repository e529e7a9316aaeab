#include "io/progress.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <csignal>
#include <utility>

namespace flappy::io {
namespace {

volatile std::sig_atomic_t interrupted_flag = 0;

/// "9 s", "12 min", "3.4 h"
std::string duration_text(double s) {
  char text[32];
  if (s < 100) std::snprintf(text, sizeof text, "%.0f s", s);
  else if (s < 6000) std::snprintf(text, sizeof text, "%.0f min", s / 60);
  else std::snprintf(text, sizeof text, "%.1f h", s / 3600);
  return text;
}

/// What does not fit would wrap, and the next line would not cover it.
std::size_t width_of(std::FILE* terminal) {
  winsize size{};
  return ioctl(fileno(terminal), TIOCGWINSZ, &size) == 0 && size.ws_col > 1 ? size.ws_col - 1u : 79u;
}

}  // namespace

void stop_on_interrupt() {
  struct sigaction action {};
  action.sa_handler = [](int) { interrupted_flag = 1; };
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

bool interrupted() { return interrupted_flag != 0; }

ProgressLine::ProgressLine(std::string what, double plain_every_s, std::FILE* stream)
    : what_(std::move(what)),
      stream_(stream),
      terminal_(isatty(fileno(stream)) != 0),
      every_(terminal_ ? 0.2 : plain_every_s),
      start_(Clock::now()),
      shown_(start_) {}

ProgressLine::~ProgressLine() { clear(); }

bool ProgressLine::due() const { return Clock::now() - shown_ >= every_; }

void ProgressLine::show(double done, const std::string& more) {
  const auto now = Clock::now();
  if (done_at_start_ < 0) {
    done_at_start_ = done;
    start_ = now;
  }
  if (now - shown_ < every_) return;
  shown_ = now;
  char share[16];
  std::snprintf(share, sizeof share, " %.0f %%", 100 * done);
  std::string text = what_ + share;
  if (done > done_at_start_) {
    const double spent_s = std::chrono::duration<double>(now - start_).count();
    text += ", " + duration_text(spent_s * (1 - done) / (done - done_at_start_)) + " left";
  }
  if (!more.empty()) text += ", " + more;
  if (terminal_) {
    std::fprintf(stream_, "\r%s\x1b[K", text.substr(0, width_of(stream_)).c_str());
  } else {
    std::fprintf(stream_, "%s\n", text.c_str());
  }
  std::fflush(stream_);
  visible_ = terminal_;
}

void ProgressLine::clear() {
  if (!std::exchange(visible_, false)) return;
  std::fputs("\r\x1b[K", stream_);
  std::fflush(stream_);
}

}  // namespace flappy::io
