#include "server/jobs/supervisor.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/signalfd.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string_view>
#include <system_error>

#include "io/files.hpp"
#include "server/jobs/process.hpp"

namespace flappy::server {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr int kLockDescriptor = 3;
constexpr std::size_t kMaxOfLine = 4096;

fs::path attempt_file(const fs::path& folder, int attempt, const char* what) {
  return folder / ("attempt_" + std::to_string(attempt) + what);
}

void leave(const fs::path& file, const Json& json) {
  io::write_atomically(file, json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n");
  io::sync_folder(file.parent_path());
}

std::optional<Json> read(const fs::path& file) {
  try {
    const Json json = Json::parse(io::read_text(file), nullptr, false);
    return json.is_object() ? std::optional(json) : std::nullopt;
  } catch (const io::InputError&) {
    return std::nullopt;
  }
}

/// Copies a program's output from a pipe to the log (the supervisor's stdout), until that has kMaxOfLog bytes.
class Copy {
 public:
  Copy(int from, bool keeps_last_line) : from_(from), keeps_last_line_(keeps_last_line) {}
  int descriptor() const { return from_; }  ///< -1: the pipe is at its end
  const std::string& last_line() const { return line_.empty() ? last_ : line_; }

  void read_some() {
    std::array<char, 65536> block;
    const ssize_t count = ::read(from_, block.data(), block.size());
    if (count < 0 && (errno == EINTR || errno == EAGAIN)) return;
    if (count <= 0) {
      close(from_);
      from_ = -1;
      return;
    }
    const std::string_view text(block.data(), static_cast<std::size_t>(count));
    struct stat log {};
    if (fstat(STDOUT_FILENO, &log) == 0 && static_cast<std::uint64_t>(log.st_size) < kMaxOfLog) {
      // a full disk must cost only the log, not the job
      [[maybe_unused]] const ssize_t written = ::write(STDOUT_FILENO, text.data(), text.size());
    }
    if (keeps_last_line_) keep(text);
  }

 private:
  void keep(std::string_view text) {
    for (const char c : text) {
      if (c != '\n' && c != '\r') {
        if (line_.size() < kMaxOfLine) line_ += c;
      } else if (!line_.empty()) {
        last_ = line_;
        line_.clear();
      }
    }
  }

  int from_;
  bool keeps_last_line_;
  std::string line_, last_;
};

/// Starts the program in a process group of its own; the kernel kills it when the supervisor dies.
pid_t start(const fs::path& folder, char** command, int out, int err, pid_t supervisor) {
  const pid_t child = fork();
  if (child != 0) return child;
  setpgid(0, 0);
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != supervisor) _exit(1);
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  dup2(out, STDOUT_FILENO), dup2(err, STDERR_FILENO);
  if (chdir(folder.c_str()) == 0) execvp(command[0], command);
  std::fprintf(stderr, "%s: cannot be started: %s\n", command[0], std::strerror(errno));
  _exit(127);
}

std::array<int, 2> make_pipe() {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) throw std::system_error(errno, std::generic_category(), "pipe");
  return ends;
}

void supervise(const fs::path& folder, int attempt, char** command) {
  // do not keep ports and connections of the server open
  close_range(kLockDescriptor + 1, ~0u, 0);
  sigset_t handled;
  sigemptyset(&handled);
  for (const int signal : {SIGINT, SIGTERM, SIGCHLD}) sigaddset(&handled, signal);
  sigprocmask(SIG_BLOCK, &handled, nullptr);
  const int signals = signalfd(-1, &handled, SFD_CLOEXEC);

  const Process self = process_of(getpid()).value();
  leave(attempt_file(folder, attempt, ".began"),
        {{"pid", self.pid}, {"start_ticks", self.start_ticks}, {"boot_id", self.boot_id}});
  const std::array<int, 2> out = make_pipe(), err = make_pipe();
  const pid_t program = start(folder, command, out[1], err[1], getpid());
  if (program < 0) throw std::system_error(errno, std::generic_category(), "fork");
  setpgid(program, program);  // parent and child both set the group, because either may run first
  close(out[1]), close(err[1]);

  std::array<Copy, 2> copies = {Copy(out[0], false), Copy(err[0], true)};
  int status = 0;
  bool ended = false;
  // end with the program, not with its pipes: processes that it started may keep them open
  while (!ended) {
    std::array<pollfd, 3> waited = {
        {{signals, POLLIN, 0}, {copies[0].descriptor(), POLLIN, 0}, {copies[1].descriptor(), POLLIN, 0}}};
    if (poll(waited.data(), waited.size(), -1) < 0) continue;
    for (std::size_t i = 0; i < copies.size(); ++i)
      if (waited[i + 1].revents != 0) copies[i].read_some();
    if (waited[0].revents == 0) continue;
    signalfd_siginfo signal{};
    if (::read(signals, &signal, sizeof signal) != sizeof signal) continue;
    if (signal.ssi_signo == SIGINT) kill(program, SIGINT);
    if (signal.ssi_signo == SIGTERM) kill(-program, SIGKILL);
    siginfo_t gone{};
    ended =
        waitid(P_PID, static_cast<id_t>(program), &gone, WEXITED | WNOHANG | WNOWAIT) == 0 && gone.si_pid == program;
  }
  kill(-program, SIGKILL);  // kill the processes that it left before waitpid() frees its pid for others
  waitpid(program, &status, 0);
  for (Copy& copy : copies) {
    pollfd more{copy.descriptor(), POLLIN, 0};
    while (copy.descriptor() >= 0 && poll(&more, 1, 0) > 0) copy.read_some();
  }
  Json json = WIFEXITED(status) ? Json{{"code", WEXITSTATUS(status)}} : Json{{"signal", WTERMSIG(status)}};
  json["message"] = shown(copies[1].last_line());
  leave(attempt_file(folder, attempt, ".exit"), json);
}

}  // namespace

std::vector<std::string> supervisor_command(const std::string& server, const fs::path& folder, int attempt,
                                            const std::vector<std::string>& command) {
  std::vector<std::string> words = {server, "--child", folder.string(), std::to_string(attempt), "--"};
  words.insert(words.end(), command.begin(), command.end());
  return words;
}

void supervise_if_asked(int argc, char** argv) {
  if (argc < 6 || std::strcmp(argv[1], "--child") != 0 || std::strcmp(argv[4], "--") != 0) return;
  try {
    supervise(argv[2], std::atoi(argv[3]), argv + 5);
    std::exit(0);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "flappy-server --child: %s\n", e.what());
    std::exit(1);
  }
}

std::optional<Process> began(const fs::path& folder, int attempt) {
  const auto json = read(attempt_file(folder, attempt, ".began"));
  if (!json) return std::nullopt;
  return Process{json->value("pid", std::int64_t{0}), json->value("start_ticks", std::uint64_t{0}),
                 json->value("boot_id", std::string())};
}

std::optional<Exit> exit_of(const fs::path& folder, int attempt) {
  const auto json = read(attempt_file(folder, attempt, ".exit"));
  if (!json) return std::nullopt;
  return Exit{json->value("code", -1), json->value("signal", 0), json->value("message", std::string())};
}

}  // namespace flappy::server
