#include "flightlog/smoother.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "flightlog/readings.hpp"
#include "flightlog/rotation.hpp"

namespace flappy::flightlog {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kPi = std::numbers::pi;
/// Standard deviations in no header: bias of a consumer accelerometer (BMI088: 20 mg), drifts, initial velocity.
constexpr double kAccelBiasSd_m_s2 = 0.2;
constexpr double kGyroBiasDrift_rad_s_sqrt_s = 1e-4, kAccelBiasDrift_m_s2_sqrt_s = 0.01;
constexpr double kVelocitySd_m_s = 3;
/// In a gap of the IMU, motion is random with about these rates and accelerations, each for about this long.
constexpr double kUnseenRate_rad_s = 5, kUnseenAcceleration_m_s2 = 30, kUnseenFor_s = 0.01;
/// Least noise of the filter, for headers that declare less: below it, rounding errors in double precision dominate.
constexpr double kMinAngle_rad = 1e-6, kMinPosition_m = 1e-7, kMinRate_rad_s = 1e-5, kMinForce_m_s2 = 1e-4;
constexpr double kSame_s = 1e-9;
/// Longest gap of motion capture that covers() accepts, in frames.
constexpr double kLongestUnseenFrames = 4;

Matrix3d cross_matrix(const Vector3d& v) {
  Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// Weight of a new value in the low-pass that, with the mean over an interval, passes 1/sqrt(2) at the bandwidth; 1 (no
/// low-pass) where the mean alone does.
double low_pass_share(const ImuHeader& h) {
  const double x = kPi * h.bandwidth_hz / h.rate_hz;
  if (x >= kPi) return 1;
  const auto passes = [&](double share) {
    const double past = 1 - share;
    return std::sin(x) / x * share / std::sqrt(1 - 2 * past * std::cos(2 * x) + past * past);
  };
  constexpr double kWhole = 0.98;  // tolerance for a rounded bandwidth in the header
  if (passes(1) <= std::numbers::sqrt2 / 2 / kWhole) return 1;
  double low = 1e-4, high = 1;
  for (int i = 0; i < 60; ++i) (passes((low + high) / 2) > std::numbers::sqrt2 / 2 ? high : low) = (low + high) / 2;
  return (low + high) / 2;
}

}  // namespace

/// Spectral densities of the IMU's noise, and variances of poses and biases.
struct Smoother::Noise {
  double angle_rad2_s, velocity_m2_s3;
  double pose_angle_rad2, pose_position_m2;
  Vector3d gyro_bias_rad2_s2;

  explicit Noise(const FlightHeader& h) {
    const auto density = [&](double sd, double least) {
      return std::max(sd, least) * std::max(sd, least) / h.imu.rate_hz;
    };
    const auto variance = [](double sd, double least) { return std::max(sd, least) * std::max(sd, least); };
    angle_rad2_s = density(h.imu.gyro_noise_rad_s, kMinRate_rad_s);
    velocity_m2_s3 = density(h.imu.accel_noise_m_s2, kMinForce_m_s2);
    pose_angle_rad2 = variance(h.mocap.attitude_noise_rad, kMinAngle_rad);
    pose_position_m2 = variance(h.mocap.position_noise_m, kMinPosition_m);
    for (int i = 0; i < 3; ++i)
      gyro_bias_rad2_s2[i] = variance(h.imu.gyro_bias_sd_rad_s[static_cast<std::size_t>(i)], kMinRate_rad_s);
  }
};

/// Integrals of the IMU's signals over part of an interval. Changes of velocity and position are in B at the middle of
/// the whole interval: the frame of a mean is known no better.
struct Smoother::Reading {
  double duration_s, to_middle_s;
  Vector3d rotation_rad, turn_to_middle_rad, gained_m_s, moved_m;
  bool gap;
};

struct Smoother::Pose {
  double t_s;
  Vector3d position_m;
  Quaterniond attitude;
};

/// Transition matrix F of the error state over dt: 1 except for 3 x 3 blocks. Offsets: angle 0, position 3, velocity 6,
/// gyro bias 9, accelerometer bias 12.
struct Smoother::Transition {
  double dt;
  Matrix3d turn, half;
  Matrix3d leans;  ///< d velocity error / d angle error

  template <class M>
  M of(M m) const {
    const auto gained = (leans * m.template topRows<3>() - dt * half * m.template bottomRows<3>()).eval();
    m.template middleRows<3>(3) += dt * m.template middleRows<3>(6) + dt / 2 * gained;
    m.template middleRows<3>(6) += gained;
    m.template topRows<3>() = (turn * m.template topRows<3>() - dt * m.template middleRows<3>(9)).eval();
    return m;
  }
  /// F transposed times a matrix.
  template <class M>
  M transposed_of(M m) const {
    const auto gained = (m.template middleRows<3>(6) + dt / 2 * m.template middleRows<3>(3)).eval();
    m.template middleRows<3>(6) += dt * m.template middleRows<3>(3);
    m.template middleRows<3>(9) -= dt * m.template topRows<3>();
    m.template bottomRows<3>() -= dt * half.transpose() * gained;
    m.template topRows<3>() = (turn.transpose() * m.template topRows<3>() + leans.transpose() * gained).eval();
    return m;
  }
};

/// The update by one pose: observation matrix h, gain, inverse S^-1 of the innovation's covariance, innovation `off`.
struct Smoother::Correction {
  Eigen::Matrix<double, 6, 15> h;
  Eigen::Matrix<double, 15, 6> gain;
  Eigen::Matrix<double, 6, 6> inverse;
  Eigen::Matrix<double, 6, 1> off;
};

/// For the backward pass: covariance of every node, transition to the next, correction by every pose except the first.
struct Smoother::Filtered {
  std::vector<Covariance> covariance;
  std::vector<Transition> transition;
  std::vector<Correction> correction;
};

Smoother::Smoother(const FlightLog& log, const std::filesystem::path& folder, bool with_covariance)
    : gravity_m_s2_(log.header.gravity_m_s2),
      longest_unseen_s_(kLongestUnseenFrames / log.header.mocap.rate_hz),
      arm_m_(log.header.imu.position_m.data()) {
  require_voltages(log, folder.string());
  read_imu(log);
  const std::vector<Pose> poses = read_poses(log);
  if (poses.size() < 2)
    throw io::InputError(folder.string() + ": motion capture and IMU, less their latencies, share " +
                         std::to_string(poses.size()) + " poses; accepted: streams that overlap");
  lay_nodes(poses);
  const Noise noise(log.header);
  smooth(filter(poses, noise), noise, with_covariance);
}

void Smoother::read_imu(const FlightLog& log) {
  const ImuHeader& h = log.header.imu;
  const ImuStream& s = log.imu;
  const std::size_t n = s.t_s.size();
  const double interval_s = 1 / h.rate_hz, share = low_pass_share(h);
  const double late_s = h.latency_s + 1 / (2 * kPi * h.bandwidth_hz) - (1 - share) / share * interval_s;
  const auto follows = [&](std::size_t i) { return s.t_s[i] - s.t_s[i - 1] < 1.5 * interval_s; };
  std::vector<Vector3d> gyro, accel;
  const auto add = [&](double from_s, const Vector3d& rate, const Vector3d& force, bool gap) {
    sample_.push_back(sample_.empty() ? 0 : sample_.back() + (gap_.back() ? 0 : 1));
    bounds_s_.push_back(from_s);
    gyro.push_back(rate);
    accel.push_back(force);
    gap_.push_back(gap ? 1 : 0);
  };
  Vector3d rate_before, force_before;
  for (std::size_t i = 0; i < n; ++i) {
    const auto [rate, force] = imu_reading(s, i);
    const double centre_s = s.t_s[i] - late_s;
    const bool begins = i == 0 || !follows(i);
    if (i > 0 && begins)
      add(s.t_s[i - 1] - late_s + interval_s / 2, (gyro.back() + rate) / 2, (accel.back() + force) / 2, true);
    const double from_s = begins ? centre_s - interval_s / 2 : (s.t_s[i - 1] + s.t_s[i]) / 2 - late_s;
    if (begins) rate_before = rate, force_before = force;
    add(from_s, (rate - (1 - share) * rate_before) / share, (force - (1 - share) * force_before) / share, false);
    rate_before = rate;
    force_before = force;
  }
  bounds_s_.push_back(s.t_s.back() - late_s + interval_s / 2);
  gyro_ = SplineOfMeans(bounds_s_, std::move(gyro));
  accel_ = SplineOfMeans(bounds_s_, std::move(accel));
}

auto Smoother::read_poses(const FlightLog& log) const -> std::vector<Pose> {
  std::vector<Pose> poses;
  for (const PoseReading& p : pose_readings(log))
    if (p.t_s >= bounds_s_.front() && p.t_s < bounds_s_.back() - kSame_s)
      poses.push_back({p.t_s, p.position_m, p.attitude()});
  return poses;
}

void Smoother::lay_nodes(const std::vector<Pose>& poses) {
  std::size_t next_pose = 0;
  for (std::size_t k = last_not_after(bounds_s_, poses.front().t_s); next_pose < poses.size(); ++k) {
    if (next_pose > 0 && bounds_s_[k] > nodes_.back().t_s + kSame_s) nodes_.push_back({bounds_s_[k], k, {}});
    for (; next_pose < poses.size() && poses[next_pose].t_s < bounds_s_[k + 1] - kSame_s; ++next_pose) {
      const double t_s = poses[next_pose].t_s;
      if (nodes_.empty() || t_s > nodes_.back().t_s + kSame_s) nodes_.push_back({t_s, k, {}});
      pose_s_.push_back(t_s);
      pose_node_.push_back(nodes_.size() - 1);
    }
  }
}

auto Smoother::reading(std::size_t interval, double from_s, double to_s) const -> Reading {
  const double length = bounds_s_[interval + 1] - bounds_s_[interval];
  const double u = (from_s - bounds_s_[interval]) / length, v = (to_s - bounds_s_[interval]) / length;
  return {to_s - from_s,
          (0.5 - u) * length,
          length * gyro_.integral(interval, u, v),
          length * (gyro_.integral(interval, 0, 1) / 2 - gyro_.integral(interval, 0, u)),
          length * accel_.integral(interval, u, v),
          length * length * accel_.second_integral(interval, u, v),
          gap_[interval] != 0};
}

Quaterniond Smoother::to_middle(const State& x, const Reading& r) {
  return x.attitude * exponential(r.turn_to_middle_rad - r.to_middle_s * x.gyro_bias);
}

auto Smoother::moved(const State& x, const Reading& r) const -> State {
  const Vector3d turn = r.rotation_rad - r.duration_s * x.gyro_bias;
  const double dt = r.duration_s;
  const Quaterniond middle = to_middle(x, r);
  const Vector3d down(0, 0, -gravity_m_s2_);
  State y = x;
  // Uses the second integral; half of the gained velocity would leave A dt^2/12 of an acceleration A: some 0.01 mm.
  y.position_m += dt * x.velocity_m_s + middle * (r.moved_m - dt * dt / 2 * x.accel_bias) + dt * dt / 2 * down;
  y.velocity_m_s += middle * (r.gained_m_s - dt * x.accel_bias) + dt * down;
  y.attitude = (x.attitude * exponential(turn)).normalized();
  return y;
}

auto Smoother::transition(const State& x, const Reading& r) const -> Transition {
  const double dt = r.duration_s;
  const Matrix3d half = to_middle(x, r).toRotationMatrix();
  return {dt, exponential(dt * x.gyro_bias - r.rotation_rad).toRotationMatrix(), half,
          -half * cross_matrix(r.gained_m_s - dt * x.accel_bias)};
}

void Smoother::add_noise(Covariance& p, const Reading& r, const Noise& noise) const {
  const double dt = r.duration_s;
  const double angle = noise.angle_rad2_s + (r.gap ? kUnseenRate_rad_s * kUnseenRate_rad_s * kUnseenFor_s : 0);
  const double velocity =
      noise.velocity_m2_s3 + (r.gap ? kUnseenAcceleration_m_s2 * kUnseenAcceleration_m_s2 * kUnseenFor_s : 0);
  for (int i = 0; i < 3; ++i) {
    p(i, i) += dt * angle;
    p(3 + i, 3 + i) += dt * dt * dt / 3 * velocity;
    p(3 + i, 6 + i) += dt * dt / 2 * velocity;
    p(6 + i, 3 + i) += dt * dt / 2 * velocity;
    p(6 + i, 6 + i) += dt * velocity;
    p(9 + i, 9 + i) += dt * kGyroBiasDrift_rad_s_sqrt_s * kGyroBiasDrift_rad_s_sqrt_s;
    p(12 + i, 12 + i) += dt * kAccelBiasDrift_m_s2_sqrt_s * kAccelBiasDrift_m_s2_sqrt_s;
  }
}

void Smoother::displace(State& x, const Eigen::Matrix<double, 15, 1>& error) {
  x.attitude = (x.attitude * exponential(error.segment<3>(0))).normalized();
  x.position_m += error.segment<3>(3);
  x.velocity_m_s += error.segment<3>(6);
  x.gyro_bias += error.segment<3>(9);
  x.accel_bias += error.segment<3>(12);
}

auto Smoother::correct(State& x, Covariance& p, const Pose& z, const Noise& noise) -> Correction {
  const Matrix3d R = x.attitude.toRotationMatrix();
  Correction c;
  c.h.setZero();
  c.h.block<3, 3>(0, 0).setIdentity();
  c.h.block<3, 3>(3, 0) = R * cross_matrix(arm_m_);
  c.h.block<3, 3>(3, 3).setIdentity();
  Eigen::Matrix<double, 6, 1> variance;
  c.off << logarithm(x.attitude.conjugate() * z.attitude), z.position_m - (x.position_m - R * arm_m_);
  variance << Vector3d::Constant(noise.pose_angle_rad2), Vector3d::Constant(noise.pose_position_m2);
  const Eigen::Matrix<double, 15, 6> ph = p * c.h.transpose();
  Eigen::Matrix<double, 6, 6> s = c.h * ph;
  s.diagonal() += variance;
  normalised_innovation_[0] += c.off.head<3>().dot(s.topLeftCorner<3, 3>().llt().solve(c.off.head<3>())) / 3;
  normalised_innovation_[1] += c.off.tail<3>().dot(s.bottomRightCorner<3, 3>().llt().solve(c.off.tail<3>())) / 3;
  c.inverse = s.llt().solve(Eigen::Matrix<double, 6, 6>::Identity());
  c.gain = ph * c.inverse;
  displace(x, c.gain * c.off);
  p -= c.gain * ph.transpose();
  p = (0.5 * (p + p.transpose())).eval();
  return c;
}

auto Smoother::filter(const std::vector<Pose>& poses, const Noise& noise) -> Filtered {
  Covariance p = Covariance::Zero();
  p.diagonal() << Vector3d::Constant(noise.pose_angle_rad2), Vector3d::Constant(noise.pose_position_m2),
      Vector3d::Constant(kVelocitySd_m_s * kVelocitySd_m_s), noise.gyro_bias_rad2_s2,
      Vector3d::Constant(kAccelBiasSd_m_s2 * kAccelBiasSd_m_s2);
  const Pose& first = poses.front();
  // Through the lever arm, the angle error of the first pose becomes an error of the IMU's position.
  Covariance from_pose = Covariance::Identity();
  from_pose.block<3, 3>(3, 0) = -first.attitude.toRotationMatrix() * cross_matrix(arm_m_);
  p = (from_pose * p * from_pose.transpose()).eval();
  State x{first.attitude, first.position_m + first.attitude * arm_m_, Vector3d::Zero(), Vector3d::Zero(),
          Vector3d::Zero()};
  Filtered list;
  list.covariance.reserve(nodes_.size());
  list.transition.reserve(nodes_.size());
  std::size_t next_pose = 1;  // the first pose is the initial state
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    if (i > 0) {
      const Reading r = reading(nodes_[i - 1].interval, nodes_[i - 1].t_s, nodes_[i].t_s);
      const Transition f = transition(x, r);
      p = f.of(Covariance(f.of(p).transpose()));
      add_noise(p, r, noise);
      x = moved(x, r);
      list.transition.push_back(f);
    }
    for (; next_pose < poses.size() && pose_node_[next_pose] == i; ++next_pose)
      list.correction.push_back(correct(x, p, poses[next_pose], noise));
    nodes_[i].state = x;
    list.covariance.push_back(p);
  }
  for (int k = 0; k < 2; ++k) normalised_innovation_[k] /= std::max(static_cast<double>(list.correction.size()), 1.0);
  return list;
}

/// Goes backward with the adjoint lambda and its covariance Lambda: state + P lambda, covariance P - P Lambda P.
void Smoother::smooth(const Filtered& filtered, const Noise& noise, bool with_covariance) {
  Eigen::Matrix<double, 15, 1> lambda = Eigen::Matrix<double, 15, 1>::Zero();
  Covariance of_lambda = Covariance::Zero();
  if (with_covariance) covariance_.resize(pose_node_.size());
  std::size_t pose = pose_node_.size();
  for (std::size_t i = nodes_.size(); i-- > 0;) {
    const Covariance& p = filtered.covariance[i];
    displace(nodes_[i].state, p * lambda);
    for (std::size_t k = pose; with_covariance && k-- > 0 && pose_node_[k] == i;)
      covariance_[k] = p - p * of_lambda * p;
    for (; pose > 1 && pose_node_[pose - 1] == i; --pose) {
      const Correction& c = filtered.correction[pose - 2];
      lambda += c.h.transpose() * (c.inverse * c.off - c.gain.transpose() * lambda);
      if (!with_covariance) continue;
      const Covariance kept = Covariance::Identity() - c.gain * c.h;
      of_lambda = kept.transpose() * of_lambda * kept + c.h.transpose() * c.inverse * c.h;
    }
    if (i == 0) break;
    const Transition& f = filtered.transition[i - 1];
    lambda = f.transposed_of(lambda);
    if (with_covariance) of_lambda = f.transposed_of(Covariance(f.transposed_of(of_lambda).transpose()));
  }
  const State& first = nodes_.front().state;
  normalised_innovation_[2] = std::max((first.gyro_bias.array().square() / noise.gyro_bias_rad2_s2.array()).mean(),
                                       first.accel_bias.squaredNorm() / (3 * kAccelBiasSd_m_s2 * kAccelBiasSd_m_s2));
}

std::size_t Smoother::node_before(double t_s) const {
  if (!(t_s >= begin_s() - kSame_s && t_s <= end_s() + kSame_s))
    throw std::out_of_range("no motion at " + std::to_string(t_s) + " s");
  const auto after = std::ranges::upper_bound(nodes_, t_s, {}, &Node::t_s);
  return after == nodes_.begin() ? 0 : static_cast<std::size_t>(after - nodes_.begin()) - 1;
}

double Smoother::imu_bound_s(double t_s) const {
  const std::size_t k = last_not_after(bounds_s_, t_s);
  return k + 1 < bounds_s_.size() && bounds_s_[k + 1] - t_s < t_s - bounds_s_[k] ? bounds_s_[k + 1] : bounds_s_[k];
}

std::optional<std::size_t> Smoother::imu_sample(double t_s) const {
  const std::size_t k = last_not_after(bounds_s_, t_s);
  if (k >= gap_.size() || gap_[k]) return std::nullopt;
  return sample_[k];
}

Vector3d Smoother::mean(const SplineOfMeans& signal, double from_s, double to_s) const {
  Vector3d sum = Vector3d::Zero();
  for (std::size_t k = last_not_after(bounds_s_, from_s); k + 1 < bounds_s_.size() && bounds_s_[k] < to_s; ++k) {
    const double length = bounds_s_[k + 1] - bounds_s_[k];
    const double u = std::max(0.0, (from_s - bounds_s_[k]) / length), v = std::min(1.0, (to_s - bounds_s_[k]) / length);
    if (v > u) sum += length * signal.integral(k, u, v);
  }
  return sum / (to_s - from_s);
}

TorsoMotion Smoother::at(double t_s) const {
  const Node& node = nodes_[node_before(t_s)];
  const State x = moved(node.state, reading(node.interval, node.t_s, t_s));
  const double from_s = bounds_s_[node.interval], to_s = bounds_s_[node.interval + 1];
  const Vector3d rate = gyro_.value(node.interval, (t_s - from_s) / (to_s - from_s)) - x.gyro_bias;
  return {x.position_m - x.attitude * arm_m_, x.attitude, x.velocity_m_s - x.attitude * rate.cross(arm_m_), rate};
}

bool Smoother::covers(double from_s, double to_s) const {
  if (from_s < begin_s() || to_s > end_s()) return false;
  for (std::size_t k = last_not_after(bounds_s_, from_s); k < gap_.size() && bounds_s_[k] < to_s; ++k)
    if (gap_[k]) return false;
  for (std::size_t i = last_not_after(pose_s_, from_s); i + 1 < pose_s_.size() && pose_s_[i] < to_s; ++i)
    if (pose_s_[i + 1] - pose_s_[i] > longest_unseen_s_) return false;
  return true;
}

sim::VoltageScript motor_voltages(const FlightLog& log) {
  const CommandStream& c = log.command;
  sim::VoltageScript script{c.t_s, c.left_voltage_V, c.right_voltage_V};
  if (!log.power) return script;
  const Column& t = log.power->t_s;
  const double late_s = log.header.power->latency_s, nominal_V = log.header.power->battery_nominal_V;
  for (std::size_t i = 0; i < script.t_s.size(); ++i) {
    const double at_s = script.t_s[i] + late_s;
    const std::size_t k = std::min(last_not_after(t, at_s), t.size() - 2);
    const double share = std::clamp((at_s - t[k]) / (t[k + 1] - t[k]), 0.0, 1.0);
    const Column& v = log.power->battery_V;
    const double scale = (v[k] + share * (v[k + 1] - v[k])) / nominal_V;
    script.left_V[i] *= scale;
    script.right_V[i] *= scale;
  }
  return script;
}

std::array<double, 4> wing_angles_at(const WingsStream& wings, double rate_hz, double t_s) {
  const Column& t = wings.t_s;
  const std::size_t k = last_not_after(t, t_s);
  if (k < 1 || k + 2 >= t.size() || t[k + 2] - t[k - 1] > 3.5 / rate_hz)
    return {std::nan(""), std::nan(""), std::nan(""), std::nan("")};
  std::array<double, 4> angles = {0, 0, 0, 0};
  for (std::size_t i = k - 1; i <= k + 2; ++i) {
    double weight = 1;
    for (std::size_t j = k - 1; j <= k + 2; ++j)
      if (j != i) weight *= (t_s - t[j]) / (t[i] - t[j]);
    angles[0] += weight * wings.left_stroke_rad[i];
    angles[1] += weight * wings.right_stroke_rad[i];
    angles[2] += weight * wings.left_rotation_rad[i];
    angles[3] += weight * wings.right_rotation_rad[i];
  }
  return angles;
}

}  // namespace flappy::flightlog
