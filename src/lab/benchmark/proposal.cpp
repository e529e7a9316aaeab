#include "lab/benchmark/proposal.hpp"

#include <algorithm>

namespace flappy::benchmark {
namespace {

std::array<double, 4> on_path(const std::vector<flight::Segment<double>>& path, double tick_s, double t_s) {
  const auto next = std::ranges::find_if(
      path.begin() + 1, path.end(), [&](const auto& s) { return static_cast<double>(s.start_tick) * tick_s > t_s; });
  const flight::Segment<double>& now = *(next - 1);
  const double t = std::max(0.0, t_s - static_cast<double>(now.start_tick) * tick_s);
  std::array<double, 4> at{};
  for (std::size_t c = 0; c < at.size(); ++c)
    for (int n = 5; n >= 0; --n) at[c] = at[c] * t + now.coefficients[c][n];
  return at;
}

/// A surface that is farther away does not exist.
constexpr double kNone_m = 500;

std::array<double, 3> moved_by(const sim::World& own, const flightlog::LogAmbient& room) {
  std::array<double, 3> by{0, 0, room.ground_z_m - own.ground_z_m};
  if (own.ceiling_z_m < kNone_m) by[2] = room.ceiling_z_m - own.ceiling_z_m;
  if (!own.walls.empty() && !room.walls.empty()) {
    const sim::Wall& from = own.walls.front();
    const auto& to = room.walls.front();
    const double along = (to.x_m - from.x_m) * from.normal_x + (to.y_m - from.y_m) * from.normal_y;
    by[0] = along * from.normal_x, by[1] = along * from.normal_y;
  }
  return by;
}

}  // namespace

blind::ProposedFlight proposed_flight(const gap::Manoeuvre& manoeuvre, const flightlog::FlightHeader& header) {
  const rollout::FlyConfig& c = manoeuvre.config;
  const std::array<double, 3> by = moved_by(c.fleet.batch.world, header.ambient);
  const double from_s = c.settle_s, tick_s = 1 / c.fleet.control_hz;
  return {c.duration_s - from_s,
          [&c, by, from_s, tick_s](double t_s) {
            std::array<double, 4> at = on_path(c.fleet.task.path, tick_s, from_s + t_s);
            for (std::size_t i = 0; i < by.size(); ++i) at[i] += by[i];
            return at;
          },
          [&c, from_s](double t_s) {
            const sim::Input u = c.excitation.at(from_s + t_s);
            return std::array<double, 4>{u.amplitude_V, u.difference_V, u.bias_V, u.split_cycle};
          }};
}

}  // namespace flappy::benchmark
