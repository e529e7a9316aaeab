#include "server/jobs/rate_limit.hpp"

#include <algorithm>

#include "io/log.hpp"

namespace flappy::server {

bool TokenBucket::take(double now_s) {
  if (at_s_ >= 0) tokens_ = std::min(most_, tokens_ + rate_hz_ * std::max(0.0, now_s - at_s_));
  at_s_ = std::max(at_s_, now_s);
  if (tokens_ < 1) return false;
  tokens_ -= 1;
  return true;
}

bool TokenBucket::is_full(double now_s) const { return tokens_ + rate_hz_ * (now_s - at_s_) >= most_; }

RateLimit::RateLimit(const RateConfig& config)
    : config_(config),
      all_(config.all_hz, std::max(1.0, config.all_hz * config.burst_s)),
      further_(config.per_client_hz, std::max(1.0, config.per_client_hz * config.burst_s)) {}

bool RateLimit::take(const std::string& client, double now_s) {
  return bucket_of(client, now_s).take(now_s) && all_.take(now_s);
}

TokenBucket& RateLimit::bucket_of(const std::string& client, double now_s) {
  if (const auto known = clients_.find(client); known != clients_.end()) return known->second;
  if (clients_.size() >= kMaxClients) {
    // forget clients whose bucket is as full as a new one; only once a second, because this visits all clients
    if (now_s >= forgot_s_ + 1) std::erase_if(clients_, [&](const auto& each) { return each.second.is_full(now_s); });
    else return further_;
    forgot_s_ = now_s;
    if (clients_.size() >= kMaxClients) return further_;
  }
  const double most = std::max(1.0, config_.per_client_hz * config_.burst_s);
  return clients_.emplace(client, TokenBucket(config_.per_client_hz, most)).first->second;
}

}  // namespace flappy::server
