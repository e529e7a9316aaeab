// Predicts what the sensors of vehicles with wings and motors would have measured in a recorded flight, by reset
// predictions, as in multiple shooting (Bock, Plitt 1984). Recorded voltages drive each vehicle. At the end of every
// interval of the IMU, its torso is reset to the recorded motion. Wings and motors keep their state, and the body rate
// is only corrected by the rotation that the simulation lacked (reset_kernel.hpp). So an interval tests mainly the
// forces and torques within it, errors of the motion do not accumulate, and a flight is simulated once. Predictions do
// not depend on the other vehicles of a batch.
//
// Rows of the angular acceleration are differences from the record: predict() gives simulated less recorded, and
// measured() is 0.
// The measured mean force of a beat comes from motion capture, because an accelerometer aliases vibration above its
// rate. It is a second difference of positions over three beats, so the accelerations of five beats have the weights
// 1 2 3 2 1; predicted mean forces are weighed likewise. Harmonics of the force come from the accelerometer.
#pragma once

#include <deque>
#include <mutex>

#include "gap/replay/predicted_flight.hpp"

namespace flappy::gap {

/// What the IMU measured in one of its intervals less what a vehicle predicts: the specific force, and the change of
/// the body rate within the interval; both in B.
struct ImuResidual {
  std::size_t sample = 0;  ///< index in imu.csv
  Eigen::Vector3d force_m_s2, rate_rad_s;
};

class ResetPrediction final : public PredictedFlight {
 public:
  /// Channels of wings.csv and power.csv have rows of 0 if their stream is not logged.
  explicit ResetPrediction(Recording recording);

  const std::string& name() const override { return recording_.name; }
  std::string session() const override { return recording_.log.header.session; }
  bool has_ground() const override { return recording_.world.has_ground(); }
  std::size_t beats() const override { return recording_.beats; }
  double beats_Hz() const override { return recording_.log.header.flapping_Hz; }
  /// False in the first kSpinUpBeats beats, and in beats with too few valid intervals (Recording::valid,
  /// BeatProjection). In addition, path and rotate need motion capture kSpan beats to either side (stream_rows.hpp).
  /// Specific force in flight needs the same, and two covered beats to either side. Strokes need wings.csv, rotations
  /// need a wings.csv that has them, battery and currents need power.csv.
  bool covers(std::size_t beat, int channel) const override;
  /// Coefficient 0 is the mean of a beat, the others are its harmonics; path and rotate have only the mean. True also
  /// for streams that are not logged: covers() excludes those.
  bool has_rows(int channel, int coefficient) const override { return channel < kPathX || coefficient == 0; }
  const Rows& measured() const override { return measured_; }
  const Rows& signal() const override { return signal_; }
  /// Takes 1 to kVehicles vehicles (reset_kernel.hpp). Changes that the log's header declares are made to each.
  std::vector<Rows> predict(const std::vector<const VehicleHypothesis*>& vehicles) const override;
  /// Simulates vehicles in one block even if different errors of sensors are undone for each, unless these change the
  /// grid or the beats that count. Caches the last kMaxUndone corrected logs; several threads may call it.
  std::vector<Rows> compare(const std::vector<ComparedVehicle>& vehicles) const override;
  /// Residuals of single samples, for flappy-gap mcap: in valid intervals with a sample, once the wings have spun up;
  /// empty if the simulation diverges.
  std::vector<ImuResidual> imu_residuals(const VehicleHypothesis& vehicle) const;
  Rows declared_noise(std::uint64_t seed) const override;
  std::vector<RegimeFunction> functions() const override;
  std::vector<std::pair<std::string, std::string>> products() const override;
  std::vector<RegimeQuantity> regimes() const override;
  std::vector<RegimeQuantity> inputs() const override;
  bool is_averaged() const override { return false; }
  const Recording* recording() const override { return &recording_; }
  std::shared_ptr<const PredictedFlight> with_log(const flightlog::FlightLog& log) const override;
  /// Does not undo effects without which the robot flew, as the log's header declares.
  std::shared_ptr<const PredictedFlight> corrected(const EffectValues& given) const override;
  void forget() const override;
  /// Number of corrected logs that are kept: a fit asks again for the log of its current point. Size: of a cache.
  static constexpr std::size_t kMaxUndone = 2;

 private:
  /// value(recording, regime) of each beat.
  template <class Value>
  std::vector<double> each(const Value& value) const;
  Rows rows_of(const std::vector<double>& samples) const;
  struct Lane;
  struct Replay;
  /// All lanes have the grid of this flight.
  Replay replay(const std::vector<Lane>& lanes) const;
  std::vector<Rows> fly(const std::vector<Lane>& lanes) const;
  EffectValues undone_of(EffectValues given) const;
  std::shared_ptr<const ResetPrediction> without_errors(const EffectValues& undone) const;
  bool shares_grid(const ResetPrediction& other) const;

  void lay_power(std::size_t first_beat);
  void put_power(const std::vector<double>& samples, Rows& rows) const;
  void compare_streams();
  void smooth_forces(Rows& rows, const Eigen::Matrix3Xd& more_m_s2) const;

  Recording recording_;

  BeatProjection imu_, wings_, power_;
  std::vector<char> compared_, smoothed_;  ///< [beat] has path and rotate rows; has mean forces of motion capture
  Eigen::Matrix3Xd path_m_s2_;             ///< [axis][beat] rows of the path channels, W
  std::vector<Eigen::Matrix3d> attitude_;  ///< [beat] B to W
  bool has_wings_ = false, has_rotations_ = false;
  // [power.csv sample on the grid] index; first step that does not begin before it; by how many steps it begins later
  std::vector<std::size_t> power_sample_, power_step_;
  std::vector<double> power_late_;
  Rows measured_, signal_;
  mutable std::mutex mutex_;
  /// Corrected copies of this flight, without streams (Recording::drop_streams), the latest first.
  mutable std::deque<std::pair<EffectValues, std::shared_ptr<const ResetPrediction>>> undone_;
};

}  // namespace flappy::gap
