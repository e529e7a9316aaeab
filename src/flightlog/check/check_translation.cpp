#include <algorithm>
#include <cmath>

#include "flightlog/check/check_motion.hpp"

namespace flappy::flightlog {
namespace {

// ---- the accelerometer

std::string axis_name(const Vector3d& v) {
  Eigen::Index i = 0;
  v.cwiseAbs().maxCoeff(&i);
  return std::string(v(i) > 0 ? "+" : "-") + kAxes[i];
}

/// Axes and unit that turn the accelerometer's columns into a specific force in B; nothing where unknown.
std::optional<Matrix3d> check_gravity(Context& c) {
  const double gravity = c.log.header.gravity_m_s2;
  const auto not_tested = [&](const char* why) {
    c.add_finding("accelerometer", Verdict::not_tested, why);
    return std::nullopt;
  };
  const std::vector<double>& t = c.motion.imu_t_s();
  std::vector<Matrix3d> turns;
  std::vector<Vector3d> felt;
  double begin_s = 0, end_s = 0;
  for (std::size_t k = 0; k < t.size(); ++k) {
    const double at = t[k] - c.lag.at(t[k]);
    const auto q = c.motion.attitude_at(at, c.frame.order);
    if (!q) continue;
    if (turns.empty()) begin_s = at;
    end_s = at;
    turns.push_back(q->toRotationMatrix());
    felt.emplace_back(c.accel_axes * c.motion.accel_m_s2()[k]);
  }
  if (t.empty()) return not_tested("there is no imu.csv");
  if (end_s - begin_s < 2) return not_tested("shorter than 2 s");
  if (gravity < 1) return not_tested("hardly any gravity declared");
  const double n = static_cast<double>(turns.size());
  const auto mean_with = [&](const Matrix3d& correction) {
    Vector3d sum = Vector3d::Zero();
    for (std::size_t k = 0; k < turns.size(); ++k) sum += turns[k] * (correction * felt[k]) / n;
    return sum;
  };
  const Matrix3d one = Matrix3d::Identity();
  const Vector3d up = mean_with(one), weight(0, 0, gravity);
  Vector3d body = Vector3d::Zero();
  for (const Vector3d& f : felt) body += f / n;
  // Accelerations average out, except 3 / duration for a velocity that changes by 3 m/s; noise to sd / sqrt(n). A fifth
  // of gravity allows for bias and vibration rectification, which no log declares.
  const double allowed =
      0.2 * gravity + 3 / (end_s - begin_s) + kSigmas * c.log.header.imu.accel_noise_m_s2 / std::sqrt(n);
  const Values values = {{"mean_x_m_s2", up(0)}, {"mean_y_m_s2", up(1)}, {"mean_z_m_s2", up(2)}};
  const std::string seen = format("mean specific force (%.2f, %.2f, %.2f) m/s^2 in W", up(0), up(1), up(2));
  const std::string expected = format(", (0, 0, %.2f) +- %.1f expected: ", gravity, allowed);
  const auto is_up = [&](const Vector3d& v) { return (v - weight).norm() <= allowed; };
  const auto warn = [&](const std::string& cause, const std::string& file = kImu) {
    c.add_finding("accelerometer", Verdict::warning, seen + expected + cause, values, {file});
  };
  if (is_up(up)) {
    c.add_finding("accelerometer", Verdict::ok, seen, values);
    return one;
  }
  if (!c.frame.axes.isIdentity() && is_up(mean_with(c.frame.axes))) {
    warn("its axes are those of the gyro: the whole sensor is turned, or in another convention");
    return c.frame.axes;
  }
  if (is_up(-up)) {
    warn("the sign is flipped: gravity instead of specific force, or axes reversed");
    return Matrix3d(-one);
  }
  if (is_up(up * gravity)) {
    warn("the accelerometer is likely in g, not m/s^2");
    return Matrix3d(one * gravity);
  }
  if (is_up(-up * gravity)) {
    warn("the accelerometer is likely in g, not m/s^2, and its sign is flipped");
    return Matrix3d(-one * gravity);
  }
  if (body.norm() <= allowed && up.norm() <= allowed && body.norm() < 0.5 * gravity) {
    // An accelerometer in g also reads about a tenth, in any direction; so far excluded for the vertical only.
    warn("gravity is missing: acceleration instead of specific force");
    return one;
  }
  const std::string points = "at rest it would point along the body's +z; it points along " + axis_name(body) + " in B";
  const auto fits = [&](const Matrix3d& m) { return is_up(mean_with(m)); };
  const auto found = std::ranges::find_if(signed_permutations(), fits);
  if (found != signed_permutations().end() && axis_name(body) != "+z") warn("wrong axes: " + points);
  else if (std::abs(up.norm() - gravity) <= allowed)
    warn("attitude and accelerometer disagree about up by " +
             format("%.0f deg: ", std::acos(std::clamp(up(2) / up.norm(), -1.0, 1.0)) / kDegree) +
             "W is not z up, or the attitude is of another body",
         kMocap);
  else warn("another unit, or a wrong scale");
  return std::nullopt;
}

// ---- the position

void check_scale(Context& c, const std::optional<Matrix3d>& correction) {
  const auto not_tested = [&](const std::string& why) { c.add_finding("position scale", Verdict::not_tested, why); };
  if (!correction) return not_tested("needs an accelerometer that is understood");
  const FlightHeader& h = c.log.header;
  // Second differences over span_s equal the acceleration with triangular weights of width 2 span_s.
  const double span_s = h.flapping_Hz > 0 ? std::max(std::round(0.2 * h.flapping_Hz), 1.0) / h.flapping_Hz : 0.2;
  const std::vector<double>& t = c.motion.imu_t_s();
  const Vector3d arm(h.imu.position_m[0], h.imu.position_m[1], h.imu.position_m[2]);
  const auto at_imu = [&](double at) -> std::optional<Vector3d> {
    const auto p = c.motion.position_at(at);
    const auto q = c.motion.attitude_at(at, c.frame.order);
    if (!p || !q) return std::nullopt;
    return *p + *q * arm;
  };
  std::vector<Vector3d> moved, felt;
  const std::vector<double>& poses_s = c.motion.mocap_t_s();
  for (double middle = next_window(poses_s, 0, span_s); middle + span_s < poses_s.back();
       middle = next_window(poses_s, middle, span_s)) {
    const double shift = c.lag.at(middle);
    const auto before = at_imu(middle - span_s), here = at_imu(middle), after = at_imu(middle + span_s);
    if (!before || !here || !after || !c.motion.mean_rate(middle - span_s + shift, middle + span_s + shift)) continue;
    Vector3d sum = Vector3d::Zero();
    bool whole = true;
    for (std::size_t k = index_before(t, middle - span_s + shift) + 1; t[k] < middle + span_s + shift; ++k) {
      const auto q = c.motion.attitude_at(t[k] - shift, c.frame.order);
      whole &= q.has_value();
      if (q)
        sum += (span_s - std::abs(t[k] - shift - middle)) * (t[k + 1] - t[k - 1]) / 2 *
               (*q * (*correction * (c.accel_axes * c.motion.accel_m_s2()[k])));
    }
    if (!whole) continue;
    moved.emplace_back(*after - 2 * *here + *before);
    felt.push_back(sum);
  }
  const double n = static_cast<double>(moved.size());
  if (moved.size() < 5) return not_tested("too short, or too many gaps");
  Vector3d m0 = Vector3d::Zero(), f0 = Vector3d::Zero();
  for (std::size_t i = 0; i < moved.size(); ++i) m0 += moved[i] / n, f0 += felt[i] / n;
  double mm = 0, mf = 0, ff = 0;
  for (std::size_t i = 0; i < moved.size(); ++i) {
    const Vector3d m = moved[i] - m0, f = felt[i] - f0;
    mm += m.squaredNorm(), mf += m.dot(f), ff += f.squaredNorm();
  }
  // Noise of the triangle-weighted accelerometer, and of gravity turned by a noisy attitude.
  const double triangle = std::sqrt(2.0 / 3 * span_s * span_s * span_s);
  const double felt_noise =
      triangle * std::hypot(h.imu.accel_noise_m_s2 / std::sqrt(h.imu.rate_hz),
                            h.gravity_m_s2 * h.mocap.attitude_noise_rad / std::sqrt(h.mocap.rate_hz));
  const double moved_noise = std::sqrt(6.0) * h.mocap.position_noise_m;
  const double gain = mf / ff, sd = std::hypot(moved_noise, felt_noise) / std::sqrt(ff),
               alike = mf / std::sqrt(mm * ff);
  if (!(sd < 0.05) || ff / (3 * n) < 25 * felt_noise * felt_noise) return not_tested("too little acceleration");
  const std::string seen =
      format("positions accelerate %.4g x as the accelerometer feels (alike by %.2f)", gain, alike);
  const Values values = {{"gain", gain}, {"gain_sd", sd}, {"correlation", alike}};
  // A quarter allows for vibration and flexible mounts; different units differ by more.
  const double allowed = 0.25 + kSigmas * sd;
  const auto is = [&](double unit) { return std::abs(gain / unit - 1) <= allowed; };
  if (is(1)) return c.add_finding("position scale", Verdict::ok, seen, values);
  if (!correction->isDiagonal() || !(*correction / (*correction)(0, 0)).isIdentity()) {
    if (alike < 0.7) return not_tested("needs an accelerometer that is understood");
  }
  std::string cause = alike > 0.5 ? "another unit" : "attitude, accelerometer or clock do not belong to this motion";
  if (is(1000)) cause = "likely in mm, not m";
  if (is(100)) cause = "likely in cm, not m";
  if (is(1 / 0.0254)) cause = "likely in inches, not m";
  c.add_finding("position scale", Verdict::warning, seen + ", 1 expected: " + cause, values,
                alike > 0.9 ? LogPlace{kMocap} : LogPlace{});
}

void check_speed(Context& c) {
  const MocapStream& m = c.log.mocap;
  std::vector<double> speeds;
  const double usual_s = 1 / stream_statistics("", m.t_s, std::nullopt).rate_hz;
  for (std::size_t i = 1; i < m.t_s.size(); ++i) {
    const double dt = std::max(m.t_s[i] - m.t_s[i - 1], 0.5 * usual_s);
    speeds.push_back(std::hypot(m.x_m[i] - m.x_m[i - 1], m.y_m[i] - m.y_m[i - 1], m.z_m[i] - m.z_m[i - 1]) / dt);
  }
  std::ranges::sort(speeds);
  const double usual = speeds[speeds.size() * 9 / 10], largest = speeds.back();
  // Twice the speed of a hummingbird, and the noise of two samples at 6 sd: one in 1e9.
  const double fastest = 20 + 6 * std::numbers::sqrt2 * c.log.header.mocap.position_noise_m / (0.5 * usual_s);
  const Values values = {{"largest_m_s", largest}};
  const std::string seen = format("up to %.3g m/s", largest),
                    expected = seen + format(", at most %.3g expected: ", fastest);
  if (usual > fastest)
    c.add_finding("speed", Verdict::warning, expected + "positions likely in mm, not m, or t_s not in seconds", values,
                  {kMocap});
  else if (largest > fastest)
    c.add_finding("speed", Verdict::warning, expected + "positions jump; markers mistaken for one another?", values);
  else c.add_finding("speed", Verdict::ok, seen, values);
}

void check_upright(Context& c) {
  Vector3d up = Vector3d::Zero();
  for (std::size_t i = 0; i < c.motion.mocap_t_s().size(); ++i)
    up += c.motion.attitude(i, c.frame.order) * Vector3d::UnitZ();
  up.normalize();
  const double tilt = std::acos(std::clamp(up(2), -1.0, 1.0));
  const std::string seen = format("the body's z axis points %.0f deg off +z of W on average", tilt / kDegree);
  // Wings lift along the body's z axis, so it points up on average, or the flight is a fall.
  if (tilt < std::numbers::pi / 3) c.add_finding("upright", Verdict::ok, seen, {{"tilt_rad", tilt}});
  else
    c.add_finding("upright", Verdict::warning,
                  seen + ", along " + axis_name(up) + ", below 60 expected: W is not z up, or B is not",
                  {{"tilt_rad", tilt}}, {kMocap});
}

}  // namespace

void check_translation(Context& c) {
  check_scale(c, check_gravity(c));
  check_speed(c);
  check_upright(c);
}

}  // namespace flappy::flightlog
