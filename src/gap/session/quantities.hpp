// What one flight of a beat-averaged vehicle shows, in a few numbers, for contrasts
// (gap/question/session_contrast.hpp): how far its rows are from a prediction, along directions that have a physical
// meaning. Each number is a coefficient of a linear regression of the residual. So an effect shifts it by what the same
// regression gives for the change that the effect makes in the rows:
//   force along z      share of the thrust; with the battery, the height, the climb and the speed squared; a delay
//   forces along x, y  a constant and a drag of each axis; the pull of a weight on a line, for several lengths
//   moments            where the thrust acts: mean moment over the weight
//   inputs             the logarithm of how much they shake, which no effect of the catalogue predicts; a loss of an
//                      actuator may come with it (gap/question/session_fit.hpp)
// A prior draws regressors to 0, the more the less a flight excites them. Flights of one robot have the same
// quantities, if they have the same channels and streams; those of a channel without rows are missing.
#pragma once

#include "gap/replay/predicted_flight.hpp"

namespace flappy::gap {

struct SessionQuantity {
  std::string name, unit;
  std::string block;  ///< quantities of one kind, which a cause that is not in the catalogue changes together
};

inline constexpr const char* kSessionBlocks[] = {"thrust", "battery", "height", "climb",  "speed", "delay",
                                                 "force",  "drag",    "swing",  "moment", "yaw",   "noise"};

/// Variance of what a flight does not show. Choice: far more than that of anything seen.
inline constexpr double kUnseen = 1e6;

/// What all references together show of the force along z besides the thrust, for which each flight's thrust is
/// corrected.
struct CommonTrend {
  double battery = 0, height_m = 0;  ///< means over the references, at which the regressors are 0; battery: a share
  Eigen::VectorXd slopes;            ///< [regressor: battery, height, climb, speed squared, delay]; empty: no such rows
};
/// `robot`: the vehicle that predicts, with the parameters of the references.
CommonTrend common_trend(const FlightList& references, const VehicleHypothesis& robot);

/// What a quantity of a flight is at each instant that shows it, for odd_flights.hpp.
struct FlightSeries {
  std::string quantity;
  Eigen::VectorXd time_s, values;  ///< [instant] time since the recorded motion begins; in the quantity's unit
};
/// The thrust, corrected for the trend, and the moments, as far as their channels have rows.
std::vector<FlightSeries> flight_series(const PredictedFlight& flight, const VehicleHypothesis& robot,
                                        const CommonTrend& trend);

/// The regressions of one flight.
class FlightQuantities {
 public:
  /// `robot`: what predicts; the same for all flights that are compared.
  FlightQuantities(const PredictedFlight& flight, const VehicleHypothesis& robot, const CommonTrend& trend);
  const std::vector<SessionQuantity>& quantities() const { return quantities_; }
  /// [quantity] What the flight shows.
  const Eigen::VectorXd& values() const { return values_; }
  /// [quantity] Variance by the noise of the flight; huge where the flight does not show a quantity.
  const Eigen::VectorXd& variances() const { return variances_; }
  /// [quantity] What the values would change by if the flight had measured `rows` more.
  Eigen::VectorXd change(const Rows& rows) const;

 private:
  struct Regression;
  void add(const Regression& regression, const Eigen::VectorXd& residual);
  void keep(const SessionQuantity& quantity, double value, double variance);
  std::vector<SessionQuantity> quantities_;
  Eigen::VectorXd values_, variances_;
  struct Weights {
    std::vector<std::size_t> rows;
    Eigen::MatrixXd weights;  ///< [quantity][row]
    Eigen::Index first;
  };
  std::vector<Weights> regressions_;
};

}  // namespace flappy::gap
