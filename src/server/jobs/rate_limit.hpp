// How often somebody may come.
#pragma once

#include <map>
#include <string>

#include "server/jobs/server_config.hpp"

namespace flappy::server {

inline constexpr std::size_t kMostClients = 1024;  ///< that are told apart

/// So many tokens come in a second, and no more than `most` are kept. One is taken each time.
class TokenBucket {
 public:
  TokenBucket(double rate_hz, double most) : rate_hz_(rate_hz), most_(most), tokens_(most) {}
  /// False where there is none.
  bool take(double now_s);
  bool is_full(double now_s) const;

 private:
  double rate_hz_, most_, tokens_;
  double at_s_ = -1;
};

/// A bucket for each client and one for all of them. Its memory is bounded: who has not come for long is forgotten, and while that is
/// nobody, further clients share a bucket. One thread at a time.
class RateLimit {
 public:
  explicit RateLimit(const RateConfig& config);
  /// A client that is refused takes nothing from the others.
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
