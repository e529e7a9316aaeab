#include "io/log.hpp"

#include <gtest/gtest.h>

#include <regex>

#include "io/files.hpp"

namespace flappy::io {
namespace {

class LogTest : public testing::Test {
 protected:
  LogTest() { make_folder(folder_); }
  ~LogTest() override {
    start_log(LogLevel::warning, "");
    std::filesystem::remove_all(folder_);
  }
  std::string file() const { return read_text(folder_ / "log.txt"); }
  /// What `note` leaves on stderr.
  template <class Note>
  static std::string shown(const Note& note) {
    testing::internal::CaptureStderr();
    note();
    return testing::internal::GetCapturedStderr();
  }

  const std::filesystem::path folder_ = testing::TempDir() + "/flappy_log_test";
};

TEST_F(LogTest, HasEachLevelWhereItBelongs) {
  const auto note_all = [] {
    log(LogLevel::debug, "a detail");
    log(LogLevel::info, "a stage");
    log(LogLevel::warning, "no {} figure %s");
    log_error("f.toml:1:2: k: is wrong");
  };
  start_log(LogLevel::warning, "flappy-x 1, commit c: flappy-x --out o");
  log_into(folder_);
  EXPECT_EQ(shown(note_all), "warning: no {} figure %s\nf.toml:1:2: k: is wrong\n");
  const std::string time = R"(\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}[+-]\d\d:\d\d )";
  EXPECT_TRUE(std::regex_match(
      file(), std::regex(time + "info: flappy-x 1, commit c: flappy-x --out o\n" + time + "info: a stage\n" + time +
                         R"(warning: no \{\} figure %s)" + "\n" + time + "error: f.toml:1:2: k: is wrong\n")))
      << file();
  start_log(LogLevel::error, "");
  EXPECT_EQ(shown(note_all), "f.toml:1:2: k: is wrong\n");
  start_log(LogLevel::debug, "");
  EXPECT_EQ(shown(note_all).substr(0, 33), "debug: a detail\ninfo: a stage\nwar");
  EXPECT_NE(file().find("debug: a detail\n"), std::string::npos);
}

TEST_F(LogTest, GoesOnInTheFolderOfTheMoment) {
  start_log(LogLevel::warning, "first");
  log_into(folder_);
  log(LogLevel::info, "here");
  make_folder(folder_ / "next");
  log_into(folder_ / "next");
  log(LogLevel::info, "there");
  const std::string before = file();
  EXPECT_EQ(before.find("there"), std::string::npos);
  EXPECT_NE(read_text(folder_ / "next/log.txt").find("info: there\n"), std::string::npos);
  start_log(LogLevel::warning, "second");
  log_into(folder_);
  EXPECT_TRUE(file().starts_with(before)) << "a run that is resumed";
  EXPECT_TRUE(file().ends_with("info: second\n"));
}

TEST_F(LogTest, RefusesAFolderThatCannotBeWritten) {
  write_atomically(folder_ / "file", "");
  try {
    log_into(folder_ / "file");
    FAIL();
  } catch (const InputError& e) {
    EXPECT_EQ(e.what(), (folder_ / "file/log.txt").string() + ": cannot be written: Not a directory");
  }
}

}  // namespace
}  // namespace flappy::io
