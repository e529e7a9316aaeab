// Another program that answers questions as long as it is asked.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <string>
#include <vector>

namespace flappy::io {

/// Runs along PATH, without a shell; its stdin and stdout are pipes. Ended and waited for by the destructor.
class ChildProcess {
 public:
  /// Throws std::system_error where it cannot be started.
  explicit ChildProcess(const std::vector<std::string>& command);
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  /// Both throw std::runtime_error where it has ended. It must read all of `data` before it answers with much.
  void write(const void* data, std::size_t bytes) const;
  void read(void* data, std::size_t bytes) const;
  std::string read_line() const;  ///< without its end

 private:
  pid_t pid_ = -1;
  int to_ = -1, from_ = -1;
};

}  // namespace flappy::io
