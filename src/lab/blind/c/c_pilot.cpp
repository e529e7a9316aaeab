#include "lab/blind/c/c_pilot.hpp"

#include <algorithm>

#include "lab/blind/c/c_session.hpp"

namespace flappy::blind::c {
namespace {

constexpr double kMaxAcceleration = 4.5;
const Eigen::Vector3d kTurnHoldLimit(2.0, 2.5, 0.1);

Pilot::Gains changed(Pilot::Gains g, const SessionChange& day) {
  const std::array<double*, kPilotGains> all = {
      &g.climb_V_s2_m,    &g.place_1_s,     &g.speed_1_s,     &g.speed_hold_1_s2, &g.height_1_s,    &g.climb_1_s,
      &g.climb_hold_1_s2, &g.turn.x(),      &g.turn.y(),      &g.turn.z(),        &g.turn_rate.x(), &g.turn_rate.y(),
      &g.turn_rate.z(),   &g.turn_hold.x(), &g.turn_hold.y(), &g.turn_hold.z()};
  for (std::size_t i = 0; i < all.size(); ++i) *all[i] *= day.gains[i];
  return g;
}

}  // namespace

double wrapped(double angle) { return std::remainder(angle, 2 * M_PI); }

double heading_of(const Eigen::Matrix3d& R) { return std::atan2(R(1, 0), R(0, 0)); }

Eigen::Vector3d rotation_between(const Eigen::Matrix3d& from, const Eigen::Matrix3d& to) {
  const Eigen::AngleAxisd turn(Eigen::Matrix3d(from.transpose() * to));
  return turn.angle() * turn.axis();
}

Pilot::Pilot(const RobotParameters& parameters, const Assignment& a, std::size_t flight)
    : parameters_(&parameters), gains_(changed({}, session_change(a))), random_(a.seed, "pilot", stream_of(a, flight)) {
  beat_ticks_ = static_cast<std::size_t>(std::max(1.0, std::round(1 / (parameters.flapping_Hz * parameters.hold_s))));
  late_ticks_ = 2;
  past_.resize(beat_ticks_ + late_ticks_);
  trim_ = {kHover_V, 0, 0, 0};
}

void Pilot::look(const Motion& now, double tick_s) {
  // errors of an estimator: the position drifts slowly by some millimetres, the rates have a gyro's noise
  drift_ += -drift_ * tick_s / 2 + 2e-3 * std::sqrt(tick_s) * random_.normal3();
  const Eigen::Vector3d noise = 0.05 * random_.normal3();
  past_[next_] = {now.position_W + drift_, now.velocity_W, now.rate_B + noise, now.R_WB};
  next_ = (next_ + 1) % past_.size();
  filled_ = std::min(filled_ + 1, past_.size());
  if (filled_ < past_.size()) {
    view_ = {now.position_W, now.velocity_W, now.rate_B, now.R_WB};
    return;
  }
  View mean;
  mean.R_WB.setZero();
  for (std::size_t i = 0; i < beat_ticks_; ++i) {  // oldest first; the newest samples are still delayed
    const Sample& sample = past_[(next_ + i) % past_.size()];
    mean.velocity_W += sample.velocity_W;
    mean.rate_B += sample.rate_B;
    mean.R_WB += sample.R_WB;
  }
  mean.velocity_W /= static_cast<double>(beat_ticks_);
  mean.rate_B /= static_cast<double>(beat_ticks_);
  // averages are half a beat late, so the attitude is extrapolated by its rate; so is the position, by its delay
  const double late_s = tick_s * (0.5 * static_cast<double>(beat_ticks_) + static_cast<double>(late_ticks_));
  Eigen::Quaterniond q(Eigen::Matrix3d(mean.R_WB / static_cast<double>(beat_ticks_)));
  q.normalize();
  const Eigen::Vector3d lead = mean.rate_B * late_s;
  if (lead.norm() > 1e-9) q = q * Eigen::Quaterniond(Eigen::AngleAxisd(lead.norm(), lead.normalized()));
  mean.R_WB = q.toRotationMatrix();
  mean.position_W = past_[(next_ + past_.size() - 1 - late_ticks_) % past_.size()].position_W +
                    mean.velocity_W * tick_s * static_cast<double>(late_ticks_);
  view_ = mean;
}

void Pilot::carry(const Eigen::Vector3d& about_W, double turn_rad, const Eigen::Vector3d& shift_m) {
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const auto move = [&](Eigen::Vector3d& position, Eigen::Vector3d& velocity, Eigen::Matrix3d& R) {
    position = about_W + turn * (position - about_W) + shift_m;
    velocity = turn * velocity;
    R = turn * R;
  };
  for (Sample& sample : past_) move(sample.position_W, sample.velocity_W, sample.R_WB);
  move(view_.position_W, view_.velocity_W, view_.R_WB);
  drift_ = turn * drift_;
  hold_acceleration_ = turn * hold_acceleration_;
}

Inputs Pilot::fly(const Target& target, double tick_s) {
  Eigen::Vector3d speed = target.velocity_W + gains_.place_1_s * (target.position_W - view_.position_W);
  speed.z() = target.velocity_W.z() + gains_.height_1_s * (target.position_W.z() - view_.position_W.z());
  const double level = speed.head<2>().norm();
  if (level > 1.2) speed.head<2>() *= 1.2 / level;
  speed.z() = std::clamp(speed.z(), -0.5, 0.7);
  const Eigen::Vector3d error = speed - view_.velocity_W;
  Eigen::Vector3d wanted = gains_.speed_1_s * error + hold_acceleration_ + target.acceleration_W;
  wanted.z() = 0;
  if (wanted.norm() < kMaxAcceleration) {
    hold_acceleration_ += gains_.speed_hold_1_s2 * tick_s * error;
    hold_acceleration_ = hold_acceleration_.cwiseMax(-2.0).cwiseMin(2.0);
  } else {
    wanted *= kMaxAcceleration / wanted.norm();
  }
  climb_V_ = std::clamp(climb_V_ + gains_.climb_V_s2_m * gains_.climb_hold_1_s2 * error.z() * tick_s, -3.0, 5.0);

  const Eigen::Vector3d up = (wanted + Eigen::Vector3d(0, 0, Mechanism::kGravity_m_s2)).normalized();
  const Eigen::Vector3d nose(std::cos(target.heading_rad), std::sin(target.heading_rad), 0);
  Eigen::Matrix3d R;
  R.col(2) = up;
  R.col(1) = up.cross(nose).normalized();
  R.col(0) = R.col(1).cross(up);
  Eigen::Vector3d turn = rotation_between(view_.R_WB, R);
  turn = turn.cwiseMax(-0.7).cwiseMin(0.7);

  const Eigen::Vector3d rate = view_.rate_B;
  hold_turn_ =
      (hold_turn_ + gains_.turn_hold.cwiseProduct(turn) * tick_s).cwiseMax(-kTurnHoldLimit).cwiseMin(kTurnHoldLimit);
  const Eigen::Vector3d out = gains_.turn.cwiseProduct(turn) - gains_.turn_rate.cwiseProduct(rate) + hold_turn_;
  const double lean = std::max(0.5, view_.R_WB(2, 2));
  trim_ = {kHover_V + climb_V_, hold_turn_.x(), hold_turn_.y(), hold_turn_.z()};
  Inputs inputs = {
      (kHover_V + climb_V_ + gains_.climb_V_s2_m * (gains_.climb_1_s * error.z() + target.acceleration_W.z())) /
          std::sqrt(lean),
      out.x(), out.y(), out.z()};
  inputs.amplitude_V = std::clamp(inputs.amplitude_V, 6.0, 16.0);
  return clipped(inputs, *parameters_);
}

}  // namespace flappy::blind::c
