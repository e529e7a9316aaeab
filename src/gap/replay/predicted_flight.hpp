// A recorded flight and its predictions as rows: for each beat, the coefficients of each channel. Implemented for
// vehicles with wings and motors (reset_prediction.hpp) and beat-averaged ones (beat_averaged_prediction.hpp). "Beat"
// is the index of both: for beat-averaged vehicles it counts rows in time, which are not beats of the wings.
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
  // these three, for vehicles with wings: predicted less recorded angular acceleration, so measured rows are 0
  kAngularAccelerationX,
  kAngularAccelerationY,
  kAngularAccelerationZ,  ///< rad/s^2, B
  kSpecificForceX,
  kSpecificForceY,
  kSpecificForceZ,  ///< at the IMU, or for beat-averaged vehicles at the torso origin, m/s^2, B
  // from here on only for vehicles with wings
  kStrokeLeft,
  kStrokeRight,  ///< stroke angle, rad; only covered where logged
  kRotationLeft,
  kRotationRight,  ///< rotation of the wing, rad; only covered where logged
  kBattery,        ///< battery voltage, V; only covered where logged
  kCurrentLeft,
  kCurrentRight,  ///< motor current, A; only covered where logged
  // motion capture against the IMU, without a vehicle (stream_rows.hpp), so every vehicle predicts 0; only the mean
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

/// Rows of one flight: [beat][channel][coefficient], in the channel's unit. Rows that are not covered are 0 or
/// undefined.
using Rows = std::vector<double>;
inline constexpr std::size_t kRowsPerBeat = static_cast<std::size_t>(kChannels) * kCoefficients;

/// Channels of flights in the air, then those of runs on a bench: what a model gets wrong and the noise of the sensors
/// differ there.
inline constexpr int kSettingChannels = 2 * kChannels;

/// Index in Rows of the mean of a channel over a beat.
constexpr std::size_t row_of_mean(std::size_t beat, int channel) {
  return beat * kRowsPerBeat + static_cast<std::size_t>(channel) * kCoefficients;
}

/// A vehicle that may have flown a recording, and the errors of its sensors. Hypothesis::vehicle makes it.
struct VehicleHypothesis {
  model::Vehicle vehicle;  ///< with its effects
  /// By how much inputs act later than the log says, beyond what its header declares. For vehicles with wings: a latency
  /// of all sensors. For beat-averaged ones: a delay of the commands.
  double lag_s = 0;
  EffectValues sensors;  ///< errors of declared sensors (gap/replay/sensor_correction.hpp); none if beat-averaged
  /// Draws of the vehicle's parameters. Two vehicles of one robot with the same draws differ in effects alone.
  std::vector<double> variates;
  EffectValues file_effects;  ///< effects of the vehicle file: all that the vehicle has in reference flights
};

/// A vehicle as one lane of PredictedFlight::compare.
struct ComparedVehicle {
  const VehicleHypothesis* vehicle;
  EffectValues undone;  ///< effects and errors of sensors that are undone in the log; none if beat-averaged
};

/// Kinds of functions of the regime (gap/evidence/evidence.hpp). Each has a prior of its own (Shares).
enum class BasisFunction {
  constant,
  input,
  rate,     ///< body rates and, of beat-averaged vehicles, angular accelerations
  product,  ///< of an input and another function
  place,    ///< height, nearness of surfaces, heading, attitude, time
  flight,   ///< 1 in one flight, 0 in the others
  velocity_x,
  velocity_y,
  velocity_z,
  drag_x,  ///< |v| v_x, v: velocity in B; y and z likewise
  drag_y,
  drag_z,
  count
};

/// A function of input and motion, of which the model discrepancy is a sum.
struct RegimeFunction {
  std::string name;
  /// What it depends on: the name of an input, amplitude, velocity, rate, height, ceiling, wall, heading, time, ...
  std::string quantity;
  BasisFunction kind;
  Eigen::VectorXd values;  ///< [beat]
};

/// A quantity by which residuals are located (gap/localise/where.hpp).
struct RegimeQuantity {
  std::string name, unit;
  std::vector<double> values;  ///< [beat]
};

class PredictedFlight {
 public:
  virtual ~PredictedFlight() = default;
  /// Residuals of earlier vehicles; only residuals() uses it, of reference flights.
  ResidualMemo& memo() const { return *memo_; }
  /// Frees what is kept to be faster: hundreds of megabytes.
  virtual void forget() const { memo_->clear(); }
  virtual const std::string& name() const = 0;
  /// Name of the session; empty: the flight is its own.
  virtual std::string session() const { return {}; }
  virtual bool clamped() const;           ///< whether it is a run of a robot on a bench
  virtual bool has_ground() const = 0;    ///< whether the log declares a ground
  virtual std::size_t beats() const = 0;  ///< number of beats; of a beat-averaged vehicle, number of rows in time
  virtual double beats_Hz() const = 0;    ///< beats, or these rows, a second
  /// Whether a channel counts in a beat. Only rows of such beats are compared.
  virtual bool covers(std::size_t beat, int channel) const = 0;
  /// Whether a coefficient of a channel is compared at all.
  virtual bool has_rows(int channel, int coefficient) const = 0;
  /// Whether the noise of a channel is learnt from its whole residual, less the mean of each session. So for moments that
  /// an autopilot counteracts.
  virtual bool disturbed(int /*channel*/) const { return false; }
  /// What the sensors measured.
  virtual const Rows& measured() const = 0;
  /// The size of each channel, relative to which the model discrepancy is stated: the measured rows, with exceptions.
  /// For a vehicle with wings: the recorded angular acceleration; the battery's voltage less its full voltage; constants
  /// for path and rotate. For moments under an autopilot, whose contributions cancel: the root of the sum of squares of
  /// the contributions.
  virtual const Rows& signal() const = 0;
  /// [vehicle] Rows that the sensors of each vehicle would have measured; empty if its simulation diverges. Simulates
  /// all effects, except those of sensors of vehicles with wings: compare() undoes these in the log instead.
  virtual std::vector<Rows> predict(const std::vector<const VehicleHypothesis*>& vehicles) const = 0;
  /// [vehicle] What the flight measured, less what each vehicle predicts; empty if its simulation diverges.
  /// residuals() calls it.
  virtual std::vector<Rows> compare(const std::vector<ComparedVehicle>& vehicles) const;
  /// Rows that the declared noise of the sensors alone would give: one realisation for each seed.
  virtual Rows declared_noise(std::uint64_t seed) const = 0;
  /// Functions of the regime, without the constant, offsets of flights, and products(). RegimeBasis centres them.
  virtual std::vector<RegimeFunction> functions() const = 0;
  /// Pairs of functions, by name, whose products complete the regime basis.
  virtual std::vector<std::pair<std::string, std::string>> products() const = 0;
  /// regimes(): quantities whose range is split into thirds to say where residuals are large. inputs(): those to which
  /// residuals may be proportional.
  virtual std::vector<RegimeQuantity> regimes() const = 0;
  virtual std::vector<RegimeQuantity> inputs() const = 0;
  /// Logarithm of the rms of the inputs' second differences, in shares of their ranges: how much the controller shakes
  /// while the robot is in the air. None for vehicles with wings, or where inputs do not change.
  virtual std::optional<double> log_input_noise() const { return {}; }
  /// Whether rows have means alone, no harmonics: those of a beat-averaged vehicle.
  virtual bool is_averaged() const = 0;
  /// Null for beat-averaged vehicles.
  virtual const Recording* recording() const { return nullptr; }
  /// The same beats with another log (Recording's second constructor). Null for beat-averaged vehicles. For tests.
  virtual std::shared_ptr<const PredictedFlight> with_log(const flightlog::FlightLog& /*log*/) const { return nullptr; }
  /// The same beats with the given effects and errors of sensors undone in the log. Null for beat-averaged vehicles,
  /// whose prediction includes the effects of their sensors.
  virtual std::shared_ptr<const PredictedFlight> corrected(const EffectValues& /*sensors*/) const { return nullptr; }

 private:
  std::shared_ptr<ResidualMemo> memo_ = std::make_shared<ResidualMemo>();
};

using FlightList = std::vector<std::shared_ptr<const PredictedFlight>>;

/// The flights of one robot. An index [flight] counts the references first, then the tests; [test flight] counts the
/// tests alone.
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

/// Whether an error of a sensor (gap/replay/sensor_correction.hpp) is one of the times of a stream that a bench has.
bool is_lateness(const std::string& error);
/// By how much the measured rows of a run on a bench change, to first order, if a stream comes late by t_late: where a
/// row has c cos(phase) + s sin(phase) in harmonic h of the beat f,
///   dc = -2 pi h f t_late s,   ds = 2 pi h f t_late c
/// `size`: a delay, s; or, for the value "rate", by how much a clock runs fast: t_late is that times the time since the
/// middle of the log. 0 for other errors.
Rows late_rows(const PredictedFlight& run, const std::string& error, const std::string& value, double size);

}  // namespace flappy::gap
