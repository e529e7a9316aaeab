#include "rollout/outcome.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "io/statistics.hpp"
#include "model/math.hpp"
#include "rollout/flight_score.hpp"
#include "sim/storage.hpp"

namespace flappy::rollout {
namespace {

using flight::Motion;
using flight::Target;

constexpr double kTick = 1e-6;  // tolerance in s for rounding of times that are whole control ticks

double length(const double (&a)[3], const double (&b)[3] = {0, 0, 0}) {
  const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
  return std::sqrt(x * x + y * y + z * z);
}

/// Quantities of the true state that are judged, relative to the set point.
struct Seen {
  double distance_m, speed_m_s, body_rate_rad_s, upright;  // upright: cosine of tilt
  double facing, aside;  // horizontal components of the body's x axis along and left of the set point's heading
  double heading_cos() const { return facing / std::sqrt(std::max(facing * facing + aside * aside, 1e-12)); }
};

Seen seen(const Motion& m, const Target& goal) {
  const auto& [w, x, y, z] = m.attitude;
  const double r00 = 1 - 2 * (y * y + z * z), r10 = 2 * (x * y + w * z);
  return {length(m.position_m, goal.position_m),
          length(m.velocity_m_s, goal.velocity_m_s),
          length(m.body_rate_rad_s),
          1 - 2 * (x * x + y * y),
          goal.heading_cos * r00 + goal.heading_sin * r10,
          goal.heading_cos * r10 - goal.heading_sin * r00};
}

/// About the ratio of an angle to its limit, from their cosines; exactly 1 at the limit.
double angle_share(double cos, double limit_cos) { return std::sqrt(std::max(0.0, 1 - cos) / (1 - limit_cos)); }

std::size_t largest(std::span<const double> list) {
  return static_cast<std::size_t>(std::ranges::max_element(list) - list.begin());
}

Quantiles quantiles(const std::vector<double>& list) {
  if (list.empty()) return {};
  return {io::quantile(list, 0.1), io::median(list), io::quantile(list, 0.9)};
}

}  // namespace

const char* name_of(TaskFailure failure) {
  static constexpr const char* kNames[kTaskFailures] = {"none",          "not_finite", "crashed",
                                                        "out_of_bounds", "too_late",   "never_captured",
                                                        "lost_position", "lost_tilt",  "lost_heading"};
  return kNames[static_cast<std::size_t>(failure)];
}

const char* name_of(Demand demand) {
  static constexpr const char* kNames[kDemands] = {"distance", "speed", "body_rate", "tilt", "heading"};
  return kNames[static_cast<std::size_t>(demand)];
}

bool Outcome::success() const {
  return captured_s > 0 && lost_s == 0 && status == 0 && (ended & ~std::uint32_t{flight::kTimeOut}) == 0;
}

OutcomeMonitor::OutcomeMonitor(const flight::Task& task, const Motion& start, const Target& goal)
    : success_(task.constants.success) {
  const double far = length(goal.position_m, start.position_m);
  for (int i = 0; i < 3; ++i) way_[i] = far > 0 ? (goal.position_m[i] - start.position_m[i]) / far : 0;
}

void OutcomeMonitor::see(const Motion& truth, const Target& goal, double t_s, const Outcome& so_far) {
  const Seen s = seen(truth, goal);
  const flight::Success<double>& k = success_;
  position_error_m_ = s.distance_m;
  facing_ = s.facing, aside_ = s.aside;
  if (strict_s_ == 0 && s.distance_m < kStrictDistance_m && s.speed_m_s < kStrictSpeed_m_s &&
      s.body_rate_rad_s < kStrictBodyRate_rad_s && s.upright > kStrictCos && s.heading_cos() > kStrictCos)
    strict_s_ = t_s;

  const bool captured = so_far.captured_s > 0, in_time = t_s < k.by_s + kTick;
  if (!captured && in_time) {
    const double shares[kDemands] = {s.distance_m / k.distance_m, s.speed_m_s / k.speed_m_s,
                                     s.body_rate_rad_s / k.body_rate_rad_s, angle_share(s.upright, k.tilt_cos),
                                     angle_share(s.heading_cos(), k.heading_cos)};
    const std::size_t worst = largest(shares);
    if (shares[worst] < least_) least_ = shares[worst], missing_ = static_cast<Demand>(worst);
  }
  // overshoot: distance beyond the goal along the line from start to goal, from the capture to keep_from_s
  if (captured && t_s < k.keep_from_s + kTick) {
    double beyond = 0;
    for (int i = 0; i < 3; ++i) beyond += way_[i] * (truth.position_m[i] - goal.position_m[i]);
    overshoot_m_ = std::max(overshoot_m_, beyond);
  }

  if (failure_ != TaskFailure::none) return;
  constexpr std::uint32_t kLate = flight::kHeadingLate | flight::kArrivalLate;
  if ((so_far.status & sim::kFrozen) != 0) failure_ = TaskFailure::not_finite;
  else if (so_far.status != 0) failure_ = TaskFailure::crashed;
  else if ((so_far.ended & flight::kOutOfBounds) != 0) failure_ = TaskFailure::out_of_bounds;
  else if ((so_far.ended & kLate) != 0) failure_ = TaskFailure::too_late;
  else if (!captured && !in_time) failure_ = TaskFailure::never_captured;
  else if (so_far.lost_s > 0) {
    const double shares[] = {s.distance_m / k.keep_distance_m, angle_share(s.upright, k.keep_tilt_cos),
                             angle_share(s.heading_cos(), k.keep_heading_cos)};
    failure_ = static_cast<TaskFailure>(static_cast<std::size_t>(TaskFailure::lost_position) + largest(shares));
  }
}

bool OutcomeMonitor::manoeuvring(double t_s) const { return !handed_back_ && t_s < success_.by_s + kTick; }

void OutcomeMonitor::spend(double energy_J, double period_s, bool handed_back) {
  energy_J_ += energy_J;
  manoeuvre_s_ += period_s;
  handed_back_ = handed_back;
}

void OutcomeMonitor::finish(Outcome& outcome) const {
  outcome.failure = failure_ == TaskFailure::none && outcome.captured_s == 0 ? TaskFailure::never_captured : failure_;
  outcome.missing = missing_;
  outcome.strict_s = strict_s_;
  outcome.overshoot_m = overshoot_m_;
  outcome.position_error_m = position_error_m_;
  outcome.heading_error_rad = std::abs(model::atan2(aside_, facing_));
  outcome.energy_J = energy_J_;
  outcome.manoeuvre_s = manoeuvre_s_;
}

Rate rate_of(std::size_t successes, std::size_t flights) {
  if (flights == 0) return {};
  const io::Interval interval = io::wilson_interval(successes, flights);
  return {static_cast<double>(successes) / static_cast<double>(flights), interval.low, interval.high};
}

Summary summarise(std::span<const Outcome> flights) {
  Summary s;
  s.flights = flights.size();
  std::size_t successes = 0, strict = 0;
  std::vector<double> capture, strict_s, overshoot, position, heading, energy, power;
  for (const Outcome& o : flights) {
    successes += o.success();
    strict += o.strict_s > 0;
    if (o.captured_s > 0) {
      capture.push_back(o.captured_s);
      overshoot.push_back(o.overshoot_m);
    } else if (o.failure == TaskFailure::never_captured) {
      ++s.missing[static_cast<std::size_t>(o.missing)];
    }
    strict_s.push_back(o.strict_s > 0 ? o.strict_s : std::numeric_limits<double>::infinity());
    position.push_back(o.position_error_m);
    heading.push_back(o.heading_error_rad);
    if (!std::isnan(o.energy_J)) energy.push_back(o.energy_J);
    if (!std::isnan(o.energy_J) && o.manoeuvre_s > 0) power.push_back(o.energy_J / o.manoeuvre_s);
    ++s.failures[static_cast<std::size_t>(o.failure)];
    for (const double x : {o.captured_s, o.lost_s, o.strict_s, o.overshoot_m, o.position_error_m, o.heading_error_rad,
                           o.energy_J, o.manoeuvre_s})
      s.hash = sim::mixed(s.hash, sim::bits_of(x));
    for (const std::uint64_t word :
         {std::uint64_t{o.status}, std::uint64_t{o.ended}, static_cast<std::uint64_t>(o.failure),
          static_cast<std::uint64_t>(o.missing), o.hash})
      s.hash = sim::mixed(s.hash, word);
  }
  s.success = rate_of(successes, s.flights);
  s.captured = rate_of(capture.size(), s.flights);
  s.strict = rate_of(strict, s.flights);
  s.capture_s = quantiles(capture);
  s.strict_s = quantiles(strict_s);
  s.overshoot_m = quantiles(overshoot);
  s.position_error_m = quantiles(position);
  s.heading_error_rad = quantiles(heading);
  s.energy_J = quantiles(energy);
  s.power_W = quantiles(power);
  return s;
}

}  // namespace flappy::rollout
