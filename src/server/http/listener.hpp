// cpp-httplib's server, but for what it leaves open: a client that is slow with its request, or with taking the answer, is cut off;
// connections that nobody has time for are closed rather than kept; one request is answered on each.
#pragma once

#include <httplib.h>

#include <condition_variable>
#include <deque>
#include <functional>
#include <thread>
#include <vector>

namespace flappy::server {

/// Runs calls on so many threads, and lets so many wait. What comes beyond is called at once, with turned_away() true.
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
  /// `threads` answer at a time. A request has to come, and each piece of an answer to be taken, within `patience_s`.
  Listener(std::size_t threads, double patience_s);
  /// Lets more than httplib's five arrive at once. Once it is bound.
  void widen();

 private:
  bool process_and_close_socket(socket_t socket) override;

  double patience_s_;
};

}  // namespace flappy::server
