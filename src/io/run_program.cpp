#include "io/run_program.hpp"

#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <memory>
#include <system_error>
#include <utility>

#include "io/files.hpp"

namespace flappy::io {
namespace {

using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

std::string contents(std::FILE* file) {
  std::rewind(file);
  std::string text;
  std::array<char, 4096> block;
  while (const std::size_t count = std::fread(block.data(), 1, block.size(), file)) text.append(block.data(), count);
  return text;
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
  rusage used{};
  while (wait4(child, &status, 0, &used) < 0)
    if (errno != EINTR) fail(errno);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, contents(streams[1].get()), contents(streams[2].get()),
          1024.0 * static_cast<double>(used.ru_maxrss)};
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
