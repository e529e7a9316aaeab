// A hypothesis of a contrast of beat-averaged vehicles, fitted to what the test flights show as one session
// (session_contrast.hpp).
#pragma once

#include "gap/fit/hypothesis.hpp"
#include "gap/session/session_scatter.hpp"

namespace flappy::gap {

/// This effect has one magnitude for each actuator, and may act by one of them alone.
inline constexpr const char* kActuatorLoss = "actuator_loss";

/// Test flights as one session. Quantities are those of gap/session/quantities.hpp.
class TestSession {
 public:
  /// `tests`, `quantities` and `density` are not copied and have to outlive it. `quantities`: [test flight]; `density`: of
  /// the session; `robot`: the vehicle that was fitted to the reference flights.
  TestSession(const FlightList& tests, const std::vector<FlightQuantities>& quantities, const SessionDensity& density,
              const SessionPrior& prior, const VehicleHypothesis& robot);
  const SessionDensity& density() const { return density_; }
  /// [quantity] Variance that is added to the noise of the inputs if a damaged actuator shakes; 0 of other quantities.
  const Eigen::VectorXd& noise_variance() const { return noise_variance_; }
  /// [vehicle][quantity] What each vehicle would have shown less what the vehicle of the references would.
  std::vector<Eigen::VectorXd> shifts(const std::vector<VehicleHypothesis>& vehicles) const;

 private:
  const FlightList& tests_;
  const std::vector<FlightQuantities>& quantities_;
  Eigen::MatrixXd shares_;  ///< [flight][quantity]
  const SessionDensity& density_;
  Eigen::VectorXd noise_variance_;
  std::vector<Rows> unchanged_;
};

struct EffectFit {
  Eigen::VectorXd at;          ///< all coordinates of the hypothesis
  Eigen::MatrixXd covariance;  ///< of all coordinates; 0 for those that were not fitted
  double explained = -std::numeric_limits<double>::infinity();  ///< log evidence, without the prior of the hypothesis
  std::vector<Eigen::Index> free;                               ///< coordinates that were fitted
};

/// Fits all effects of `h` together, the last one in each of its ways, which are equally probable: a loss of actuators
/// is one of all, or of one of them; a damaged actuator shakes, or does not. The evidence is the mean over all ways, the
/// fit that of the most probable way.
/// `law_error`: deviation of the robot's law of the effects from the catalogue's, as a share of what they change.
/// `robot`: [coordinate] the references' parameters. `first`: a fit of the effects before the last; null: there are
/// none.
EffectFit fit_each_way(const TestSession& tests, const Hypothesis& h, const Eigen::VectorXd& robot,
                       const EffectFit* first, double law_error);
/// Whether a magnitude of one prior standard deviation, of any sign that it may have, changes any quantity by more than
/// a tenth of what sessions differ by.
bool shows(const TestSession& tests, const Hypothesis& h, const Eigen::VectorXd& robot);
/// Logarithm of the sum of exponentials.
double log_sum(const std::vector<double>& values);

}  // namespace flappy::gap
