// cpp-httplib's server with limits that it lacks: a client that is slow to send its request or to take the answer is
// cut off; connections beyond the capacity are closed instead of kept; each connection serves one request.
#pragma once

#include <httplib.h>

#include <condition_variable>
#include <deque>
#include <functional>
#include <thread>
#include <vector>

namespace flappy::server {

/// Queues up to `waiting` calls for `threads` threads; further calls run in the caller, with turned_away() true.
class BoundedPool : public httplib::TaskQueue {
 public:
  BoundedPool(std::size_t threads, std::size_t waiting);
  void enqueue(std::function<void()> call) override;
  void shutdown() override;
  static bool turned_away();

 private:
  void work();

  std::size_t most_;
  std::mutex mutex_;
  std::condition_variable come_;
  std::deque<std::function<void()>> calls_;
  bool over_ = false;
  std::vector<std::thread> threads_;
};

class Listener : public httplib::Server {
 public:
  /// Answers `threads` requests at a time; `patience_s`: for a whole request, and for each piece of an answer.
  Listener(std::size_t threads, double patience_s);
  /// Raises the backlog of connections from httplib's 5 to 128. Call it once the listener is bound.
  void widen();

 private:
  bool process_and_close_socket(socket_t socket) override;

  double patience_s_;
};

}  // namespace flappy::server
