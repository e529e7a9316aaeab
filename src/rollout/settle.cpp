#include "rollout/settle.hpp"

#include <algorithm>
#include <cmath>

#include "model/derive.hpp"

namespace flappy::rollout {
namespace {

/// At the origin, released in the air: on a support a controller would accept too little thrust.
flight::Task staying() {
  flight::Task task;
  task.name = "settle";
  task.start.kind = sim::Start::flying;
  task.path.push_back({0, {}});
  task.constants.limits = {1e9, -1e9, 1e9, 1e9, 1e9, 1e9, 1e9, 1e9, -1e9};
  return task;
}

/// The places of a world belong to the task, not to the hover at the origin: removes shapes, and moves surfaces so far away that the
/// air does not feel them.
void clear_origin(sim::World& world) {
  constexpr double kClear_m = 0.5;
  world.shapes.clear();
  world.ground_z_m = std::min(world.ground_z_m, -kClear_m);
  world.ceiling_z_m = std::max(world.ceiling_z_m, kClear_m);
  for (sim::Wall& w : world.walls) {
    const double missing_m = kClear_m + w.normal_x * w.x_m + w.normal_y * w.y_m;
    if (missing_m <= 0) continue;
    w.x_m -= missing_m * w.normal_x;
    w.y_m -= missing_m * w.normal_y;
  }
}

}  // namespace

template <class T>
std::vector<flight::Snapshot<T>> settle(const flight::FleetOptions& options, std::size_t count, double seconds,
                                        const std::function<model::Vehicle(std::uint32_t flapper)>& vehicle) {
  std::vector<flight::Snapshot<T>> list(count);
  if (count == 0) return list;
  flight::FleetOptions o = options;
  o.task = staying();
  clear_origin(o.batch.world);
  flight::Fleet<T> fleet(count, vehicle(o.first_flapper), o);
  const long settled = std::lround(seconds / fleet.period_s());
  std::vector<long> taken_at(count);  // control tick of each snapshot, spread over one beat
  for (std::size_t i = 0; i < count; ++i) {
    const model::Vehicle v = vehicle(o.first_flapper + static_cast<std::uint32_t>(i));
    fleet.set_vehicle(i, v);
    fleet.start(i, 0);
    const auto phases = std::max(1L, static_cast<long>(std::ceil(1 / model::beats_Hz(v) / fleet.period_s())));
    taken_at[i] = settled + static_cast<long>((o.first_flapper + i) % static_cast<std::size_t>(phases));
  }
  const long last = std::ranges::max(taken_at);
  for (long tick = 0; tick <= last; ++tick) {
    fleet.step();
    for (std::size_t i = 0; i < count; ++i)
      if (tick == taken_at[i]) list[i] = fleet.snapshot(i);
  }
  return list;
}

template std::vector<flight::Snapshot<float>> settle(const flight::FleetOptions&, std::size_t, double,
                                                     const std::function<model::Vehicle(std::uint32_t)>&);
template std::vector<flight::Snapshot<double>> settle(const flight::FleetOptions&, std::size_t, double,
                                                      const std::function<model::Vehicle(std::uint32_t)>&);

}  // namespace flappy::rollout
