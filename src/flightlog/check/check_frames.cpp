// For declared inputs: compares attitude, accelerometer and positions with one another and with a second estimator.
// Such robots often have neither a gyro nor a model that determines an angle's convention.
#include <algorithm>
#include <cmath>
#include <functional>

#include "flightlog/check/check_motion.hpp"
#include "flightlog/readings.hpp"
#include "io/statistics.hpp"

namespace flappy::flightlog {
namespace {

struct Angles {
  double roll, pitch, yaw;
};

Angles angles_of(const Quaterniond& q) {
  const Matrix3d m = q.toRotationMatrix();
  return {std::atan2(m(2, 1), m(2, 2)), -std::asin(std::clamp(m(2, 0), -1.0, 1.0)), std::atan2(m(1, 0), m(0, 0))};
}

Quaterniond from(const Angles& a) {
  return Eigen::AngleAxisd(a.yaw, Vector3d::UnitZ()) * Eigen::AngleAxisd(a.pitch, Vector3d::UnitY()) *
         Eigen::AngleAxisd(a.roll, Vector3d::UnitX());
}

/// A convention of the attitude, or a mounting of the accelerometer.
struct Frames {
  std::string text;
  std::function<Quaterniond(const Quaterniond&)> attitude;
  Matrix3d accel = Matrix3d::Identity();
};

/// The declared convention first, then mistakes, likelier ones first; from `accel` on, the accelerometer's.
struct Hypotheses {
  std::vector<Frames> all;
  std::size_t accel;
};

Hypotheses hypotheses() {
  const auto same = [](const Quaterniond& q) { return q; };
  const auto turned = [](auto&& change) {
    return [change](const Quaterniond& q) { return from(change(angles_of(q))); };
  };
  const Matrix3d one = Matrix3d::Identity();
  std::vector<Frames> list = {
      {"as declared", same, one},
      {"pitch is inverted", turned([](Angles a) {
         return Angles{a.roll, -a.pitch, a.yaw};
       }),
       one},
      {"roll is inverted", turned([](Angles a) {
         return Angles{-a.roll, a.pitch, a.yaw};
       }),
       one},
      {"roll and pitch are inverted, or the quaternion is inverse", turned([](Angles a) {
         return Angles{-a.roll, -a.pitch, a.yaw};
       }),
       one},
      {"yaw is inverted", turned([](Angles a) {
         return Angles{a.roll, a.pitch, -a.yaw};
       }),
       one},
      {"angles are too small by 57: radians taken for degrees", turned([](Angles a) {
         return Angles{a.roll / kDegree, a.pitch / kDegree, a.yaw / kDegree};
       }),
       one},
      {"the quaternion is inverse, world to body", [](const Quaterniond& q) { return q.conjugate(); }, one},
      {"the quaternion order is x, y, z, w",
       [](const Quaterniond& q) { return Quaterniond(q.z(), q.w(), q.x(), q.y()); }, one}};
  for (const double roll : {1, -1})
    for (const double pitch : {1, -1})
      list.push_back({"roll and pitch are swapped", turned([=](Angles a) {
                        return Angles{roll * a.pitch, pitch * a.roll, a.yaw};
                      }),
                      one});
  const std::size_t accel = list.size();
  // Only mountings with the right z axis: gravity decides about z.
  for (const Matrix3d& m : signed_permutations())
    if (m(2, 2) == 1 && !m.isIdentity()) {
      std::string text =
          m.isDiagonal() ? "the accelerometer's axes are flipped:" : "the accelerometer's axes are swapped:";
      for (int j = 0; j < 2; ++j) {
        const int i = m(0, j) != 0 ? 0 : 1;
        text += std::string(j == 0 ? " accel_" : ", accel_") + kAxes[j] + " is the body's " +
                (m(i, j) > 0 ? "+" : "-") + kAxes[i];
      }
      list.push_back({text, same, m});
    }
  return {std::move(list), accel};
}

// ---- by accelerations

struct Shove {
  Vector3d force_m_s2;  ///< mean specific force in W: acceleration less gravity
  std::vector<std::size_t> samples;
  std::vector<double> weights;  ///< weights of the samples, with sum 1
};

struct Shoves {
  std::vector<Shove> list;
  std::vector<Quaterniond> attitude;  ///< as logged, at each sample of the IMU
};

/// Second differences over span_s equal the mean acceleration with triangular weights of width 2 span_s.
Shoves shoves_of(const Context& c) {
  const FlightHeader& h = c.log.header;
  const double span_s = h.flapping_Hz > 0 ? std::max(std::round(0.2 * h.flapping_Hz), 1.0) / h.flapping_Hz : 0.2;
  const std::vector<double>& t = c.motion.imu_t_s();
  Shoves s;
  std::vector<char> known;
  for (const double t_s : t) {
    const auto q = c.motion.attitude_at(t_s, Order::wxyz);
    known.push_back(q ? 1 : 0);
    s.attitude.push_back(q.value_or(Quaterniond::Identity()));
  }
  const std::vector<double>& poses_s = c.motion.mocap_t_s();
  for (double middle = next_window(poses_s, 0, span_s); middle + span_s < poses_s.back();
       middle = next_window(poses_s, middle, span_s)) {
    const auto before = c.motion.position_at(middle - span_s), here = c.motion.position_at(middle),
               after = c.motion.position_at(middle + span_s);
    if (!before || !here || !after || !c.motion.mean_rate(middle - span_s, middle + span_s)) continue;
    Shove shove{(*after - 2 * *here + *before) / (span_s * span_s) + Vector3d(0, 0, h.gravity_m_s2), {}, {}};
    double sum = 0;
    bool whole = true;
    for (std::size_t k = index_before(t, middle - span_s) + 1; k < t.size() && t[k] < middle + span_s; ++k) {
      whole &= known[k] != 0;
      shove.samples.push_back(k);
      shove.weights.push_back(span_s - std::abs(t[k] - middle));
      sum += shove.weights.back();
    }
    if (!whole || !(sum > 0)) continue;
    for (double& w : shove.weights) w /= sum;
    s.list.push_back(std::move(shove));
  }
  return s;
}

/// Mean square of the specific force from positions less that from the accelerometer, less a constant.
double misfit(const Context& c, const Shoves& shoves, const Frames& frames, double unit) {
  std::vector<Vector3d> felt(shoves.attitude.size());
  for (std::size_t k = 0; k < felt.size(); ++k)
    felt[k] = frames.attitude(shoves.attitude[k]) * (frames.accel * c.motion.accel_m_s2()[k] * unit);
  Vector3d mean = Vector3d::Zero();
  double squares = 0;
  const double n = static_cast<double>(shoves.list.size());
  for (const Shove& s : shoves.list) {
    Vector3d left = s.force_m_s2;
    for (std::size_t i = 0; i < s.samples.size(); ++i) left -= s.weights[i] * felt[s.samples[i]];
    mean += left / n;
    squares += left.squaredNorm() / n;
  }
  return squares - mean.squaredNorm();
}

/// Finds the convention of the attitude and sets accel_axes. Returns the convention if it is not the declared one.
const Frames* check_axes(Context& c, const Hypotheses& h) {
  const auto not_tested = [&](const std::string& why) {
    c.add_finding("axes", Verdict::not_tested, why);
    return nullptr;
  };
  if (c.motion.imu_t_s().empty()) return not_tested("there is no imu.csv");
  const Shoves shoves = shoves_of(c);
  constexpr std::size_t kMin = 20;
  if (shoves.list.size() < kMin) return not_tested("too short, or too many gaps");
  // An accelerometer in g is reported by the check of gravity; here it must not hide other mistakes.
  Vector3d mean = Vector3d::Zero();
  for (const Vector3d& f : c.motion.accel_m_s2()) mean += f / static_cast<double>(c.motion.accel_m_s2().size());
  // A wrong z axis is reported by the check of gravity, from the mean alone.
  if (mean.z() < 0.5 * mean.norm()) return not_tested("the accelerometer's +z is not up");
  const double gravity = c.log.header.gravity_m_s2;
  const bool in_g = gravity > 5 && mean.norm() > 0.7 && mean.norm() < 1.3;
  std::vector<double> left;
  for (const Frames& f : h.all) left.push_back(misfit(c, shoves, f, in_g ? gravity : 1));
  const Values values = {{"misfit_m_s2", std::sqrt(left[0])},
                         {"pitch_inverted_m_s2", std::sqrt(left[1])},
                         {"roll_inverted_m_s2", std::sqrt(left[2])}};
  // Noise and lever arms leave the same misfit in all hypotheses; over so many windows, chance never halves it.
  constexpr double kFar = 0.5, kNear = 1.2, kTells = 1.5;
  const double least = *std::ranges::min_element(left);
  const std::string seen =
      format("positions accelerate by %.2g m/s^2 otherwise than the accelerometer feels", std::sqrt(left[0]));
  if (least < kFar * left[0]) {
    const auto found = std::ranges::find_if(left, [&](double r) { return r <= kNear * least; });
    const auto at = static_cast<std::size_t>(found - left.begin());
    const bool of_accel = at >= h.accel;
    c.add_finding("axes", Verdict::warning, seen + format(", %.2g once turned: ", std::sqrt(*found)) + h.all[at].text,
                  values, {of_accel ? kImu : kMocap});
    if (of_accel) c.accel_axes = h.all[at].accel;
    return of_accel ? nullptr : &h.all[at];
  }
  const auto hidden = [&](std::size_t i) { return left[i] < kTells * left[0]; };
  if (hidden(1) || hidden(2))
    return not_tested("too little tilt to tell an inverted " + std::string(hidden(1) ? "pitch" : "roll"));
  c.add_finding("axes", Verdict::ok,
                seen + format("; by %.2g with pitch inverted, %.2g with roll", std::sqrt(left[1]), std::sqrt(left[2])),
                values);
  return nullptr;
}

// ---- by a second estimator

/// Attitudes of both estimators at one instant; mocap's after conversion to the declared convention.
struct Pair {
  Quaterniond mocap, other;
};

std::vector<Pair> pairs_of(const FlightLog& log, const Frames& meant) {
  const std::vector<std::optional<Quaterniond>> others = second_attitudes(log);
  const MocapStream& m = log.mocap;
  std::vector<Pair> pairs;
  for (std::size_t i = 0; i < others.size(); ++i)
    if (others[i]) pairs.push_back({meant.attitude({m.qw[i], m.qx[i], m.qy[i], m.qz[i]}), *others[i]});
  return pairs;
}

/// Median angle between both up directions, less a mounting's constant angle; independent of a yaw offset.
double usual_difference(const std::vector<Pair>& pairs) {
  std::array<std::vector<double>, 3> offset;
  std::vector<Vector3d> differences;
  for (const Pair& p : pairs) {
    differences.emplace_back(p.mocap.conjugate() * Vector3d::UnitZ() - p.other.conjugate() * Vector3d::UnitZ());
    for (int i = 0; i < 3; ++i) offset[static_cast<std::size_t>(i)].push_back(differences.back()(i));
  }
  const Vector3d middle(io::median(offset[0]), io::median(offset[1]), io::median(offset[2]));
  std::vector<double> angles;
  for (const Vector3d& d : differences) angles.push_back((d - middle).norm());
  return io::median(angles);
}

/// Compares the tilt of mocap and of the second estimator; true where they agree or there is no second one.
bool check_second(Context& c, const Hypotheses& h, const Frames* meant, bool mocap_is_right) {
  if (!c.log.attitude) return true;
  const std::string name = "attitude";
  const std::vector<Pair> declared = pairs_of(c.log, meant ? *meant : h.all[0]);
  if (declared.size() < 200) {
    c.add_finding(name, Verdict::not_tested, "mocap and attitude.csv have too little time in common");
    return true;
  }
  const double usual = usual_difference(declared);
  std::size_t best = 0;
  double least = usual;
  for (std::size_t i = 1; i < h.accel && !meant; ++i)
    if (const double d = usual_difference(pairs_of(c.log, h.all[i])); d < 0.999 * least) best = i, least = d;
  const Values values = {{"tilt_difference_rad", usual}};
  const std::string seen = format("tilt usually differs by %.2g deg from attitude.csv", usual / kDegree);
  // With some degrees of tilt, two estimators agree far better as declared than with one mirrored.
  constexpr double kMin_rad = 2 * kDegree;
  const bool mirrored = least < 0.5 * usual && usual > kMin_rad, apart = usual > 10 * kDegree;
  if (mirrored)
    c.add_finding(
        name, Verdict::warning,
        seen + format(", by %.2g deg once, in %s, ", least / kDegree, mocap_is_right ? "attitude.csv" : "one of them") +
            h.all[best].text,
        values);
  else if (apart)
    c.add_finding(name, Verdict::warning, seen + ", below 10 expected: another body, or another clock", values);
  else c.add_finding(name, Verdict::ok, seen, values);
  return !mirrored && !apart;
}

// ---- markers

/// Largest share of poses that may be swapped or frozen; beyond it, interpolation between the rest is a guess.
constexpr double kMaxLost = 0.2;

void check_swapped(Context& c, bool understood) {
  if (!understood) return c.add_finding("markers", Verdict::not_tested, "needs attitudes that are understood");
  const std::size_t n = c.log.mocap.t_s.size();
  const std::vector<char> swapped = swapped_poses(c.log);
  std::size_t count = 0, longest = 0, run = 0, first = n;
  for (std::size_t i = 0; i < swapped.size(); ++i) {
    run = swapped[i] ? run + 1 : 0;
    longest = std::max(longest, run);
    count += swapped[i] != 0;
    if (swapped[i]) first = std::min(first, i);
  }
  const double share = static_cast<double>(count) / static_cast<double>(n);
  const Values values = {{"swapped", static_cast<double>(count)}, {"longest", static_cast<double>(longest)}};
  if (count == 0)
    return c.add_finding("markers", Verdict::ok,
                         c.log.attitude ? "no pose leaps, or is turned against attitude.csv" : "no pose leaps", values);
  c.add_finding(
      "markers", Verdict::warning,
      format("%zu of %zu poses (%.2g %%), up to %zu in a row, leap%s, from %.6g s on: markers taken for others", count,
             n, 100 * share, longest, c.log.attitude ? " or are turned against attitude.csv" : "",
             c.log.mocap.t_s[first]),
      values, share > kMaxLost ? LogPlace{kMocap, first + 2} : LogPlace{});
}

void check_frozen(Context& c) {
  const auto look = [&](const std::string& stream, const std::string& file, const Column& t_s,
                        const std::vector<const Column*>& columns, double noise) {
    if (!(noise > 0) || t_s.empty()) return;
    std::size_t count = 0, longest = 0, run = 0, first = t_s.size();
    for (std::size_t i = 1; i < t_s.size(); ++i) {
      const bool same = std::ranges::all_of(columns, [&](const Column* v) { return (*v)[i] == (*v)[i - 1]; });
      run = same ? run + 1 : 0;
      longest = std::max(longest, run);
      count += same;
      if (same) first = std::min(first, i);
    }
    const double share = static_cast<double>(count) / static_cast<double>(t_s.size());
    const Values values = {{"repeats", static_cast<double>(count)}, {"longest", static_cast<double>(longest)}};
    const std::string seen =
        format("%zu of %zu samples repeat the one before, up to %zu in a row", count, t_s.size(), longest);
    // One or two repeats in a row may come from resampling to another rate.
    if (share > 0.01 || longest > 2)
      c.add_finding(stream + " frozen", Verdict::warning,
                    seen + format(", from %.6g s on: tracking lost, or written faster than measured", t_s[first]),
                    values, share > kMaxLost ? LogPlace{file, first + 2} : LogPlace{});
    else c.add_finding(stream + " frozen", Verdict::ok, seen, values);
  };
  const FlightLog& log = c.log;
  const MocapStream& m = log.mocap;
  const ImuStream& u = log.imu;
  // an estimate may be logged more often than it is made, and rounded
  const double pose_noise =
      log.header.mocap.source == PoseSource::motion_capture ? log.header.mocap.position_noise_m : 0;
  look("mocap", kMocap, m.t_s, {&m.x_m, &m.y_m, &m.z_m, &m.qw, &m.qx, &m.qy, &m.qz}, pose_noise);
  look("imu", kImu, u.t_s, {&u.accel_x_m_s2, &u.accel_y_m_s2, &u.accel_z_m_s2}, log.header.imu.accel_noise_m_s2);
  if (!log.attitude) return;
  const AttitudeStream& a = *log.attitude;
  look("attitude", kAttitude, a.t_s, {&a.qw, &a.qx, &a.qy, &a.qz}, log.header.attitude->noise_rad);
}

}  // namespace

bool check_frames(Context& c) {
  const Hypotheses h = hypotheses();
  const Frames* const meant = check_axes(c, h);
  const bool alike = check_second(c, h, meant, c.findings.back().verdict == Verdict::ok);
  check_swapped(c, alike && meant == nullptr);
  check_frozen(c);
  return meant == nullptr;
}

}  // namespace flappy::flightlog
