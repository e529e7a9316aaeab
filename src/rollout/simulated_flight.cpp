#include "rollout/simulated_flight.hpp"

#include <cmath>

#include "rollout/flight_score.hpp"
#include "rollout/recorder.hpp"
#include "rollout/settle.hpp"

namespace flappy::rollout {
namespace {

/// Farther from its set point, a vehicle no longer flies what was asked.
constexpr double kLost_m = 0.5;

bool is_lost(const flight::Fleet<double>& fleet, std::size_t i) {
  if (fleet.batch().status(i) & sim::kFrozen) return true;
  const rollout::Errors e = rollout::errors_of(fleet.truth(i), fleet.target(i));
  const double off_m = std::sqrt(e[3] * e[3] + e[4] * e[4] + e[5] * e[5]);
  return !(off_m < kLost_m) || !(std::cos(e[0]) * std::cos(e[1]) > std::cos(rollout::kTippedOver_rad));
}

}  // namespace

std::vector<SimulatedFlight> simulate(const rollout::FlyConfig& config, const model::Vehicle& vehicle,
                                      std::size_t copies, double from_s) {
  flight::FleetOptions options = config.fleet;
  options.batch.threads = 1;
  if (!config.actor) options.task.forbid_actions();
  flight::Fleet<double> fleet(copies, vehicle, options);
  if (options.task.start.settled) {
    const auto pool =
        rollout::settle<double>(options, copies, rollout::kHover_s, [&](std::uint32_t) { return vehicle; });
    for (std::size_t i = 0; i < copies; ++i) fleet.start(i, 0, pool[i]);
  }
  fleet.set_actor(config.actor);
  std::vector<rollout::Recorder<double>> recorders;
  std::vector<SimulatedFlight> flights(copies);
  const auto ticks = std::lround(config.duration_s / fleet.period_s()), first = std::lround(from_s / fleet.period_s());
  for (long tick = 0; tick < ticks; ++tick) {
    if (tick == first) {
      for (std::size_t i = 0; i < copies; ++i) recorders.emplace_back(config, fleet, i, vehicle);
      fleet.record(true);
    }
    if (tick == 0 || config.excitation.changes())
      for (std::size_t i = 0; i < copies; ++i)
        fleet.set_added(i, config.excitation.at(static_cast<double>(tick) * fleet.period_s()));
    fleet.step();
    for (std::size_t i = 0; i < recorders.size(); ++i) {
      recorders[i].record();
      flights[i].lost = flights[i].lost || is_lost(fleet, i);
    }
  }
  for (std::size_t i = 0; i < recorders.size(); ++i) flights[i].log = recorders[i].log();
  return flights;
}

}  // namespace flappy::rollout
