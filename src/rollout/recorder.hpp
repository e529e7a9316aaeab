// Records one flight of a fleet: a flight log as the robot's sensors would give it, and the truth.
#pragma once

#include <memory>

#include "rollout/fly_config.hpp"

namespace flappy::rollout {

/// An update of the motor driver at physics step `step`: clipped inputs, and voltages that hold until the next update.
struct DriverUpdate {
  std::int64_t step;
  std::uint32_t phase;  ///< phase of the wing beat; 2^32 is one beat
  sim::Input input;
  double left_V, right_V;
};

/// Driver updates of flapper `i` in the last control period. A batch does not show them: they are computed again, with
/// the same bits. If voltages were set directly: one update, at the start.
template <class T>
std::vector<DriverUpdate> driver_updates(flight::Fleet<T>& fleet, std::size_t i);

/// Describes the simulated IMU to readers of logs, who assume one first-order low-pass and a latency. It (mean over an
/// interval, then a low-pass) passes 1/sqrt(2) at bandwidth_hz. The total delay of slow motion is right:
///   latency + interval/2 + (1-c)/c interval - 1/(2 pi bandwidth)      c: share of a new value in the low-pass
flightlog::ImuHeader imu_header(const flight::ImuSensor& imu);

template <class T>
class Recorder {
 public:
  /// Records flapper `i`, whose vehicle is `vehicle`. Construct it before the first control period to be recorded.
  Recorder(const FlyConfig& config, flight::Fleet<T>& fleet, std::size_t i, const model::Vehicle& vehicle);
  ~Recorder();
  Recorder(Recorder&&) noexcept;
  Recorder& operator=(Recorder&&) noexcept;

  /// Call it after each control period.
  void record();
  /// All samples so far, even if the log is incomplete.
  const flightlog::FlightLog& so_far() const;
  /// The log so far; empty until all streams have at least two samples and overlap in time.
  std::optional<flightlog::FlightLog> log() const;
  /// Columns of wing_loads.csv (flightlog::kWingLoadNames); empty where they are not asked for.
  const std::vector<flightlog::Column>& wing_loads() const;
  /// Writes log and truth. Returns false, and writes nothing, if log() is empty. Throws io::InputError.
  bool write(const std::filesystem::path& folder) const;

  /// Memory for a second of flight.
  static double bytes_per_s(const FlyConfig& config);

 private:
  struct Storage;
  std::unique_ptr<Storage> storage_;
};

extern template class Recorder<float>;
extern template class Recorder<double>;

}  // namespace flappy::rollout
