// The quantities of one flight of a beat-averaged vehicle, for contrasts (gap/question/session_contrast.hpp). Each is a
// coefficient of a linear regression of the residual on functions with a physical meaning. An effect changes the rows,
// so it shifts a quantity by what the same regression gives for that change. Quantities from each kind of channel:
//   force along z      thrust, as a share; slopes with battery, height, climb and speed squared; delay
//   forces along x, y  constant and drag of each axis; pull of a weight on a line, for several lengths
//   moments            where the thrust acts: mean moment over the weight
//   inputs             logarithm of how much they shake, without a regression. No effect of the catalogue predicts it,
//                      but a loss of an actuator may come with it (gap/question/session_fit.hpp)
// A prior draws some coefficients to 0, the more the less a flight excites them. Flights of one robot have the same
// quantities, if they have the same channels and streams; quantities of a channel without rows are missing.
#pragma once

#include "gap/replay/predicted_flight.hpp"

namespace flappy::gap {

struct SessionQuantity {
  std::string name, unit;
  std::string block;  ///< kind of quantity, of kSessionBlocks; an unknown cause changes a whole kind
};

inline constexpr const char* kSessionBlocks[] = {"thrust", "battery", "height", "climb",  "speed", "delay",
                                                 "force",  "drag",    "swing",  "moment", "yaw",   "noise"};

/// Variance of what a flight does not show. Choice: far more than that of anything seen.
inline constexpr double kUnseen = 1e6;

/// How the force along z depends on the regressors other than the thrust, fitted to all references together. The thrust
/// of each flight is corrected for it.
struct CommonTrend {
  double battery = 0, height_m = 0;  ///< means over the references, from which regressors count; battery: a share
  Eigen::VectorXd slopes;            ///< [regressor: battery, height, climb, speed squared, delay]; empty: no such rows
};
/// `robot`: the vehicle that predicts, with the parameters of the references.
CommonTrend common_trend(const FlightList& references, const VehicleHypothesis& robot);

/// A quantity over the time of a flight, at each instant whose rows count; for odd_flights.hpp.
struct FlightSeries {
  std::string quantity;
  Eigen::VectorXd time_s, values;  ///< [instant] time since the recorded motion begins; values in the quantity's unit
};
/// Series of the thrust, corrected for the trend, and of the moments; only for channels with rows.
std::vector<FlightSeries> flight_series(const PredictedFlight& flight, const VehicleHypothesis& robot,
                                        const CommonTrend& trend);

/// The regressions of one flight.
class FlightQuantities {
 public:
  /// `robot`: the vehicle that predicts; the same for all flights that are compared.
  FlightQuantities(const PredictedFlight& flight, const VehicleHypothesis& robot, const CommonTrend& trend);
  const std::vector<SessionQuantity>& quantities() const { return quantities_; }
  /// [quantity] What the flight shows.
  const Eigen::VectorXd& values() const { return values_; }
  /// [quantity] Variance due to the noise of the flight; kUnseen if the flight has too few rows for a quantity.
  const Eigen::VectorXd& variances() const { return variances_; }
  /// [quantity] By how much the values would change if `rows` were added to the measured rows.
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
