#include "rollout/simulated_flight.hpp"

#include <cmath>

#include "rollout/flight_score.hpp"
#include "rollout/rollout.hpp"

namespace flappy::rollout {
namespace {

/// Distance from the set point beyond which a flight counts as lost.
constexpr double kLost_m = 0.5;

bool is_lost(const flight::Fleet<double>& fleet, std::size_t i) {
  if (fleet.batch().status(i) & sim::kFrozen) return true;
  const Errors e = errors_of(fleet.truth(i), fleet.target(i));
  const double off_m = std::sqrt(e[3] * e[3] + e[4] * e[4] + e[5] * e[5]);
  return !(off_m < kLost_m) || !(std::cos(e[0]) * std::cos(e[1]) > std::cos(kTippedOver_rad));
}

}  // namespace

std::vector<SimulatedFlight> simulate(const FlyConfig& given, const model::Vehicle& vehicle, std::size_t copies,
                                      double from_s) {
  FlyConfig config = given;
  config.vehicle = vehicle;
  config.draw_no_vehicles();
  config.fleet.batch.threads = 1;
  Rollout<double> rollout(std::move(config), copies);
  std::vector<SimulatedFlight> flights(copies);
  for (const auto first = std::lround(from_s / rollout.fleet().period_s()); !rollout.over();) {
    if (rollout.tick() == first) rollout.record();
    rollout.step();
    for (std::size_t i = 0; i < rollout.recorders().size(); ++i)
      flights[i].lost = flights[i].lost || is_lost(rollout.fleet(), i);
  }
  for (std::size_t i = 0; i < rollout.recorders().size(); ++i) flights[i].log = rollout.recorders()[i].log();
  return flights;
}

}  // namespace flappy::rollout
