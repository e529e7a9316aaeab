// What somebody who knew the truth could find out from flights: how large an effect of the blind robot has to be, and which
// others it could be taken for.
//
// A robot without effects flies; everything else is a change of its rows, found by predicting the flights with and without an
// effect, the torso reset at every interval (detectability_prediction.hpp), or by sensing the same flight again. The rows have the noise that is left once
// the robot itself is predicted, and the model discrepancy of gap::Evidence; together with the
// uncertain parameters and the little that every vehicle has of every entry of the catalogue (gap/evidence/model_discrepancy.hpp), integrated
// out, that is one normal distribution, N(0, C). An effect in force moves its mean by d.
//
// A hypothesis has columns M beside the parameters, a ~ N(0, P^-1) of them: r ~ N(0, C + M P^-1 M'). With A = M' C^-1 M and
// f = M' C^-1 d, the determinant lemma and Woodbury's identity give what it is expected to gain over parameters alone,
//   L = E log N(r; 0, C + M P^-1 M') - E log N(r; 0, C) = 1/2 (f' (A + P)^-1 f + tr A (A + P)^-1 - log det (1 + P^-1 A))
// under the truth r ~ N(d, C). With M = d and little prior that is half the information d' C^-1 d, less the price of learning
// the size. A third of the flights counts for a third of L: what it gains once the others are known would say how well these
// teach the errors that every flight shares, discrepancy and background, to mimic the effect, and not how well it shows.
#pragma once

#include <map>
#include <memory>
#include <optional>

#include "benchmark/detectability_prediction.hpp"
#include "blind/flights.hpp"
#include "sim/randomise.hpp"

namespace flappy::benchmark {

/// All flights of a case.
std::vector<blind::RobotFlight> fly_all(const blind::Case& c, int threads);

/// L. `information`: d' C^-1 d of columns; `truth`: d as weights of these; `hypothesis`: M, a column of weights each; `precision`:
/// of its coefficients, P.
double expected_gain(const Eigen::MatrixXd& information, const Eigen::VectorXd& truth,
                     const Eigen::MatrixXd& hypothesis, const Eigen::VectorXd& precision);

/// Whether the catalogue has an entry for it.
constexpr bool in_catalogue(blind::Effect effect) { return effect < blind::Effect::outside_magnetic_torque; }
/// Whether only what the sensors say has the effect; the motion is the same.
bool acts_on_sensors(blind::Effect effect);

/// One robot without effects that flew, and what moves its rows.
class Subject {
 public:
  /// `flights`: of case `c`, all of them; both without effects. io::InputError where one of them crashed.
  Subject(blind::Case c, std::vector<blind::RobotFlight> flights, int threads);

  struct Added {
    blind::Effect effect;
    double size;
    std::uint64_t seed;  ///< of what effects of the vehicle draw once, as directions
  };
  /// What each adds to the rows; empty for those with which the robot comes apart.
  std::vector<gap::BasisCoefficients> added(const std::vector<Added>& list) const;
  /// The same of every uncertain parameter for one standard deviation, and of the IMU's lag, in the robot and in the
  /// simulator. `uncertain`: draws, about any vehicle.
  std::vector<gap::BasisCoefficients> parameters(const sim::Randomisation& uncertain) const;
  std::vector<gap::BasisCoefficients> simulated_parameters(const sim::Randomisation& uncertain) const;
  /// What every vehicle has a little of (gap/evidence/model_discrepancy.hpp), in the simulator.
  std::vector<gap::BasisCoefficients> background() const;
  /// The same of coordinates of an entry of the catalogue, in the simulator.
  std::vector<gap::BasisCoefficients> catalogue(const std::string& effect,
                                                const std::vector<Eigen::VectorXd>& coordinates) const;

  /// d' C^-1 d of `columns`, with the parameters integrated out.
  Eigen::MatrixXd information(const std::vector<gap::BasisCoefficients>& parameters,
                              const std::vector<gap::BasisCoefficients>& columns) const;

  /// Of the rows' noise over what the headers declare, median of the groups.
  double noise_ratio() const { return noise_ratio_; }
  const blind::Case& flown() const { return case_; }

 private:
  std::vector<gap::BasisCoefficients> sensed(const std::vector<Added>& list) const;
  model::Vehicle moved(const sim::Randomisation& uncertain, std::size_t draw, double variate) const;

  blind::Case case_;
  int threads_;
  std::vector<gap::PredictedFlight> flights_;
  gap::Residuals unperturbed_, left_;  ///< by the robot as it is; by the simulator, of the measurement
  std::unique_ptr<gap::Evidence> evidence_;
  double noise_ratio_ = 1;
};

/// What flights say of every effect.
class DetectabilityAnalysis {
 public:
  /// The columns of an effect, as indices.
  struct Columns {
    std::vector<double> sizes;  ///< increasing, at which there is a column
    std::vector<int> at;        ///< which
    std::vector<int> further;   ///< other directions, at typical size
  };
  DetectabilityAnalysis(std::array<Columns, blind::kBlindEffects> effects, Eigen::MatrixXd information)
      : effects_(std::move(effects)), information_(std::move(information)) {}
  /// `uncertain`: draws of the parameters, about any vehicle. Some minutes of one processor.
  DetectabilityAnalysis(const Subject& subject, const sim::Randomisation& uncertain);

  /// Nats that the truth gains over parameters alone, on a third of the flights; 0 where the robot comes apart.
  double gain(blind::Effect truth, double size) const;
  /// Nats that it gains over a rival whose sizes are free.
  double gain_over(blind::Effect truth, double size, blind::Effect rival) const;
  /// Where gain() reaches `nats`, there and at twice the size; infinite beyond size 4.
  double detectable(blind::Effect effect, double nats) const;

 private:
  std::size_t tried(blind::Effect effect, double size) const;
  Eigen::VectorXd truth_of(blind::Effect effect, double size) const;
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  double best_gain(const Eigen::VectorXd& truth, blind::Effect hypothesis, std::size_t but) const;
  Eigen::Index width() const { return information_.rows(); }

  std::array<Columns, blind::kBlindEffects> effects_;
  Eigen::MatrixXd information_;
};

/// An entry of the catalogue where it is most like an effect of the blind robot.
struct TrueValue {
  std::map<std::string, double> values;  ///< "effect.parameter": of its sizes
  double misfit = 1;                     ///< share of the effect's rows that it leaves: 0 none, 1 all
};
/// An entry that leaves more is nothing like the effect.
inline constexpr double kMostMisfit = 0.5;
/// The sizes and shapes of the entry with which the simulator's noise-free rows change most as the robot's do, in the measure
/// C^-1 above: what `parameters`, the simulator's, can take over is nobody's size. Shapes have their prior, sizes none.
/// `effect`: of the catalogue.
TrueValue true_value(const Subject& subject, const std::vector<gap::BasisCoefficients>& parameters,
                     blind::Effect effect, double size);

/// "effect.parameter" of each effect in `effects`, alone, on flights without any under the same seed; null where the entry is
/// nothing like it (misfit above 0.5), or where the robot does not fly without. Some twenty seconds of one processor.
std::map<std::string, std::optional<double>> true_values(const blind::Case& c,
                                                         const std::vector<blind::BlindEffect>& effects,
                                                         const sim::Randomisation& uncertain, int threads);

}  // namespace flappy::benchmark
