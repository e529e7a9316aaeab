#include "io/append_file.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <functional>

#include "io/files.hpp"

namespace flappy::io {
namespace {

std::string refusal(const std::function<void()>& call) {
  try {
    call();
    return "accepted";
  } catch (const InputError& error) {
    return error.what();
  }
}

/// Whether `job` is true in a process of its own, which may kill itself only when the job returns.
bool in_child(const std::function<bool()>& job) {
  const pid_t child = fork();
  if (child == 0) _exit(job() ? 0 : 1);
  int status = 0;
  waitpid(child, &status, 0);
  return status == 0;
}

class AppendFileTest : public testing::Test {
 protected:
  ~AppendFileTest() override { std::filesystem::remove_all(folder_); }

  const std::filesystem::path folder_ =
      testing::TempDir() + "flappy_append_" + testing::UnitTest::GetInstance()->current_test_info()->name();
  const bool made_ = std::filesystem::create_directories(folder_);
  const std::filesystem::path path_ = folder_ / "a";
};

TEST_F(AppendFileTest, GrowsAndGoesOn) {
  {
    AppendFile file(path_);
    file.write("one\n");
    EXPECT_EQ(read_text(path_), "one\n") << "handed on at once";
    file.write("two\n");
    file.sync();
  }
  {
    AppendFile file(path_, 4);
    EXPECT_EQ(read_text(path_), "one\n");
    file.write("three\n");
    EXPECT_EQ(read_text(path_), "one\nthree\n");
  }
  const AppendFile file(path_);
  EXPECT_EQ(read_text(path_), "");
}

TEST_F(AppendFileTest, RefusesWhatCannotBeWritten) {
  EXPECT_EQ(refusal([&] { AppendFile file(folder_ / "none" / "a"); }),
            (folder_ / "none" / "a").string() + ": cannot be written: No such file or directory");
  EXPECT_EQ(refusal([&] { AppendFile file(folder_); }), folder_.string() + ": cannot be written: Is a directory");
  AppendFile full("/dev/full");
  EXPECT_EQ(refusal([&] { full.write("x"); }), "/dev/full: cannot be written: No space left on device");
}

TEST_F(AppendFileTest, LeavesNoHalfRecord) {
  EXPECT_TRUE(in_child([&] {
    const rlimit limit{10, 10};
    setrlimit(RLIMIT_FSIZE, &limit);
    std::signal(SIGXFSZ, SIG_IGN);
    AppendFile file(path_);
    file.write("seven..");
    return refusal([&] { file.write("seven.."); }) == path_.string() + ": cannot be written: File too large";
  }));
  EXPECT_EQ(read_text(path_), "seven..");
}

TEST_F(AppendFileTest, LocksAFolder) {
  {
    const FolderLock lock(folder_);
    EXPECT_EQ(refusal([&] { const FolderLock second(folder_); }),
              folder_.string() + ": another process is at work here; accepted: wait for it, or another folder");
    EXPECT_TRUE(in_child([&] { return refusal([&] { const FolderLock second(folder_); }) != "accepted"; }));
  }
  EXPECT_EQ(refusal([&] { const FolderLock again(folder_); }), "accepted");
  EXPECT_EQ(refusal([&] { const FolderLock none(folder_ / "none"); }),
            (folder_ / "none").string() + ": cannot be read: No such file or directory");
}

TEST_F(AppendFileTest, RemovesWhatAKilledProcessLeft) {
  // killed while it writes
  in_child([&] {
    AtomicFile file(path_);
    file.write(std::string(100000, 'x'));
    std::raise(SIGKILL);
    return true;
  });
  for (const char* other : {"keep.tmp", "keep.tmp12", "keep.tmp1-2.csv", ".tmp1-2"})
    write_atomically(folder_ / other, "");
  const auto files = [&] { return std::distance(std::filesystem::directory_iterator(folder_), {}); };
  ASSERT_EQ(files(), 5);
  const FolderLock lock(folder_);
  EXPECT_EQ(files(), 4);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "keep.tmp1-2.csv"));
}

}  // namespace
}  // namespace flappy::io
