#include "io/progress.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/ioctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <memory>
#include <regex>
#include <thread>

namespace flappy::io {
namespace {

using namespace std::chrono_literals;
using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

/// A file or a terminal, and what was written to it.
class Screen {
 public:
  explicit Screen(bool terminal) : stream(nullptr, std::fclose) {
    if (!terminal) {
      stream.reset(std::tmpfile());
      return;
    }
    master_ = posix_openpt(O_RDWR | O_NOCTTY);
    if (grantpt(master_) != 0 || unlockpt(master_) != 0) return;
    const winsize size{24, 30, 0, 0};
    ioctl(master_, TIOCSWINSZ, &size);
    stream.reset(std::fopen(ptsname(master_), "r+"));
    fcntl(master_, F_SETFL, O_NONBLOCK);
  }
  ~Screen() {
    if (master_ >= 0) close(master_);
  }
  std::string written() {
    char text[4096];
    ssize_t size = 0;
    if (master_ >= 0) size = read(master_, text, sizeof text);
    else size = pread(fileno(stream.get()), text, sizeof text, 0);
    return {text, static_cast<std::size_t>(std::max<ssize_t>(size, 0))};
  }

  File stream;

 private:
  int master_ = -1;
};

TEST(ProgressLine, WritesOverItselfOnATerminal) {
  Screen screen(true);
  ASSERT_TRUE(screen.stream && isatty(fileno(screen.stream.get())));
  {
    ProgressLine line("flown", 1000, screen.stream.get());
    EXPECT_FALSE(line.due());
    for (int i = 0; i < 10; ++i) line.show(0);
    EXPECT_EQ(screen.written(), "") << "nothing for short work";
    std::this_thread::sleep_for(210ms);
    EXPECT_TRUE(line.due());
    for (int i = 0; i < 10; ++i) line.show(0.25);
    // a quarter took 0.2 s, or longer on a busy machine
    EXPECT_TRUE(std::regex_match(screen.written(), std::regex("\rflown 25 %, [1-9] s left\x1b\\[K")));
    std::this_thread::sleep_for(210ms);
    line.show(0.999, "and more than fits in thirty columns");
    EXPECT_EQ(screen.written(), "\rflown 100 %, 0 s left, and mo\x1b[K");
    line.clear();
    EXPECT_EQ(screen.written(), "\r\x1b[K");
    line.clear();
    EXPECT_EQ(screen.written(), "");
    std::this_thread::sleep_for(210ms);
    line.show(1);
    screen.written();
  }
  EXPECT_EQ(screen.written(), "\r\x1b[K") << "cleared at its end";
}

TEST(ProgressLine, WritesPlainLinesElsewhere) {
  Screen screen(false);
  {
    ProgressLine line("trained", 0.1, screen.stream.get());
    for (int i = 0; i < 10; ++i) line.show(0.5);
    EXPECT_EQ(screen.written(), "");
    std::this_thread::sleep_for(110ms);
    for (int i = 0; i < 10; ++i) line.show(0.5, "update 7");
    EXPECT_EQ(screen.written(), "trained 50 %, update 7\n") << "no time left while nothing was done";
    line.clear();
  }
  EXPECT_EQ(screen.written(), "trained 50 %, update 7\n");
}

TEST(StopOnInterrupt, TheFirstAsksTheSecondEnds) {
  for (const int signal : {SIGINT, SIGTERM}) {
    const pid_t child = fork();
    if (child == 0) {
      stop_on_interrupt();
      if (interrupted()) _exit(1);
      std::raise(signal);
      if (!interrupted()) _exit(2);
      std::raise(signal);
      _exit(3);
    }
    int status = 0;
    waitpid(child, &status, 0);
    EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == signal) << status;
  }
}

}  // namespace
}  // namespace flappy::io
