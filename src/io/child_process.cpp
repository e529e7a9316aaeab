#include "io/child_process.hpp"

#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <stdexcept>
#include <system_error>

#include "io/run_program.hpp"

namespace flappy::io {
namespace {

[[noreturn]] void fail(int error) { throw std::system_error(error, std::generic_category()); }

}  // namespace

ChildProcess::ChildProcess(const std::vector<std::string>& command) {
  int in[2], out[2];  // [0]: ours; sockets, since writing to one whose other end is closed need not raise a signal
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, in) != 0) fail(errno);
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, out) != 0) {
    const int error = errno;
    close(in[0]), close(in[1]);
    fail(error);
  }
  to_ = in[0], from_ = out[0];
  try {
    const int theirs[] = {in[1], out[1]};
    pid_ = start_program(command, theirs);
    close(in[1]), close(out[1]);
  } catch (const std::system_error&) {
    for (const int end : {in[0], in[1], out[0], out[1]}) close(end);
    throw;
  }
}

ChildProcess::~ChildProcess() {
  close(to_), close(from_);
  kill(pid_, SIGKILL);
  while (waitpid(pid_, nullptr, 0) < 0 && errno == EINTR) continue;
}

void ChildProcess::write(const void* data, std::size_t bytes) const {
  for (std::size_t done = 0; done < bytes;) {
    const ssize_t n = send(to_, static_cast<const char*>(data) + done, bytes - done, MSG_NOSIGNAL);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) throw std::runtime_error("has ended");
    done += static_cast<std::size_t>(n);
  }
}

void ChildProcess::read(void* data, std::size_t bytes) const {
  for (std::size_t done = 0; done < bytes;) {
    const ssize_t n = recv(from_, static_cast<char*>(data) + done, bytes - done, 0);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) throw std::runtime_error("has ended");
    done += static_cast<std::size_t>(n);
  }
}

std::string ChildProcess::read_line() const {
  std::string line;
  for (char c = 0; read(&c, 1), c != '\n';) line += c;
  return line;
}

}  // namespace flappy::io
