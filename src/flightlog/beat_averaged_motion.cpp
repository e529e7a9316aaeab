#include "flightlog/beat_averaged_motion.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "flightlog/readings.hpp"
#include "flightlog/rotation.hpp"
#include "io/statistics.hpp"

namespace flappy::flightlog {
namespace {

using Eigen::Vector3d;

/// In periods of the bandwidth: longest gap filled by a line; unseen time around a longer gap, and at both ends.
constexpr double kFilled = 0.3, kAround = 2.5, kEnds = 3;
/// Length of the reflected ends, in periods of the bandwidth.
constexpr double kReflected = 5;

/// A second-order section, half of the filter of order 4; transposed direct form II.
struct Biquad {
  double b0, b1, b2, a1, a2;
  void run(std::vector<double>& x) const {
    // Initial state: steady state for the first sample.
    const double gain = (b0 + b1 + b2) / (1 + a1 + a2), first = x.front();
    double s2 = (b2 - a2 * gain) * first, s1 = (b1 - a1 * gain) * first + s2;
    for (double& v : x) {
      const double y = b0 * v + s1;
      s1 = b1 * v - a1 * y + s2;
      s2 = b2 * v - a2 * y;
      v = y;
    }
  }
};

/// Section of pole pair 0 or 1 of the Butterworth filter of order 4: bilinear transform, pre-warped frequency.
Biquad pair_of(double per_sample, int pair) {
  const double k = std::tan(std::numbers::pi * per_sample);
  const double q = 2 * std::sin(std::numbers::pi * (2 * pair + 1) / 8);
  const double norm = 1 / (1 + q * k + k * k);
  return {k * k * norm, 2 * k * k * norm, k * k * norm, 2 * (k * k - 1) * norm, (1 - q * k + k * k) * norm};
}

template <class Get>
std::vector<double> filtered(std::size_t n, double per_sample, const Get& get) {
  std::vector<double> x(n);
  for (std::size_t i = 0; i < n; ++i) x[i] = get(i);
  return low_pass(x, per_sample);
}

std::vector<Vector3d> filtered(const std::vector<Vector3d>& v, double per_sample) {
  std::vector<Vector3d> all(v.size());
  for (Eigen::Index k = 0; k < 3; ++k) {
    const std::vector<double> x = filtered(v.size(), per_sample, [&](std::size_t i) { return v[i][k]; });
    for (std::size_t i = 0; i < v.size(); ++i) all[i][k] = x[i];
  }
  return all;
}

std::vector<Vector3d> gradient(const std::vector<Vector3d>& v, double step_s) {
  std::vector<Vector3d> d(v.size());
  for (std::size_t i = 0; i < v.size(); ++i) {
    const std::size_t a = i == 0 ? 0 : i - 1, b = std::min(i + 1, v.size() - 1);
    d[i] = (v[b] - v[a]) / (step_s * static_cast<double>(b - a));
  }
  return d;
}

/// A pose farther than this from the median position of the poses around it is taken for another body's.
constexpr double kOtherPlace_m = 0.25;
constexpr std::size_t kHalfWindow = 7;

/// Poses without swapped and distant ones, and without their neighbours, which may be wrong in part.
std::vector<PoseReading> own_poses(const FlightLog& log) {
  const std::vector<PoseReading> poses = pose_readings(log);
  const std::vector<char> swapped = swapped_poses(log);
  std::vector<char> other;
  for (const PoseReading& p : poses) other.push_back(swapped[p.row]);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const std::size_t from = i < kHalfWindow ? 0 : i - kHalfWindow, to = std::min(poses.size(), i + kHalfWindow + 1);
    Vector3d middle;
    for (Eigen::Index k = 0; k < 3; ++k) {
      std::vector<double> near;
      for (std::size_t j = from; j < to; ++j) near.push_back(poses[j].position_m[k]);
      middle[k] = io::upper_median(near);
    }
    if ((poses[i].position_m - middle).norm() > kOtherPlace_m) other[i] = 1;
  }
  std::vector<PoseReading> own;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const bool beside = (i > 0 && other[i - 1]) || (i + 1 < poses.size() && other[i + 1]);
    if (!other[i] && !beside) own.push_back(poses[i]);
  }
  return own;
}

}  // namespace

std::vector<double> low_pass(const std::vector<double>& x, double per_sample) {
  const std::size_t n = x.size();
  const std::size_t more = std::min(n > 0 ? n - 1 : 0, static_cast<std::size_t>(std::ceil(kReflected / per_sample)));
  std::vector<double> y;
  y.reserve(n + 2 * more);
  for (std::size_t i = more; i > 0; --i) y.push_back(2 * x.front() - x[i]);
  y.insert(y.end(), x.begin(), x.end());
  for (std::size_t i = 1; i <= more; ++i) y.push_back(2 * x.back() - x[n - 1 - i]);
  const Biquad pairs[] = {pair_of(per_sample, 0), pair_of(per_sample, 1)};
  for (int pass = 0; pass < 2; ++pass) {
    for (const Biquad& pair : pairs) pair.run(y);
    std::ranges::reverse(y);
  }
  return {y.begin() + static_cast<std::ptrdiff_t>(more), y.begin() + static_cast<std::ptrdiff_t>(more + n)};
}

BeatAveragedMotion beat_averaged_motion(const FlightLog& log, double bandwidth_Hz,
                                        const std::filesystem::path& folder) {
  const std::vector<PoseReading> poses = own_poses(log);
  BeatAveragedMotion m;
  m.step_s = 1 / log.header.mocap.rate_hz;
  const double period_s = 1 / bandwidth_Hz, per_sample = bandwidth_Hz * m.step_s;
  if (per_sample > 0.25)
    throw io::InputError((folder / "flight.toml").string() +
                         ": mocap.rate_hz: " + io::shortest_digits(log.header.mocap.rate_hz) +
                         " is too slow to see motion up to the vehicle's beat.bandwidth_Hz; accepted: " +
                         io::shortest_digits(4 * bandwidth_Hz) + " or more");
  if (poses.size() < 2 || poses.back().t_s - poses.front().t_s < 3 * kEnds * period_s)
    throw TooLittleSeen((folder / "mocap.csv").string() + ": is too short for means over beats; accepted: " +
                        io::shortest_digits(3 * kEnds * period_s) + " s or more of motion capture");
  m.begin_s = poses.front().t_s;
  const auto n = static_cast<std::size_t>((poses.back().t_s - m.begin_s) / m.step_s) + 1;
  std::vector<Vector3d> position(n);
  std::vector<Eigen::Quaterniond> attitude(n);
  m.seen.assign(n, 1);
  std::size_t k = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double t = m.t_s(i);
    while (k + 2 < poses.size() && poses[k + 1].t_s <= t) ++k;
    const PoseReading &a = poses[k], &b = poses[k + 1];
    const double share = std::clamp((t - a.t_s) / (b.t_s - a.t_s), 0.0, 1.0);
    position[i] = a.position_m + share * (b.position_m - a.position_m);
    attitude[i] = a.attitude().normalized().slerp(share, b.attitude().normalized());
    if (i > 0 && attitude[i].dot(attitude[i - 1]) < 0) attitude[i].coeffs() *= -1;
  }
  const auto unseen = [&](double from_s, double to_s) {
    for (std::size_t i = 0; i < n; ++i)
      if (m.t_s(i) >= from_s && m.t_s(i) <= to_s) m.seen[i] = 0;
  };
  unseen(m.begin_s, m.begin_s + kEnds * period_s);
  unseen(poses.back().t_s - kEnds * period_s, INFINITY);  // not up to the last pose: rounding may place a step after it
  const auto skip = [&](double before_s, double after_s) {  // a gap between two samples
    if (after_s - before_s > kFilled * period_s) unseen(before_s - kAround * period_s, after_s + kAround * period_s);
  };
  for (std::size_t i = 1; i < poses.size(); ++i) skip(poses[i - 1].t_s, poses[i].t_s);

  std::vector<Eigen::Vector4d> smooth(n);
  for (Eigen::Index c = 0; c < 4; ++c) {
    const std::vector<double> x = filtered(n, per_sample, [&](std::size_t i) { return attitude[i].coeffs()[c]; });
    for (std::size_t i = 0; i < n; ++i) smooth[i][c] = x[i];
  }
  for (std::size_t i = 0; i < n; ++i)
    m.attitude.push_back(Eigen::Quaterniond(smooth[i].normalized()).toRotationMatrix());
  const std::vector<Vector3d> path = gradient(position, m.step_s);
  const std::vector<Vector3d> velocity = filtered(path, per_sample),
                              acceleration = filtered(gradient(path, m.step_s), per_sample);
  m.position_m = filtered(position, per_sample);
  std::vector<Vector3d> rate(n);
  if (!log.imu.gyro_x_rad_s.empty()) {
    const Column& t_s = log.imu.t_s;
    const double filter_s = 1 / (2 * std::numbers::pi * log.header.imu.bandwidth_hz);
    const double late_s = log.header.imu.latency_s + filter_s;
    skip(m.begin_s, t_s.front() - late_s);
    skip(t_s.back() - late_s, poses.back().t_s);
    for (std::size_t i = 1; i < t_s.size(); ++i) skip(t_s[i - 1] - late_s, t_s[i] - late_s);
    std::vector<Vector3d> gyro(n);
    for (std::size_t i = 0, at = 0; i < n; ++i) {
      const double t = m.t_s(i) + late_s;
      while (at + 1 < t_s.size() && t_s[at + 1] <= t) ++at;
      gyro[i] = imu_reading(log.imu, at).rate_rad_s;
    }
    rate = filtered(gyro, per_sample);
  } else {
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t a = i == 0 ? 0 : i - 1, b = std::min(i + 1, n - 1);
      rate[i] = logarithm(Eigen::Quaterniond(m.attitude[a].transpose() * m.attitude[b])) /
                (m.step_s * static_cast<double>(b - a));
    }
  }
  m.rate_rad_s = rate;
  m.turning_rad_s2 = gradient(rate, m.step_s);
  const Vector3d gravity(0, 0, log.header.gravity_m_s2);
  for (std::size_t i = 0; i < n; ++i) {
    m.velocity_B_m_s.push_back(m.attitude[i].transpose() * velocity[i]);
    m.force_m_s2.push_back(m.attitude[i].transpose() * (acceleration[i] + gravity));
  }
  return m;
}

}  // namespace flappy::flightlog
