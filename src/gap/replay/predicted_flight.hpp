// A recorded flight that candidate vehicles predict, as rows: one for each beat, sorted by channel and by coefficient of the beat. Two kinds of
// vehicle do so, each in its own way: one of wings and motors (reset_prediction.hpp), and one that is known by the beat (mean_prediction.hpp).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "flappy/vehicle.hpp"
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

/// Rows of one flight: [beat][channel][coefficient].
using Rows = std::vector<double>;
inline constexpr std::size_t kRowsPerBeat = static_cast<std::size_t>(kChannels) * kCoefficients;

/// What flies a recording once more.
struct Candidate {
  model::Vehicle vehicle;
  /// By which the sensors are later, against the voltages, than the header says.
  double lag_s = 0;
  /// What its sensors are off by beyond the headers (gap/replay/sensor_correction.hpp).
  EffectValues sensors;
};

/// Kinds of functions of the regime (gap/evidence/evidence.hpp).
enum class BasisFunction {
  constant,
  input,
  rate,
  product,
  place,
  flight,  ///< one of several, as a whole
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
  BasisFunction kind;
  Eigen::VectorXd values;  ///< [beat]
};

/// What beats of a flight are sorted by.
struct RegimeQuantity {
  std::string name, unit;
  std::vector<double> values;  ///< [beat]
};

/// How vehicles of one kind predict a flight.
class Predictor {
 public:
  virtual ~Predictor() = default;
  virtual const std::string& name() const = 0;
  virtual std::size_t beats() const = 0;
  virtual double beats_Hz() const = 0;
  virtual bool covers(std::size_t beat, int channel) const = 0;
  /// Whether a channel has rows of this coefficient.
  virtual bool has_rows(int channel, int coefficient) const = 0;
  virtual const Rows& measured() const = 0;
  virtual const Rows& signal() const = 0;
  virtual std::vector<Rows> predict(const std::vector<const Candidate*>& candidates) const = 0;
  /// Weighs rows of samples that were predicted elsewhere as `measured` and `predict` do.
  virtual void weigh(Rows& /*rows*/) const {}
  virtual Rows declared_noise(std::uint64_t seed) const = 0;
  virtual std::vector<RegimeFunction> functions() const = 0;
  /// Pairs of functions, by name, whose product says what they do not.
  virtual std::vector<std::pair<std::string, std::string>> products() const = 0;
  virtual std::vector<RegimeQuantity> regimes() const = 0;
  virtual std::vector<RegimeQuantity> inputs() const = 0;
  /// Null where vehicles are known by the beat.
  virtual const Recording* recording() const { return nullptr; }
};

/// A recording that vehicles predict, with what its own sensors showed, as rows.
class PredictedFlight {
 public:
  /// Of vehicles of wings and motors.
  explicit PredictedFlight(Recording recording);
  explicit PredictedFlight(std::shared_ptr<const Predictor> predictor) : predictor_(std::move(predictor)) {}

  /// Of its folder.
  const std::string& name() const { return predictor_->name(); }
  std::size_t beats() const { return predictor_->beats(); }
  double beats_Hz() const { return predictor_->beats_Hz(); }
  bool covers(std::size_t beat, int channel) const { return predictor_->covers(beat, channel); }
  bool has_rows(int channel, int coefficient) const { return predictor_->has_rows(channel, coefficient); }
  /// As measured.
  const Rows& measured() const { return predictor_->measured(); }
  /// What moved: as measured, and for torques the angular acceleration of the recorded motion, of which `measured` holds
  /// nothing, for there the prediction is already the difference.
  const Rows& signal() const { return predictor_->signal(); }

  /// As every candidate's sensors would have shown it; empty for one that came apart.
  std::vector<Rows> predict(const std::vector<const Candidate*>& candidates) const {
    return predictor_->predict(candidates);
  }

  void weigh(Rows& rows) const { predictor_->weigh(rows); }

  /// Rows of the sensors' declared noise alone: one of its many courses, the same for a seed.
  Rows declared_noise(std::uint64_t seed) const { return predictor_->declared_noise(seed); }
  std::vector<RegimeFunction> functions() const { return predictor_->functions(); }
  std::vector<std::pair<std::string, std::string>> products() const { return predictor_->products(); }
  std::vector<RegimeQuantity> regimes() const { return predictor_->regimes(); }
  std::vector<RegimeQuantity> inputs() const { return predictor_->inputs(); }

  /// Of a flight whose vehicles have wings and motors.
  bool within_the_beat() const { return predictor_->recording() != nullptr; }
  const Recording& recording() const { return *predictor_->recording(); }
  /// The same beats as another log of the flight shows them.
  PredictedFlight with_log(flightlog::FlightLog log) const {
    return PredictedFlight(Recording(recording(), std::move(log)));
  }

 private:
  std::shared_ptr<const Predictor> predictor_;
};

/// All flights under all candidates on all processors: [candidate][flight].
std::vector<std::vector<Rows>> predict_all(const std::vector<PredictedFlight>& flights,
                                           const std::vector<Candidate>& candidates, int threads);

}  // namespace flappy::gap
