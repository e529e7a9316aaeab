// The microcontroller that qemu stands in for, and the compilers of C that may be there or not.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "io/run_program.hpp"

namespace flappy::deploy {

/// A compiler of some other machine, as Debian has it.
struct CrossCompiler {
  std::string prefix;  ///< "arm-none-eabi-"; gcc and size begin with it
  std::string package;
};
CrossCompiler arm_compiler();
CrossCompiler riscv_compiler();

/// Programs of PATH: by its name, and those whose names are `stem` or `stem-12`, the former first.
bool in_path(const std::string& name);
std::vector<std::string> versions_in_path(const std::string& stem);

/// The options that the exported headers have to pass without a warning, the includes of `folders` among them.
std::vector<std::string> strict_options(const std::vector<std::filesystem::path>& folders);
/// Of the output of a compiler, the first complaint, without the names of folders.
std::string first_complaint(const std::string& output);
/// run() that ends after a minute, with exit code 124.
io::Finished run_limited(std::vector<std::string> command, std::string_view input = {});
void append(std::vector<std::string>& to, const std::vector<std::string>& more);

/// Writes board.h and its sources into a folder; C of one's own is compiled beside them.
void write_board(const std::filesystem::path& folder);
/// "not installed: ..." where a program for the board cannot be compiled or run; otherwise empty.
std::string board_missing();
/// What makes the processor of the board, for the compiler.
std::vector<std::string> board_machine();
/// The command that makes `program` of `sources` with the files of write_board(folder); `options` come with it.
std::vector<std::string> board_build(const std::filesystem::path& folder,
                                     const std::vector<std::filesystem::path>& sources,
                                     const std::vector<std::string>& options, const std::filesystem::path& program);
/// The command that runs it: its serial line is stdin and stdout, and it ends with the code of its main(), 3 after a
/// fault. `count`: its clock counts instructions, one in a nanosecond, instead of following the time of this machine.
std::vector<std::string> board_run(const std::filesystem::path& program, bool count);

}  // namespace flappy::deploy
