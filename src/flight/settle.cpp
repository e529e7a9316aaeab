#include "flight/settle.hpp"

#include <cmath>

namespace flappy::flight {
namespace {

/// At the origin, to stay there: released in the air, for a flapper on a stand is content with too little thrust.
Task staying() {
  Task task;
  task.name = "settle";
  task.start.kind = sim::Start::flying;
  task.path.push_back({0, {}});
  task.constants.limits = {1e9, -1e9, 1e9, 1e9, 1e9, 1e9, 1e9, 1e9, -1e9};
  return task;
}

}  // namespace

template <class T>
std::vector<Snapshot<T>> settle(const FleetOptions& options, std::size_t count, double seconds,
                                const std::function<model::Vehicle(std::uint32_t flapper)>& vehicle) {
  std::vector<Snapshot<T>> list(count);
  if (count == 0) return list;
  FleetOptions o = options;
  o.task = staying();
  Fleet<T> fleet(count, vehicle(o.first_flapper), o);
  double beat_s = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const model::Vehicle v = vehicle(o.first_flapper + static_cast<std::uint32_t>(i));
    fleet.set_vehicle(i, v);
    fleet.start(i, 0);
    beat_s = 1 / v.driver.flapping_Hz;
  }
  const long settled = std::lround(seconds / fleet.period_s());
  const long phases = std::max(1L, static_cast<long>(std::ceil(beat_s / fleet.period_s())));
  for (long tick = 0; tick < settled + phases; ++tick) {
    fleet.step();
    if (tick < settled) continue;
    for (std::size_t i = 0; i < count; ++i)
      if (static_cast<long>((o.first_flapper + i) % static_cast<std::size_t>(phases)) == tick - settled)
        list[i] = fleet.snapshot(i);
  }
  return list;
}

template std::vector<Snapshot<float>> settle(const FleetOptions&, std::size_t, double,
                                             const std::function<model::Vehicle(std::uint32_t)>&);
template std::vector<Snapshot<double>> settle(const FleetOptions&, std::size_t, double,
                                              const std::function<model::Vehicle(std::uint32_t)>&);

}  // namespace flappy::flight
