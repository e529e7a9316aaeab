// A recorded flight that vehicles predict, as rows: one for each beat, sorted by channel and by coefficient of the beat. There are two
// implementations: for vehicles with wings and motors (reset_prediction.hpp), and for beat-averaged ones (mean_prediction.hpp).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "flappy/vehicle.hpp"
#include "gap/replay/beat_rows.hpp"
#include "gap/replay/policy.hpp"
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
  kForceZ,  ///< specific force at the IMU, or at the origin, m/s^2, B
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
const char* channel_unit(int channel);

/// Rows of one flight: [beat][channel][coefficient].
using Rows = std::vector<double>;
inline constexpr std::size_t kRowsPerBeat = static_cast<std::size_t>(kChannels) * kCoefficients;

/// A vehicle that may have flown a recording, and how its sensors may differ from the headers of the log.
struct VehicleHypothesis {
  model::Vehicle vehicle;
  double lag_s = 0;      ///< the sensors are later, against the voltages, than the header says
  EffectValues sensors;  ///< errors of sensors beyond the headers (gap/replay/sensor_correction.hpp)
};

/// Kinds of functions of the regime (gap/evidence/evidence.hpp).
enum class BasisFunction {
  constant,
  input,
  rate,
  product,
  place,
  flight,  ///< an offset of one flight
  velocity_x,
  velocity_y,
  velocity_z,
  drag_x,
  drag_y,
  drag_z,
  count
};

/// A function of what a flight did, beat by beat.
struct RegimeFunction {
  std::string name;
  std::string
      quantity;  ///< what it depends on: a name, amplitude, velocity, rate, height, ceiling, wall, heading, time, ...
  BasisFunction kind;
  Eigen::VectorXd values;  ///< [beat]
};

/// A quantity by which the beats of a flight are sorted.
struct RegimeQuantity {
  std::string name, unit;
  std::vector<double> values;  ///< [beat]
};

class PredictedFlight {
 public:
  virtual ~PredictedFlight() = default;
  /// Of the log's folder.
  virtual const std::string& name() const = 0;
  virtual std::size_t beats() const = 0;
  virtual double beats_Hz() const = 0;
  virtual bool covers(std::size_t beat, int channel) const = 0;
  /// Whether a channel has rows of this coefficient.
  virtual bool has_rows(int channel, int coefficient) const = 0;
  virtual const Rows& measured() const = 0;
  /// What moved: as measured, and for torques the angular acceleration of the recorded motion. Of these `measured` holds nothing, for the
  /// prediction is the difference already.
  virtual const Rows& signal() const = 0;
  /// Rows as the sensors of each vehicle would have shown them; empty for one that came apart.
  virtual std::vector<Rows> predict(const std::vector<const VehicleHypothesis*>& vehicles) const = 0;
  /// Weighs rows of samples that were predicted elsewhere as `measured` and `predict` do.
  virtual void weigh(Rows& /*rows*/) const {}
  /// Rows of the sensors' declared noise alone: one of its many realisations, the same for a seed.
  virtual Rows declared_noise(std::uint64_t seed) const = 0;
  virtual std::vector<RegimeFunction> functions() const = 0;
  /// Pairs of functions, by name, whose products complete the regime basis.
  virtual std::vector<std::pair<std::string, std::string>> products() const = 0;
  virtual std::vector<RegimeQuantity> regimes() const = 0;
  virtual std::vector<RegimeQuantity> inputs() const = 0;
  virtual const DiagnosisPolicy& policy() const = 0;
  /// Null for beat-averaged vehicles.
  virtual const Recording* recording() const { return nullptr; }
  /// The same beats of another log of the flight. Null for beat-averaged vehicles.
  virtual std::shared_ptr<const PredictedFlight> with_log(flightlog::FlightLog /*log*/) const { return nullptr; }
  /// The same beats after these effects of sensors are undone in the log. Null for beat-averaged vehicles, whose sensors are part of their
  /// prediction.
  virtual std::shared_ptr<const PredictedFlight> corrected(const EffectValues& /*sensors*/) const { return nullptr; }
};

/// The flights of one robot.
using Flights = std::vector<std::shared_ptr<const PredictedFlight>>;

}  // namespace flappy::gap
