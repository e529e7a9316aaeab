// Rate limits of commands, as token buckets.
#pragma once

#include <map>
#include <string>

#include "server/jobs/server_config.hpp"

namespace flappy::server {

inline constexpr std::size_t kMaxClients = 1024;  ///< clients with a bucket of their own

/// Gains `rate_hz` tokens a second and keeps at most `most`; every command takes one.
class TokenBucket {
 public:
  TokenBucket(double rate_hz, double most) : rate_hz_(rate_hz), most_(most), tokens_(most) {}
  bool take(double now_s);  ///< false: there is none
  bool is_full(double now_s) const;

 private:
  double rate_hz_, most_, tokens_;
  double at_s_ = -1;
};

/// A token bucket for each client and one for all. Memory is bounded: a client whose bucket is full again is forgotten;
/// where none can be, further clients share a bucket. Only one thread at a time may use it.
class RateLimit {
 public:
  explicit RateLimit(const RateConfig& config);
  /// Whether a command is within both limits. A client over its own limit takes nothing from the common bucket.
  bool take(const std::string& client, double now_s);
  std::size_t clients() const { return clients_.size(); }

 private:
  TokenBucket& bucket_of(const std::string& client, double now_s);

  RateConfig config_;
  TokenBucket all_, further_;
  std::map<std::string, TokenBucket> clients_;
  double forgot_s_ = -1;
};

}  // namespace flappy::server
