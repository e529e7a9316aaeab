// Where a program finds the project's configurations.
#include "io/installation.hpp"

#include <gtest/gtest.h>

#include <cstdlib>

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

}  // namespace
}  // namespace flappy::io
