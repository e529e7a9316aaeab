#include "accuracy.hpp"

#include <cmath>

#include "flappy/batch.hpp"

namespace flappy::bench {
namespace {

sim::Batch<double> one_flapper(const model::Vehicle& vehicle, double step_s, sim::Start start) {
  sim::Batch<double> batch(1, vehicle, {.step_s = step_s, .threads = 1});
  batch.reset(0, {}, start);
  batch.set_input(0, {10, 0, 0, 0});
  return batch;
}

void advance(sim::Batch<double>& batch, double seconds, double step_s) {
  batch.step(static_cast<int>(std::lround(seconds / step_s)));
}

}  // namespace

Flight free_flight(const model::Vehicle& vehicle, double step_s) {
  sim::Batch<double> batch = one_flapper(vehicle, step_s, sim::Start::flying);
  advance(batch, 0.3, step_s);
  const sim::FlapperState s = batch.state(0);
  const auto [w, x, y, z] = s.attitude;
  const auto [cx, cy, cz] = vehicle.torso.com_m;
  return {s.position_m[0] + (1 - 2 * (y * y + z * z)) * cx + 2 * (x * y - w * z) * cy + 2 * (x * z + w * y) * cz,
          s.position_m[1] + 2 * (x * y + w * z) * cx + (1 - 2 * (x * x + z * z)) * cy + 2 * (y * z - w * x) * cz,
          s.position_m[2] + 2 * (x * z - w * y) * cx + 2 * (y * z + w * x) * cy + (1 - 2 * (x * x + y * y)) * cz};
}

double mean_thrust_N(const model::Vehicle& vehicle, double step_s) {
  sim::Batch<double> batch = one_flapper(vehicle, step_s, sim::Start::welded);
  advance(batch, 1, step_s);
  const double before = batch.held_impulse(0).force_N_s[2];
  const double beats = 17 / vehicle.driver.flapping_Hz;
  advance(batch, beats, step_s);
  return (batch.held_impulse(0).force_N_s[2] - before) / beats;
}

double distance_m(const Flight& a, const Flight& b) { return std::hypot(a.x_m - b.x_m, a.y_m - b.y_m, a.z_m - b.z_m); }

std::vector<StepRow> step_study(const model::Vehicle& vehicle) {
  const Flight fine = free_flight(vehicle, 5e-6);
  std::vector<StepRow> rows;
  for (const double us : {500, 250, 200, 125, 100, 50, 25, 20, 10, 5}) {
    const double step_s = us * 1e-6;
    rows.push_back({step_s, distance_m(free_flight(vehicle, step_s), fine), mean_thrust_N(vehicle, step_s)});
  }
  return rows;
}

}  // namespace flappy::bench
