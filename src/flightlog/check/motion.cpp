#include "flightlog/check/motion.hpp"

#include <algorithm>
#include <cmath>

#include "flightlog/check/check_parts.hpp"
#include "flightlog/readings.hpp"
#include "flightlog/rotation.hpp"
#include "io/statistics.hpp"

namespace flappy::flightlog {
namespace {

double longest_bridged(const std::vector<double>& t_s) {
  std::vector<double> intervals;
  for (std::size_t i = 1; i < t_s.size(); ++i) intervals.push_back(t_s[i] - t_s[i - 1]);
  return std::max(3 * io::upper_median(intervals), 0.01);
}

Vector3d mean_of(const std::vector<Vector3d>& values) {
  Vector3d sum = Vector3d::Zero();
  for (const Vector3d& v : values) sum += v;
  return sum / static_cast<double>(values.size());
}

struct Moments {
  Matrix3d cross = Matrix3d::Zero();  ///< mocap x gyro
  double mocap = 0, gyro = 0;
};

Moments moments(const Pairs& pairs) {
  const Vector3d m0 = mean_of(pairs.mocap), g0 = mean_of(pairs.gyro);
  Moments sum;
  for (std::size_t i = 0; i < pairs.mocap.size(); ++i) {
    const Vector3d m = pairs.mocap[i] - m0, g = pairs.gyro[i] - g0;
    sum.cross += m * g.transpose();
    sum.mocap += m.squaredNorm();
    sum.gyro += g.squaredNorm();
  }
  return sum;
}

double overlap(const Matrix3d& axes, const Matrix3d& cross) { return axes.cwiseProduct(cross).sum(); }

}  // namespace

const std::vector<Matrix3d>& signed_permutations() {
  static const std::vector<Matrix3d> all = [] {
    std::vector<Matrix3d> list;
    std::array<int, 3> order = {0, 1, 2};
    do {
      for (int signs = 0; signs < 8; ++signs) {
        Matrix3d m = Matrix3d::Zero();
        for (int i = 0; i < 3; ++i) m(i, order[static_cast<std::size_t>(i)]) = (signs >> i & 1) ? -1 : 1;
        list.push_back(m);
      }
    } while (std::ranges::next_permutation(order).found);
    return list;
  }();
  return all;
}

SensorMotion::SensorMotion(const FlightLog& log) {
  const double start_s = log.mocap.t_s.front() - log.header.mocap.latency_s;
  for (const PoseReading& p : pose_readings(log)) {
    mocap_t_s_.push_back(p.t_s - start_s);
    position_m_.push_back(p.position_m);
    quaternion_.push_back(p.quaternion);
  }
  for (std::size_t i = 0; i < log.imu.t_s.size(); ++i) {
    const auto [rate, force] = imu_reading(log.imu, i);
    imu_t_s_.push_back(log.imu.t_s[i] - log.header.imu.latency_s - start_s);
    gyro_rad_s_.push_back(rate);
    accel_m_s2_.push_back(force);
  }
  longest_mocap_s_ = longest_bridged(mocap_t_s_);
  longest_imu_s_ = imu_t_s_.empty() ? 0 : longest_bridged(imu_t_s_);
  gyro_integral_rad_.emplace_back(Vector3d::Zero());
  gaps_before_.push_back(0);
  for (std::size_t i = 1; i < imu_t_s_.size(); ++i) {
    const double dt = imu_t_s_[i] - imu_t_s_[i - 1];
    gyro_integral_rad_.push_back(gyro_integral_rad_.back() + (gyro_rad_s_[i] + gyro_rad_s_[i - 1]) * (dt / 2));
    gaps_before_.push_back(gaps_before_.back() + (dt > longest_imu_s_));
  }
}

Quaterniond SensorMotion::attitude(std::size_t sample, Order order) const {
  const auto& [a, b, c, d] = quaternion_[sample];
  const bool w_first = order == Order::wxyz || order == Order::wxyz_inverse;
  const Quaterniond q = w_first ? Quaterniond(a, b, c, d) : Quaterniond(d, a, b, c);
  return order == Order::wxyz || order == Order::xyzw ? q : q.conjugate();
}

std::optional<std::size_t> SensorMotion::bracket(double t_s) const {
  const std::size_t k = index_before(mocap_t_s_, t_s);
  if (k + 1 >= mocap_t_s_.size() || mocap_t_s_[k + 1] - mocap_t_s_[k] > longest_mocap_s_) return std::nullopt;
  return k;
}

std::optional<Quaterniond> SensorMotion::attitude_at(double t_s, Order order) const {
  const auto k = bracket(t_s);
  if (!k) return std::nullopt;
  const double share = (t_s - mocap_t_s_[*k]) / (mocap_t_s_[*k + 1] - mocap_t_s_[*k]);
  return attitude(*k, order).slerp(share, attitude(*k + 1, order));
}

std::optional<Vector3d> SensorMotion::position_at(double t_s) const {
  const auto k = bracket(t_s);
  if (!k) return std::nullopt;
  const double share = (t_s - mocap_t_s_[*k]) / (mocap_t_s_[*k + 1] - mocap_t_s_[*k]);
  return position_m_[*k] + share * (position_m_[*k + 1] - position_m_[*k]);
}

Vector3d SensorMotion::gyro_integral(std::size_t k, double t_s) const {
  const double dt = t_s - imu_t_s_[k];
  const Vector3d slope = (gyro_rad_s_[k + 1] - gyro_rad_s_[k]) / (imu_t_s_[k + 1] - imu_t_s_[k]);
  return gyro_integral_rad_[k] + dt * gyro_rad_s_[k] + dt * dt / 2 * slope;
}

std::optional<Vector3d> SensorMotion::mean_rate(double begin_s, double end_s) const {
  const std::size_t first = index_before(imu_t_s_, begin_s), last = index_before(imu_t_s_, end_s);
  if (first + 1 >= imu_t_s_.size() || last + 1 >= imu_t_s_.size()) return std::nullopt;
  if (gaps_before_[last + 1] != gaps_before_[first]) return std::nullopt;
  return (gyro_integral(last, end_s) - gyro_integral(first, begin_s)) / (end_s - begin_s);
}

Vector3d SensorMotion::gyro_at(std::size_t k, double t_s) const {
  const double share = (t_s - imu_t_s_[k]) / (imu_t_s_[k + 1] - imu_t_s_[k]);
  return gyro_rad_s_[k] + share * (gyro_rad_s_[k + 1] - gyro_rad_s_[k]);
}

std::optional<Vector3d> SensorMotion::mean_turn(double begin_s, double end_s) const {
  if (!mean_rate(begin_s, end_s)) return std::nullopt;
  Quaterniond turn = Quaterniond::Identity();
  double from_s = begin_s;
  for (std::size_t k = index_before(imu_t_s_, begin_s); from_s < end_s; ++k) {
    const double to_s = std::min(end_s, imu_t_s_[k + 1]), dt = to_s - from_s;
    const Vector3d first = gyro_at(k, from_s), last = gyro_at(k, to_s);
    // Coning within the interval included (linear rate): Savage, J. Guidance, Control and Dynamics 21 (1998).
    turn = turn * exponential((first + last) * (dt / 2) + first.cross(last) * (dt * dt / 12));
    from_s = to_s;
  }
  return logarithm(turn) / (end_s - begin_s);
}

double SensorMotion::roughness_rad() const {
  double squares = 0, count = 0;
  for (std::size_t i = 1; i + 1 < mocap_t_s_.size(); ++i) {
    const double before = mocap_t_s_[i] - mocap_t_s_[i - 1], after = mocap_t_s_[i + 1] - mocap_t_s_[i];
    if (std::max(before, after) > longest_mocap_s_) continue;
    const Quaterniond between =
        attitude(i - 1, Order::wxyz).slerp(before / (before + after), attitude(i + 1, Order::wxyz));
    squares += logarithm(between.conjugate() * attitude(i, Order::wxyz)).squaredNorm() / 3;
    ++count;
  }
  return count > 0 ? std::sqrt(squares / count) : 0;
}

std::vector<BeatWindow> make_windows(const SensorMotion& motion, double length_s) {
  const std::vector<double>& t = motion.mocap_t_s();
  std::vector<BeatWindow> windows;
  for (std::size_t i = 0; i < t.size();) {
    const double end_s = t[i] + length_s;
    BeatWindow w{t[i], end_s, {}};
    bool whole = true;
    for (const Order order : kOrders) {
      const auto end = motion.attitude_at(end_s, order);
      whole &= end.has_value();
      if (end)
        w.rate_rad_s[static_cast<std::size_t>(order)] =
            logarithm(motion.attitude(i, order).conjugate() * *end) / length_s;
    }
    if (whole) windows.push_back(w);
    const std::size_t last = index_before(t, end_s);
    i = whole ? std::max(last, i + 1) : i + 1;
    if (last + 1 >= t.size()) break;
  }
  return windows;
}

Pairs pair_up(const SensorMotion& motion, const std::vector<BeatWindow>& windows, Order order, const Lag& lag) {
  constexpr double kStep_s = 0.005;  // wide enough to smooth the change over the gyro's samples
  Pairs pairs;
  for (std::size_t i = 0; i < windows.size(); ++i) {
    const BeatWindow& w = windows[i];
    const double shift = lag.at(w.middle_s());
    const auto rate = motion.mean_rate(w.begin_s + shift, w.end_s + shift);
    const auto before = motion.mean_rate(w.begin_s + shift - kStep_s, w.end_s + shift - kStep_s);
    const auto after = motion.mean_rate(w.begin_s + shift + kStep_s, w.end_s + shift + kStep_s);
    if (!rate || !before || !after) continue;
    pairs.mocap.push_back(w.rate_rad_s[static_cast<std::size_t>(order)]);
    pairs.gyro.push_back(*rate);
    pairs.gyro_change.emplace_back((*after - *before) / (2 * kStep_s));
    pairs.window.push_back(i);
  }
  return pairs;
}

Pairs with_turns(const SensorMotion& motion, const std::vector<BeatWindow>& windows, const Pairs& pairs,
                 const Lag& lag) {
  Pairs turned = pairs;
  for (std::size_t i = 0; i < pairs.gyro.size(); ++i) {
    const BeatWindow& w = windows[pairs.window[i]];
    const double shift = lag.at(w.middle_s());
    if (const auto turn = motion.mean_turn(w.begin_s + shift, w.end_s + shift)) turned.gyro[i] = *turn;
  }
  return turned;
}

std::optional<Sync> find_lag(const SensorMotion& motion, const std::vector<BeatWindow>& windows) {
  constexpr double kRange_s = 1, kStep_s = 0.005;
  // In nearly periodic motion several lags and frames match: prefer the smaller lag and the declared frame.
  constexpr double kPenalty_per_s = 0.1, kOtherFrame = 0.01;
  std::optional<Sync> best;
  double best_score = 0;
  const auto steps = static_cast<int>(std::lround(kRange_s / kStep_s));
  for (int n = -steps; n <= steps; ++n) {
    const double lag_s = n * kStep_s;
    Pairs pairs = pair_up(motion, windows, Order::wxyz, {0, lag_s, 0});
    if (pairs.mocap.size() < 10) continue;
    for (const Order order : kOrders) {
      for (std::size_t i = 0; i < pairs.mocap.size(); ++i)
        pairs.mocap[i] = windows[pairs.window[i]].rate_rad_s[static_cast<std::size_t>(order)];
      const Moments m = moments(pairs);
      if (!(m.mocap > 0 && m.gyro > 0)) continue;
      for (const Matrix3d& axes : signed_permutations()) {
        if (order != Order::wxyz && !axes.isIdentity()) break;  // test one mistake at a time
        const double correlation = overlap(axes, m.cross) / std::sqrt(m.mocap * m.gyro);
        const bool as_declared = order == Order::wxyz && axes.isIdentity();
        const double score = correlation - kPenalty_per_s * std::abs(lag_s) - (as_declared ? 0 : kOtherFrame);
        if (best && score <= best_score) continue;
        best_score = score;
        best = Sync{lag_s, correlation, {order, axes}};
      }
    }
  }
  return best;
}

std::optional<LagEstimate> refine_lag(const SensorMotion& motion, const std::vector<BeatWindow>& windows,
                                      const SensorFrame& frame, Lag start, double noise) {
  double moved_s = 0, sd = 0;
  for (int iteration = 0; iteration < 4; ++iteration) {
    // Linear fit mocap = a gyro + (a step) gyro_change + constant, for a and (a step).
    const Pairs pairs = pair_up(motion, windows, frame.order, start);
    if (pairs.mocap.size() < 10) return std::nullopt;
    const Vector3d m0 = mean_of(pairs.mocap), g0 = mean_of(pairs.gyro), c0 = mean_of(pairs.gyro_change);
    Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
    Eigen::Vector2d right = Eigen::Vector2d::Zero();
    double squares = 0;
    for (std::size_t i = 0; i < pairs.mocap.size(); ++i) {
      const Vector3d m = pairs.mocap[i] - m0, g = frame.axes * (pairs.gyro[i] - g0);
      const Vector3d c = frame.axes * (pairs.gyro_change[i] - c0);
      normal += Eigen::Matrix2d{{g.dot(g), g.dot(c)}, {g.dot(c), c.dot(c)}};
      right += Eigen::Vector2d(g.dot(m), c.dot(m));
      squares += m.squaredNorm();
    }
    if (!(normal.determinant() > 1e-12 * normal(0, 0) * normal(1, 1))) return std::nullopt;
    const Eigen::Vector2d x = normal.inverse() * right;
    const double gain = x(0), step = x(1) / gain;
    const double residual =
        std::sqrt(std::max(squares - x.dot(right), 0.0) / (3.0 * static_cast<double>(pairs.mocap.size())));
    // The larger of the expected and the observed noise: too small a value would cause false alarms.
    sd = std::max(noise, residual) * std::sqrt(normal.inverse()(1, 1)) / std::abs(gain);
    if (!(std::abs(step) < 0.1)) return std::nullopt;
    start.at_middle_s += step;
    moved_s += step;
  }
  return LagEstimate{moved_s, sd};
}

double misfit(const Pairs& pairs, const Matrix3d& axes, double scale) {
  const Moments m = moments(pairs);
  return m.mocap - 2 * scale * overlap(axes, m.cross) + scale * scale * m.gyro;
}

Gains fit_gains(const Pairs& pairs, double mocap_noise, double gyro_noise) {
  // A gain with sd 1/20 reveals every mistake of axes or units; noise of a tenth of the spread biases it by 1/100.
  constexpr double kLargestSd = 0.05, kMinSpread = 10;
  const double n = static_cast<double>(pairs.mocap.size());
  const Vector3d m0 = mean_of(pairs.mocap), g0 = mean_of(pairs.gyro);
  Matrix3d square = Matrix3d::Zero(), cross = Matrix3d::Zero();
  for (std::size_t i = 0; i < pairs.mocap.size(); ++i) {
    const Vector3d g = pairs.gyro[i] - g0;
    square += g * g.transpose();
    cross += (pairs.mocap[i] - m0) * g.transpose();
  }
  Gains fit;
  fit.spread = (square.diagonal() / n).cwiseSqrt();
  std::vector<int> axes;
  for (int i = 0; i < 3; ++i) {
    if (fit.spread(i) > kMinSpread * gyro_noise && fit.spread(i) > 0) axes.push_back(i);
  }
  Eigen::MatrixXd inverse;
  while (!axes.empty()) {
    inverse = Eigen::MatrixXd(square(axes, axes)).inverse();
    Eigen::Index worst = 0;
    const double variance = inverse.diagonal().maxCoeff(&worst);
    if (mocap_noise * std::sqrt(variance) <= kLargestSd) break;
    axes.erase(axes.begin() + worst);
  }
  // Rotation about an untested axis may correlate with that about others: subtract it with gain 1.
  for (int i = 0; i < 3; ++i) {
    if (std::ranges::find(axes, i) != axes.end()) continue;
    fit.gain(i, i) = 1;
    cross.row(i) -= square.row(i);
  }
  if (!axes.empty()) {
    const Eigen::MatrixXd solved = Eigen::MatrixXd(cross(Eigen::all, axes)) * inverse;
    for (std::size_t k = 0; k < axes.size(); ++k) {
      const auto column = static_cast<Eigen::Index>(k);
      fit.gain.col(axes[k]) = solved.col(column);
      fit.gain_sd(axes[k]) = mocap_noise * std::sqrt(inverse(column, column));
      fit.tested[static_cast<std::size_t>(axes[k])] = true;
    }
  }
  fit.offset = m0 - fit.gain * g0;
  for (int i = 0; i < 3; ++i)
    fit.offset_sd(i) =
        mocap_noise * std::sqrt(1 / n + (fit.gain_sd.cwiseProduct(g0) / std::max(mocap_noise, 1e-12)).squaredNorm());
  for (std::size_t i = 0; i < pairs.mocap.size(); ++i)
    fit.residual += (pairs.mocap[i] - fit.gain * pairs.gyro[i] - fit.offset).cwiseAbs2() / n;
  fit.residual = fit.residual.cwiseSqrt();
  return fit;
}

}  // namespace flappy::flightlog
