// Reset predictions, as in multiple shooting (Bock, Plitt 1984): what sensors of many vehicles would have measured.
// Recorded voltages drive each vehicle, and its torso is reset to the record at every interval of the IMU; wings and
// motors keep their state. So intervals test only their own forces and torques, errors do not accumulate, and a flight
// is simulated once. Predictions do not depend on the other vehicles of a batch.
// A beat's measured mean force is that of motion capture, a second difference of positions over three beats, which
// weighs beats as 1 2 3 2 1: an accelerometer aliases vibration above its rate. Predicted forces are weighed likewise.
#pragma once

#include <deque>
#include <mutex>

#include "gap/replay/predicted_flight.hpp"

namespace flappy::gap {

/// What the IMU measured in one of its intervals, less what a vehicle predicts: specific force, and the rate that the
/// vehicle gains in this interval alone, both in B.
struct ImuResidual {
  std::size_t sample = 0;  ///< of imu.csv
  Eigen::Vector3d force_m_s2, rate_rad_s;
};

class ResetPrediction final : public PredictedFlight {
 public:
  explicit ResetPrediction(Recording recording);

  const std::string& name() const override { return recording_.name; }
  std::string session() const override { return recording_.log.header.session; }
  bool has_ground() const override { return recording_.world.has_ground(); }
  std::size_t beats() const override { return recording_.beats; }
  double beats_Hz() const override { return recording_.log.header.flapping_Hz; }
  /// Specific force needs mocap in the beat and the IMU in two more on each side; path and rotate need mocap, the others
  /// a log.
  bool covers(std::size_t beat, int channel) const override;
  /// Coefficient 0 is the mean of a beat, the others are its harmonics; path and rotate have only the mean.
  bool has_rows(int channel, int coefficient) const override { return channel < kPathX || coefficient == 0; }
  const Rows& measured() const override { return measured_; }
  const Rows& signal() const override { return signal_; }
  /// Takes 1 to kVehicles vehicles (reset_kernel.hpp). The rows of a vehicle whose simulation diverges are empty.
  std::vector<Rows> predict(const std::vector<const VehicleHypothesis*>& vehicles) const override;
  /// In the intervals whose sample and motion are known, once the wings have spun up; empty if the simulation diverges.
  std::vector<ImuResidual> imu_residuals(const VehicleHypothesis& vehicle) const;
  void weigh(Rows& rows) const override;
  Rows declared_noise(std::uint64_t seed) const override;
  std::vector<RegimeFunction> functions() const override;
  std::vector<std::pair<std::string, std::string>> products() const override;
  std::vector<RegimeQuantity> regimes() const override;
  std::vector<RegimeQuantity> inputs() const override;
  bool is_averaged() const override { return false; }
  const Recording* recording() const override { return &recording_; }
  std::shared_ptr<const PredictedFlight> with_log(const flightlog::FlightLog& log) const override;
  /// Undoes errors of sensors in the log. Caches the last kMaxCorrected results; several threads may call it.
  std::shared_ptr<const PredictedFlight> corrected(const EffectValues& given) const override;
  void forget() const override;
  /// Logs that are kept. Size: of a cache.
  static constexpr std::size_t kMaxCorrected = 8;

 private:
  /// value(recording, regime) of each beat.
  template <class Value>
  std::vector<double> each(const Value& value) const;
  Rows rows_of(const std::vector<double>& samples) const;
  struct Replay;
  Replay replay(const std::vector<const VehicleHypothesis*>& vehicles) const;

  void lay_power(std::size_t first_beat);
  void put_power(const std::vector<double>& samples, Rows& rows) const;
  void compare_streams();
  void smooth_forces(Rows& rows, const Eigen::Matrix3Xd& more_m_s2) const;

  Recording recording_;

  BeatProjection imu_, wings_, power_;
  std::vector<char> compared_, smoothed_;  ///< [beat] has path and rotate rows; has mean forces of motion capture
  Eigen::Matrix3Xd path_m_s2_;             ///< [axis][beat] rows of the path channels, W
  std::vector<Eigen::Matrix3d> attitude_;  ///< [beat] B to W
  bool has_wings_ = false;
  // [power.csv sample on the grid] index, first step not before it, and how many steps later that begins
  std::vector<std::size_t> power_sample_, power_step_;
  std::vector<double> power_late_;
  Rows measured_, signal_;
  mutable std::mutex mutex_;
  mutable std::deque<std::pair<EffectValues, std::shared_ptr<const PredictedFlight>>> corrected_;
};

}  // namespace flappy::gap
