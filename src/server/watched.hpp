// The flapper that somebody looks at: whoever receives its state sets it, whoever shows it asks for it.
#pragma once

#include <array>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>

namespace flappy::server {

/// SI, world W: z up; quaternion w, x, y, z, body to world.
struct WatchedState {
  std::string source;  ///< a topic, a job
  double t_s = 0;
  std::array<double, 3> position_m{};
  std::array<double, 4> q_WB{1, 0, 0, 0};
  std::array<double, 3> v_WB_W_m_s{}, w_WB_B_rad_s{};
  std::optional<double> battery_V;
};

/// Any thread may call it.
class Watched {
 public:
  void set(WatchedState state) {
    const std::lock_guard guard(mutex_);
    state_ = std::move(state);
    ++count_;
  }
  /// Nothing until one was set; and how many were.
  std::pair<std::optional<WatchedState>, std::uint64_t> get() const {
    const std::lock_guard guard(mutex_);
    return {state_, count_};
  }

 private:
  mutable std::mutex mutex_;
  std::optional<WatchedState> state_;
  std::uint64_t count_ = 0;
};

}  // namespace flappy::server
