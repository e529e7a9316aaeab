// A microcontroller emulated by qemu, and C compilers, which may or may not be installed.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "io/run_program.hpp"

namespace flappy::deploy {

/// A compiler for another machine, as packaged by Debian.
struct CrossCompiler {
  std::string prefix;  ///< prefix of its gcc and size, such as "arm-none-eabi-"
  std::string package;
};
CrossCompiler arm_compiler();
CrossCompiler riscv_compiler();

/// in_path(): whether PATH has it. versions_in_path(): the programs `stem` and `stem-12`, the former first.
bool in_path(const std::string& name);
std::vector<std::string> versions_in_path(const std::string& stem);

/// Compiler options under which the exported headers must give no warning, with `folders` as include folders.
std::vector<std::string> strict_options(const std::vector<std::filesystem::path>& folders);
std::string first_complaint(const std::string& output);
/// io::run() with a limit of one minute; exit code 124 at the limit.
io::Finished run_limited(std::vector<std::string> command, std::string_view input = {});
void append(std::vector<std::string>& to, const std::vector<std::string>& more);

/// Writes board.h and its sources into a folder, where a program's own C files can be compiled with them.
void write_board(const std::filesystem::path& folder);
/// "not installed: ..." where a program for the board cannot be compiled or run; empty where it can.
std::string board_missing();
/// The compiler options that select the board's processor.
std::vector<std::string> board_machine();
/// The command that builds `program` from `sources` and the files of write_board(folder), with additional `options`.
std::vector<std::string> board_build(const std::filesystem::path& folder,
                                     const std::vector<std::filesystem::path>& sources,
                                     const std::vector<std::string>& options, const std::filesystem::path& program);
/// The command that runs it: the serial line is stdin and stdout, the exit code main()'s, or 3 after a fault. `count`:
/// the board's clock counts instructions, one per nanosecond, instead of following this machine's time.
std::vector<std::string> board_run(const std::filesystem::path& program, bool count);

}  // namespace flappy::deploy
