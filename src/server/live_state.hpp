// The live state of the flapper that the dashboard shows. A receiver of telemetry sets it, the dashboard reads it.
#pragma once

#include <array>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>

namespace flappy::server {

/// SI units; W: world frame, z up; B: body frame. The quaternion is w, x, y, z and turns body to world.
struct ShownState {
  std::string source;  ///< topic or job that it comes from
  double t_s = 0;
  std::array<double, 3> position_m{};
  std::array<double, 4> q_WB{1, 0, 0, 0};
  std::array<double, 3> v_WB_W_m_s{}, w_WB_B_rad_s{};
  std::optional<double> battery_V;
};

/// Thread-safe.
class LiveState {
 public:
  void set(ShownState state) {
    const std::lock_guard guard(mutex_);
    state_ = std::move(state);
    ++count_;
  }
  /// The last state, nothing before the first set(), and the number of set() calls.
  std::pair<std::optional<ShownState>, std::uint64_t> get() const {
    const std::lock_guard guard(mutex_);
    return {state_, count_};
  }

 private:
  mutable std::mutex mutex_;
  std::optional<ShownState> state_;
  std::uint64_t count_ = 0;
};

}  // namespace flappy::server
