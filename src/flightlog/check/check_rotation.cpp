#include <algorithm>
#include <cmath>

#include "flightlog/check/check_motion.hpp"

namespace flappy::flightlog {
namespace {

double spread(const std::vector<Vector3d>& values) {
  Vector3d mean = Vector3d::Zero();
  double squares = 0;
  for (const Vector3d& v : values) mean += v / static_cast<double>(values.size());
  for (const Vector3d& v : values) squares += (v - mean).squaredNorm();
  return std::sqrt(squares / static_cast<double>(values.size()));
}

/// "x 0.31, y 0.2, z 1.1": spread of each axis.
std::string per_axis(const std::vector<Vector3d>& values) {
  std::string text;
  for (int i = 0; i < 3; ++i) {
    std::vector<Vector3d> axis;
    for (const Vector3d& v : values) axis.emplace_back(v(i), 0, 0);
    text += (i == 0 ? "" : ", ") + format("%c %.3g", kAxes[i], spread(axis));
  }
  return text;
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

/// Delays up to this are an effect that a diagnosis finds (mocap_delay, 0.02 s); beyond it the clocks are wrong.
constexpr double kLargestDelay_s = 0.03;
/// Largest delay for declared inputs: a diagnosis uses only beat-averaged motion of some Hz, which tolerates more.
constexpr double kLargestSlowDelay_s = 0.1;
/// Crystals agree to 1e-4; a clock with ten times that drift is wrong.
constexpr double kLargestDrift = 1e-3;

/// Refines a first estimate; returns the total lag at the middle of `start`.
std::optional<LagEstimate> refine_from(const Context& c, const std::vector<BeatWindow>& windows, const Lag& start) {
  auto lag = refine_lag(c.motion, windows, c.frame, start, c.rate_noise);
  if (lag) lag->value += start.at_middle_s;
  return lag;
}

/// Estimates the lag of the gyro's clock behind mocap's; sets lag and frame. False where it cannot be estimated.
bool check_clock(Context& c) {
  const ImuHeader& imu = c.log.header.imu;
  const auto not_tested = [&](const std::string& why) {
    c.add_finding("clock", Verdict::not_tested, why);
    return false;
  };
  if (c.windows.size() < 20) return not_tested("too short, or too many gaps");
  const Pairs here = pair_up(c.motion, c.windows, Order::wxyz, {});
  if (here.mocap.size() < 20) return not_tested("mocap and gyro have too little time in common");
  const double mocap = spread(here.mocap), gyro = spread(here.gyro);
  const bool mocap_turns = mocap > 3 * std::sqrt(3.0) * c.rate_noise,
             gyro_turns = gyro > 3 * std::sqrt(3.0) * c.gyro_noise;
  // If only one of them turns, its rotation must exceed the noise by far.
  if (!(mocap_turns && gyro_turns) && std::max(mocap / c.rate_noise, gyro / c.gyro_noise) < 50)
    return not_tested("too little rotation");
  const std::size_t third = c.windows.size() / 3;
  const std::vector<BeatWindow> beginning(c.windows.begin(), c.windows.begin() + static_cast<std::ptrdiff_t>(third));
  const std::vector<BeatWindow> end(c.windows.end() - static_cast<std::ptrdiff_t>(third), c.windows.end());
  auto sync = find_lag(c.motion, c.windows);
  auto early = find_lag(c.motion, beginning), late = find_lag(c.motion, end);
  // Noise reduces the correlation to this even for one motion; a further quarter is for a lag that changes.
  const double noise_share = 3 * c.rate_noise * c.rate_noise / (mocap * mocap);
  const double least = 0.75 * std::sqrt(std::max(1 - noise_share, 0.1));
  const auto alike = [&](const std::optional<Sync>& s) { return s && s->correlation >= least; };
  const bool apart = !alike(sync) && alike(early) && alike(late) && early->frame == late->frame;
  if (apart) sync = early;
  if (!alike(sync)) {
    not_tested("gyro and mocap do not match");
    c.add_finding(
        "gyro", Verdict::warning,
        format("rates of the gyro (%s rad/s rms) and of mocap (%s) are alike by %.2f at most, in any frame and "
               "within a second; "
               "above %.2f expected: a dead axis, another body or flight, or clocks far apart",
               per_axis(here.gyro).c_str(), per_axis(here.mocap).c_str(), sync ? sync->correlation : 0.0, least),
        {}, {kImu});
    return false;
  }
  if (!early || early->frame != sync->frame) early = sync;
  if (!late || late->frame != sync->frame) late = sync;
  c.frame = sync->frame;
  auto lag = refine_from(c, c.windows, {0, sync->lag_s, 0});
  auto first = refine_from(c, beginning, {0, early->lag_s, 0}), last = refine_from(c, end, {0, late->lag_s, 0});
  const double begin_s = c.windows[third / 2].middle_s(),
               end_s = c.windows[c.windows.size() - 1 - third / 2].middle_s();
  const auto noticed_s = [&] { return 1e-3 + kSigmas * std::hypot(first->sd, last->sd); };
  const bool drifts = first && last && std::abs(last->value - first->value) > noticed_s();
  // A line through the lags of the first and last third; both refined: a lag that changes within a third blurs it.
  for (int pass = 0; pass < 2 && drifts; ++pass) {
    c.lag = {begin_s, first->value, (last->value - first->value) / (end_s - begin_s)};
    const auto nearer = refine_from(c, beginning, c.lag), nearer_last = refine_from(c, end, c.lag);
    if (!nearer || !nearer_last) break;
    first = LagEstimate{nearer->value, nearer->sd};
    last = LagEstimate{nearer_last->value + c.lag.per_s * (end_s - begin_s), nearer_last->sd};
  }
  if (drifts) lag = LagEstimate{(first->value + last->value) / 2, std::hypot(first->sd, last->sd) / 2};
  if (!lag || (lag->sd > 0.0025 && !drifts)) return not_tested("too little rotation");
  if (!drifts) c.lag = {0, lag->value, 0};

  // A first-order low-pass delays slow motion by 1 / (2 pi bandwidth). The log does not say whether the latency
  // includes this nor the filter's order: accept 0 to twice it, and 0.5 ms for the way samples are stamped.
  const double filter_s = 1 / (2 * std::numbers::pi * imu.bandwidth_hz),
               allowed_s = filter_s + kSigmas * lag->sd + 5e-4;
  const double declared_s = imu.latency_s - c.log.header.mocap.latency_s;
  const std::string seen = format("gyro comes %.1f ms after mocap", 1e3 * (lag->value + declared_s));
  const std::string expected =
      format(", %.1f +- %.1f ms expected from latencies and bandwidth", 1e3 * (declared_s + filter_s), 1e3 * allowed_s);
  const double off_s = std::abs(lag->value - filter_s);
  const bool good = off_s <= allowed_s;
  const double change_s = first && last ? last->value - first->value : 0, per_s = change_s / (end_s - begin_s);
  const bool slow = !c.log.header.inputs.empty();
  const bool runs_off =
      drifts && std::abs(per_s) > kLargestDrift && (!slow || std::abs(change_s) > kLargestSlowDelay_s);
  c.add_finding(
      "clock", good ? Verdict::ok : Verdict::warning,
      seen + expected + (good ? "" : ": clocks apart, or a wrong latency"),
      {{"lag_s", lag->value}, {"lag_sd_s", lag->sd}, {"correlation", sync->correlation}},
      off_s > allowed_s + (slow ? kLargestSlowDelay_s : kLargestDelay_s) && !runs_off ? LogPlace{kImu} : LogPlace{});

  // A lag that changes by a millisecond in a flight is a fifth of a radian of the beat, which no check here notices.
  if (!drifts && (!first || !last || std::hypot(first->sd, last->sd) > 0.0025)) {
    c.add_finding("clock speed", Verdict::not_tested, "too short, or too little rotation at the beginning or the end");
    return true;
  }
  c.add_finding("clock speed", drifts ? Verdict::warning : Verdict::ok,
                format("gyro against mocap moves by %.2f ms in %.3g s, at most %.2f ms expected", 1e3 * change_s,
                       end_s - begin_s, 1e3 * noticed_s()) +
                    (drifts ? format(": clocks run at different speeds, by %.0f ppm", 1e6 * per_s) : ""),
                {{"change_s", change_s}, {"per_s", per_s}},
                runs_off ? LogPlace{kImu, line_at(c.log.imu.t_s, noticed_s() / std::abs(per_s))} : LogPlace{});
  return true;
}

// ---- the gyro

struct FrameHypothesis {
  SensorFrame frame;
  double scale;
  std::string text;
};

/// Common mistakes, the likelier ones first.
std::vector<FrameHypothesis> mistakes() {
  const Matrix3d one = Matrix3d::Identity();
  std::vector<FrameHypothesis> list = {
      {{Order::wxyz, one}, kDegree, "the gyro is likely in deg/s, not rad/s"},
      {{Order::xyzw, one}, 1, "the quaternion order is likely x, y, z, w, not w, x, y, z"},
      {{Order::wxyz_inverse, one},
       1,
       "the quaternion is likely inverse, world to body (or the gyro has all signs flipped)"},
      {{Order::xyzw_inverse, one}, 1, "the quaternion order is likely x, y, z, w and inverse, world to body"}};
  const auto flips = [](const Matrix3d& m) { return (m.diagonal().array() < 0).count(); };
  std::vector<FrameHypothesis> axes;
  for (const Matrix3d& m : signed_permutations()) {
    if (m.isIdentity()) continue;
    const bool diagonal = m.isDiagonal();
    std::string text = "axes are flipped: ";
    if (!diagonal) text = "axes are swapped: ";
    axes.push_back({{Order::wxyz, m}, 1, text + describe_axes("gyro", m)});
  }
  // One flipped axis, then two, then turned frames, then mirrored ones.
  std::ranges::stable_sort(axes, {}, [&](const FrameHypothesis& h) {
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

/// The mistake that explains the rates, and the file that has it; empty if none does. Sets the frame.
std::pair<std::string, LogPlace> find_mistake(Context& c) {
  const std::vector<FrameHypothesis> all = mistakes();
  std::vector<double> left;
  double total = 0, noise = 0;
  for (const FrameHypothesis& h : all) {
    const Pairs pairs = pair_up(c.motion, c.windows, h.frame.order, c.lag);
    left.push_back(misfit(pairs, h.frame.axes, h.scale));
    total = misfit(pairs, Matrix3d::Identity(), 0);
    noise = 3 * static_cast<double>(pairs.mocap.size()) * c.rate_noise * c.rate_noise;
  }
  // Some mistakes look alike near level flight: of those that noise does not tell apart, report the likelier.
  const double least = *std::ranges::min_element(left);
  const auto near = [&](double r) { return r <= 2 * least + 2 * noise; };
  const double declared = misfit(pair_up(c.motion, c.windows, Order::wxyz, c.lag), Matrix3d::Identity(), 1);
  if (least > 0.5 * total || near(declared)) return {};
  const auto found = std::ranges::find_if(left, near);
  const FrameHypothesis& h = all[static_cast<std::size_t>(found - left.begin())];
  c.frame = h.frame;
  return {h.text, {h.frame.order == Order::wxyz ? kImu : kMocap}};
}

void check_gyro(Context& c) {
  const Pairs means = pair_up(c.motion, c.windows, Order::wxyz, c.lag);
  const Pairs pairs = with_turns(c.motion, c.windows, means, c.lag);
  const Gains fit = fit_gains(pairs, c.rate_noise, c.gyro_noise);
  Values values;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) values.emplace_back(std::string("gain_") + kAxes[i] + kAxes[j], fit.gain(i, j));
  }
  // Scale errors and misalignment of a mounted sensor are below 0.1; every mistake of axes or units is larger.
  bool good = true;
  for (int j = 0; j < 3; ++j) {
    if (!fit.tested[static_cast<std::size_t>(j)]) continue;
    const Vector3d error = fit.gain.col(j) - Vector3d::Unit(j);
    good &= error.cwiseAbs().maxCoeff() <= 0.1 + kSigmas * fit.gain_sd(j);
  }
  // Expected residual: noise of both, and a twentieth of the rotation for errors beyond a constant gain.
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
        c.add_finding(name, Verdict::ok, format("mocap turns %.3f x as fast", fit.gain(j, j)),
                      j == 0 ? values : Values{});
      else c.add_finding(name, Verdict::not_tested, "too little rotation");
    }
    Vector3d bias = Vector3d::Zero(), rate = Vector3d::Zero(), coning = Vector3d::Zero();
    const double n = static_cast<double>(pairs.mocap.size());
    for (std::size_t i = 0; i < pairs.mocap.size(); ++i)
      bias += (pairs.gyro[i] - pairs.mocap[i]) / n, rate += pairs.mocap[i] / n,
          coning += (pairs.gyro[i] - means.gyro[i]) / n;
    // Share of the beat's coning, at once and twice its frequency, that a first-order low-pass removes.
    const double beat = 1.5 * c.log.header.flapping_Hz / c.log.header.imu.bandwidth_hz, hidden = beat * beat;
    std::string wrong;
    for (int i = 0; i < 3; ++i) {
      const double sd =
          std::hypot(c.log.header.imu.gyro_bias_sd_rad_s[static_cast<std::size_t>(i)], c.rate_noise / std::sqrt(n));
      const double allowed = kSigmas * sd + 0.1 * rate.norm() + hidden * std::abs(coning(i)) + 0.005;
      if (std::abs(bias(i)) > allowed)
        wrong +=
            (wrong.empty() ? "" : ", ") + format("%c %.3g rad/s (at most %.2g expected)", kAxes[i], bias(i), allowed);
    }
    c.add_finding("gyro bias", wrong.empty() ? Verdict::ok : Verdict::warning,
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
  if (seen.empty() && odd.empty()) return c.add_finding("gyro", Verdict::not_tested, "too little rotation");
  const auto [cause, fault] = good ? std::pair<std::string, LogPlace>() : find_mistake(c);
  if (good) c.frame = {};
  c.add_finding("gyro", Verdict::warning,
                (good ? odd : "mocap turns " + seen + ", 1 x about the same axis expected") + ": " +
                    (!cause.empty() ? cause
                     : good         ? "attitude_noise_rad is too small, or markers moved"
                                    : "axes, units or a bent mount"),
                values, fault);
}

}  // namespace

void check_rotation(Context& c) {
  if (check_clock(c)) check_gyro(c);
  else if (c.findings.back().check != "gyro") c.add_finding("gyro", Verdict::not_tested, c.findings.back().text);
}

}  // namespace flappy::flightlog
