// Where a program finds the project's configurations.
#include "io/installation.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

#include "io/files.hpp"
#include "io/temporary_folder.hpp"

namespace flappy::io {
namespace {

TEST(Installation, FindsTheConfigurationsOfTheSourceOrThoseChosen) {
  const std::string name = "vehicles/hummingbird_nominal.toml";
  unsetenv("FLAPPY_CONFIGS");
  EXPECT_EQ(config_path(name), FLAPPY_SOURCE_DIR "/configs/" + name);
  setenv("FLAPPY_CONFIGS", "/elsewhere", 1);
  EXPECT_EQ(config_path(name), "/elsewhere/" + name);
  setenv("FLAPPY_CONFIGS", "", 1);
  EXPECT_EQ(config_path(name), FLAPPY_SOURCE_DIR "/configs/" + name);
  unsetenv("FLAPPY_CONFIGS");
}

TEST(Installation, FindsWhatIsShippedUnlessThereIsAFile) {
  setenv("FLAPPY_CONFIGS", FLAPPY_SOURCE_DIR "/configs", 1);
  const auto before = std::filesystem::current_path();
  const TemporaryFolder folder;
  std::filesystem::current_path(folder.path());
  const std::string own = FLAPPY_SOURCE_DIR "/configs/fly/hover.toml";
  EXPECT_EQ(shipped("configs/fly/hover.toml"), own);
  EXPECT_EQ(read_text("configs/fly/hover.toml"), read_text(own));
  EXPECT_EQ(shipped("configs/fly/none.toml"), "configs/fly/none.toml");
  EXPECT_EQ(shipped("fly/hover.toml"), "fly/hover.toml");
  EXPECT_EQ(shipped(""), "");
  std::filesystem::create_directories("configs/fly");
  std::ofstream("configs/fly/hover.toml") << "mine = 1\n";
  EXPECT_EQ(shipped("configs/fly/hover.toml"), "configs/fly/hover.toml");
  EXPECT_EQ(read_text("configs/fly/hover.toml"), "mine = 1\n");
  std::filesystem::current_path(before);
  unsetenv("FLAPPY_CONFIGS");
}

}  // namespace
}  // namespace flappy::io
