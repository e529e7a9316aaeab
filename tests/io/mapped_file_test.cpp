#include "io/mapped_file.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "io/temporary_folder.hpp"
#include "refusal.hpp"

namespace flappy::io {
namespace {

TEST(MappedFile, HasTheBytesOfAFile) {
  const TemporaryFolder folder;
  std::ofstream(folder / "some") << "a\0b";
  std::ofstream(folder / "empty");
  EXPECT_EQ(MappedFile(folder / "some").bytes(), read_text(folder / "some"));
  EXPECT_EQ(MappedFile(folder / "empty").bytes(), "");
}

TEST(MappedFile, RefusesWhatIsNoFile) {
  const TemporaryFolder folder;
  const std::string at = folder.path().string();
  EXPECT_EQ(test::refusal([&] { MappedFile(folder / "none"); }),
            at + "/none: cannot be read: No such file or directory");
  EXPECT_EQ(test::refusal([&] { MappedFile(folder.path()); }), at + ": cannot be read: Is a directory");
}

}  // namespace
}  // namespace flappy::io
