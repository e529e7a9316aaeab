// A web page that shows the queue, training curves, logs and the live state. Read only: no request changes anything.
//
//   GET /                       the page; also page.css, icon.svg, page.js with its imports, three.min.js
//   GET /api/jobs               the newest jobs, newest first
//   GET /api/jobs/ID/curve      {"update": [...], "success_rate": [...], "return_mean": [...]} of a training job
//   GET /api/jobs/ID/log        the last lines of the job's log
//   GET /api/jobs/ID/files      [{"name", "bytes"}, ...]: the files of the job's folder
//   GET /api/jobs/ID/history    [{"time_s", "state", "attempt", "why"}, ...]: the states that the job came to
//   GET /api/watched            the live state, or null
//   GET /events                 server-sent events: "jobs" when the queue changed, "watched" with the live state
#pragma once

#include <memory>
#include <string>

#include "server/jobs/queue.hpp"
#include "server/jobs/server_config.hpp"
#include "server/live_state.hpp"

namespace flappy::server {

inline constexpr std::size_t kMaxOfRequest = 16'384;  ///< bytes of a request, including its headers

class Dashboard {
 public:
  /// Listens in threads of its own. Throws io::InputError where config.http.listen is malformed or cannot be bound.
  Dashboard(const Queue& queue, const LiveState& watched, const ServerConfig& config);
  ~Dashboard();
  Dashboard(const Dashboard&) = delete;
  Dashboard& operator=(const Dashboard&) = delete;

  /// ADDRESS:PORT, such as "127.0.0.1:8080"; if port 0 was configured, the port that the system assigned.
  const std::string& address() const { return address_; }

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
  std::string address_;
};

}  // namespace flappy::server
