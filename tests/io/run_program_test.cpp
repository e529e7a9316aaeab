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

TEST(Run, CountsTheMemoryOfTheProgramAlone) {
  const std::vector<char> own(64 << 20, 1);  // which the kernel's usage of a child would include
  const Finished small = io::run({"sleep", "0.05"});
  EXPECT_GT(small.peak_bytes, 1e5);
  EXPECT_LT(small.peak_bytes, 32e6) << own[0];
  const Finished large = io::run({"sh", "-c", "text=$(head -c 40000000 /dev/zero | tr '\\0' x); sleep 0.05"});
  EXPECT_GT(large.peak_bytes, 40e6);
}

}  // namespace
}  // namespace flappy::io
