// cpp-httplib's server with limits that it lacks: a client that is slow to send its request or to take the answer is cut off; connections beyond
// the capacity are closed instead of kept; each connection serves one request.
#pragma once

#include <httplib.h>

#include <condition_variable>
#include <deque>
#include <functional>
#include <thread>
#include <vector>

namespace flappy::server {

/// Runs calls on `threads` threads and queues up to `waiting` more. Further calls run at once in the caller, with turned_away() true.
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
  /// Up to `threads` requests are answered at a time. A whole request has to arrive, and each piece of an answer to be
  /// taken, within `patience_s`.
  Listener(std::size_t threads, double patience_s);
  /// Raises the backlog of connections from httplib's 5 to 128. Call it once the listener is bound.
  void widen();

 private:
  bool process_and_close_socket(socket_t socket) override;

  double patience_s_;
};

}  // namespace flappy::server
