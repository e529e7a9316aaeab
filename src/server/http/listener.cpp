#include "server/http/listener.hpp"

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>

#include "io/progress.hpp"
#include "server/http/dashboard.hpp"

namespace flappy::server {
namespace {

constexpr std::size_t kWaiting = 32;
thread_local bool is_turned_away = false;

/// A connection with a deadline for the whole request, and one for each piece of the answer.
class PatientStream : public httplib::Stream {
 public:
  PatientStream(socket_t socket, double patience_s)
      : socket_(socket), patience_s_(patience_s), until_s_(io::steady_seconds() + patience_s) {}

  bool is_readable() const override { return wait(POLLIN, until_s_); }
  /// Also false once the client has closed the connection.
  bool is_writable() const override {
    char byte = 0;
    const ssize_t count = recv(socket_, &byte, 1, MSG_PEEK | MSG_DONTWAIT);
    return count != 0 && wait(POLLOUT, io::steady_seconds() + patience_s_);
  }

  ssize_t read(char* bytes, std::size_t size) override {
    if (left_ == 0 || !wait(POLLIN, until_s_)) return -1;
    const ssize_t count = recv(socket_, bytes, std::min(size, left_), 0);
    if (count > 0) left_ -= static_cast<std::size_t>(count);
    return count;
  }

  ssize_t write(const char* bytes, std::size_t size) override {
    const double until_s = io::steady_seconds() + patience_s_;
    for (std::size_t written = 0; written < size;) {
      if (!wait(POLLOUT, until_s)) return -1;
      const ssize_t count = send(socket_, bytes + written, size - written, MSG_NOSIGNAL | MSG_DONTWAIT);
      if (count < 0 && errno != EINTR && errno != EAGAIN) return -1;
      if (count > 0) written += static_cast<std::size_t>(count);
    }
    return static_cast<ssize_t>(size);
  }

  void get_remote_ip_and_port(std::string& ip, int& port) const override { ip.clear(), port = 0; }
  void get_local_ip_and_port(std::string& ip, int& port) const override { ip.clear(), port = 0; }
  socket_t socket() const override { return socket_; }

 private:
  bool wait(short events, double until_s) const {
    while (true) {
      const double left_s = until_s - io::steady_seconds();
      if (left_s <= 0) return false;
      pollfd waited{socket_, events, 0};
      const int count = poll(&waited, 1, static_cast<int>(1000 * left_s) + 1);
      if (count > 0) return true;
      if (count < 0 && errno != EINTR) return false;
    }
  }

  socket_t socket_;
  double patience_s_, until_s_;
  std::size_t left_ = kMaxOfRequest;
};

/// Discards what the client still sends; otherwise closing would reset the connection and might lose the answer.
void close_after_answer(socket_t socket) {
  shutdown(socket, SHUT_WR);
  std::array<char, 4096> rest;
  for (int i = 0; i < 16 && recv(socket, rest.data(), rest.size(), MSG_DONTWAIT) > 0; ++i) continue;
  close(socket);
}

}  // namespace

BoundedPool::BoundedPool(std::size_t threads, std::size_t waiting) : most_(waiting) {
  for (std::size_t i = 0; i < threads; ++i) threads_.emplace_back([this] { work(); });
}

void BoundedPool::enqueue(std::function<void()> call) {
  {
    const std::lock_guard guard(mutex_);
    if (calls_.size() < most_) {
      calls_.push_back(std::move(call));
      come_.notify_one();
      return;
    }
  }
  is_turned_away = true;
  call();
  is_turned_away = false;
}

void BoundedPool::shutdown() {
  {
    const std::lock_guard guard(mutex_);
    over_ = true;
  }
  come_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

bool BoundedPool::turned_away() { return is_turned_away; }

void BoundedPool::work() {
  while (true) {
    std::unique_lock lock(mutex_);
    come_.wait(lock, [this] { return over_ || !calls_.empty(); });
    if (calls_.empty()) return;
    const std::function<void()> call = std::move(calls_.front());
    calls_.pop_front();
    lock.unlock();
    call();
  }
}

Listener::Listener(std::size_t threads, double patience_s) : patience_s_(patience_s) {
  new_task_queue = [threads] { return new BoundedPool(threads, kWaiting); };  // httplib deletes it
  // httplib's default would share the port with any other process that asks
  set_socket_options([](socket_t socket) {
    const int yes = 1;
    setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  });
}

void Listener::widen() { ::listen(svr_sock_, 128); }

bool Listener::process_and_close_socket(socket_t socket) {
  if (BoundedPool::turned_away()) {
    close(socket);
    return false;
  }
  PatientStream stream(socket, patience_s_);
  bool closed = false;
  const bool answered = process_request(stream, true, closed, {});
  close_after_answer(socket);
  return answered;
}

}  // namespace flappy::server
