// A recorded flight and its predictions as rows: for each beat, the coefficients of each channel. Implemented for
// vehicles with wings and motors (reset_prediction.hpp) and beat-averaged ones (beat_averaged_prediction.hpp).
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "flappy/vehicle.hpp"
#include "gap/replay/beat_rows.hpp"
#include "gap/replay/recording.hpp"
#include "gap/replay/residual_memo.hpp"
#include "gap/replay/sensor_correction.hpp"

namespace flappy::gap {

enum Channel : int {
  kAngularAccelerationX,
  kAngularAccelerationY,
  kAngularAccelerationZ,  ///< rad/s^2, B
  kSpecificForceX,
  kSpecificForceY,
  kSpecificForceZ,  ///< at the IMU, or for beat-averaged vehicles at the torso origin, m/s^2, B
  kStrokeLeft,
  kStrokeRight,  ///< stroke angle, rad; only where logged
  kBattery,      ///< battery voltage, V; only where logged
  kCurrentLeft,
  kCurrentRight,  ///< motor current, A; only where logged
  // motion capture against the IMU, without a vehicle (stream_rows.hpp): only the mean of a beat
  kPathX,
  kPathY,
  kPathZ,  ///< acceleration of the torso origin by motion capture less that by the IMU, m/s^2, W
  kRotateX,
  kRotateY,
  kRotateZ,  ///< angular rate by motion capture less that by the gyro and a constant bias, rad/s, B
  kChannels
};
const char* channel_name(int channel);
const char* channel_unit(int channel);

/// Rows of one flight: [beat][channel][coefficient].
using Rows = std::vector<double>;
inline constexpr std::size_t kRowsPerBeat = static_cast<std::size_t>(kChannels) * kCoefficients;

/// Index in Rows of the mean of a channel over a beat.
constexpr std::size_t row_of_mean(std::size_t beat, int channel) {
  return beat * kRowsPerBeat + static_cast<std::size_t>(channel) * kCoefficients;
}

/// A vehicle that may have flown a recording, and the errors of its sensors.
struct VehicleHypothesis {
  model::Vehicle vehicle;
  double lag_s = 0;      ///< delay of the sensors relative to the inputs, beyond the latency in the header
  EffectValues sensors;  ///< errors of sensors that the headers do not declare (gap/replay/sensor_correction.hpp)
  std::vector<double> variates;  ///< draws of the vehicle's parameters: two that are equal differ only in effects
  EffectValues file_effects;     ///< the effects of the vehicle file, which reference flights keep
};

/// Kinds of functions of the regime (gap/evidence/evidence.hpp).
enum class BasisFunction {
  constant,
  input,
  rate,
  product,
  place,
  flight,  ///< 1 in one flight, 0 in the others
  velocity_x,
  velocity_y,
  velocity_z,
  drag_x,
  drag_y,
  drag_z,
  count
};

struct RegimeFunction {
  std::string name;
  /// What it depends on: the name of an input, amplitude, velocity, rate, height, ceiling, wall, heading, time, ...
  std::string quantity;
  BasisFunction kind;
  Eigen::VectorXd values;  ///< [beat]
};

struct RegimeQuantity {
  std::string name, unit;
  std::vector<double> values;  ///< [beat]
};

class PredictedFlight {
 public:
  virtual ~PredictedFlight() = default;
  /// Residuals without the effects of a vehicle, which hypotheses share if the flight is a reference.
  ResidualMemo& memo() const { return *memo_; }
  /// Frees what is kept to be faster: hundreds of megabytes.
  virtual void forget() const { memo_->clear(); }
  virtual const std::string& name() const = 0;
  /// Name of the session; empty: the flight is its own.
  virtual std::string session() const { return {}; }
  virtual bool has_ground() const = 0;    ///< whether the log declares a ground
  virtual std::size_t beats() const = 0;  ///< number of beats; of a beat-averaged vehicle, number of rows in time
  virtual double beats_Hz() const = 0;    ///< beats, or these rows, a second
  /// Whether a channel has data in a beat.
  virtual bool covers(std::size_t beat, int channel) const = 0;
  /// Whether a coefficient of a channel is compared at all.
  virtual bool has_rows(int channel, int coefficient) const = 0;
  /// Whether what no model explains in a channel counts as noise, but its mean over a session: moments that an autopilot
  /// counteracts.
  virtual bool disturbed(int /*channel*/) const { return false; }
  virtual const Rows& measured() const = 0;
  /// The signal of each channel, which the model discrepancy is a share of: the measured rows. Exceptions for vehicles
  /// with wings and motors: for the angular acceleration the recorded one, as the rows are already differences from it;
  /// for the battery its voltage less the full voltage; for path and rotate constants. For moments that an autopilot
  /// counteracts, which add up to nothing: the root of the sum of their squares.
  virtual const Rows& signal() const = 0;
  /// Rows that the sensors of each vehicle would have measured, [vehicle]; empty if its simulation diverges.
  virtual std::vector<Rows> predict(const std::vector<const VehicleHypothesis*>& vehicles) const = 0;
  /// Smooths rows that were predicted elsewhere over beats, as `measured` and `predict` do.
  virtual void weigh(Rows& /*rows*/) const {}
  /// Rows that the declared noise of the sensors alone would give: one realisation for each seed.
  virtual Rows declared_noise(std::uint64_t seed) const = 0;
  virtual std::vector<RegimeFunction> functions() const = 0;
  /// Pairs of functions, by name, whose products complete the regime basis.
  virtual std::vector<std::pair<std::string, std::string>> products() const = 0;
  virtual std::vector<RegimeQuantity> regimes() const = 0;
  virtual std::vector<RegimeQuantity> inputs() const = 0;
  /// Logarithm of the rms of the inputs' second differences, in shares of their ranges: how much the controller shakes
  /// while the robot is in the air. None for vehicles with wings, or where inputs do not change.
  virtual std::optional<double> log_input_noise() const { return {}; }
  /// Whether rows are means over beats alone: of a beat-averaged vehicle.
  virtual bool is_averaged() const = 0;
  /// Null for beat-averaged vehicles.
  virtual const Recording* recording() const { return nullptr; }
  /// The same beats with another log. Null for beat-averaged vehicles.
  virtual std::shared_ptr<const PredictedFlight> with_log(const flightlog::FlightLog& /*log*/) const { return nullptr; }
  /// The same beats with the given errors of sensors undone in the log. Null for beat-averaged vehicles, whose
  /// prediction includes the effects of their sensors.
  virtual std::shared_ptr<const PredictedFlight> corrected(const EffectValues& /*sensors*/) const { return nullptr; }

 private:
  std::shared_ptr<ResidualMemo> memo_ = std::make_shared<ResidualMemo>();
};

using FlightList = std::vector<std::shared_ptr<const PredictedFlight>>;

/// The flights of one robot. Where all are counted, references come first.
struct Flights {
  FlightList references;  ///< from before the change that is asked about: the robot is believed to have had no effects
  FlightList tests;       ///< the flights asked about
  std::size_t size() const { return references.size() + tests.size(); }
  bool is_reference(std::size_t flight) const { return flight < references.size(); }
  const std::shared_ptr<const PredictedFlight>& operator[](std::size_t flight) const {
    return is_reference(flight) ? references[flight] : tests[flight - references.size()];
  }
  FlightList all() const;
};

}  // namespace flappy::gap
