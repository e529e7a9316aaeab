// Predictions with resets, as in multiple shooting (Bock, Plitt 1984): what the sensors of many vehicles would have shown, had
// they flown a recorded flight. The voltages are the recorded ones, and the torso is reset to the recorded motion at every
// interval of the IMU; wings and motors are the vehicle's own. So every interval tests the forces and torques of that moment
// alone, and a whole flight costs its own length once. A vehicle's numbers depend on no other's.
//
// The mean force of a beat is that of motion capture: an accelerometer folds what shakes faster than it samples into it, and a second
// difference of positions over three beats, which weighs the beats in between as 1 2 3 2 1, does not. A prediction is weighed alike.
#pragma once

#include <string>
#include <vector>

#include "gap/replay/beat_rows.hpp"
#include "gap/replay/recording.hpp"
#include "gap/replay/sensor_correction.hpp"

namespace flappy::gap {

/// The channels that residuals are sorted by.
enum Channel : int {
  kTorqueX,
  kTorqueY,
  kTorqueZ,  ///< angular acceleration, rad/s^2, B
  kForceX,
  kForceY,
  kForceZ,  ///< specific force at the IMU, m/s^2, B
  kStrokeLeft,
  kStrokeRight,  ///< rad, where logged
  kBattery,      ///< V, where logged, as the next
  kCurrentLeft,
  kCurrentRight,  ///< of the motors, A
  // what motion capture says against the IMU alone, no vehicle: the mean only
  kPathX,
  kPathY,
  kPathZ,  ///< acceleration of the origin, m/s^2, W
  kTurnX,
  kTurnY,
  kTurnZ,  ///< rate beyond the gyro's and a constant bias, rad/s, B
  kChannels
};
const char* channel_name(int channel);

/// Rows of one flight: [beat][channel][coefficient].
using Rows = std::vector<double>;
/// Whether a channel has rows of this coefficient.
constexpr bool has_rows(int channel, int coefficient) { return channel < kPathX || coefficient == 0; }
inline constexpr std::size_t kRowsPerBeat = static_cast<std::size_t>(kChannels) * kCoefficients;

/// What flies a recording once more.
struct Candidate {
  model::Vehicle vehicle;
  /// By which the sensors are later, against the voltages, than the header says.
  double lag_s = 0;
  /// What its sensors are off by beyond the headers (gap/replay/sensor_correction.hpp).
  EffectValues sensors;
};

/// A recording that vehicles predict, with what its own sensors showed, as rows.
class PredictedFlight {
 public:
  explicit PredictedFlight(Recording recording);

  const Recording& recording() const { return recording_; }
  std::size_t beats() const { return recording_.beats; }
  bool covers(std::size_t beat, int channel) const;
  /// As measured.
  const Rows& measured() const { return measured_; }
  /// What moved: as measured, and for torques the angular acceleration of the recorded motion, of which `measured` holds
  /// nothing, for there the prediction is already the difference.
  const Rows& signal() const { return signal_; }

  /// As every candidate's sensors would have shown it; empty for one that came apart.
  std::vector<Rows> predict(const std::vector<const Candidate*>& candidates) const;

  /// Rows of the sensors' declared noise alone: one of its many courses, the same for a seed.
  Rows declared_noise(std::uint64_t seed) const;
  /// The same beats as another log of the flight shows them.
  PredictedFlight with_log(flightlog::FlightLog log) const {
    return PredictedFlight(Recording(recording_, std::move(log)));
  }

 private:
  Rows rows_of(const std::vector<double>& samples) const;

  void lay_power(std::size_t first_beat);
  void put_power(const std::vector<double>& samples, Rows& rows) const;
  void compare_streams();
  void smooth_forces(Rows& rows, const Eigen::Matrix3Xd& more_m_s2) const;

  Recording recording_;

  BeatProjection imu_, wings_, power_;
  std::vector<char> compared_, smoothed_;  ///< beats
  Eigen::Matrix3Xd path_m_s2_;             ///< of each beat, W
  std::vector<Eigen::Matrix3d> attitude_;  ///< of each beat
  bool has_wings_ = false;
  std::vector<std::size_t> power_sample_, power_step_;  ///< of power.csv on the grid; the step that begins with it
  std::vector<double> power_late_;                      ///< or so many steps later
  Rows measured_, signal_;
};

/// All flights under all candidates on all processors: [candidate][flight].
std::vector<std::vector<Rows>> predict_all(const std::vector<PredictedFlight>& flights,
                                           const std::vector<Candidate>& candidates, int threads);

}  // namespace flappy::gap
