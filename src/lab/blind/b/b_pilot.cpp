#include "lab/blind/b/b_pilot.hpp"

#include <algorithm>
#include <cmath>

namespace flappy::blind::b {
namespace {

Eigen::Quaterniond turn_by(const Vector3d& rotation) {
  const double angle = rotation.norm();
  if (angle < 1e-12) return Eigen::Quaterniond::Identity();
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle, rotation / angle));
}

Vector3d rotation_of(const Eigen::Quaterniond& q) {
  const double sign = q.w() < 0 ? -1 : 1;
  return 2 * sign * q.vec();  // small-angle approximation
}

}  // namespace

double wrapped(double angle) { return angle - 2 * kPi * std::round(angle / (2 * kPi)); }

double heading_of(const Eigen::Quaterniond& attitude) {
  return std::atan2(2 * (attitude.w() * attitude.z() + attitude.x() * attitude.y()),
                    1 - 2 * (attitude.y() * attitude.y() + attitude.z() * attitude.z()));
}

Observer::Observer(const flightlog::FlightHeader& header, const Vector3d& position, double heading)
    : place_(header.imu.position_m[0], header.imu.position_m[1], header.imu.position_m[2]),
      late_ticks_(static_cast<std::size_t>(std::lround(header.mocap.latency_s / kTick_s))),
      period_s_(1 / header.mocap.rate_hz) {
  view_.position_m = position;
  view_.attitude = Eigen::Quaterniond(Eigen::AngleAxisd(heading, Vector3d::UnitZ()));
  last_.accel_m_s2 = Vector3d(0, 0, kGravity_m_s2);
  past_.fill(view_);
}

void Observer::correct(const MocapSample& frame) {
  const View& then = past_[(ticks_ + past_.size() - std::min(late_ticks_, past_.size() - 1)) % past_.size()];
  const Vector3d away = frame.position_m - then.position_m;
  const Vector3d turned = rotation_of(then.attitude.conjugate() * frame.attitude);
  // Up to 11 outliers in a row are rejected: after that the estimate is assumed to be wrong.
  if ((away.norm() > 0.025 || turned.norm() > 0.5) && ++refused_ < 12) return;
  refused_ = 0;
  const double position = 30 * period_s_, velocity = 350 * period_s_, attitude = 8 * period_s_, drift = 6 * period_s_;
  view_.position_m += position * away;
  view_.velocity_m_s += velocity * away;
  view_.attitude = (view_.attitude * turn_by(attitude * turned)).normalized();
  bias_ -= drift * turned;
}

void Observer::tick(Sensors& sensors, double now) {
  while (const auto sample = sensors.imu(now)) last_ = *sample;
  const Vector3d rate = last_.gyro_rad_s - bias_;
  const Vector3d lever = rate.cross(rate.cross(place_));
  const Vector3d acceleration = view_.attitude * (last_.accel_m_s2 - lever) - kGravity_m_s2 * Vector3d::UnitZ();
  view_.position_m += kTick_s * view_.velocity_m_s + 0.5 * kTick_s * kTick_s * acceleration;
  view_.velocity_m_s += kTick_s * acceleration;
  view_.attitude = (view_.attitude * turn_by(kTick_s * rate)).normalized();
  view_.rate_rad_s = rate;
  ++ticks_;
  past_[ticks_ % past_.size()] = view_;
  while (const auto frame = sensors.mocap(now)) correct(*frame);
}

double Pilot::Notch::operator()(double x, double frequency) {
  if (!begun) {
    x1 = x2 = y1 = y2 = x;
    begun = true;
  }
  const double w = std::tan(kPi * frequency * kPeriod_s), norm = 1 + w + w * w;
  const double y = ((1 + w * w) * (x + x2) + 2 * (w * w - 1) * (x1 - y1) - (1 - w + w * w) * y2) / norm;
  x2 = x1, x1 = x, y2 = y1, y1 = y;
  return y;
}

Beat Pilot::trim() const { return {lift_V_, roll_, pitch_, yaw_}; }

Beat Pilot::steer(const View& view, const Target& target) {
  Vector3d rate, velocity;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    rate[i] = rate_notch_[k](view.rate_rad_s[i], parameters_.flapping_Hz);
    velocity[i] = velocity_notch_[k](view.velocity_m_s[i], parameters_.flapping_Hz);
  }
  const double dt = kPeriod_s;
  const PilotGains& k = gains_;
  const double near_level = 2.2 * k.position, near_up = 4 * k.height;
  Vector3d wanted =
      target.velocity_m_s + Vector3d(near_level, near_level, near_up).cwiseProduct(target.position_m - view.position_m);
  const double level = wanted.head<2>().norm();
  if (level > 1.3) wanted.head<2>() *= 1.3 / level;
  wanted.z() = std::clamp(wanted.z(), -0.8, 0.8);
  const Vector3d error = wanted - velocity;
  held_acceleration_ += dt * Vector3d(1.2, 1.2, 0).cwiseProduct(error);
  held_acceleration_ = held_acceleration_.cwiseMax(-2.5).cwiseMin(2.5);
  Vector3d acceleration = 3.2 * k.velocity * Vector3d(1, 1, 0).cwiseProduct(error) + held_acceleration_;
  const double lean = acceleration.head<2>().norm();
  if (lean > 5) acceleration.head<2>() *= 5 / lean;

  Vector3d up = acceleration + kGravity_m_s2 * Vector3d::UnitZ();
  up.normalize();
  const Vector3d up_B = view.attitude.conjugate() * up;
  const double roll_error = std::clamp(-up_B.y(), -0.6, 0.6), pitch_error = std::clamp(up_B.x(), -0.6, 0.6);
  const double yaw_error = std::clamp(wrapped(target.heading_rad - heading_of(view.attitude)), -0.35, 0.35);
  lift_V_ = std::clamp(lift_V_ + dt * 7 * error.z(), 6.0, 15.0);
  roll_ = std::clamp(roll_ + dt * 2.5 * roll_error, -1.8, 1.8);
  pitch_ = std::clamp(pitch_ + dt * 3.0 * pitch_error, -2.5, 2.5);
  yaw_ = std::clamp(yaw_ + dt * 0.12 * yaw_error, -0.1, 0.1);
  const double upright = std::max(0.5, (view.attitude * Vector3d::UnitZ()).z());

  Beat b;
  b.amplitude_V = std::clamp((lift_V_ + 4.0 * k.climb * error.z()) / (0.5 + 0.5 * upright), 5.0, 17.0);
  b.difference_V = std::clamp(roll_ + 1.9 * k.roll * roll_error - 0.16 * k.roll_rate * rate.x(), -2.8, 2.8);
  b.bias_V = std::clamp(pitch_ + 3.0 * k.pitch * pitch_error - 0.28 * k.pitch_rate * rate.y(), -3.3, 3.3);
  b.split_cycle = std::clamp(yaw_ + 0.16 * k.yaw * yaw_error - 0.014 * k.yaw_rate * rate.z(), -0.12, 0.12);
  return b;
}

Programme::Programme(const Assignment& a, std::uint64_t flight, const RobotParameters& parameters,
                     const Surroundings& room)
    : proposed_(a.proposed) {
  if (proposed_) {
    const auto [x, y, z, facing] = proposed_->goal(0);
    legs_.push_back({-1e3, 1, Vector3d(x, y, z), facing});
    return;
  }
  Random random(a.seed, draw_number(flight, programme_session(a)), Stream::kProgramme);
  const double heading = random.uniform(-kPi, kPi);
  const double turn_rad_s = a.calm ? 0.25 : 3;
  double now = 0, facing = heading;
  Vector3d at = Vector3d::Zero();
  const auto go = [&](const Vector3d& to, double speed, double turn, double wait) {
    facing += turn;
    // The peak speed of a smooth leg is 1.875 times its mean.
    const double lasts = std::max({0.3, 1.875 * (to - at).norm() / speed, 1.875 * std::abs(turn) / turn_rad_s});
    legs_.push_back({now, lasts, to, facing});
    now += lasts + wait;
    at = to;
  };
  const auto about = [&](double x, double y, double z, double r) {
    const double to_y = y + random.uniform(-r, r), to_x = x + random.uniform(-r, r);
    return Vector3d(to_x, to_y, z);
  };
  if (a.hover || (a.calm && flight == 0)) {
    const std::array<double, 3> heights = {0.4, 0.8, 0.6};
    at = Vector3d(0, 0, heights[flight % 3]);
    legs_.push_back({-1e3, 1, at, heading});
    return;
  }
  if (a.calm) {
    // Far from all surfaces; flight 2 also rises and sinks.
    at = about(0, -0.2, 0.8, 0.1);
    legs_.push_back({-1e3, 1, at, heading});
    now = random.uniform(0.2, 0.8);
    while (now < 10.5) {
      const double height = flight == 2 ? random.uniform(0.5, 1.2) : at.z();
      const Vector3d next = about(-0.5 * at.x(), -0.2 - 0.5 * (at.y() + 0.2), height, 0.25);
      const double speed = random.uniform(0.1, 0.16);
      go(next, speed, random.uniform(-0.4, 0.4), 0.3);
    }
    return;
  }
  const double ceiling = room.ceiling_z_m - parameters.above_m, wall = room.wall_y_m - parameters.around_m;
  at = flight == 0   ? about(0, 0, 0.35, 0.1)
       : flight == 1 ? about(0, -0.2, ceiling - 0.4, 0.1)
                     : about(-0.4, wall - 0.4, 0.9, 0.1);
  legs_.push_back({-1e3, 1, at, heading});
  now = 0.3;
  const double turn = random.sign() * random.uniform(0.8, 1.6);
  const double speed = random.uniform(0.75, 1.0);
  if (flight == 0) {
    go(Vector3d(at.x(), at.y(), random.uniform(0.07, 0.10)), 0.35, 0, 0.7);
    go(about(at.x() + 0.25, at.y(), random.uniform(0.06, 0.09), 0.05), 0.4, turn, 0.5);
    go(about(at.x() - 0.1, at.y() + 0.2, 0.16, 0.05), 0.4, 0, 0.3);
    go(about(at.x() - 0.7, at.y() - 0.4, 0.7, 0.1), speed, 0, 0.2);
    go(about(at.x() + 0.8, at.y() + 0.1, 0.8, 0.1), speed, -turn, 0.2);
  } else if (flight == 1) {
    go(Vector3d(at.x(), at.y(), ceiling - random.uniform(0.05, 0.08)), 0.35, 0, 0.7);
    go(about(at.x() - 0.25, at.y(), ceiling - random.uniform(0.05, 0.08), 0.05), 0.4, turn, 0.5);
    go(about(at.x(), at.y() - 0.2, ceiling - 0.2, 0.05), 0.4, 0, 0.2);
    go(about(at.x() + 0.8, at.y(), 1.1, 0.1), speed, 0, 0.2);
    go(about(at.x() - 0.5, at.y() - 0.4, 0.6, 0.1), speed, -turn, 0.2);
  } else {
    go(Vector3d(at.x(), wall - random.uniform(0.13, 0.16), 0.9), 0.35, 0, 0.7);
    go(Vector3d(at.x() + 0.5, at.y(), 1.0), 0.5, turn, 0.4);
    go(about(at.x(), wall - 0.3, 0.8, 0.03), 0.4, 0, 0.1);
    go(about(at.x() - 0.9, at.y() - 0.6, 1.2, 0.1), speed, 0, 0.2);
    go(about(at.x() + 0.9, at.y() - 0.4, 1.2, 0.1), speed, -turn, 0.2);
  }
  while (now < 10.5) {
    const Vector3d next =
        about(-0.4 * at.x(), flight == 2 ? -0.3 : 0.0, std::clamp(at.z() + random.uniform(-0.3, 0.3), 0.4, 1.5), 0.3);
    go(next, speed, random.uniform(-1, 1), 0.2);
  }
  const std::array<double, 4> share = {0.35, 0.16, 0.2, 0.012};
  for (std::size_t input = 0; input < 4; ++input)
    for (int n = 0; n < 5; ++n) {
      const double frequency = 0.9 * std::pow(9.5, (n + random.uniform()) / 5);
      // Slow tones would displace the robot, so they are weaker below 3 Hz.
      tones_[input].push_back({share[input] * std::min(1.0, frequency / 3), frequency, random.uniform(0, 2 * kPi)});
    }
  for (double t = 1 + random.uniform(); t < 9.5; t += random.uniform(0.5, 0.9)) {
    const std::size_t input = random.below(4);
    const std::array<double, 4> size = {1.2, 0.6, 0.8, 0.05};
    pulses_.push_back({t, random.uniform(0.03, 0.09), input, random.sign() * size[input] * random.uniform(0.6, 1)});
  }
}

Target Programme::target(double time) const {
  if (proposed_) {
    constexpr double kApart_s = 2e-3;
    const double now = std::max(0.0, time);
    const auto goal = proposed_->goal(now), next = proposed_->goal(now + kApart_s);
    const Vector3d at(goal[0], goal[1], goal[2]), to(next[0], next[1], next[2]);
    return {at, time < 0 ? Vector3d::Zero() : Vector3d((to - at) / kApart_s), goal[3]};
  }
  const Leg* leg = &legs_.front();
  const Leg* before = leg;
  for (const Leg& next : legs_)
    if (time >= next.begins_s) before = leg, leg = &next;
  if (leg == &legs_.front()) return {leg->to, Vector3d::Zero(), leg->heading};
  // Polynomial of fifth degree from rest to rest.
  const double x = std::clamp((time - leg->begins_s) / leg->lasts_s, 0.0, 1.0);
  const double s = x * x * x * (10 + x * (-15 + 6 * x)), rate = 30 * x * x * (1 - x) * (1 - x) / leg->lasts_s;
  const Vector3d way = leg->to - before->to;
  return {before->to + s * way, rate * way, before->heading + s * (leg->heading - before->heading)};
}

Beat Programme::excitation(double time) const {
  if (proposed_) {
    const auto [amplitude, difference, bias, split] = proposed_->excitation(time);
    return {amplitude, difference, bias, split};
  }
  std::array<double, 4> u{};
  const double fade = std::clamp(time, 0.0, 1.0);
  for (std::size_t i = 0; i < 4; ++i)
    for (const Tone& t : tones_[i])
      u[i] += fade * t.amplitude * std::sin(2 * kPi * t.frequency_hz * time + t.phase_rad);
  for (const Pulse& p : pulses_)
    if (time >= p.at_s && time < p.at_s + p.lasts_s) u[p.input] += p.size;
  return {u[0], u[1], u[2], u[3]};
}

}  // namespace flappy::blind::b
