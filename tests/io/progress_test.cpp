#include "io/progress.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <cstdlib>
#include <memory>

#include "io/files.hpp"
#include "io/temporary_folder.hpp"

namespace flappy::io {
namespace {

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
    std::string all(4096, ' ');
    ssize_t size = 0, more = 0;
    if (master_ < 0) size = pread(fileno(stream.get()), all.data(), all.size(), 0);
    // the kernel hands a terminal's output on piece by piece, soon
    for (pollfd ready{master_, POLLIN, 0}; master_ >= 0 && poll(&ready, 1, 100) > 0; size += more)
      if (more = read(master_, &all[static_cast<std::size_t>(size)], 1024); more <= 0) break;
    all.resize(static_cast<std::size_t>(std::max<ssize_t>(size, 0)));
    return all;
  }

  File stream;

 private:
  int master_ = -1;
};

TEST(TimeLeft, IsThatOfTheRecentRate) {
  // 30 s on a busy machine for a tenth, then 1 % a second
  TimeLeft left;
  double now_s = 0, done = 0;
  for (; done < 0.0999; ++now_s, done += 0.1 / 30) left.add(now_s, done);
  left.add(now_s, done);
  EXPECT_NEAR(*left.seconds(now_s), 270, 1e-6) << "30 s for each tenth";
  for (int i = 0; i < 10; ++i) left.add(++now_s, done += 0.01);
  EXPECT_NEAR(*left.seconds(now_s), 0.8 / ((0.1 + 0.1 / 3) / 20), 1e-6) << "half of the last 20 s was quick";
  for (int i = 0; i < 10; ++i) left.add(++now_s, done += 0.01);
  EXPECT_NEAR(*left.seconds(now_s), 70, 1e-6) << "the busy time is forgotten";
  EXPECT_NEAR(*left.seconds(now_s + 20), 140, 1e-6) << "nothing done for as long again";
}

TEST(TimeLeft, ForgetsWorkThatBeginsAnew) {
  TimeLeft left;
  for (int i = 0; i <= 10; ++i) left.add(i, 0.1 * i);
  left.add(11, 0.01);
  EXPECT_FALSE(left.seconds(11));
  for (int i = 1; i <= 4; ++i) left.add(11 + i, 0.01 + 0.01 * i);
  EXPECT_NEAR(*left.seconds(15), 95, 1e-6);
}

TEST(TimeLeft, IsUnknownBeforeThreeAdvances) {
  TimeLeft left;
  EXPECT_FALSE(left.seconds(0));
  left.add(0, 0.4);
  left.add(100, 0.4);
  left.add(100, 0.5);
  left.add(200, 0.51);
  EXPECT_FALSE(left.seconds(200));
  left.add(200.05, 0.9);
  EXPECT_FALSE(left.seconds(200.05)) << "too soon after the last to tell a rate";
  left.add(300, 0.9);
  EXPECT_NEAR(*left.seconds(300), 300 * 0.1 / 0.5, 1e-9);
  // rare advances: the last three, however long they took
  for (int i = 1; i <= 4; ++i) left.add(300 + 100 * i, 0.9 + 0.01 * i);
  EXPECT_NEAR(*left.seconds(700), 600, 1e-6);
}

TEST(ProgressLine, WritesOverItselfOnATerminal) {
  Screen screen(true);
  ASSERT_TRUE(screen.stream && isatty(fileno(screen.stream.get())));
  double now_s = 100;
  {
    ProgressLine line("flown", 1000, screen.stream.get(), [&] { return now_s; });
    EXPECT_FALSE(line.due());
    for (int i = 0; i < 10; ++i) line.show(0);
    EXPECT_EQ(screen.written(), "") << "nothing for short work";
    for (const double done : {0.05, 0.1}) {
      now_s += 5;
      EXPECT_TRUE(line.due());
      for (int i = 0; i < 10; ++i) line.show(done);
    }
    EXPECT_EQ(screen.written(), "\rflown 5 %\x1b[K\rflown 10 %\x1b[K") << "no time left while none is known";
    now_s += 5;
    line.show(0.15);
    EXPECT_EQ(screen.written(), "\rflown 15 %, 85 s left\x1b[K");
    now_s += 5;
    line.show(0.999, "and more than fits in thirty columns");
    EXPECT_EQ(screen.written(), "\rflown 99 %, 0 s left, and mor\x1b[K");
    line.clear();
    EXPECT_EQ(screen.written(), "\r\x1b[K");
    line.clear();
    EXPECT_EQ(screen.written(), "");
    now_s += 0.3;
    line.show(1);
    screen.written();
  }
  EXPECT_EQ(screen.written(), "\r\x1b[K") << "cleared at its end";
}

TEST(ProgressLine, IsClearedForWhoKnowsItNot) {
  Screen screen(true);
  double now_s = 0;
  ProgressLine line("flown", 1000, screen.stream.get(), [&] { return now_s; });
  clear_progress();
  EXPECT_EQ(screen.written(), "");
  now_s = 1;
  line.show(0.5);
  screen.written();
  clear_progress();
  EXPECT_EQ(screen.written(), "\r\x1b[K");
  clear_progress();
  EXPECT_EQ(screen.written(), "");
}

TEST(ProgressLine, StandsInAFileAsJson) {
  const TemporaryFolder folder;
  Screen screen(false);
  double now_s = 100;
  write_progress(folder / "progress.json");
  ProgressLine line("flown", HUGE_VAL, screen.stream.get(), [&] { return now_s; });
  write_progress({});
  EXPECT_TRUE(line.due()) << "at once";
  line.show(0.25, "of \"all\"");
  EXPECT_EQ(read_text(folder / "progress.json"), "{\"share\":0.25,\"message\":\"flown 25 %, of \\\"all\\\"\"}\n");
  now_s += 0.9;
  EXPECT_FALSE(line.due());
  line.show(0.5);
  EXPECT_EQ(read_text(folder / "progress.json").substr(0, 14), "{\"share\":0.25,") << "a second has not passed";
  now_s += 0.1;
  line.show(0.5);
  EXPECT_EQ(read_text(folder / "progress.json").substr(0, 13), "{\"share\":0.5,");
  EXPECT_EQ(screen.written(), "");
}

TEST(ProgressLine, WritesPlainLinesElsewhere) {
  Screen screen(false);
  double now_s = 100;
  {
    ProgressLine line("trained", 10, screen.stream.get(), [&] { return now_s; });
    for (int i = 0; i < 10; ++i) line.show(0.5);
    EXPECT_EQ(screen.written(), "");
    now_s += 10;
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
