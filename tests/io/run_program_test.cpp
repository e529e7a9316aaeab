#include "io/run_program.hpp"

#include <gtest/gtest.h>

#include "io/files.hpp"

namespace flappy::io {
namespace {

std::string run(const std::vector<std::string>& command, std::string_view input = "") {
  try {
    return run_program(command, input, "figure.svg");
  } catch (const InputError& error) {
    return error.what();
  }
}

TEST(RunProgram, IsAFunctionFromTextToText) {
  const std::string much(1 << 20, 'x');  // more than a pipe holds
  EXPECT_EQ(run({"cat"}, much), much);
  EXPECT_EQ(run({"cat", "-"}, "a $HOME 'b'\n"), "a $HOME 'b'\n");
  EXPECT_EQ(run({"true"}), "");
}

TEST(RunProgram, SaysWhatIsMissingOrFailed) {
  EXPECT_EQ(run({"no_such_program_of_ours"}), "figure.svg: is not written: no_such_program_of_ours is not installed");
  EXPECT_EQ(run({"false"}), "figure.svg: is not written: false failed: ");
  EXPECT_EQ(run({"sh", "-c", "echo why >&2; kill -9 $$"}), "figure.svg: is not written: sh failed: why\\x0a");
}

}  // namespace
}  // namespace flappy::io
