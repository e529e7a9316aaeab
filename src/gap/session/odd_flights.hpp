// Which flight of a set differs from the others, and from when on a flight differs from its beginning; for contrasts of
// beat-averaged vehicles.
//   which  a quantity of the flight against the mean of the others, in standard deviations between sessions
//   when   the split of a series with the largest difference of means (Page, Biometrika 41, 1954; Hinkley, Biometrika
//          57, 1970), over the standard deviation of that difference, given that noise is autocorrelated
#pragma once

#include "gap/result/diagnosis.hpp"
#include "gap/session/session_scatter.hpp"

namespace flappy::gap {

/// The flights of a set that differ from the other flights of the set by more than five standard deviations, the oddest
/// first. `names`, `flights`: [flight of the set]. With fewer than three flights none is odd.
std::vector<OddFlight> odd_flights(const std::vector<std::string>& names, const std::vector<FlightQuantities>& flights,
                                   const SessionScatter& scatter, const SessionPrior& prior);

/// A jump of the thrust or of a torque within a flight. SessionContrast reports it only if it is far clearer than those
/// within the reference flights.
struct StepWithin {
  std::string quantity;
  double since_s = 0;  ///< from the begin of the recorded motion on
  double step = 0;     ///< in the quantity's unit
  double times = 0;    ///< in standard deviations of the difference of means
};
/// The clearest step of a flight, however small; none: too short. `robot`, `trend`: as for flight_series.
std::optional<StepWithin> step_within(const PredictedFlight& flight, const VehicleHypothesis& robot,
                                      const CommonTrend& trend);

}  // namespace flappy::gap
