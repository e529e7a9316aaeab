// Some of many flappers are shown to others while they fly. What is shown changes nothing of the flight.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <limits>
#include <vector>

#include "flight/fleet.hpp"

namespace flappy::rollout {

/// A flapper at the end of a control period.
struct FlightSample {
  std::uint32_t slot = 0, flapper = 0;  ///< place in the list of those that are watched; its number
  std::uint64_t tick = 0;               ///< control periods since the flight's start
  double t_s = 0;                       ///< since then
  sim::FlapperState state;              ///< true
  double gyro_rad_s[3], accel_m_s2[3];  ///< as its IMU means them, in B; without noise
  sim::Input input;                     ///< as controller and actor set it; nothing where the actor sets voltages
  bool sets_voltages = false;
  double left_V = 0, right_V = 0;  ///< as it sets them, where it does
};

/// Whoever watches. Flights ask it after each control period; it may be told from another thread whom to watch.
class Watch {
 public:
  explicit Watch(const std::vector<std::uint32_t>& flappers);
  virtual ~Watch() = default;
  /// Of one flight thread at a time; it must not wait.
  virtual void see(const FlightSample& sample) = 0;

  std::size_t size() const { return size_; }
  std::uint32_t flapper(std::size_t slot) const { return flappers_[slot].load(std::memory_order_relaxed); }
  void set_flapper(std::size_t slot, std::uint32_t to) { flappers_[slot].store(to, std::memory_order_relaxed); }

 private:
  static constexpr std::size_t kMost = 64;
  std::size_t size_;
  std::array<std::atomic<std::uint32_t>, kMost> flappers_{};
};

/// Shows those of a fleet that are watched, by their numbers within their stream (training, validation, test).
template <class T>
void show(Watch& watch, const flight::Fleet<T>& fleet);

}  // namespace flappy::rollout
