#include "rollout/flight_score.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "model/math.hpp"

namespace flappy::rollout {

const char* name_of(FlightFailure failure) {
  static constexpr const char* kNames[kFlightFailures] = {
      "none", "frozen", "touched_ground", "touched_wall_or_ceiling", "tipped_over", "drifted_away", "never_took_off"};
  return kNames[static_cast<std::size_t>(failure)];
}

Errors errors_of(const flight::Motion& truth, const flight::Target& target) {
  const auto& [w, x, y, z] = truth.attitude;
  const double r00 = 1 - 2 * (y * y + z * z), r10 = 2 * (x * y + w * z);
  const double r20 = 2 * (x * z - w * y), r21 = 2 * (y * z + w * x), r22 = 1 - 2 * (x * x + y * y);
  const double aside = target.heading_cos * r10 - target.heading_sin * r00;
  const double facing = target.heading_cos * r00 + target.heading_sin * r10;
  return {model::atan2(r21, r22),
          -model::asin(std::clamp(r20, -1.0, 1.0)),
          model::atan2(aside, facing),
          truth.position_m[0] - target.position_m[0],
          truth.position_m[1] - target.position_m[1],
          truth.position_m[2] - target.position_m[2]};
}

void FlightScore::add(const flight::Motion& truth, const flight::Target& target, std::uint32_t status, double t_s,
                      bool is_settled) {
  const Errors e = errors_of(truth, target);
  for (std::size_t k = 0; k < e.size(); ++k) {
    whole[k] += e[k] * e[k];
    if (is_settled) settled[k] += e[k] * e[k];
  }
  ++ticks;
  settled_ticks += is_settled;

  static const double kTippedCos = model::sin_cos_wide(kTippedOver_rad).cos;
  const double upright = 1 - 2 * (truth.attitude[1] * truth.attitude[1] + truth.attitude[2] * truth.attitude[2]);
  const bool far = e[3] * e[3] + e[4] * e[4] + e[5] * e[5] > kFarAway_m * kFarAway_m;
  const auto& v = truth.velocity_m_s;
  const bool held = v[0] == 0 && v[1] == 0 && v[2] == 0;  // velocity is exactly 0 while something supports the body
  crashed = crashed || (status & (sim::kFrozen | sim::kTouchedGround)) != 0;
  far_away = far_away || far;
  if (failure == FlightFailure::never_took_off && !held) failure = FlightFailure::drifted_away;  // took off late
  if (failure != FlightFailure::none) return;
  if (status & sim::kFrozen) failure = FlightFailure::frozen;
  else if (status & sim::kTouchedGround) failure = FlightFailure::touched_ground;
  else if (status) failure = FlightFailure::touched_wall_or_ceiling;
  else if (upright < kTippedCos) failure = FlightFailure::tipped_over;
  else if (far) failure = held ? FlightFailure::never_took_off : FlightFailure::drifted_away;
  failed_s = t_s;
}

FlightSummary summarise(std::span<const FlightScore> flights) {
  FlightSummary s;
  s.flights = flights.size();
  std::array<std::vector<std::pair<double, std::size_t>>, kFlightFailures> when;  // [failure]: time and flight
  std::size_t within = 0, settled_ticks = 0, ticks = 0;
  for (std::size_t i = 0; i < flights.size(); ++i) {
    const FlightScore& f = flights[i];
    s.crashed += f.crashed;
    within += f.ticks > 0 && !f.crashed && !f.far_away;
    if (f.failure != FlightFailure::none) when[static_cast<std::size_t>(f.failure)].push_back({f.failed_s, i});
    if (f.crashed) continue;
    settled_ticks += f.settled_ticks;
    ticks += f.ticks;
    for (std::size_t k = 0; k < s.settled.size(); ++k) s.settled[k] += f.settled[k], s.takeoff[k] += f.whole[k];
    if (f.settled_ticks == 0) continue;
    Errors& rms = s.each.emplace_back(f.settled);
    for (double& e : rms) e = std::sqrt(e / static_cast<double>(f.settled_ticks));
  }
  for (double& sum : s.settled) sum = std::sqrt(sum / static_cast<double>(settled_ticks));
  for (double& sum : s.takeoff) sum = std::sqrt(sum / static_cast<double>(ticks));
  s.within_share = static_cast<double>(within) / static_cast<double>(flights.size());
  for (std::size_t k = 0; k < kFlightFailures; ++k) {
    auto& t = when[k];
    if (t.empty()) continue;
    std::ranges::sort(t);
    s.failures[k] = {t.size(), t.front().second, t.front().first, t[t.size() / 2].first, t.back().first};
    s.failed += t.size();
  }
  return s;
}

}  // namespace flappy::rollout
