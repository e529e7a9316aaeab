// What a recorder sees of one flight of a fleet, and the truth beside it.
#pragma once

#include <memory>

#include "rollout/fly_config.hpp"

namespace flappy::rollout {

/// What the driver did at physics step `step`: inputs as it clipped them, voltages that hold until its next update.
struct DriverUpdate {
  std::int64_t step;
  std::uint32_t phase;  ///< of the beat, 2^32 each
  sim::Input input;
  double left_V, right_V;
};

/// The updates of flapper `i` within the fleet's last control period: the physics applies them between the samples that
/// a batch shows, so they are worked out once more, to the bit. Of voltages that were set directly: one, when the period began.
template <class T>
std::vector<DriverUpdate> driver_updates(flight::Fleet<T>& fleet, std::size_t i);

/// The sensor as a reader models it: a first-order low-pass of `bandwidth_hz`, where the real one (mean over an interval,
/// then its own low-pass) passes 1/sqrt(2), and a latency, so that slow motion is as late as it really is:
///   latency + interval/2 + (1-c)/c interval - 1/(2 pi bandwidth)      c: share of a new value in the low-pass
flightlog::ImuHeader imu_header(const flight::ImuSensor& imu);

template <class T>
class Recorder {
 public:
  /// `i` of `fleet`, before the first period that it is to see; `vehicle` is its own.
  Recorder(const FlyConfig& config, flight::Fleet<T>& fleet, std::size_t i, const model::Vehicle& vehicle);
  ~Recorder();
  Recorder(Recorder&&) noexcept;
  Recorder& operator=(Recorder&&) noexcept;

  /// After each control period.
  void record();
  /// All samples so far.
  const flightlog::FlightLog& so_far() const;
  /// What was recorded so far; nothing before every stream has samples at one time.
  std::optional<flightlog::FlightLog> log() const;
  /// Writes log and truth. False, and no log, if the flight ended before every stream had samples at one time.
  bool write(const std::filesystem::path& folder) const;

  /// Of a second of flight.
  static double bytes_per_s(const FlyConfig& config);

 private:
  struct Storage;
  std::unique_ptr<Storage> storage_;
};

extern template class Recorder<float>;
extern template class Recorder<double>;

}  // namespace flappy::rollout
