#include "accuracy.hpp"

#include <algorithm>
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

/// Rms difference of the angles of both wings.
double apart_rad(const std::vector<std::array<double, 2>>& a, const std::vector<std::array<double, 2>>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t side = 0; side < 2; ++side) sum += std::pow(a[i][side] - b[i][side], 2);
  return std::sqrt(sum / static_cast<double>(2 * a.size()));
}

void advance(sim::Batch<double>& batch, double seconds, double step_s) {
  batch.step(static_cast<int>(std::lround(seconds / step_s)));
}

}  // namespace

Flight free_flight(const model::Vehicle& vehicle, double step_s) {
  sim::Batch<double> batch = one_flapper(vehicle, step_s, sim::Start::flying);
  std::vector<std::array<double, 2>> stroke_rad, rotation_rad;
  for (int ms = 0; ms < 300; ++ms) {
    advance(batch, 1e-3, step_s);
    const sim::FlapperState s = batch.state(0);
    stroke_rad.push_back({s.stroke_rad[0], s.stroke_rad[1]});
    rotation_rad.push_back({s.rotation_rad[0], s.rotation_rad[1]});
  }
  const sim::FlapperState s = batch.state(0);
  const auto [w, x, y, z] = s.attitude;
  const auto [cx, cy, cz] = vehicle.torso.com_m;
  return {s.position_m[0] + (1 - 2 * (y * y + z * z)) * cx + 2 * (x * y - w * z) * cy + 2 * (x * z + w * y) * cz,
          s.position_m[1] + 2 * (x * y + w * z) * cx + (1 - 2 * (x * x + z * z)) * cy + 2 * (y * z - w * x) * cz,
          s.position_m[2] + 2 * (x * z - w * y) * cx + 2 * (y * z + w * x) * cy + (1 - 2 * (x * x + y * y)) * cz,
          {w, x, y, z},
          stroke_rad,
          rotation_rad};
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

double turn_rad(const Flight& a, const Flight& b) {
  double minus = 0, plus = 0;  // q and -q are the same attitude
  for (std::size_t i = 0; i < 4; ++i) {
    minus += std::pow(a.attitude[i] - b.attitude[i], 2);
    plus += std::pow(a.attitude[i] + b.attitude[i], 2);
  }
  return 4 * std::asin(std::sqrt(std::min(minus, plus)) / 2);
}

std::vector<StepRow> step_study(const model::Vehicle& vehicle) {
  const Flight fine = free_flight(vehicle, 5e-6);
  std::vector<StepRow> rows;
  for (const double us : {500, 250, 200, 125, 100, 50, 25, 20, 10, 5}) {
    const double step_s = us * 1e-6;
    const Flight flight = free_flight(vehicle, step_s);
    rows.push_back({step_s, distance_m(flight, fine), turn_rad(flight, fine),
                    apart_rad(flight.stroke_rad, fine.stroke_rad), apart_rad(flight.rotation_rad, fine.rotation_rad),
                    mean_thrust_N(vehicle, step_s)});
  }
  return rows;
}

}  // namespace flappy::bench
