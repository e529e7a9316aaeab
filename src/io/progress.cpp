#include "io/progress.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <nlohmann/json.hpp>
#include <thread>
#include <utility>

#include "io/files.hpp"
#include "io/text.hpp"

namespace flappy::io {
namespace {

constexpr std::size_t kPoints = 4;  // beginning and ends of the last three advances

volatile std::sig_atomic_t interrupted_flag = 0;
ProgressLine* visible_line = nullptr;  // the line on the terminal, or null
bool silent = false;
std::filesystem::path progress_file;  // empty: no file
constexpr double kFileEvery_s = 1;

/// "9 s", "12 min", "3.4 h"
std::string duration_text(double s) {
  if (s < 100) return format("%.0f s", s);
  return s < 6000 ? format("%.0f min", s / 60) : format("%.1f h", s / 3600);
}

/// The longest text of a line: a longer one would wrap, and the next line would not overwrite it.
std::size_t width_of(std::FILE* terminal) {
  winsize size{};
  return ioctl(fileno(terminal), TIOCGWINSZ, &size) == 0 && size.ws_col > 1 ? size.ws_col - 1u : 79u;
}

}  // namespace

void silence_progress() { silent = true; }
void write_progress(const std::filesystem::path& file) { progress_file = file; }

void stop_on_interrupt() {
  struct sigaction action {};
  action.sa_handler = [](int) { interrupted_flag = 1; };
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

bool interrupted() { return interrupted_flag != 0; }
void forget_interrupt() { interrupted_flag = 0; }

double steady_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

void sleep_until(double steady_s) {
  constexpr double kLook_s = 0.1;
  for (double left_s; (left_s = steady_s - steady_seconds()) > 0 && !interrupted();)
    std::this_thread::sleep_for(std::chrono::duration<double>(std::min(left_s, kLook_s)));
}

void TimeLeft::add(double now_s, double done) {
  constexpr double kWindow_s = 20, kApart_s = 0.1;
  if (done < done_) points_.clear();  // the work begins anew
  done_ = done;
  if (!points_.empty() && (done <= points_.back().done || now_s < points_.back().at_s + kApart_s)) return;
  points_.push_back({now_s, done});
  while (points_.size() > kPoints && points_[1].at_s <= now_s - kWindow_s) points_.pop_front();
}

std::optional<double> TimeLeft::seconds(double now_s) const {
  if (points_.size() < kPoints) return std::nullopt;
  return (1 - done_) * (now_s - points_.front().at_s) / (done_ - points_.front().done);
}

ProgressLine::ProgressLine(std::string what, double plain_every_s, std::FILE* stream, std::function<double()> clock_s)
    : what_(std::move(what)),
      file_(silent ? "" : progress_file),
      stream_(stream),
      terminal_(!silent && isatty(fileno(stream)) != 0),
      every_s_(silent      ? HUGE_VAL
               : terminal_ ? 0.2
                           : plain_every_s),
      clock_s_(std::move(clock_s)),
      shown_s_(clock_s_()),
      filed_s_(file_.empty() ? HUGE_VAL : shown_s_ - kFileEvery_s) {}

ProgressLine::~ProgressLine() { clear(); }

bool ProgressLine::due() const {
  const double now_s = clock_s_();
  return now_s - shown_s_ >= every_s_ || now_s - filed_s_ >= kFileEvery_s;
}

void ProgressLine::show(double done, const std::string& more) {
  const double now_s = clock_s_();
  left_.add(now_s, done);
  const bool shows = now_s - shown_s_ >= every_s_, files = now_s - filed_s_ >= kFileEvery_s;
  if (!shows && !files) return;
  std::string text = what_ + format(" %.0f %%", std::floor(100 * done + 1e-9));  // floor: 100 % means done
  if (const auto left_s = left_.seconds(now_s)) text += ", " + duration_text(*left_s) + " left";
  if (!more.empty()) text += ", " + more;
  if (files) {
    filed_s_ = now_s;
    write_atomically(file_, nlohmann::ordered_json{{"share", done}, {"message", text}}.dump() + "\n");
  }
  if (!shows) return;
  shown_s_ = now_s;
  if (terminal_) {
    std::fprintf(stream_, "\r%s\x1b[K", text.substr(0, width_of(stream_)).c_str());
  } else {
    std::fprintf(stream_, "%s\n", text.c_str());
  }
  std::fflush(stream_);
  visible_ = terminal_;
  if (visible_) visible_line = this;
}

void clear_progress() {
  if (ProgressLine* line = visible_line) line->clear();
}

void ProgressLine::clear() {
  if (!std::exchange(visible_, false)) return;
  visible_line = nullptr;
  std::fputs("\r\x1b[K", stream_);
  std::fflush(stream_);
}

}  // namespace flappy::io
