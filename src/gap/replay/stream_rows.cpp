#include "gap/replay/stream_rows.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "flightlog/readings.hpp"
#include "flightlog/rotation.hpp"

namespace flappy::gap {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

/// Beats that differences of path and turn span. Choice.
constexpr std::size_t kSpan = 3;

/// Dead reckoning of the IMU, at the bounds of its intervals.
struct Reckoned {
  std::vector<double> t_s;
  std::vector<Vector3d> position_m, velocity_m_s;
  std::vector<Quaterniond> attitude;
};

/// [interval] `force`: specific force, B; `turn`: rotation vector, B. Rotated by the smoothed attitude: it is more
/// accurate.
Reckoned reckon(const Recording& r, const std::vector<Vector3d>& force, const std::vector<Vector3d>& turn,
                double gravity) {
  Reckoned x;
  const auto attitude = [&](std::size_t k) {
    const double* q = r.torso[k].attitude;
    return Quaterniond(q[0], q[1], q[2], q[3]);
  };
  x.t_s.push_back(r.begin_s);
  x.position_m.emplace_back(r.torso[0].position_m);
  x.velocity_m_s.emplace_back(r.torso[0].velocity_m_s);
  x.attitude.push_back(attitude(0));
  for (std::size_t k = 0; k < r.intervals(); ++k) {
    const double dt = r.interval_s(k);
    const Vector3d a = attitude(k).slerp(0.5, attitude(k + 1)) * force[k] - Vector3d(0, 0, gravity);
    x.position_m.push_back(x.position_m.back() + dt * x.velocity_m_s.back() + dt * dt / 2 * a);
    x.velocity_m_s.push_back(x.velocity_m_s.back() + dt * a);
    x.attitude.push_back((x.attitude.back() * flightlog::exponential(turn[k])).normalized());
    x.t_s.push_back(r.end_s[k]);
  }
  return x;
}

/// Beat means of `samples`, [pose][6]: difference of the path, rotation of the attitude; both in W.
std::vector<StreamRow> differences(const Recording& r, const std::vector<double>& pose_s,
                                   const std::vector<double>& samples) {
  std::vector<double> beat;
  for (const double t_s : pose_s) beat.push_back(r.beat_at(t_s));
  const BeatProjection projection(beat, std::vector<char>(beat.size(), 1), r.beats, 0);
  std::vector<double> rows(r.beats * kCoefficients * 6, 0);
  projection.project(samples.data(), 6, rows.data());
  const auto mean = [&](std::size_t j, int part) {
    return Vector3d(&rows[j * kCoefficients * 6 + static_cast<std::size_t>(part)]);
  };
  std::vector<StreamRow> list(r.beats);
  const double span_s = kSpan / r.log.header.flapping_Hz;
  Vector3d sum = Vector3d::Zero();
  double n = 0;
  for (std::size_t j = kSpan; j + kSpan < r.beats; ++j) {
    bool covered = true;
    for (std::size_t i = j - kSpan; i <= j + kSpan; ++i) covered = covered && projection.covers(i);
    if (!covered) continue;
    StreamRow& row = list[j];
    row.valid = true;
    row.path_m_s2 = (mean(j + kSpan, 0) - 2 * mean(j, 0) + mean(j - kSpan, 0)) / (span_s * span_s);
    // in W, where an accumulated drift stays constant while the body turns
    row.rotate_rad_s = r.smoother->at(r.regimes[j].t_s).attitude.conjugate() *
                       Vector3d((mean(j + kSpan, 3) - mean(j - kSpan, 3)) / (2 * span_s));
    sum += row.rotate_rad_s;
    n += 1;
  }
  for (StreamRow& row : list)
    if (row.valid) row.rotate_rad_s -= sum / n;
  return list;
}

}  // namespace

std::vector<StreamRow> stream_rows(const Recording& r) {
  const Vector3d bias = r.smoother->gyro_bias_rad_s((r.begin_s + r.last_s) / 2);
  std::vector<Vector3d> turn;
  double from_s = r.begin_s;
  for (std::size_t k = 0; k < r.intervals(); ++k) {
    turn.push_back(r.smoother->mean_rate_rad_s(from_s, r.end_s[k]) * r.interval_s(k) - bias * r.interval_s(k));
    from_s = r.end_s[k];
  }
  const Reckoned x = reckon(r, r.force_m_s2, turn, r.world.gravity_m_s2);
  const Vector3d arm(r.log.header.imu.position_m.data());
  std::vector<double> pose_s, samples;
  for (const flightlog::PoseReading& seen : flightlog::pose_readings(r.log)) {
    const double t_s = seen.t_s;
    if (t_s < x.t_s.front() || t_s >= x.t_s.back() || t_s < r.smoother->begin_s() || t_s > r.smoother->end_s())
      continue;
    const std::size_t k = flightlog::last_not_after(x.t_s, t_s);
    const double dt = t_s - x.t_s[k], share = dt / (x.t_s[k + 1] - x.t_s[k]);
    const Vector3d a = (x.velocity_m_s[k + 1] - x.velocity_m_s[k]) / (x.t_s[k + 1] - x.t_s[k]);
    const Quaterniond reckoned = x.attitude[k].slerp(share, x.attitude[k + 1]);
    const Vector3d path = seen.position_m + r.smoother->at(t_s).attitude * arm -
                          (x.position_m[k] + dt * x.velocity_m_s[k] + dt * dt / 2 * a);
    const Vector3d off = flightlog::logarithm(seen.attitude() * reckoned.conjugate());
    pose_s.push_back(t_s);
    samples.insert(samples.end(), {path.x(), path.y(), path.z(), off.x(), off.y(), off.z()});
  }
  return differences(r, pose_s, samples);
}

std::vector<StreamRow> stream_noise(const Recording& r, std::uint64_t seed, bool mocap_alone) {
  const flightlog::FlightHeader& h = r.log.header;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const auto noise = [&](double sd) {
    const double z = sd * normal(random), y = sd * normal(random), x = sd * normal(random);
    return Vector3d(x, y, z);
  };
  // errors of path and angle by dead reckoning with noise alone
  std::vector<double> t_s = {r.begin_s};
  std::vector<Vector3d> path = {Vector3d::Zero()}, angle = {Vector3d::Zero()};
  Vector3d velocity = Vector3d::Zero();
  for (std::size_t k = 0; k < r.intervals(); ++k) {
    const double dt = r.interval_s(k);
    const Vector3d a = noise(mocap_alone ? 0 : h.imu.accel_noise_m_s2);
    path.push_back(path.back() + dt * velocity + dt * dt / 2 * a);
    velocity += dt * a;
    angle.push_back(angle.back() + dt * noise(mocap_alone ? 0 : h.imu.gyro_noise_rad_s));
    t_s.push_back(r.end_s[k]);
  }
  std::vector<double> pose_s, samples;
  for (const flightlog::PoseReading& seen : flightlog::pose_readings(r.log)) {
    const double at_s = seen.t_s;
    if (at_s < t_s.front() || at_s >= t_s.back()) continue;
    const std::size_t k = flightlog::last_not_after(t_s, at_s);
    const Vector3d p = noise(h.mocap.position_noise_m) - path[k], q = noise(h.mocap.attitude_noise_rad) - angle[k];
    pose_s.push_back(at_s);
    samples.insert(samples.end(), {p.x(), p.y(), p.z(), q.x(), q.y(), q.z()});
  }
  return differences(r, pose_s, samples);
}

}  // namespace flappy::gap
