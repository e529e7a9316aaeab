#include "lab/benchmark/change_over_sessions.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

namespace flappy::benchmark {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using flightlog::Column;
using flightlog::FlightLog;

constexpr double kBeats = 5;             // a window is so long that slow motion capture has kFewest samples in it
constexpr std::size_t kFewest = 12;      // a window with fewer samples has no value
constexpr std::size_t kMinSessions = 4;  // two in each half
constexpr std::size_t kFirstOther = 11;  // first number of the other sessions: none that a case flies
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// Windows of a log.
struct Windows {
  double width_s, beat_s;
  std::size_t count;

  explicit Windows(const FlightLog& log)
      : width_s(kBeats / log.header.flapping_Hz),
        beat_s(1 / log.header.flapping_Hz),
        count(static_cast<std::size_t>(log.command.t_s.back() / width_s)) {}
  double begin(std::size_t w) const { return static_cast<double>(w) * width_s; }
};

/// Samples from `from` on that lie in [begin, end).
std::pair<std::size_t, std::size_t> samples(const Column& t_s, double begin, double end) {
  const auto first = std::ranges::lower_bound(t_s, begin), last = std::ranges::lower_bound(t_s, end);
  return {static_cast<std::size_t>(first - t_s.begin()), static_cast<std::size_t>(last - t_s.begin())};
}

/// Mean and, with `harmonics`, two harmonics of a column, by least squares in each window.
void add_column(std::vector<WindowedChannel>& all, const Windows& windows, const std::string& name, const Column& t_s,
                double late_s, const Column& x, bool harmonics) {
  const double turn = 2 * std::numbers::pi / windows.beat_s;
  const Eigen::Index width = harmonics ? 5 : 1;
  std::vector<WindowedChannel> own = {{name + " mean", {}}};
  if (harmonics) own.push_back({name + " harmonic 1", {}}), own.push_back({name + " harmonic 2", {}});
  for (std::size_t w = 0; w < windows.count; ++w) {
    const auto [from, to] = samples(t_s, windows.begin(w) + late_s, windows.begin(w + 1) + late_s);
    Eigen::VectorXd fit = Eigen::VectorXd::Constant(width, kNone);
    if (to - from >= kFewest) {
      Eigen::MatrixXd waves(static_cast<Eigen::Index>(to - from), width);
      Eigen::VectorXd values(waves.rows());
      for (std::size_t i = from; i < to; ++i) {
        const double a = turn * (t_s[i] - late_s - windows.begin(w));
        const auto row = static_cast<Eigen::Index>(i - from);
        waves(row, 0) = 1;
        if (harmonics) waves.row(row).tail(4) << std::cos(a), std::sin(a), std::cos(2 * a), std::sin(2 * a);
        values[row] = x[i];
      }
      fit = waves.colPivHouseholderQr().solve(values);
    }
    own[0].values.push_back(fit[0]);
    for (std::size_t h = 1; h < own.size(); ++h)
      for (const Eigen::Index k : {2 * h - 1, 2 * h}) own[h].values.push_back(fit[k]);
  }
  std::ranges::move(own, std::back_inserter(all));
}

/// Attitude at a time, between samples by slerp; held before the first and after the last.
Quaterniond attitude_at(const flightlog::MocapStream& m, double t_s) {
  const auto at = [&](std::size_t i) { return Quaterniond(m.qw[i], m.qx[i], m.qy[i], m.qz[i]); };
  const auto next = static_cast<std::size_t>(std::ranges::lower_bound(m.t_s, t_s) - m.t_s.begin());
  if (next == 0) return at(0);
  if (next == m.t_s.size()) return at(next - 1);
  const double share = (t_s - m.t_s[next - 1]) / (m.t_s[next] - m.t_s[next - 1]);
  return at(next - 1).slerp(share, at(next));
}

Vector3d rotation_vector(const Quaterniond& q) {
  const Eigen::AngleAxisd a(q);
  return a.angle() * a.axis();
}

/// Quadratic B-spline of support 3: the second difference of means over windows is the acceleration seen through it.
double spline(double x) {
  x = std::abs(x);
  return x < 0.5 ? 0.75 - x * x : x < 1.5 ? 0.5 * (1.5 - x) * (1.5 - x) : 0;
}

/// Motion capture: place and attitude in each window; by how much the turn from window to window is not the gyro's, and by how much the
/// second difference of places is not what the accelerometer gives.
void add_motion(std::vector<WindowedChannel>& all, const Windows& windows, const FlightLog& log) {
  const flightlog::MocapStream& m = log.mocap;
  const flightlog::ImuStream& imu = log.imu;
  const double late_s = log.header.mocap.latency_s, imu_late_s = log.header.imu.latency_s;
  std::vector<std::optional<Vector3d>> places(windows.count);
  std::vector<std::optional<Quaterniond>> attitudes(windows.count);
  for (std::size_t w = 0; w < windows.count; ++w) {
    const auto [from, to] = samples(m.t_s, windows.begin(w) + late_s, windows.begin(w + 1) + late_s);
    if (to - from < kFewest) continue;
    const std::size_t middle = (from + to) / 2;
    const Quaterniond centre(m.qw[middle], m.qx[middle], m.qy[middle], m.qz[middle]);
    // means at the middle of the window, which is not quite that of its samples: a straight line by least squares
    Eigen::MatrixX2d line(static_cast<Eigen::Index>(to - from), 2);
    Eigen::Matrix<double, Eigen::Dynamic, 6> seen(line.rows(), 6);
    for (std::size_t i = from; i < to; ++i) {
      const auto row = static_cast<Eigen::Index>(i - from);
      line.row(row) << 1, m.t_s[i] - late_s - windows.begin(w) - windows.width_s / 2;
      seen.row(row) << m.x_m[i], m.y_m[i], m.z_m[i],
          rotation_vector(centre.conjugate() * Quaterniond(m.qw[i], m.qx[i], m.qy[i], m.qz[i])).transpose();
    }
    const Eigen::Matrix<double, 1, 6> mean = line.colPivHouseholderQr().solve(seen).row(0);
    const Vector3d turn = mean.tail(3);
    places[w] = mean.head(3);
    attitudes[w] = centre * (turn.norm() > 0 ? Quaterniond(Eigen::AngleAxisd(turn.norm(), turn.normalized()))
                                             : Quaterniond::Identity());
  }
  // true times of the IMU's samples, their turn and their acceleration in W
  Eigen::Matrix3Xd acceleration(3, static_cast<Eigen::Index>(imu.t_s.size()));
  for (std::size_t i = 0; i < imu.t_s.size(); ++i)
    acceleration.col(static_cast<Eigen::Index>(i)) =
        attitude_at(m, imu.t_s[i] - imu_late_s + late_s) *
            Vector3d(imu.accel_x_m_s2[i], imu.accel_y_m_s2[i], imu.accel_z_m_s2[i]) -
        Vector3d(0, 0, log.header.gravity_m_s2);
  std::vector<WindowedChannel> own;
  for (const char* what :
       {"place", "forward axis", "upward axis", "turn less the gyro's", "acceleration less the accelerometer's"})
    for (const char* axis : {" x", " y", " z"}) own.push_back({std::string(what) + axis, {}});
  const auto put = [&](std::size_t first, const std::optional<Vector3d>& x) {
    for (std::size_t k = 0; k < 3; ++k) own[first + k].values.push_back(x ? (*x)[static_cast<Eigen::Index>(k)] : kNone);
  };
  for (std::size_t w = 0; w < windows.count; ++w) {
    put(0, places[w]);
    // axes, as a rotation vector jumps at half a turn
    put(3, attitudes[w] ? std::optional<Vector3d>(*attitudes[w] * Vector3d::UnitX()) : std::nullopt);
    put(6, attitudes[w] ? std::optional<Vector3d>(*attitudes[w] * Vector3d::UnitZ()) : std::nullopt);
    std::optional<Vector3d> turn, second;
    const double middle_s = windows.begin(w) + windows.width_s / 2;
    if (w + 1 < windows.count && attitudes[w] && attitudes[w + 1]) {
      const auto [from, to] = samples(imu.t_s, middle_s + imu_late_s, middle_s + windows.width_s + imu_late_s);
      Quaterniond turned = Quaterniond::Identity();
      for (std::size_t i = from; i < to; ++i) {
        const Vector3d angle = windows.width_s / static_cast<double>(to - from) *
                               Vector3d(imu.gyro_x_rad_s[i], imu.gyro_y_rad_s[i], imu.gyro_z_rad_s[i]);
        if (angle.norm() > 0) turned = turned * Quaterniond(Eigen::AngleAxisd(angle.norm(), angle.normalized()));
      }
      if (to > from) turn = rotation_vector(turned.conjugate() * (attitudes[w]->conjugate() * *attitudes[w + 1]));
    }
    put(9, turn);
    if (w > 0 && w + 1 < windows.count && places[w - 1] && places[w] && places[w + 1]) {
      const auto [from, to] = samples(imu.t_s, middle_s - 1.5 * windows.width_s + imu_late_s,
                                      middle_s + 1.5 * windows.width_s + imu_late_s);
      Vector3d sum = Vector3d::Zero();
      double weight = 0;
      for (std::size_t i = from; i < to; ++i) {
        const double k = spline((imu.t_s[i] - imu_late_s - middle_s) / windows.width_s);
        sum += k * acceleration.col(static_cast<Eigen::Index>(i)), weight += k;
      }
      if (weight > 0)
        second =
            (*places[w - 1] - 2 * *places[w] + *places[w + 1]) / (windows.width_s * windows.width_s) - sum / weight;
    }
    put(12, second);
  }
  std::ranges::move(own, std::back_inserter(all));
}

}  // namespace

std::vector<WindowedChannel> windowed_channels(const FlightLog& log) {
  std::vector<WindowedChannel> all;
  const Windows windows(log);
  const auto add = [&](const char* name, const Column& t_s, double late_s, const Column& x, bool harmonics = true) {
    add_column(all, windows, name, t_s, late_s, x, harmonics);
  };
  if (const auto& u = log.command.inputs) {
    add("amplitude", log.command.t_s, 0, u->amplitude_V, false);
    add("difference", log.command.t_s, 0, u->difference_V, false);
    add("bias", log.command.t_s, 0, u->bias_V, false);
    add("split_cycle", log.command.t_s, 0, u->split_cycle, false);
  }
  if (!log.imu.t_s.empty()) {
    const double late_s = log.header.imu.latency_s;
    add("gyro_x", log.imu.t_s, late_s, log.imu.gyro_x_rad_s);
    add("gyro_y", log.imu.t_s, late_s, log.imu.gyro_y_rad_s);
    add("gyro_z", log.imu.t_s, late_s, log.imu.gyro_z_rad_s);
    add("accel_x", log.imu.t_s, late_s, log.imu.accel_x_m_s2);
    add("accel_y", log.imu.t_s, late_s, log.imu.accel_y_m_s2);
    add("accel_z", log.imu.t_s, late_s, log.imu.accel_z_m_s2);
  }
  if (log.power && log.header.power) {
    const double late_s = log.header.power->latency_s;
    add("battery", log.power->t_s, late_s, log.power->battery_V);
    if (!log.power->left_current_A.empty()) {
      add("left_current", log.power->t_s, late_s, log.power->left_current_A);
      add("right_current", log.power->t_s, late_s, log.power->right_current_A);
    }
  }
  if (log.wings) {
    add("left_stroke", log.wings->t_s, 0, log.wings->left_stroke_rad);
    add("left_rotation", log.wings->t_s, 0, log.wings->left_rotation_rad);
    add("right_stroke", log.wings->t_s, 0, log.wings->right_stroke_rad);
    add("right_rotation", log.wings->t_s, 0, log.wings->right_rotation_rad);
  }
  if (log.forces && log.header.rig) {
    const double late_s = log.header.rig->latency_s;
    add("force_x_N", log.forces->t_s, late_s, log.forces->force_x_N);
    add("force_y_N", log.forces->t_s, late_s, log.forces->force_y_N);
    add("force_z_N", log.forces->t_s, late_s, log.forces->force_z_N);
    add("moment_x_Nm", log.forces->t_s, late_s, log.forces->moment_x_Nm);
    add("moment_y_Nm", log.forces->t_s, late_s, log.forces->moment_y_Nm);
    add("moment_z_Nm", log.forces->t_s, late_s, log.forces->moment_z_Nm);
  }
  if (!log.mocap.t_s.empty() && !log.imu.t_s.empty()) add_motion(all, windows, log);
  return all;
}

namespace {

/// What sessions change along the change by an effect, in one channel.
struct Projected {
  std::string channel;
  std::vector<double> sizes;  ///< [flight] |e_f|
  std::vector<double> along;  ///< [session] x_s; NaN where the effect does not change its flight

  double size() const {
    double sum = 0, squares = 0;
    for (const double e : sizes) sum += e, squares += e * e;
    return sum > 0 ? squares / sum : 0;
  }
  std::size_t pairs() const { return along.size() / 2; }
  /// Variance by one pair, over the square of the size.
  double variance(std::size_t pair) const {
    const double gap = along[2 * pair] - along[2 * pair + 1];
    return gap * gap / 2 / (size() * size());
  }
  /// The mean over all pairs but one. NaN: no other pair is known.
  double variance_without(std::size_t pair) const {
    double sum = 0, count = 0;
    for (std::size_t p = 0; p < pairs(); ++p)
      if (const double v = variance(p); p != pair && std::isfinite(v)) sum += v, ++count;
    return sum / count;
  }
};

/// The channel with the largest ratio by all pairs but one (one beyond the last: by all); null: there is none.
const Projected* largest(const std::vector<Projected>& channels, std::size_t without_pair) {
  const Projected* best = nullptr;
  double least = std::numeric_limits<double>::infinity();
  for (const Projected& c : channels)
    if (const double variance = c.variance_without(without_pair); variance < least) best = &c, least = variance;
  return best;
}

}  // namespace

OverSessions over_sessions(const std::vector<std::pair<FlightLog, FlightLog>>& change,
                           const std::vector<OtherSession>& sessions) {
  std::vector<Projected> channels;
  for (std::size_t flight = 0; flight < change.size(); ++flight) {
    const auto with = windowed_channels(change[flight].first), without = windowed_channels(change[flight].second);
    for (std::size_t c = 0; c < without.size(); ++c) {
      if (flight == 0) channels.push_back({without[c].name, {}, std::vector<double>(sessions.size())});
      double square = 0;
      for (std::size_t i = 0; i < std::min(with[c].values.size(), without[c].values.size()); ++i) {
        const double before = without[c].values[i], e = with[c].values[i] - before;
        const auto known = [&](const OtherSession& s) {
          return s.flight != flight || (i < s.channels[c].values.size() && std::isfinite(s.channels[c].values[i]));
        };
        if (!std::isfinite(e) || !std::ranges::all_of(sessions, known)) continue;
        square += e * e;
        for (std::size_t s = 0; s < sessions.size(); ++s)
          if (sessions[s].flight == flight) channels[c].along[s] += e * (sessions[s].channels[c].values[i] - before);
      }
      channels[c].sizes.push_back(std::sqrt(square));
      for (std::size_t s = 0; s < sessions.size(); ++s)
        if (sessions[s].flight == flight) channels[c].along[s] /= std::sqrt(square);  // 0 / 0: not known
    }
  }
  const std::size_t pairs = sessions.size() / 2;
  std::erase_if(channels, [&](const Projected& c) { return !(c.size() > 0) || !(c.variance_without(pairs) > 0); });
  double sum = 0, count = 0;
  for (std::size_t pair = 0; pair < pairs; ++pair)
    if (const Projected* chosen = largest(channels, pair))
      if (const double variance = chosen->variance(pair); std::isfinite(variance)) sum += variance, ++count;
  if (count == 0) return {};
  return {largest(channels, pairs)->channel, std::sqrt(count / sum)};
}

std::vector<OverSessions> change_over_sessions(const blind::Family& family, const blind::Assignment& robot,
                                               const std::vector<FlightLog>& flown, std::size_t other_sessions) {
  if (other_sessions == 0) return {};
  blind::Assignment other = robot;
  other.effects.clear();
  other.programme_of = robot.programme_of.value_or(robot.session);
  std::vector<OtherSession> sessions;
  // a session in which the robot crashes is replaced by the next
  for (std::size_t s = 0; sessions.size() < other_sessions && s < 2 * other_sessions; ++s) {
    other.session = kFirstOther + s;
    const std::size_t flight = sessions.size() / 2 % flown.size();
    if (const blind::FamilyFlight f = family.fly(other, flight); !f.crashed)
      sessions.push_back({flight, windowed_channels(f.log)});
  }
  std::vector<OverSessions> all;
  if (sessions.size() < kMinSessions) return all;
  for (const auto& [id, magnitude] : robot.effects) {
    blind::Assignment without = robot;
    std::erase_if(without.effects, [&](const auto& e) { return e.first == id; });
    std::vector<std::pair<FlightLog, FlightLog>> change;
    for (std::size_t k = 0; k < flown.size(); ++k) {
      blind::FamilyFlight f = family.fly(without, k);
      if (f.crashed) break;
      change.emplace_back(flown[k], std::move(f.log));
    }
    // a robot that flies with its effect alone has changed as much as a robot can
    all.push_back(change.size() < flown.size() ? OverSessions{"crash", 1e9} : over_sessions(change, sessions));
  }
  return all;
}

std::vector<OverSessions> larger_of(std::vector<OverSessions> in_flight, const std::vector<OverSessions>& on_bench) {
  in_flight.resize(std::max(in_flight.size(), on_bench.size()));
  for (std::size_t i = 0; i < on_bench.size(); ++i)
    if (on_bench[i].ratio > in_flight[i].ratio) in_flight[i] = on_bench[i];
  return in_flight;
}

}  // namespace flappy::benchmark
