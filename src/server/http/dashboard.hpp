// A page that shows queue, curves, logs and the watched flapper. Read only: no request changes anything.
//
//   GET /                       the page; page.css, page.js and what it imports; three.min.js
//   GET /api/jobs               the newest jobs, newest first
//   GET /api/jobs/ID/curve      {"update": [...], "success_rate": [...], "return_mean": [...]} of a training
//   GET /api/jobs/ID/log        the last lines of its log
//   GET /api/jobs/ID/history    the states that it came to
//   GET /api/watched            the watched flapper's state, or null
//   GET /events                 server-sent events: "jobs" when the queue has changed, "watched" with the state
#pragma once

#include <memory>
#include <string>

#include "server/jobs/queue.hpp"
#include "server/jobs/server_config.hpp"
#include "server/watched.hpp"

namespace flappy::server {

inline constexpr std::size_t kMostOfRequest = 16'384;  ///< bytes of a request, headers included

class Dashboard {
 public:
  /// Listens from now on, in threads of its own. io::InputError where it cannot.
  Dashboard(const Queue& queue, const Watched& watched, const ServerConfig& config);
  ~Dashboard();
  Dashboard(const Dashboard&) = delete;
  Dashboard& operator=(const Dashboard&) = delete;

  /// As "127.0.0.1:8080": with the port that port 0 became.
  const std::string& address() const { return address_; }

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
  std::string address_;
};

}  // namespace flappy::server
