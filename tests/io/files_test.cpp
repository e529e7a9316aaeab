#include "io/files.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>

namespace flappy::io {
namespace {

class FilesTest : public testing::Test {
 protected:
  ~FilesTest() override { std::filesystem::remove_all(folder_); }

  std::string write_message(const std::filesystem::path& path) {
    try {
      write_atomically(path, "x");
      return "accepted";
    } catch (const InputError& error) {
      return error.what();
    }
  }

  std::string read_message(const std::filesystem::path& path) {
    try {
      read_text(path);
      return "accepted";
    } catch (const InputError& error) {
      return error.what();
    }
  }

  std::size_t files() const {
    return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder_), {}));
  }

  const std::filesystem::path folder_ =
      testing::TempDir() + "flappy_files_" + testing::UnitTest::GetInstance()->current_test_info()->name();
  const bool made_ = std::filesystem::create_directories(folder_);
};

TEST_F(FilesTest, ReadsBackWhatWasWritten) {
  std::string text = std::string("a\0b\r\n\xff", 6) + std::string(200000, 'x');
  write_atomically(folder_ / "a", text);
  EXPECT_EQ(read_text(folder_ / "a"), text);
  write_atomically(folder_ / "a", "");
  EXPECT_EQ(read_text(folder_ / "a"), "");
  EXPECT_EQ(files(), 1u);
}

TEST_F(FilesTest, RefusesWhatCannotBeRead) {
  const std::string folder = folder_.string();
  EXPECT_EQ(read_message(folder + "/none"), folder + "/none: cannot be read: No such file or directory");
  EXPECT_EQ(read_message(folder), folder + ": cannot be read: Is a directory");
  EXPECT_EQ(read_message(""), ": cannot be read: No such file or directory");
}

TEST_F(FilesTest, RefusesWhatCannotBeWritten) {
  const std::string folder = folder_.string();
  EXPECT_EQ(write_message(folder + "/none/a"), folder + "/none/a: cannot be written: No such file or directory");
  EXPECT_EQ(write_message(folder), folder + ": cannot be written: Is a directory");
  // Stands for a device: a failing test must not replace a real one.
  ASSERT_EQ(mkfifo((folder + "/pipe").c_str(), 0600), 0);
  EXPECT_EQ(write_message(folder + "/pipe"), folder + "/pipe: cannot be written: Not a regular file");
  EXPECT_EQ(files(), 1u);
}

TEST_F(FilesTest, LeavesTheOldFileUnlessCommitted) {
  write_atomically(folder_ / "a", "old");
  {
    AtomicFile file(folder_ / "a");
    file.write("new");
    EXPECT_EQ(files(), 2u);
  }
  EXPECT_EQ(read_text(folder_ / "a"), "old");
  EXPECT_EQ(files(), 1u);
}

TEST_F(FilesTest, ReportsAFolderThatVanished) {
  AtomicFile file(folder_ / "a");
  std::filesystem::remove_all(folder_);
  file.write("new");
  EXPECT_THROW(file.commit(), InputError);
}

TEST(InputErrorTest, IsOneLine) { EXPECT_STREQ(InputError("a\nb\x1b[0m\x7fü").what(), "a\\x0ab\\x1b[0m\\x7fü"); }

TEST(NearestName, FindsMisspellings) {
  const std::vector<std::string> names = {"flapping_Hz", "seed", "r22", "hold_s"};
  EXPECT_EQ(nearest_name("flaping_Hz", names), "flapping_Hz");
  EXPECT_EQ(nearest_name("Flappign_Hz", names), "flapping_Hz");
  EXPECT_EQ(nearest_name("sed", names), "seed");
  EXPECT_EQ(nearest_name("SEED", names), "seed");
  EXPECT_EQ(nearest_name("r33", names), "");
  EXPECT_EQ(nearest_name("colour", names), "");
  EXPECT_EQ(nearest_name(std::string(1 << 20, 's'), names), "");
  EXPECT_EQ(did_you_mean("sed", names), "; did you mean \"seed\"?");
  EXPECT_EQ(did_you_mean("colour", names), "");
}

TEST(InAnotherUnit, ComparesTheQuantity) {
  EXPECT_EQ(in_another_unit("speed_mm_s", {"speed_m_s"}), "speed_m_s");
  EXPECT_EQ(in_another_unit("stiffness_mNm_deg", {"stiffness_Nm_rad"}), "stiffness_Nm_rad");
  EXPECT_EQ(in_another_unit("speed_mm_s", {"speed_m_s2", "speed_m", "velocity_m_s"}), "");
  EXPECT_EQ(in_another_unit("area_mm2", {"area_m2"}), "area_m2");
  EXPECT_EQ(in_another_unit("_m", {"_mm", "m"}), "");
}

}  // namespace
}  // namespace flappy::io
