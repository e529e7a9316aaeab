#include "deploy/proof/board.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <sstream>
#include <system_error>

#include "deploy/embedded.hpp"
#include "io/files.hpp"

namespace flappy::deploy {
namespace {

namespace fs = std::filesystem;

constexpr const char* kQemu = "qemu-system-arm";

std::vector<fs::path> folders_of_path() {
  const char* path = std::getenv("PATH");
  std::istringstream text(path == nullptr ? "" : path);
  std::vector<fs::path> folders;
  for (std::string folder; std::getline(text, folder, ':');)
    if (!folder.empty()) folders.emplace_back(folder);
  return folders;
}

/// The N in a name `stem-N`; -1 for other names.
int version_in_name(const std::string& name, const std::string& stem) {
  if (!name.starts_with(stem + "-")) return -1;
  const std::string digits = name.substr(stem.size() + 1);
  const bool number = !digits.empty() && digits.size() < 4 && digits.find_first_not_of("0123456789") == digits.npos;
  return number ? std::stoi(digits) : -1;
}

/// A line without the folders of file names: "/tmp/x/a.h:3: error" becomes "a.h:3: error".
std::string without_folders(const std::string& line) {
  std::istringstream words(line);
  std::string text;
  for (std::string word; words >> word;) {
    const std::size_t slash = word.rfind('/');
    text += (text.empty() ? "" : " ") + (word.starts_with("/") && slash > 0 ? word.substr(slash + 1) : word);
  }
  return text;
}

}  // namespace

CrossCompiler arm_compiler() { return {"arm-none-eabi-", "gcc-arm-none-eabi"}; }
CrossCompiler riscv_compiler() { return {"riscv64-unknown-elf-", "gcc-riscv64-unknown-elf"}; }

bool in_path(const std::string& name) {
  return std::ranges::any_of(folders_of_path(),
                             [&](const fs::path& folder) { return access((folder / name).c_str(), X_OK) == 0; });
}

std::vector<std::string> versions_in_path(const std::string& stem) {
  std::vector<int> versions;
  for (const auto& folder : folders_of_path()) {
    std::error_code unreadable;
    for (const auto& entry : fs::directory_iterator(folder, unreadable)) {
      const int version = version_in_name(entry.path().filename().string(), stem);
      if (version >= 0 && access(entry.path().c_str(), X_OK) == 0) versions.push_back(version);
    }
  }
  std::ranges::sort(versions);
  std::vector<std::string> names;
  if (in_path(stem)) names.push_back(stem);
  for (std::size_t i = 0; i < versions.size(); ++i)
    if (i == 0 || versions[i] != versions[i - 1]) names.push_back(stem + "-" + std::to_string(versions[i]));
  return names;
}

std::vector<std::string> strict_options(const std::vector<fs::path>& folders) {
  std::vector<std::string> options = {"-Wall",  "-Wextra", "-Wpedantic", "-Wconversion", "-Wdouble-promotion",
                                      "-Werror"};
  for (const auto& folder : folders) options.push_back("-I" + folder.string());
  return options;
}

std::string first_complaint(const std::string& output) {
  std::istringstream lines(output);
  std::string first;
  for (std::string line; std::getline(lines, line);) {
    if (first.empty()) first = line;
    for (const char* mark : {"error: ", "undefined reference", "multiple definition", "overflowed"})
      if (line.find(mark) != line.npos) return without_folders(line);
  }
  return without_folders(first);
}

io::Finished run_limited(std::vector<std::string> command, std::string_view input) {
  command.insert(command.begin(), {"timeout", "60"});
  return io::run(command, input);
}

void append(std::vector<std::string>& to, const std::vector<std::string>& more) {
  to.insert(to.end(), more.begin(), more.end());
}

void write_board(const fs::path& folder) {
  for (const char* name : {"board.h", "board.c", "board.ld", "board_host.c", "memory.c"})
    io::write_atomically(folder / name, kEmbedded.at(name));
}

std::string board_missing() {
  const CrossCompiler compiler = arm_compiler();
  if (!in_path(compiler.prefix + "gcc")) return "not installed: " + compiler.package;
  return in_path(kQemu) ? "" : std::string("not installed: ") + kQemu;
}

std::vector<std::string> board_machine() {
  return {"-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"};
}

std::vector<std::string> board_build(const fs::path& folder, const std::vector<fs::path>& sources,
                                     const std::vector<std::string>& options, const fs::path& program) {
  std::vector<std::string> command = {arm_compiler().prefix + "gcc"};
  append(command, board_machine());
  append(command, options);
  append(command, {"-ffreestanding", "-nostdlib", "-T" + (folder / "board.ld").string(), "-I" + folder.string()});
  for (const auto& source : sources) command.push_back(source.string());
  append(command, {(folder / "board.c").string(), (folder / "memory.c").string(), "-lgcc", "-o", program.string()});
  return command;
}

std::vector<std::string> board_run(const fs::path& program, bool count) {
  std::vector<std::string> command = {kQemu,
                                      "-M",
                                      "mps2-an386",
                                      "-display",
                                      "none",
                                      "-monitor",
                                      "none",
                                      "-serial",
                                      "stdio",
                                      "-semihosting-config",
                                      "enable=on,target=native"};
  if (count) append(command, {"-icount", "shift=0"});
  append(command, {"-kernel", program.string()});
  return command;
}

}  // namespace flappy::deploy
