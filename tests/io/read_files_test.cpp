#include "io/read_files.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "io/append_file.hpp"
#include "io/mapped_file.hpp"
#include "io/temporary_folder.hpp"
#include "refusal.hpp"

namespace flappy::io {
namespace {

namespace fs = std::filesystem;
using test::refusal;

std::string words(const fs::path& file) {
  return file.string() + ": is read by the same command; accepted: another file";
}

class ReadFiles : public ::testing::Test {
 protected:
  ReadFiles() { std::ofstream(input) << "text"; }

  const TemporaryFolder folder;
  const fs::path input = folder / "input.toml", other = folder / "other.toml";
};

TEST_F(ReadFiles, AreNotReplaced) {
  const NotedCommand command;
  read_text(input);
  fs::create_symlink(input, folder / "link");
  fs::create_hard_link(input, folder / "twin");
  for (const fs::path& name :
       {input, folder / "link", folder / "twin", folder / "../" / folder.path().filename() / "input.toml"}) {
    EXPECT_EQ(refusal([&] { check_output(name); }), words(name));
    EXPECT_EQ(refusal([&] { write_atomically(name, "lost"); }), words(name));
    EXPECT_EQ(refusal([&] { AppendFile{name}; }), words(name));
  }
  write_atomically(other, "kept");
  EXPECT_EQ(read_text(input), "text");
  EXPECT_EQ(refusal([&] { require_unread_folder(folder.path()); }),
            folder.path().string() + ": holds input.toml, which is read by the same command; accepted: another folder");
}

TEST_F(ReadFiles, AreKnownHoweverTheyAreRead) {
  const NotedCommand command;
  MappedFile{input};
  EXPECT_EQ(refusal([&] { write_atomically(input, "lost"); }), words(input));
}

TEST_F(ReadFiles, MayNotBeAnOutputThatWasNamedBefore) {
  const NotedCommand command;
  fs::create_symlink(input, folder / "link");
  check_output(folder / "link");
  EXPECT_EQ(refusal([&] { read_text(input); }), words(folder / "link"));
}

TEST_F(ReadFiles, MayBeReplacedByWhoWroteThem) {
  const NotedCommand command;
  for (int i = 0; i < 3; ++i) {
    check_output(other);
    write_atomically(other, "own");
    EXPECT_EQ(read_text(other), "own");
  }
}

TEST_F(ReadFiles, MayBeReplacedInAFolderOfTheCommand) {
  const NotedCommand command;
  fs::create_directory(folder / "run");
  std::ofstream(folder / "run" / "best.json") << "text";
  read_text(folder / "run" / "best.json");
  read_text(input);
  const FolderLock lock(folder / "run");
  write_atomically(folder / "run" / "best.json", "newer");
  EXPECT_EQ(refusal([&] { write_atomically(input, "lost"); }), words(input));
  // what the user names is not the command's own
  EXPECT_EQ(read_text(folder / "run" / "best.json"), "newer");
  std::ofstream(folder / "run" / "config.toml") << "text";
  read_text(folder / "run" / "config.toml");
  EXPECT_EQ(refusal([&] { check_output(folder / "run" / "config.toml"); }), words(folder / "run" / "config.toml"));
}

TEST_F(ReadFiles, MayBeReplacedWhereThatIsMeant) {
  const NotedCommand command;
  read_text(input);
  allow_update(input);
  check_output(input);
  write_atomically(input, "tuned");
}

TEST_F(ReadFiles, ThatAreGoneRefuseNothing) {
  const NotedCommand command;
  read_text(input);
  fs::rename(input, other);  // the file of this number has another name now
  write_atomically(other, "new");
}

TEST_F(ReadFiles, AreNotedInACommandAlone) {
  { const NotedCommand command; }
  read_text(input);
  write_atomically(input, "newer");
}

}  // namespace
}  // namespace flappy::io
