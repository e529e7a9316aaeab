// Rich flights visit one surface (0 ground, 1 ceiling, 2 wall) between legs through free air. Excitation: random levels
// of 0.2 s each, plus two tones below the beat's frequency. Calm flights 1 and 2 stray through free air.
#include "lab/blind/c/programme.hpp"

#include <algorithm>

#include "lab/blind/c/c_air.hpp"
#include "lab/blind/c/c_session.hpp"

namespace flappy::blind::c {
namespace {

constexpr double kLevel_s = 0.2;
constexpr std::array<double, 4> kLevels = {1.0, 0.4, 0.45, 0.035},
                                kTones = {0.4, 0.15, 0.15, 0.012};  // V, V, V, split cycle

double smooth(double x) { return x * x * x * (10 + x * (6 * x - 15)); }
double smooth_rate(double x) { return 30 * x * x * (1 - x) * (1 - x); }
double smooth_bend(double x) { return 60 * x * (1 - x) * (1 - 2 * x); }

}  // namespace

Programme::Programme(const Assignment& a, std::size_t flight, const RobotParameters& parameters)
    : proposed_(a.proposed), quiet_(a.hover || a.calm) {
  if (proposed_) {
    const auto goal = proposed_->goal(0);
    const Eigen::Vector3d at(goal[0], goal[1], goal[2]);
    legs_.push_back({-1e3, 0, at, at, goal[3], goal[3]});
    return;
  }
  Random random(a.seed, "programme", programme_stream_of(a, flight));
  const bool hover = a.hover || (a.calm && flight == 0);
  const double height = random.uniform(0.5, 1.0), heading = random.uniform(-0.6, 0.6);
  const double start_z = hover ? random.uniform(0.4, 1.4) : height;
  const double start_y = random.uniform(-0.3, 0.2), start_x = random.uniform(-0.3, 0.3);
  Eigen::Vector3d start(start_x, start_y, start_z);
  if (!quiet_ && flight == 1) start.z() += 0.5;
  if (!quiet_ && flight == 2) start.y() += 0.3;
  legs_.push_back({-1e3, 0.4, start, start, heading, heading});
  if (hover) return;
  if (quiet_) {
    while (legs_.back().until_s < Family::kFlight_s) {
      const double x = random.uniform(-0.6, 0.6), y = random.uniform(-0.5, 0.4), z = random.uniform(0.5, 1.5);
      const double far = random.uniform(0.2, 0.4), turn = random.uniform(-0.6, 0.6), speed = random.uniform(0.1, 0.2);
      const Eigen::Vector3d from = legs_.back().to_W, way = Eigen::Vector3d(x, y, z) - from;
      const double part = std::min(far, way.norm());  // a short leg is slower, so none takes less than 2.3 s
      add_leg(from + part * way.normalized(), legs_.back().to_heading + turn, std::min(speed, 0.8 * part), 0.3);
    }
    return;
  }
  const auto near = [&] {
    const double close = random.uniform(0.03, 0.10);
    const double z = random.uniform(0.5, 1.5), y = random.uniform(-0.5, 0.4), x = random.uniform(-0.6, 0.6);
    Eigen::Vector3d at(x, y, z);
    if (flight == 0) at.z() = Room::kGround_m + parameters.below_m + close;
    if (flight == 1) at.z() = Room::kCeiling_m - parameters.above_m - 0.01 - close;
    if (flight == 2) at.y() = Room::kWall_m - parameters.around_m - 0.03 - close;
    return at;
  };
  const double fast = random.uniform(0.8, 1.0);
  while (legs_.back().until_s < Family::kFlight_s) {
    const double turn = random.uniform(-2.2, 2.2);
    const Eigen::Vector3d surface = near();
    add_leg(surface, legs_.back().to_heading + turn, random.uniform(0.5, 0.8));
    // along the surface, then away through free air and back
    Eigen::Vector3d along = near();
    if (flight != 2) along.z() = surface.z();
    else along.y() = surface.y();
    add_leg(along, legs_.back().to_heading + random.uniform(-1.0, 1.0), random.uniform(0.25, 0.5));
    const double way = random.uniform(0, 2 * M_PI), far = random.uniform(0.6, 0.9);
    Eigen::Vector3d away = start + far * Eigen::Vector3d(std::cos(way), std::min(0.4, std::sin(way)), 0);
    away.z() = std::clamp(random.uniform(0.4, 1.5), 0.3, 1.6);
    add_leg(away, legs_.back().to_heading + random.uniform(-1.5, 1.5), fast);
  }
  for (std::size_t input = 0; input < 4; ++input) {
    for (double t = 0; t < Family::kFlight_s + kLevel_s; t += kLevel_s)
      levels_[input].push_back(kLevels[input] * random.uniform(-1, 1));
    for (int i = 0; i < 2; ++i) {
      const double frequency = random.uniform(1.5, 9);
      tones_[input].push_back({frequency, random.uniform(0, 2 * M_PI)});
    }
  }
}

void Programme::add_leg(const Eigen::Vector3d& to_W, double heading, double speed_m_s, double turn_rad_s) {
  const Leg& last = legs_.back();
  const double mean_m_s = speed_m_s / smooth_rate(0.5);  // the speed is highest half way
  const double takes_s = std::max({0.6, (to_W - last.to_W).norm() / mean_m_s,
                                   std::abs(heading - last.to_heading) * smooth_rate(0.5) / turn_rad_s,
                                   std::abs(to_W.z() - last.to_W.z()) * smooth_rate(0.5) / 0.45});
  legs_.push_back({last.until_s, last.until_s + takes_s, last.to_W, to_W, last.to_heading, heading});
}

Target Programme::target(double t_s) const {
  if (proposed_ && t_s >= 0) {
    constexpr double kApart_s = 1e-3;
    const auto at = [&](double t) {
      const auto goal = proposed_->goal(t);
      return Eigen::Vector4d(goal[0], goal[1], goal[2], goal[3]);
    };
    const Eigen::Vector4d now = at(t_s), after = at(t_s + kApart_s), later = at(t_s + 2 * kApart_s);
    Target target;
    target.position_W = now.head<3>();
    target.velocity_W = (after - now).head<3>() / kApart_s;
    target.acceleration_W = (later - 2 * after + now).head<3>() / (kApart_s * kApart_s);
    target.heading_rad = now[3];
    return target;
  }
  const Leg* leg = &legs_.back();
  for (const Leg& one : legs_)
    if (t_s < one.until_s) {
      leg = &one;
      break;
    }
  const double takes_s = leg->until_s - leg->from_s, x = std::clamp((t_s - leg->from_s) / takes_s, 0.0, 1.0);
  Target target;
  target.position_W = leg->from_W + smooth(x) * (leg->to_W - leg->from_W);
  target.velocity_W = smooth_rate(x) / takes_s * (leg->to_W - leg->from_W);
  target.acceleration_W = smooth_bend(x) / (takes_s * takes_s) * (leg->to_W - leg->from_W);
  target.heading_rad = leg->from_heading + smooth(x) * (leg->to_heading - leg->from_heading);
  return target;
}

Inputs Programme::excitation(double t_s) const {
  if (t_s < 0) return {};
  if (proposed_) {
    const auto [amplitude, difference, bias, split] = proposed_->excitation(t_s);
    return {amplitude, difference, bias, split};
  }
  if (quiet_) return {};
  std::array<double, 4> sum{};
  for (std::size_t input = 0; input < 4; ++input) {
    const std::size_t level = std::min(static_cast<std::size_t>(t_s / kLevel_s), levels_[input].size() - 1);
    sum[input] = levels_[input][level];
    for (const Tone& tone : tones_[input])
      sum[input] += kTones[input] * std::sin(2 * M_PI * tone.frequency_Hz * t_s + tone.phase);
  }
  // near the wall, inputs that push sideways are reduced to as little as 30 %
  const double free_m = Room::kWall_m - target(t_s).position_W.y() - 0.15, calm = std::clamp(free_m / 0.3, 0.3, 1.0);
  return {sum[0], calm * sum[1], calm * sum[2], calm * sum[3]};
}

}  // namespace flappy::blind::c
