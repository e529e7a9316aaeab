// Shows selected flappers to an observer while they fly. It does not change the flights.
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
  std::uint32_t slot = 0, flapper = 0;  ///< index in the list of watched flappers; number of the flapper
  std::uint64_t tick = 0;               ///< control periods since the flight's start
  double t_s = 0;                       ///< time since the flight's start
  sim::FlapperState state;              ///< true state
  double gyro_rad_s[3], accel_m_s2[3];  ///< low-passed IMU signal without noise and bias, in B
  sim::Input input;                     ///< set by controller and actor; without meaning if the actor sets voltages
  bool sets_voltages = false;
  double left_V = 0, right_V = 0;  ///< voltages set by the actor, if sets_voltages
};

/// Observer of flights, called after each control period. Other threads may change the watched flappers at any time.
class Watch {
 public:
  explicit Watch(const std::vector<std::uint32_t>& flappers);
  virtual ~Watch() = default;
  /// Receives a sample. Called by one thread at a time; it must not block.
  virtual void see(const FlightSample& sample) = 0;

  std::size_t size() const { return size_; }
  std::uint32_t flapper(std::size_t slot) const { return flappers_[slot].load(std::memory_order_relaxed); }
  void set_flapper(std::size_t slot, std::uint32_t to) { flappers_[slot].store(to, std::memory_order_relaxed); }

 private:
  static constexpr std::size_t kMax = 64;
  std::size_t size_;
  std::array<std::atomic<std::uint32_t>, kMax> flappers_{};
};

/// Shows the watched flappers of a fleet. Flappers are numbered within their stream (training, validation, test).
template <class T>
void show(Watch& watch, const flight::Fleet<T>& fleet);

}  // namespace flappy::rollout
