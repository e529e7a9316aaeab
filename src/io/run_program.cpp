#include "io/run_program.hpp"

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <memory>
#include <system_error>
#include <thread>
#include <utility>

#include "io/files.hpp"

namespace flappy::io {
namespace {

/// Between two looks at a program that runs.
constexpr std::chrono::milliseconds kLook{2};

using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

std::string contents(std::FILE* file) {
  std::rewind(file);
  std::string text;
  std::array<char, 4096> block;
  while (const std::size_t count = std::fread(block.data(), 1, block.size(), file)) text.append(block.data(), count);
  return text;
}

/// Peak memory so far of a program that runs, else 0. getrusage() would count that of the program that started it, too.
double peak_so_far(pid_t program) {
  std::ifstream status("/proc/" + std::to_string(program) + "/status");
  for (std::string word; status >> word;)
    if (double kB = 0; word == "VmHWM:" && status >> kB) return 1024 * kB;
  return 0;
}

}  // namespace

pid_t start_program(const std::vector<std::string>& command, std::span<const int> streams) {
  std::vector<char*> arguments;
  arguments.reserve(command.size() + 1);
  for (const auto& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  for (std::size_t i = 0; i < streams.size(); ++i)
    posix_spawn_file_actions_adddup2(&actions, streams[i], static_cast<int>(i));
  pid_t child = 0;
  const int error = posix_spawnp(&child, arguments[0], &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) throw std::system_error(error, std::generic_category());
  return child;
}

Finished run(const std::vector<std::string>& command, std::string_view input) {
  const auto fail = [](int error) { throw std::system_error(error, std::generic_category()); };
  // unnamed files instead of pipes, which could block both sides
  std::array<File, 3> streams = {File(std::tmpfile(), std::fclose), File(std::tmpfile(), std::fclose),
                                 File(std::tmpfile(), std::fclose)};
  for (const auto& stream : streams)
    if (!stream) fail(errno);
  if (std::fwrite(input.data(), 1, input.size(), streams[0].get()) != input.size() ||
      std::fflush(streams[0].get()) != 0)
    fail(errno);
  std::rewind(streams[0].get());

  const int numbers[] = {fileno(streams[0].get()), fileno(streams[1].get()), fileno(streams[2].get())};
  const pid_t child = start_program(command, numbers);
  int status = 0;
  double peak_bytes = 0;
  for (pid_t ended = 0; ended == 0;) {
    peak_bytes = std::max(peak_bytes, peak_so_far(child));
    ended = waitpid(child, &status, WNOHANG);
    if (ended < 0 && errno == EINTR) ended = 0;
    else if (ended < 0) fail(errno);
    else if (ended == 0) std::this_thread::sleep_for(kLook);
  }
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, contents(streams[1].get()), contents(streams[2].get()),
          peak_bytes};
}

std::string run_program(const std::vector<std::string>& command, std::string_view input, const std::string& result) {
  const auto refusal = [&](const std::string& what) { return InputError(result + ": is not written: " + what); };
  try {
    Finished finished = run(command, input);
    if (finished.exit_code != 0) throw refusal(command[0] + " failed: " + finished.err);
    return std::move(finished.out);
  } catch (const std::system_error& e) {
    if (e.code().value() == ENOENT) throw refusal(command[0] + " is not installed");
    throw refusal(command[0] + ": " + e.code().message());
  }
}

}  // namespace flappy::io
