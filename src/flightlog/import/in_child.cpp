#include "flightlog/import/in_child.hpp"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <fstream>
#include <new>
#include <system_error>
#include <vector>

#include "io/files.hpp"

namespace flappy::flightlog {
namespace {

/// Bytes of a file may hold at most so many times as many numbers' bytes: deflate packs 1032 to 1 (zlib.net, "Maximum
/// Compression Factor").
constexpr rlim_t kLargestFactor = 1032;
constexpr rlim_t kMinMemory = rlim_t{1} << 28;  ///< what libraries and their buffers take
constexpr rlim_t kMinTime_s = 10, kSlowest_bytes_s = 1 << 20;

/// How the child ends; libraries that give up exit with 1 or by a signal.
enum Ending : int { whole = 0, refused = 64, too_large = 65, unheard = 66 };

void fail_of_system() { throw std::system_error(errno, std::generic_category()); }

rlim_t physical_memory() {
  return static_cast<rlim_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<rlim_t>(sysconf(_SC_PAGESIZE));
}

void bound_child([[maybe_unused]] std::size_t file_size) {
  const auto set = [](auto what, rlim_t most) {
    const rlimit limit{most, most};
    setrlimit(what, &limit);
  };
  set(RLIMIT_CORE, 0);
  set(RLIMIT_CPU, kMinTime_s + file_size / kSlowest_bytes_s);
// sanitizers take the address space for themselves
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  rlim_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  set(RLIMIT_AS, pages * static_cast<rlim_t>(sysconf(_SC_PAGESIZE)) + kMinMemory +
                     std::min(kLargestFactor * file_size, physical_memory()));
#endif
}

void write_all(int to, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = write(to, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) _exit(unheard);
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
}

[[noreturn]] void be_child(int to, std::size_t file_size, const std::function<void(const Send&)>& read) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  // a library that crashes says so on stderr; and handlers of the parent must not run here
  const int nowhere = open("/dev/null", O_RDWR | O_CLOEXEC);
  for (const int stream : {STDOUT_FILENO, STDERR_FILENO}) dup2(nowhere, stream);
  for (const int number : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGINT, SIGTERM}) std::signal(number, SIG_DFL);
  bound_child(file_size);
  try {
    read([&](std::string_view bytes) { write_all(to, bytes); });
  } catch (const io::InputError& error) {
    // the parent forgets what came before, and finds the line by its length at the end
    const std::string line = error.what();
    const std::uint64_t size = line.size();
    write_all(to, line);
    write_all(to, {reinterpret_cast<const char*>(&size), sizeof size});
    _exit(refused);
  } catch (const std::bad_alloc&) {
    _exit(too_large);
  }
  _exit(whole);
}

}  // namespace

std::string read_in_child(const std::string& name, std::size_t file_size, const std::string& accepted,
                          const std::function<void(const Send&)>& read) {
  std::array<int, 2> pipe_ends{};
  if (pipe2(pipe_ends.data(), O_CLOEXEC) != 0) fail_of_system();
  const pid_t child = fork();
  if (child == 0) {
    close(pipe_ends[0]);
    be_child(pipe_ends[1], file_size, read);
  }
  close(pipe_ends[1]);
  if (child < 0) {
    close(pipe_ends[0]);
    fail_of_system();
  }
  std::string found;
  constexpr std::size_t kBlock = 1 << 16;  // what a pipe holds
  std::vector<char> block(kBlock);
  for (ssize_t count = 1; count != 0;) {
    count = ::read(pipe_ends[0], block.data(), block.size());
    if (count < 0 && errno != EINTR) break;
    if (count > 0) found.append(block.data(), static_cast<std::size_t>(count));
  }
  close(pipe_ends[0]);
  int status = 0;
  while (waitpid(child, &status, 0) < 0)
    if (errno != EINTR) fail_of_system();
  const int ended = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  if (ended == whole) return found;
  std::uint64_t size = 0;
  if (ended == refused && found.size() >= sizeof size) {
    found.copy(reinterpret_cast<char*>(&size), sizeof size, found.size() - sizeof size);
    if (size <= found.size() - sizeof size) throw io::InputError(found.substr(found.size() - sizeof size - size, size));
  }
  std::string what = "cannot be read to its end";
  if (ended == too_large) what = "would take more memory than its size allows";
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU) what = "takes longer to read than its size allows";
  throw io::InputError(name + ": is damaged: " + what + "; accepted: " + accepted);
}

}  // namespace flappy::flightlog
