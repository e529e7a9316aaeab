// Gyro, attitude, accelerometer and position against one another: they saw one motion, so what one says of it the others
// must. Noise is as declared; a mistake of axes, units or clocks is much larger.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "gap/check_parts.hpp"
#include "gap/motion.hpp"

namespace flappy::gap {
namespace {

using flight::FlightLog;
using Values = std::vector<std::pair<std::string, double>>;

constexpr double kDegree = std::numbers::pi / 180;
constexpr const char* kAxes = "xyz";

/// What the checks find out on the way and the next ones need.
struct Context {
  const FlightLog& log;
  Findings& findings;
  Motion motion;
  std::vector<Window> windows;
  double window_s;
  double rate_noise;  ///< rad/s, of a window's mean rate, from mocap
  double gyro_noise;  ///< rad/s, of a window's mean rate, from the gyro
  Frame frame;        ///< as found; as declared where that fits or nothing was found
  Lag lag;

  void say(const std::string& check, Verdict verdict, const std::string& text, Values values = {}) {
    findings.push_back({check, verdict, text, std::move(values)});
  }
};

double spread(const std::vector<Vector3d>& values) {
  Vector3d mean = Vector3d::Zero();
  double squares = 0;
  for (const Vector3d& v : values) mean += v / static_cast<double>(values.size());
  for (const Vector3d& v : values) squares += (v - mean).squaredNorm();
  return std::sqrt(squares / static_cast<double>(values.size()));
}

/// "gyro_x is the body's +y, gyro_y its -x, gyro_z its +z"
std::string describe_axes(const std::string& sensor, const Matrix3d& axes) {
  std::string text;
  for (int j = 0; j < 3; ++j) {
    Eigen::Index i = 0;
    axes.col(j).cwiseAbs().maxCoeff(&i);
    text += (j == 0 ? "" : ", ") + sensor + "_" + kAxes[j] + (j == 0 ? " is the body's " : " its ") +
            (axes(i, j) > 0 ? "+" : "-") + kAxes[i];
  }
  return text;
}

// ---- the clock

/// Whether the gyro's clock could be told against mocap's; leaves lag and frame.
bool check_clock(Context& c) {
  const flight::ImuHeader& imu = c.log.header.imu;
  const auto not_tested = [&](const std::string& why) {
    c.say("clock", Verdict::not_tested, "not tested: " + why);
    return false;
  };
  if (c.windows.size() < 20) return not_tested("too short, or too many gaps");
  const Pairs here = pair_up(c.motion, c.windows, Order::wxyz, {});
  if (here.mocap.size() < 20) return not_tested("mocap and gyro have too little time in common");
  // The mean of N windows is known to noise / sqrt(N); motion of a few times the noise of one is seen in any case.
  const double mocap = spread(here.mocap), gyro = spread(here.gyro);
  const bool mocap_turns = mocap > 3 * std::sqrt(3.0) * c.rate_noise,
             gyro_turns = gyro > 3 * std::sqrt(3.0) * c.gyro_noise;
  if (!mocap_turns && !gyro_turns) return not_tested("too little rotation");
  const auto sync = find_lag(c.motion, c.windows);
  if (!sync || sync->correlation < 0.5) {
    if (!mocap_turns || !gyro_turns) {
      // Only one of them moves, and by more than its noise.
      if (std::max(mocap / c.rate_noise, gyro / c.gyro_noise) < 20) return not_tested("too little rotation");
    }
    not_tested("gyro and mocap do not match");
    c.say("gyro", Verdict::warning,
          format("rotation rates of gyro (%.3g rad/s rms) and mocap (%.3g) are alike by %.2f at most, in any frame and "
                 "within "
                 "half a second; above 0.5 expected: another body, another flight, or clocks far apart",
                 gyro, mocap, sync ? sync->correlation : 0.0));
    return false;
  }
  const auto lag = refine_lag(c.motion, c.windows, *sync, c.rate_noise);
  if (!lag || lag->sd > 0.0025) return not_tested("too little rotation");
  c.frame = sync->frame;
  c.lag = {0, lag->value, 0};

  // A first-order low-pass delays slow motion by 1 / (2 pi bandwidth). Whether the declared latency has it in, and of
  // which order the filter is, the log does not say: from nothing to twice that. 0.5 ms more for how samples are stamped.
  const double filter_s = 1 / (2 * std::numbers::pi * imu.bandwidth_hz),
               allowed_s = filter_s + kSigmas * lag->sd + 5e-4;
  const double declared_s = imu.latency_s - c.log.header.mocap.latency_s;
  const std::string seen = format("gyro comes %.1f ms after mocap", 1e3 * (lag->value + declared_s));
  const std::string expected =
      format(", %.1f +- %.1f ms expected from latencies and bandwidth", 1e3 * (declared_s + filter_s), 1e3 * allowed_s);
  const bool good = std::abs(lag->value - filter_s) <= allowed_s;
  c.say("clock", good ? Verdict::ok : Verdict::warning,
        seen + expected + (good ? "" : ": clocks apart, or a wrong latency"),
        {{"lag_s", lag->value}, {"lag_sd_s", lag->sd}, {"correlation", sync->correlation}});

  // Whether it stays so: the first third against the last.
  const auto part = [&](std::size_t begin, std::size_t end) -> std::optional<Estimate> {
    const std::vector<Window> some(c.windows.begin() + static_cast<std::ptrdiff_t>(begin),
                                   c.windows.begin() + static_cast<std::ptrdiff_t>(end));
    auto start = find_lag(c.motion, some);
    if (!start || start->frame.order != sync->frame.order || start->frame.axes != sync->frame.axes) start = sync;
    return refine_lag(c.motion, some, *start, c.rate_noise);
  };
  const std::size_t third = c.windows.size() / 3;
  const auto first = part(0, third), last = part(c.windows.size() - third, c.windows.size());
  if (!first || !last || std::hypot(first->sd, last->sd) > 0.0025) {
    c.say("clock speed", Verdict::not_tested,
          "not tested: too short, or too little rotation at the beginning or the end");
    return true;
  }
  const double begin_s = c.windows[third / 2].middle_s(),
               end_s = c.windows[c.windows.size() - 1 - third / 2].middle_s();
  const double change_s = last->value - first->value, per_s = change_s / (end_s - begin_s);
  // A millisecond over a flight is a sixth of a radian of the beat, which no check here minds.
  const double unnoticed_s = 1e-3 + kSigmas * std::hypot(first->sd, last->sd);
  const bool steady = std::abs(change_s) <= unnoticed_s;
  c.say("clock speed", steady ? Verdict::ok : Verdict::warning,
        format("gyro against mocap moves by %.2f ms in %.3g s, at most %.2f ms expected", 1e3 * change_s,
               end_s - begin_s, 1e3 * unnoticed_s) +
            (steady ? "" : format(": clocks run at different speeds, by %.0f ppm", 1e6 * per_s)),
        {{"change_s", change_s}, {"per_s", per_s}});
  if (!steady) c.lag = {(begin_s + end_s) / 2, (first->value + last->value) / 2, per_s};
  return true;
}

// ---- the gyro

struct Hypothesis {
  Frame frame;
  double scale;
  std::string text;
};

/// Mistakes that people make, the likelier ones first.
std::vector<Hypothesis> mistakes() {
  const Matrix3d one = Matrix3d::Identity();
  std::vector<Hypothesis> list = {
      {{Order::wxyz, one}, kDegree, "the gyro is likely in deg/s, not rad/s"},
      {{Order::xyzw, one}, 1, "the quaternion order is likely x, y, z, w, not w, x, y, z"},
      {{Order::wxyz_inverse, one},
       1,
       "the quaternion is likely inverse, world to body (or the gyro has all signs flipped)"},
      {{Order::xyzw_inverse, one}, 1, "the quaternion order is likely x, y, z, w and inverse, world to body"}};
  const auto flips = [](const Matrix3d& m) { return (m.diagonal().array() < 0).count(); };
  std::vector<Hypothesis> axes;
  for (const Matrix3d& m : signed_permutations()) {
    if (m.isIdentity()) continue;
    const bool diagonal = m.isDiagonal();
    std::string text = "axes are flipped: ";
    if (!diagonal) text = "axes are swapped: ";
    axes.push_back({{Order::wxyz, m}, 1, text + describe_axes("gyro", m)});
  }
  // One flipped axis, then two, then turned frames, then mirrored ones.
  std::ranges::stable_sort(axes, {}, [&](const Hypothesis& h) {
    if (h.frame.axes.isDiagonal()) return static_cast<double>(flips(h.frame.axes));
    return h.frame.axes.determinant() > 0 ? 4.0 : 5.0;
  });
  list.insert(list.end(), axes.begin(), axes.end());
  const std::size_t count = list.size();
  for (std::size_t i = 1; i < count; ++i)
    list.push_back({list[i].frame, kDegree, "the gyro is likely in deg/s, not rad/s, and " + list[i].text});
  list.push_back({{Order::wxyz, one}, 1 / kDegree, "the gyro is too small by 57: converted to radians twice?"});
  return list;
}

/// The mistake that explains the rates, if any does; leaves the frame.
std::string find_mistake(Context& c) {
  const std::vector<Hypothesis> all = mistakes();
  std::vector<double> left;
  double total = 0, noise = 0;
  for (const Hypothesis& h : all) {
    const Pairs pairs = pair_up(c.motion, c.windows, h.frame.order, c.lag);
    left.push_back(remainder(pairs, h.frame.axes, h.scale));
    total = remainder(pairs, Matrix3d::Identity(), 0);
    noise = 3 * static_cast<double>(pairs.mocap.size()) * c.rate_noise * c.rate_noise;
  }
  // Some mistakes look alike near level flight. Within what noise does to a sum of squares, the likelier one counts.
  const double least = *std::ranges::min_element(left);
  if (least > 0.5 * total) return "";
  const auto found = std::ranges::find_if(left, [&](double r) { return r <= 2 * least + 2 * noise; });
  const Hypothesis& h = all[static_cast<std::size_t>(found - left.begin())];
  c.frame = h.frame;
  return h.text;
}

void check_gyro(Context& c) {
  const Pairs pairs = pair_up(c.motion, c.windows, Order::wxyz, c.lag);
  const Gains fit = fit_gains(pairs, c.rate_noise, c.gyro_noise);
  Values values;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) values.emplace_back(std::string("gain_") + kAxes[i] + kAxes[j], fit.gain(i, j));
  }
  // Scale errors and misalignment of a mounted sensor stay below a tenth; no mistake of axes or units does.
  bool good = true;
  for (int j = 0; j < 3; ++j) {
    if (!fit.tested[static_cast<std::size_t>(j)]) continue;
    const Vector3d error = fit.gain.col(j) - Vector3d::Unit(j);
    good &= error.cwiseAbs().maxCoeff() <= 0.1 + kSigmas * fit.gain_sd(j);
  }
  // What gains leave over: noise of both, and a twentieth for what a constant gain cannot say.
  Vector3d expected;
  for (int i = 0; i < 3; ++i) expected(i) = std::hypot(c.rate_noise, c.gyro_noise, 0.05 * fit.spread.norm());
  std::string odd;
  for (int i = 0; i < 3; ++i) {
    if (fit.residual(i) > 3 * expected(i))
      odd +=
          (odd.empty() ? "" : "; ") + format("about %c mocap turns otherwise by %.3g rad/s rms, at most %.3g expected",
                                             kAxes[i], fit.residual(i), 3 * expected(i));
  }
  if (good && odd.empty()) {
    c.frame = {};
    for (int j = 0; j < 3; ++j) {
      const std::string name = std::string("gyro ") + kAxes[j];
      if (fit.tested[static_cast<std::size_t>(j)])
        c.say(name, Verdict::ok, format("mocap turns %.3f x as fast", fit.gain(j, j)), j == 0 ? values : Values{});
      else c.say(name, Verdict::not_tested, "not tested: too little rotation");
    }
    // Bias: the difference of the means, whose noise averages out.
    Vector3d bias = Vector3d::Zero(), rate = Vector3d::Zero();
    const double n = static_cast<double>(pairs.mocap.size());
    for (std::size_t i = 0; i < pairs.mocap.size(); ++i)
      bias += (pairs.gyro[i] - pairs.mocap[i]) / n, rate += pairs.mocap[i] / n;
    std::string wrong;
    for (int i = 0; i < 3; ++i) {
      const double sd =
          std::hypot(c.log.header.imu.gyro_bias_sd_rad_s[static_cast<std::size_t>(i)], c.rate_noise / std::sqrt(n));
      const double allowed = kSigmas * sd + 0.1 * rate.norm() + 0.005;
      if (std::abs(bias(i)) > allowed)
        wrong +=
            (wrong.empty() ? "" : ", ") + format("%c %.3g rad/s (at most %.2g expected)", kAxes[i], bias(i), allowed);
    }
    c.say("gyro bias", wrong.empty() ? Verdict::ok : Verdict::warning,
          wrong.empty() ? format("x %.3g, y %.3g, z %.3g rad/s", bias(0), bias(1), bias(2))
                        : wrong + ": gyro_bias_sd_rad_s is too small, or the gyro was not zeroed",
          {{"x_rad_s", bias(0)}, {"y_rad_s", bias(1)}, {"z_rad_s", bias(2)}});
    return;
  }
  std::string seen;
  for (int j = 0; j < 3; ++j) {
    Eigen::Index i = 0;
    fit.gain.col(j).cwiseAbs().maxCoeff(&i);
    if (fit.tested[static_cast<std::size_t>(j)])
      seen += (seen.empty() ? "" : ", ") + format("%.3g x gyro_%c about %c", fit.gain(i, j), kAxes[j], kAxes[i]);
  }
  if (seen.empty() && odd.empty()) return c.say("gyro", Verdict::not_tested, "not tested: too little rotation");
  const std::string cause = good ? "" : find_mistake(c);
  if (good) c.frame = {};
  c.say("gyro", Verdict::warning,
        (good ? odd : "mocap turns " + seen + ", 1 x about the same axis expected") + ": " +
            (!cause.empty() ? cause
             : good         ? "attitude_noise_rad is too small, or markers moved"
                            : "axes, units or a bent mount"),
        values);
}

// ---- the accelerometer

std::string axis_name(const Vector3d& v) {
  Eigen::Index i = 0;
  v.cwiseAbs().maxCoeff(&i);
  return std::string(v(i) > 0 ? "+" : "-") + kAxes[i];
}

/// What makes the accelerometer's columns a specific force in B: axes and unit. Nothing where that is not known.
std::optional<Matrix3d> check_gravity(Context& c) {
  const double gravity = c.log.header.gravity_m_s2;
  const auto not_tested = [&](const char* why) {
    c.say("accelerometer", Verdict::not_tested, std::string("not tested: ") + why);
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
    felt.push_back(c.motion.accel_m_s2()[k]);
  }
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
  // Accelerations average out: 3 m/s more at the end than at the beginning leaves 3 / duration, the noise
  // sd / sqrt(n). A fifth of gravity for bias and for what vibration rectifies, which no log declares.
  const double allowed =
      0.2 * gravity + 3 / (end_s - begin_s) + kSigmas * c.log.header.imu.accel_noise_m_s2 / std::sqrt(n);
  const Values values = {{"mean_x_m_s2", up(0)}, {"mean_y_m_s2", up(1)}, {"mean_z_m_s2", up(2)}};
  const std::string seen = format("mean specific force (%.2f, %.2f, %.2f) m/s^2 in W", up(0), up(1), up(2));
  const std::string expected = format(", (0, 0, %.2f) +- %.1f expected: ", gravity, allowed);
  const auto is_up = [&](const Vector3d& v) { return (v - weight).norm() <= allowed; };
  const auto warn = [&](const std::string& cause) {
    c.say("accelerometer", Verdict::warning, seen + expected + cause, values);
  };
  if (is_up(up)) {
    c.say("accelerometer", Verdict::ok, seen, values);
    return one;
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
    // In g it would be a tenth of gravity whichever way it points; that was ruled out for the vertical only.
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
         "W is not z up, or the attitude is of another body");
  else warn("another unit, or a wrong scale");
  return std::nullopt;
}

// ---- the position

void check_scale(Context& c, const std::optional<Matrix3d>& correction) {
  const auto not_tested = [&](const std::string& why) {
    c.say("position scale", Verdict::not_tested, "not tested: " + why);
  };
  if (!correction) return not_tested("needs an accelerometer that is understood");
  const flight::FlightHeader& h = c.log.header;
  // Second differences of the position over T against the acceleration weighted with a triangle of 2 T.
  const double span_s = std::max(std::round(0.2 * h.flapping_Hz), 1.0) / h.flapping_Hz;
  const std::vector<double>& t = c.motion.imu_t_s();
  const Vector3d arm(h.imu.position_m[0], h.imu.position_m[1], h.imu.position_m[2]);
  const auto at_imu = [&](double at) -> std::optional<Vector3d> {
    const auto p = c.motion.position_at(at);
    const auto q = c.motion.attitude_at(at, c.frame.order);
    if (!p || !q) return std::nullopt;
    return *p + *q * arm;
  };
  std::vector<Vector3d> moved, felt;
  for (double middle = span_s; middle + span_s < c.motion.mocap_t_s().back(); middle += span_s) {
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
               (*q * (*correction * c.motion.accel_m_s2()[k]));
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
  // Noise of a triangle-weighted mean of the accelerometer, and of gravity seen through a noisy attitude.
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
  // A quarter for vibration and for flexible mounts; no unit is that near to another.
  const double allowed = 0.25 + kSigmas * sd;
  const auto is = [&](double unit) { return std::abs(gain / unit - 1) <= allowed; };
  if (is(1)) return c.say("position scale", Verdict::ok, seen, values);
  std::string cause = "another unit, or axes of W and attitude that do not belong together";
  if (is(1000)) cause = "likely in mm, not m";
  if (is(100)) cause = "likely in cm, not m";
  if (is(1 / 0.0254)) cause = "likely in inches, not m";
  c.say("position scale", Verdict::warning, seen + ", 1 expected: " + cause, values);
}

void check_speed(Context& c) {
  std::vector<double> speeds;
  for (const Window& w : c.windows) {
    const auto a = c.motion.position_at(w.begin_s), b = c.motion.position_at(w.end_s);
    if (a && b) speeds.push_back((*b - *a).norm() / w.duration_s());
  }
  if (speeds.empty()) return c.say("speed", Verdict::not_tested, "not tested: too many gaps");
  std::ranges::sort(speeds);
  const double usual = speeds[speeds.size() * 9 / 10], largest = speeds.back();
  constexpr double kFastest = 20;  // m/s; twice what a hummingbird flies
  const Values values = {{"largest_m_s", largest}};
  const std::string seen = format("up to %.3g m/s", largest),
                    expected = seen + format(", at most %g expected: ", kFastest);
  if (usual > kFastest)
    c.say("speed", Verdict::warning, expected + "positions likely in mm, not m, or t_s not in seconds", values);
  else if (largest > kFastest)
    c.say("speed", Verdict::warning, expected + "positions jump; markers mistaken for one another?", values);
  else c.say("speed", Verdict::ok, seen, values);
}

void check_upright(Context& c) {
  Vector3d up = Vector3d::Zero();
  for (std::size_t i = 0; i < c.motion.mocap_t_s().size(); ++i)
    up += c.motion.attitude(i, c.frame.order) * Vector3d::UnitZ();
  up.normalize();
  const double tilt = std::acos(std::clamp(up(2), -1.0, 1.0));
  const std::string seen = format("the body's z axis points %.0f deg off +z of W on average", tilt / kDegree);
  // Wings lift along the body's z: on average it points up, or the flight is a fall.
  if (tilt < std::numbers::pi / 3) c.say("upright", Verdict::ok, seen, {{"tilt_rad", tilt}});
  else
    c.say("upright", Verdict::warning,
          seen + ", along " + axis_name(up) + ", below 60 expected: W is not z up, or B is not", {{"tilt_rad", tilt}});
}

}  // namespace

void check_motion(const FlightLog& log, Findings& findings) {
  const flight::FlightHeader& h = log.header;
  // Whole beats, in which what the beat shakes averages out; about 50 ms, and two samples of mocap or more.
  const double window_s =
      std::max(std::round(0.05 * h.flapping_Hz), std::ceil(2.5 / h.mocap.rate_hz * h.flapping_Hz)) / h.flapping_Hz;
  Context c{log, findings, Motion(log), {}, std::max(window_s, 1 / h.flapping_Hz), 0, 0, {}, {}};
  c.windows = make_windows(c.motion, c.window_s);
  double squares = 0;
  for (const Window& w : c.windows) squares += w.rate_rad_s[0].squaredNorm() / static_cast<double>(c.windows.size());
  // Two attitudes a window apart; and how far the body turns while arrival times jitter.
  const double jitter_s = std::hypot(stream_statistics("", log.mocap.t_s, std::nullopt).jitter_s,
                                     stream_statistics("", log.imu.t_s, std::nullopt).jitter_s);
  c.rate_noise = std::max(
      std::hypot(std::numbers::sqrt2 * h.mocap.attitude_noise_rad, jitter_s * std::sqrt(squares)) / c.window_s, 1e-4);
  c.gyro_noise = std::max(h.imu.gyro_noise_rad_s / std::sqrt(std::max(h.imu.rate_hz * c.window_s, 1.0)), 1e-5);
  if (check_clock(c)) check_gyro(c);
  else if (findings.back().check != "gyro") c.say("gyro", Verdict::not_tested, findings.back().text);
  check_scale(c, check_gravity(c));
  check_speed(c);
  check_upright(c);
}

}  // namespace flappy::gap
