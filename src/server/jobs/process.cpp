#include "server/jobs/process.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/file.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <sstream>
#include <system_error>
#include <utility>

#include "io/files.hpp"

namespace flappy::server {
namespace {

[[noreturn]] void fail(int error, const std::string& what) {
  throw std::system_error(error, std::generic_category(), what);
}

}  // namespace

std::string boot_id() {
  std::string text = io::read_text("/proc/sys/kernel/random/boot_id");
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return text;
}

std::optional<Process> process_of(std::int64_t pid) {
  try {
    const std::string stat = io::read_text("/proc/" + std::to_string(pid) + "/stat");
    // the program's name in parentheses may contain anything; the start time is the 20th field after it
    std::istringstream fields(stat.substr(stat.rfind(')') + 1));
    std::string skipped;
    for (int i = 0; i < 19; ++i) fields >> skipped;
    Process process{pid, 0, boot_id()};
    fields >> process.start_ticks;
    return fields ? std::optional(process) : std::nullopt;
  } catch (const io::InputError&) {
    return std::nullopt;
  }
}

bool signal_process(const Process& process, int signal) {
  if (process.pid <= 0) return false;
  // call by number, because glibc 2.36 declares these functions for C only
  const int descriptor = static_cast<int>(syscall(SYS_pidfd_open, static_cast<pid_t>(process.pid), 0));
  if (descriptor < 0) return false;
  // open first, check second: if the check finds the very process, the descriptor refers to it, too
  const bool same = process_of(process.pid) == process;
  const bool sent = same && syscall(SYS_pidfd_send_signal, descriptor, signal, nullptr, 0) == 0;
  close(descriptor);
  return sent;
}

std::optional<JobLock> JobLock::take(const std::filesystem::path& folder) {
  const int descriptor = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0)
    throw io::InputError(folder.string() + ": cannot be read: " + std::generic_category().message(errno));
  JobLock lock(descriptor);
  if (flock(descriptor, LOCK_EX | LOCK_NB) == 0) return lock;
  if (errno == EWOULDBLOCK) return std::nullopt;
  throw io::InputError(folder.string() + ": cannot be locked: " + std::generic_category().message(errno) +
                       "; accepted: a file system with locks");
}

JobLock::JobLock(JobLock&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}

JobLock::~JobLock() {
  if (descriptor_ >= 0) close(descriptor_);
}

std::int64_t start_process(const std::vector<std::string>& command, const JobLock* lock,
                           const std::filesystem::path& log) {
  std::vector<char*> arguments;
  arguments.reserve(command.size() + 1);
  for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);

  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, 1, log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0666);
  posix_spawn_file_actions_adddup2(&actions, 1, 2);
  if (lock != nullptr) posix_spawn_file_actions_adddup2(&actions, lock->descriptor(), 3);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t held, defaults;
  sigemptyset(&held), sigemptyset(&defaults);
  for (const int signal : {SIGINT, SIGTERM}) sigaddset(&held, signal), sigaddset(&defaults, signal);
  sigaddset(&defaults, SIGPIPE);
  posix_spawnattr_setsigmask(&attributes, &held);
  posix_spawnattr_setsigdefault(&attributes, &defaults);
  posix_spawnattr_setpgroup(&attributes, 0);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  pid_t child = 0;
  const int error = posix_spawnp(&child, arguments[0], &actions, &attributes, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  posix_spawnattr_destroy(&attributes);
  if (error != 0) fail(error, command[0]);
  return child;
}

bool has_ended(std::int64_t pid) {
  const pid_t ended = waitpid(static_cast<pid_t>(pid), nullptr, WNOHANG);
  return ended == pid || (ended < 0 && errno == ECHILD);
}

}  // namespace flappy::server
