// Estimator: on motion known in closed form, run by the schedule as a block is, with its covariance open to the test; and whole
// fleets, whose innovations and errors show what sensors, schedule and filter make together.
#include "flight/estimator.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "flight/fleets.hpp"
#include "flight/schedule.hpp"
#include "sim/storage.hpp"

namespace flappy::flight::estimator_test {
namespace {

using V = model::Vec3<double>;
using Q = model::Quaternion<double>;
constexpr double kStep_s = 1e-4, kPeriod_s = 0.002;
constexpr int kPeriodSteps = 20;
constexpr double kSigmas = 4.5;

double square(const V& v) { return dot(v, v); }

/// Sum of a value's harmonics and of what it does steadily.
struct Wave {
  double start = 0, rate = 0, amplitude = 0, hz = 0, beat_amplitude = 0;
  double value(double t) const {
    return start + rate * t + amplitude * std::sin(2 * M_PI * hz * t) + beat_amplitude * std::sin(2 * M_PI * 34 * t);
  }
  double slope(double t) const {
    return rate + amplitude * 2 * M_PI * hz * std::cos(2 * M_PI * hz * t) +
           beat_amplitude * 2 * M_PI * 34 * std::cos(2 * M_PI * 34 * t);
  }
};

/// Motion by roll, pitch, yaw and position; rates by the kinematics of Euler angles.
struct Course {
  Wave roll, pitch, yaw, x, y, z;
  Truth<double> at(double t) const {
    const double cr = std::cos(roll.value(t) / 2), sr = std::sin(roll.value(t) / 2), cp = std::cos(pitch.value(t) / 2),
                 sp = std::sin(pitch.value(t) / 2), cy = std::cos(yaw.value(t) / 2), sy = std::sin(yaw.value(t) / 2);
    const double f = roll.value(t), p = pitch.value(t), df = roll.slope(t), dp = pitch.slope(t), dy = yaw.slope(t);
    return {{x.value(t), y.value(t), z.value(t)},
            {cy * cp * cr + sy * sp * sr, cy * cp * sr - sy * sp * cr, cy * sp * cr + sy * cp * sr,
             sy * cp * cr - cy * sp * sr},
            {x.slope(t), y.slope(t), z.slope(t)},
            {df - dy * std::sin(p), dp * std::cos(f) + dy * std::sin(f) * std::cos(p),
             -dp * std::sin(f) + dy * std::cos(f) * std::cos(p)}};
  }
};

/// Leans and sways as a flapper under control does, at a heading that stays.
Course swaying(double beats = 1) {
  return {{0.05, 0, 0.2, 1.3, 0.01 * beats},
          {-0.03, 0, 0.15, 0.9, 0.02 * beats},
          {0.7, 0, 0.1, 0.4, 0},
          {0.1, 0, 0.3, 0.5, 5e-4 * beats},
          {0, 0, -0.3, 0.4, 0},
          {0.4, 0, 0.1, 0.8, 1e-3 * beats}};
}

/// Errors of an estimate: true = estimate + error, angle in B.
struct Errors {
  V angle, position, velocity;
};
Errors errors(const Truth<double>& t, const Q& attitude, const V& position, const V& velocity) {
  return {rotation_vector(from_to(attitude, t.attitude)), t.position_m - position, t.velocity_m_s - velocity};
}

template <class T>
model::Vec3<T> as(const V& v) {
  return {static_cast<T>(v.x), static_cast<T>(v.y), static_cast<T>(v.z)};
}
template <class T>
Truth<T> as(const Truth<double>& t) {
  const auto q = [](double x) { return static_cast<T>(x); };
  return {as<T>(t.position_m),
          {q(t.attitude.w), q(t.attitude.x), q(t.attitude.y), q(t.attitude.z)},
          as<T>(t.velocity_m_s),
          as<T>(t.body_rate_rad_s)};
}
template <class T>
V wide(const model::Vec3<T>& v) {
  return {v.x, v.y, v.z};
}

/// One flapper on a known course, from true sensors to estimate, stage by stage as closed_loop.cpp has them.
template <class T>
class Rig {
 public:
  Rig(const Sensors& s, Course course, double gravity, double noise, std::uint32_t seed)
      : s_(s),
        course_(course),
        gravity_(gravity),
        noise_(noise),
        engine_(seed),
        schedule_(s, kStep_s, kPeriodSteps),
        ring_(static_cast<std::size_t>(schedule_.ring_slots())),
        queue_(static_cast<std::size_t>(schedule_.queue_slots())) {
    const auto t = [](double x) { return static_cast<T>(x); };
    const auto sq = [](double x) { return x * x; };
    imu_constants_ = {{t(s.imu.position_m.x), t(s.imu.position_m.y), t(s.imu.position_m.z)},
                      t(noise * s.imu.gyro_noise_rad_s),
                      t(noise * s.imu.accel_noise_m_s2),
                      t(low_pass_share(s.imu.low_pass_hz, 1 / s.imu.rate_hz)),
                      t(gravity)};
    mocap_constants_ = {t(noise * s.mocap.position_noise_m), t(noise * s.mocap.attitude_noise_rad), 0, 1};
    const EstimatorNoise& f = s.estimator;
    constants_ = {t(sq(s.imu.gyro_noise_rad_s) / s.imu.rate_hz + sq(f.angle_drift_rad_sqrt_s)),
                  t(sq(f.gyro_bias_drift_rad_s_sqrt_s)),
                  t(sq(s.imu.accel_noise_m_s2) / s.imu.rate_hz + sq(f.velocity_drift_m_s_sqrt_s)),
                  t(sq(f.accel_bias_drift_m_s2_sqrt_s)),
                  t(sq(s.mocap.attitude_noise_rad)),
                  t(sq(s.mocap.position_noise_m)),
                  t(gravity)};
    const Truth<double> start = course.at(0);
    imu_.attitude = as<T>(start).attitude;
    imu_.velocity_m_s = point_velocity(
        as<T>(start), {imu_constants_.position_m[0], imu_constants_.position_m[1], imu_constants_.position_m[2]});
    const Truth<double> a = course.at(-1e-4), b = course.at(1e-4);
    imu_.low_passed = {as<T>(start.body_rate_rad_s),
                       as<T>(transpose_times(rotation_matrix(start.attitude),
                                             5000.0 * (b.velocity_m_s - a.velocity_m_s) + V{0, 0, gravity}))};
    const auto& sd = s.imu.gyro_bias_sd_rad_s;
    gyro_bias = {noise * sd.x * normal(), noise * sd.y * normal(), noise * sd.z * normal()};
    imu_.gyro_bias_rad_s = as<T>(gyro_bias);
    accel_bias = noise * f.accel_bias_sd_m_s2 * V{normal(), normal(), normal()};
    // the horizon as uncertain as it is said to be
    estimator.covariance = {t(sq(s.mocap.attitude_noise_rad)), 0, t((sq(sd.x) + sq(sd.y) + sq(sd.z)) / 3),
                            t(sq(s.mocap.position_noise_m)),   0, 0,
                            t(sq(f.initial_velocity_sd_m_s)),  0, t(sq(f.accel_bias_sd_m_s2))};
    const Truth<double> first = course.at(-low_pass_lag_s(s.imu));
    const V turn = 0.5 * noise * s.mocap.attitude_noise_rad * V{normal(), normal(), normal()};
    Truth<double> x = first;
    x.attitude = rotated(first.attitude, turn);
    x.position_m = first.position_m + noise * s.mocap.position_noise_m * V{normal(), normal(), normal()};
    x.velocity_m_s = first.velocity_m_s + noise * f.initial_velocity_sd_m_s * V{normal(), normal(), normal()};
    estimator.horizon = estimator.now = {as<T>(x).attitude, as<T>(x.position_m), as<T>(x.velocity_m_s)};
    estimator.gathered = {};
  }

  void step() {
    const Period& p = schedule_.next();
    for (const Slice& slice : p.slices) {
      steps_ += slice.steps;
      const Truth<T> truth = as<T>(course_.at(now_s()));
      if (slice.imu) {
        const T interval = static_cast<T>(slice.imu_interval_s);
        ImuSample<T> y = sample_imu<T>(imu_constants_, 1 / interval, truth, imu_, normals(), normals());
        y.accel_m_s2 = y.accel_m_s2 + as<T>(accel_bias);
        gather(estimator.gathered, y, interval);
      }
      if (slice.mocap) {
        MocapSample<T> z = sample_mocap<T>(mocap_constants_, truth, T(1), normals(), normals());
        if (now_s() > blind_from_s && now_s() < blind_to_s) z.valid = 0;
        queue_[static_cast<std::size_t>(slice.mocap_slot)] = z;
        pose_s_.push_back(now_s());
      }
    }
    const auto move = [&](Pose<T>& pose, const Advance& a) {
      advance(pose, ring_[static_cast<std::size_t>(a.slot)], estimator.gyro_bias_rad_s, estimator.accel_bias_m_s2,
              static_cast<T>(a.share), static_cast<T>(a.duration_s), static_cast<T>(gravity_));
    };
    if (p.push_slot >= 0) ring_[static_cast<std::size_t>(p.push_slot)] = estimator.gathered, estimator.gathered = {};
    for (const Correction& f : p.corrections) {
      for (int i = 0; i < f.count; ++i) {
        const Advance& a = p.advance[static_cast<std::size_t>(f.first + i)];
        move(estimator.horizon, a);
        spread(estimator.covariance, constants_, static_cast<T>(a.share * a.duration_s));
      }
      const MocapSample<T>& z = queue_[static_cast<std::size_t>(f.slot)];
      correct(estimator, constants_, z);
      horizon_s = pose_s_.front();
      pose_s_.erase(pose_s_.begin());
      if (z.valid > 0 && on_pose) on_pose(estimator.angle_innovation, estimator.position_innovation);
    }
    if (!p.corrections.empty()) estimator.now = estimator.horizon;
    for (const Advance& a : p.replay) move(estimator.now, a);
    Pose<T> ahead = estimator.now;
    if (p.newest.slot >= 0) {
      rate = (1 / p.newest.duration_s) * wide(ring_[static_cast<std::size_t>(p.newest.slot)].rotation_rad) -
             wide(estimator.gyro_bias_rad_s);
      if (p.ahead_s > 0) move(ahead, {p.newest.slot, p.ahead_s / p.newest.duration_s, p.newest.duration_s});
    }
    present = error_of(ahead, now_s());
    middle_s = now_s() - p.ahead_s - p.newest.duration_s / 2;
  }
  void fly(double seconds) {
    for (const double until = now_s() + seconds - 1e-9; now_s() < until;) step();
  }

  double now_s() const { return static_cast<double>(steps_) * kStep_s; }
  Errors horizon() const { return error_of(estimator.horizon, horizon_s); }
  Truth<double> truth(double t) const { return course_.at(t); }

  Estimator<T> estimator{};
  Errors present{};  // of the estimate, at its own time
  V rate{};          // mean of the newest increment, whose middle is at middle_s
  double horizon_s = 0, middle_s = 0, blind_from_s = 1e9, blind_to_s = 1e9;
  V gyro_bias, accel_bias;
  std::function<void(double, double)> on_pose;

 private:
  double normal() { return normal_(engine_); }
  sim::Normals4<T> normals() {
    sim::Normals4<T> n;
    for (T& x : n.n) x = static_cast<T>(normal());
    return n;
  }
  Errors error_of(const Pose<T>& x, double t) const {
    const auto& q = x.attitude;
    return errors(course_.at(t), {q.w, q.x, q.y, q.z}, wide(x.position_m), wide(x.velocity_m_s));
  }

  Sensors s_;
  Course course_;
  double gravity_, noise_;
  std::mt19937 engine_;
  std::normal_distribution<double> normal_;
  Schedule schedule_;
  std::vector<Increment<T>> ring_;
  std::vector<MocapSample<T>> queue_;
  std::vector<double> pose_s_;
  Imu<T> imu_{};
  ImuConstants<T> imu_constants_;
  MocapConstants<T> mocap_constants_;
  EstimatorConstants<T> constants_;
  std::int64_t steps_ = 0;
};

/// The largest errors at the present time from 0.5 s to 3 s, without any noise.
struct Largest {
  double angle = 0, position = 0, velocity = 0, rate = 0;
};
Largest largest(const Sensors& s, const Course& course, double gravity = 9.81) {
  Rig<double> rig(s, course, gravity, 0, 1);
  rig.fly(0.5);
  Largest m;
  while (rig.now_s() < 3) {
    rig.step();
    m.angle = std::max(m.angle, std::sqrt(square(rig.present.angle)));
    m.position = std::max(m.position, std::sqrt(square(rig.present.position)));
    m.velocity = std::max(m.velocity, std::sqrt(square(rig.present.velocity)));
    m.rate = std::max(m.rate, std::sqrt(square(rig.truth(rig.middle_s).body_rate_rad_s - rig.rate)));
  }
  return m;
}

// Without noise, what is left is that an increment is taken as steady: half-way through one of T = 2 ms the angle is off by
// w' T^2/8 and the velocity by a' T^2/8. Here w' <= 0.2 (2 pi 1.3)^2 + .. = 20 rad/s^2, a' <= 0.3 (2 pi 0.5)^3 + g w
// = 30 m/s^3: 1e-5 rad, 1.5e-5 m/s. An estimate late by one period would be off by 3e-3 rad and 6e-3 m/s, by 30 ms 0.03 m.
TEST(Estimator, OfPerfectSensorsIsTheTruthAtThePresent) {
  for (const Overrides& o : {Overrides{},
                             {"mocap.latency_s=0.0"},
                             {"mocap.rate_hz=97.0"},
                             {"mocap.latency_s=0.08"},
                             {"imu.rate_hz=1000.0", "mocap.rate_hz=240.0"}}) {
    const Largest m = largest(sensors("paper", o), swaying(0));
    EXPECT_LT(m.angle, 1e-5);
    EXPECT_LT(m.position, 1e-6);
    EXPECT_LT(m.velocity, 2e-5);
    EXPECT_LT(m.rate, 1e-4);
  }
  // with the wing beat, a' = 45 m/s^2 x 2 pi 34 Hz, w' = 0.02 (2 pi 34)^2: present increments are whole, so only what
  // corrections brought back from half-way remains, a tenth of it
  const Largest beats = largest(sensors("paper"), swaying());
  EXPECT_LT(beats.angle, 2e-4);
  EXPECT_LT(beats.position, 1e-4);
  EXPECT_LT(beats.velocity, 1e-3);
}

// What has not arrived yet, t = 4 ms of it, is taken as steady too: w' t^2 = 3e-4 rad, a' t^2 = 5e-4 m/s. Late by it they
// would be off by 7e-3 rad and 1.2e-2 m/s. A first-order low-pass of 60 Hz is more than a delay by (2 ms)^2 w''.
TEST(Estimator, BridgesTheDelaysOfTheImu) {
  for (const Overrides& o : {Overrides{"imu.latency_s=0.003"},
                             {"imu.rate_hz=333.0"},
                             {"imu.low_pass_hz=60.0"},
                             {"imu.latency_s=0.001", "mocap.latency_s=0.0"}}) {
    const Largest m = largest(sensors("paper", o), swaying(0));
    EXPECT_LT(m.angle, 3e-4) << o[0];
    EXPECT_LT(m.position, 3e-6) << o[0];
    EXPECT_LT(m.velocity, 8e-4) << o[0];
    EXPECT_LT(m.rate, 1e-3) << o[0];
  }
}

// A quaternion turned by a quarter of a turn e at a time lags by e^2/3 of it: 2e-6 of 5 rad/s x 38 ms.
TEST(Estimator, DoesNotLagBehindSteadyMotion) {
  for (const char* o : {"imu.latency_s=0.0", "imu.latency_s=0.003", "imu.rate_hz=333.0", "imu.low_pass_hz=60.0"}) {
    Course gliding;
    gliding.x.rate = 2, gliding.y.rate = -1, gliding.yaw.rate = 5;
    Course rolling;
    rolling.roll.rate = -5, rolling.z.rate = 1;
    for (const Largest& m : {largest(sensors("paper", {o}), gliding), largest(sensors("paper", {o}), rolling, 0)}) {
      // the low-pass's lag counts as whole microseconds: times 2.3 m/s, and an attitude wrong by 5 rad/s times it under 1 g
      const double lag_s = std::string(o).starts_with("imu.low_pass") ? 0.5e-6 : 0;
      EXPECT_LT(m.angle, 1e-6 + 5 * lag_s) << o;
      EXPECT_LT(m.position, 1e-9 + 2.3 * lag_s) << o;
      EXPECT_LT(m.velocity, 1e-9 + 9.81 * lag_s) << o;
      EXPECT_LT(m.rate, 5e-5) << o;
    }
  }
}

/// Sensors whose noise is all that the filter is told of.
const Overrides kExact = {"imu.gyro_bias_sd_rad_s.x=0.02",
                          "imu.gyro_bias_sd_rad_s.y=0.02",
                          "imu.gyro_bias_sd_rad_s.z=0.02",
                          "estimator.angle_drift_rad_sqrt_s=0.0",
                          "estimator.velocity_drift_m_s_sqrt_s=0.0",
                          "estimator.gyro_bias_drift_rad_s_sqrt_s=0.0",
                          "estimator.accel_bias_drift_m_s2_sqrt_s=0.0"};

struct Sums {
  double n = 0, angle = 0, gyro_bias = 0, position = 0, velocity = 0,
         accel_bias = 0;  // squared errors over their variance
  double poses = 0, angle_innovation = 0, position_innovation = 0, angle_lagged = 0, position_lagged = 0;
};
Sums fly_many(const Sensors& s, const Course& course, double gravity, int runs, double until_s) {
  Sums sum;
  for (int run = 0; run < runs; ++run) {
    Rig<double> rig(s, course, gravity, 1, static_cast<std::uint32_t>(run + 1));
    double angle_before = 3, position_before = 3;
    rig.on_pose = [&](double angle, double position) {
      sum.poses += 1, sum.angle_innovation += angle, sum.position_innovation += position;
      sum.angle_lagged += (angle - 3) * (angle_before - 3),
          sum.position_lagged += (position - 3) * (position_before - 3);
      angle_before = angle, position_before = position;
    };
    rig.fly(until_s);
    const Errors e = rig.horizon();
    const Covariance<double>& c = rig.estimator.covariance;
    sum.n += 1;
    sum.angle += square(e.angle) / c.angle;
    sum.gyro_bias += square(rig.gyro_bias - rig.estimator.gyro_bias_rad_s) / c.gyro_bias;
    sum.position += square(e.position) / c.position;
    sum.velocity += square(e.velocity) / c.velocity;
    sum.accel_bias += square(rig.accel_bias - rig.estimator.accel_bias_m_s2) / c.accel_bias;
  }
  return sum;
}

// Where the model of the filter is all there is (no gravity that a tilt error would leak, no wing beat within an increment),
// squared errors over their variance are chi-square of 3: mean 3, variance 6, one draw for each flight. Innovations are white,
// so each pose is a draw, and neighbours do not correlate. The last poses' own correction leaves 1 % or so.
TEST(Estimator, KnowsItsErrors) {
  for (const char* low_pass : {"imu.low_pass_hz=0.0", "imu.low_pass_hz=80.0"}) {
    Overrides o = kExact;
    o.emplace_back(low_pass);
    for (const double until_s : {0.2, 4.0}) {
      const Sums s = fly_many(sensors("paper", o), swaying(0), 0, 300, until_s);
      const double bound = kSigmas * std::sqrt(6 / s.n);
      EXPECT_NEAR(s.angle / s.n, 3, bound) << until_s;
      EXPECT_NEAR(s.gyro_bias / s.n, 3, bound) << until_s;
      EXPECT_NEAR(s.position / s.n, 3, bound) << until_s;
      EXPECT_NEAR(s.velocity / s.n, 3, bound) << until_s;
      EXPECT_NEAR(s.accel_bias / s.n, 3, bound) << until_s;
      EXPECT_NEAR(s.angle_innovation / s.poses, 3, kSigmas * std::sqrt(6 / s.poses)) << until_s;
      EXPECT_NEAR(s.position_innovation / s.poses, 3, kSigmas * std::sqrt(6 / s.poses)) << until_s;
      EXPECT_NEAR(s.angle_lagged / s.poses / 6, 0, kSigmas / std::sqrt(s.poses)) << until_s;
      EXPECT_NEAR(s.position_lagged / s.poses / 6, 0, kSigmas / std::sqrt(s.poses)) << until_s;
    }
  }
}

// As shipped, with gravity, wing beat and turning heading: the declared drift covers what the model leaves out, and no more
// than covers it. Velocity errors half-way through a beat are real and in none of its numbers.
TEST(Estimator, AsShippedIsNeitherBoldNorTimid) {
  Course turning = swaying();
  turning.yaw = {0.7, 1.5, 0, 0, 0};
  for (const char* name : {"paper", "code"})
    for (const Course& course : {swaying(), turning}) {
      const Sums s = fly_many(sensors(name), course, 9.81, 150, 4);
      for (const double x : {s.angle, s.position, s.velocity}) {
        EXPECT_LT(x / s.n, 4.5) << name;
        EXPECT_GT(x / s.n, 1) << name;
      }
      EXPECT_NEAR(s.angle_innovation / s.poses, 3, 0.15) << name;
      EXPECT_NEAR(s.position_innovation / s.poses, 3, 0.45) << name;
      EXPECT_LT(std::abs(s.angle_lagged / s.poses / 6), 0.05) << name;
      EXPECT_LT(std::abs(s.position_lagged / s.poses / 6), 0.05) << name;
    }
}

TEST(Estimator, LearnsTheBiasesItKnowsOf) {
  const Sensors s = sensors("paper", kExact);
  Rig<double> rig(s, swaying(0), 0, 1, 77);
  const double gyro = rig.estimator.covariance.gyro_bias, accel = rig.estimator.covariance.accel_bias;
  rig.fly(10);
  EXPECT_LT(rig.estimator.covariance.gyro_bias, 0.01 * gyro);
  EXPECT_LT(rig.estimator.covariance.accel_bias, 0.05 * accel);
  EXPECT_LT(square(rig.gyro_bias - rig.estimator.gyro_bias_rad_s) / rig.estimator.covariance.gyro_bias,
            30);  // chi-square: 1e-6
  EXPECT_LT(square(rig.accel_bias - rig.estimator.accel_bias_m_s2) / rig.estimator.covariance.accel_bias, 30);
  EXPECT_LT(square(rig.gyro_bias - rig.estimator.gyro_bias_rad_s), 0.05 * square(rig.gyro_bias));
}

TEST(Estimator, OutlivesABurstOfLosses) {
  double before = 0, blind = 0, said = 0, after = 0;
  constexpr int kRuns = 200;
  for (int run = 0; run < kRuns; ++run) {
    Rig<double> rig(sensors("paper", kExact), swaying(0), 0, 1, static_cast<std::uint32_t>(run + 500));
    rig.blind_from_s = 1.5, rig.blind_to_s = 2;
    rig.fly(1.5);
    before += square(rig.horizon().position) / kRuns;
    rig.fly(0.52);
    blind += square(rig.horizon().position) / rig.estimator.covariance.position / kRuns;
    said += 3 * rig.estimator.covariance.position / kRuns;
    rig.fly(0.3);
    after += square(rig.horizon().position) / kRuns;
  }
  EXPECT_NEAR(blind, 3, kSigmas * std::sqrt(6.0 / kRuns));  // it knew how lost it was
  EXPECT_GT(said, 20 * before);
  EXPECT_NEAR(after / before, 1, kSigmas * std::sqrt(2 * 2.0 / 3 / kRuns));  // and 40 poses later all is as before
}

template <class T>
void stays_positive() {
  const Sensors s = sensors("code");
  Rig<T> rig(s, swaying(), 9.81, 1, 3);
  Rig<double> exact(s, swaying(), 9.81, 1, 3);
  for (int period = 0; period < 30000; ++period) {
    rig.step(), exact.step();
    const Covariance<T>& c = rig.estimator.covariance;
    const auto bounded = [](double cross, double a, double b) { return cross * cross <= a * b; };
    ASSERT_TRUE(c.angle > 0 && c.gyro_bias > 0 && c.position > 0 && c.velocity > 0 && c.accel_bias > 0) << period;
    ASSERT_TRUE(bounded(c.angle_bias, c.angle, c.gyro_bias)) << period;
    ASSERT_TRUE(bounded(c.position_velocity, c.position, c.velocity)) << period;
    ASSERT_TRUE(bounded(c.position_bias, c.position, c.accel_bias)) << period;
    ASSERT_TRUE(bounded(c.velocity_bias, c.velocity, c.accel_bias)) << period;
    ASSERT_LT(square(rig.present.position), 1e-6) << period;
    ASSERT_LT(square(rig.present.angle), 1e-3) << period;
  }
  const T* a = &rig.estimator.covariance.angle;
  const double* b = &exact.estimator.covariance.angle;
  for (int i = 0; i < 9; ++i) EXPECT_NEAR(a[i] / b[i], 1, 0.01) << i;
}

TEST(Estimator, StaysPositiveForAMinuteInFloat) { stays_positive<float>(); }

/// A fleet's errors: mean squares over flappers.
struct MeanSquares {
  double position = 0, velocity = 0, angle = 0;
};
template <class T>
MeanSquares mean_squares(const Fleet<T>& fleet, std::size_t first, std::size_t last) {
  MeanSquares m;
  for (std::size_t i = first; i < last; ++i) {
    const Motion t = fleet.truth(i), e = fleet.estimate(i);
    const auto q = [](const double* x) { return Q{x[0], x[1], x[2], x[3]}; };
    for (int k = 0; k < 3; ++k) {
      m.position += (t.position_m[k] - e.position_m[k]) * (t.position_m[k] - e.position_m[k]);
      m.velocity += (t.velocity_m_s[k] - e.velocity_m_s[k]) * (t.velocity_m_s[k] - e.velocity_m_s[k]);
    }
    m.angle += square(rotation_vector(from_to(q(e.attitude), q(t.attitude))));
  }
  const auto n = static_cast<double>(last - first);
  return {m.position / n, m.velocity / n, m.angle / n};
}

const std::string kFlight =
    "kind = \"flying\"\n[start.position_m]\nx_half = 0.1\n[start.velocity_m_s]\ny_half = 0.3\n"
    "[start.rotation_rad]\nx_half = 0.2\nz = 3.0\nz_half = 0.5";

/// Flies to and fro at 0.5 m/s.
Task travelling() {
  return task(along(waypoint(0, 0, 0, 0, 3) + waypoint(1, 0.4, 0, 0, 3) + waypoint(2, 0, 0.3, 0.1, 2.5), kFlight));
}

const Overrides kQuiet = {"imu.gyro_noise_rad_s=0.0",      "imu.accel_noise_m_s2=0.0",
                          "imu.gyro_bias_sd_rad_s.x=0.0",  "imu.gyro_bias_sd_rad_s.y=0.0",
                          "imu.gyro_bias_sd_rad_s.z=0.0",  "mocap.position_noise_m=1e-9",
                          "mocap.attitude_noise_rad=1e-9", "estimator.initial_velocity_sd_m_s=1e-9"};

TEST(FleetFusion, OfQuietSensorsIsTheTruth) {
  Sensors s =
      sensors("paper", {"imu.gyro_noise_rad_s=0.0", "imu.accel_noise_m_s2=0.0", "imu.gyro_bias_sd_rad_s.x=0.0",
                        "imu.gyro_bias_sd_rad_s.y=0.0", "imu.gyro_bias_sd_rad_s.z=0.0", "mocap.position_noise_m=1e-9",
                        "mocap.attitude_noise_rad=1e-9", "estimator.initial_velocity_sd_m_s=1e-9"});
  Fleet<double> fleet(8, test::nominal(), fleet_options(s, controller("pid"), travelling()));
  double fastest = 0;
  for (int period = 0; period < 750; ++period) {
    fleet.step();
    for (std::size_t i = 0; i < 8; ++i) {
      ASSERT_EQ(fleet.ended(i), 0u);
      const MeanSquares m = mean_squares(fleet, i, i + 1);
      const Motion t = fleet.truth(i);
      for (const double v : t.velocity_m_s) fastest = std::max(fastest, std::abs(v));
      // the beat shakes the torso by up to w' = 2000 rad/s^2 and a' = 1e4 m/s^3 and more, as the gains are, and the filter trusts each pose fully:
      // w' T^2/8 and a' T^2/8 of the interpolation, with T = 2 ms. 30 ms late: 0.015 m
      ASSERT_LT(std::sqrt(m.angle), 3e-3) << period;
      ASSERT_LT(std::sqrt(m.position), 1e-3) << period;
      ASSERT_LT(std::sqrt(m.velocity), 4e-2) << period;
    }
  }
  EXPECT_GT(fastest, 0.4);
}

/// A vehicle without air and motors falls and turns steadily but for its wings, which swing on their springs.
TEST(FleetFusion, BridgesTheDelaysOfTheImu) {
  model::Vehicle vehicle = test::nominal();
  vehicle.air_density_kg_m3 = 0;
  for (const char* delay : {"imu.latency_s=0.0", "imu.latency_s=0.003", "imu.rate_hz=333.0", "imu.rate_hz=90.0"}) {
    Overrides o = kQuiet;
    o.emplace_back(delay);
    Fleet<double> fleet(1, vehicle, fleet_options(sensors("paper", o), {}, task(staying())));
    sim::FlapperState s;
    s.velocity_m_s[0] = 3, s.velocity_m_s[2] = 2;
    fleet.start(0, 0, s, sim::Start::flying);
    for (int period = 0; period < 200; ++period) {
      fleet.step();
      if (period < 10) continue;  // up to the first increment of 90 Hz there is nothing to go on
      // late by a period it would be off by 6 mm and 0.02 m/s
      const MeanSquares m = mean_squares(fleet, 0, 1);
      ASSERT_LT(std::sqrt(m.position), 5e-4) << delay << ", " << period;
      ASSERT_LT(std::sqrt(m.velocity), 5e-3) << delay << ", " << period;
    }
  }
}

// With poses at once and an IMU slower than control, the newest increment lies behind the horizon: a new flight must not find
// the turn of the one before in it.
TEST(FleetFusion, ForgetsTheFlightBefore) {
  const FleetOptions o =
      fleet_options(sensors("paper", {"imu.rate_hz=90.0", "mocap.latency_s=0.0"}), {}, task(staying()));
  Fleet<double> fleet(1, test::nominal(), o);
  for (int again = 0; again < 40; ++again) {
    sim::FlapperState s;
    s.body_rate_rad_s[2] = 30;
    fleet.start(0, static_cast<std::uint32_t>(2 * again), s, sim::Start::flying);
    for (int period = 0; period < 20 + again % 7; ++period) fleet.step();
    EXPECT_GT(fleet.estimate(0).body_rate_rad_s[2], 15);
    fleet.start(0, static_cast<std::uint32_t>(2 * again + 1), {}, sim::Start::standing);
    for (int period = 0; period < 6; ++period) {
      fleet.step();
      for (const double rate : fleet.estimate(0).body_rate_rad_s)
        ASSERT_LT(std::abs(rate), 0.4);  // 6 sd of noise and bias
    }
  }
}

/// Innovations of a fleet after `from_s`: mean over each flapper, then over flappers, which are independent.
struct Innovations {
  double angle, angle_se, position, position_se, lagged;
};
Innovations innovations(const FleetOptions& o, const model::Vehicle& vehicle, double from_s, double until_s) {
  constexpr std::size_t kCount = 192;
  Fleet<float> fleet(kCount, vehicle, o);
  std::vector<std::pair<double, double>> last(kCount), sum(kCount);
  std::vector<double> n(kCount), lagged(kCount);
  for (double t = 0; t < until_s; t += kPeriod_s) {
    fleet.step();
    for (std::size_t i = 0; i < kCount; ++i) {
      const auto now = fleet.innovation(i);
      if (t > from_s && now != last[i]) {
        n[i] += 1, sum[i].first += now.first, sum[i].second += now.second;
        lagged[i] += (now.first - 3) * (last[i].first - 3) / 6;
      }
      last[i] = now;
    }
  }
  Innovations r{};
  double angle2 = 0, position2 = 0;
  for (std::size_t i = 0; i < kCount; ++i) {
    const double a = sum[i].first / n[i], p = sum[i].second / n[i];
    r.angle += a / kCount, r.position += p / kCount, r.lagged += lagged[i] / n[i] / kCount;
    angle2 += a * a / kCount, position2 += p * p / kCount;
  }
  r.angle_se = std::sqrt((angle2 - r.angle * r.angle) / kCount);
  r.position_se = std::sqrt((position2 - r.position * r.position) / kCount);
  return r;
}

TEST(FleetFusion, InnovationsAreAsPredicted) {
  // standing without gravity, and nothing told to the filter but the noise: exactly 3, whatever the correlation in time
  FleetOptions o = fleet_options(sensors("paper", kExact), {}, task(staying("kind = \"standing\"")));
  o.batch.world.gravity_m_s2 = 0;
  const Innovations standing = innovations(o, test::nominal(), 0.5, 2);
  EXPECT_NEAR(standing.angle, 3, kSigmas * standing.angle_se);
  EXPECT_NEAR(standing.position, 3, kSigmas * standing.position_se);
  EXPECT_LT(standing.angle_se, 0.03);
  EXPECT_NEAR(standing.lagged, 0, kSigmas / std::sqrt(192 * 1.5 * 150));
  // in flight, as shipped, and with an IMU that sits elsewhere: neglected, its lever arm would triple the position's
  const Overrides aside = {"imu.position_m.x=0.02", "imu.position_m.z=-0.01"};
  for (const Sensors& s : {sensors("paper"), sensors("code"), sensors("paper", aside)}) {
    const Innovations flying = innovations(fleet_options(s, controller("pid"), travelling()), test::nominal(), 0.5, 2);
    EXPECT_NEAR(flying.angle, 3, 0.2 + kSigmas * flying.angle_se) << s.mocap.rate_hz << ' ' << s.imu.position_m.x;
    EXPECT_NEAR(flying.position, 3, 0.5 + kSigmas * flying.position_se) << s.mocap.rate_hz << ' ' << s.imu.position_m.x;
    EXPECT_NEAR(flying.lagged, 0, 0.05) << s.mocap.rate_hz << ' ' << s.imu.position_m.x;
  }
}

TEST(FleetFusion, StartsAnewOnTheWayAsWellAsFresh) {
  constexpr std::size_t kCount = 256;
  for (const Overrides& rates : {Overrides{"imu.rate_hz=333.0", "mocap.rate_hz=97.0", "mocap.latency_s=0.0333"},
                                 {"imu.latency_s=0.003", "imu.low_pass_hz=60.0"},
                                 {"mocap.latency_s=0.0", "imu.rate_hz=90.0"}}) {
    const FleetOptions o = fleet_options(sensors("paper", rates), controller("pid"), travelling());
    Fleet<float> fresh(kCount, test::nominal(), o), again(kCount, test::nominal(), o);
    for (int period = 0; period < 101; ++period) again.step();  // 0.202 s: amid samples, poses on their way
    for (std::size_t i = 0; i < kCount; i += 2) again.start(i, 1);
    const auto others = [&] {
      std::uint64_t h = 0;
      for (std::size_t i = 1; i < kCount; i += 2) h = sim::mixed(h, again.hash(i, i + 1));
      return h;
    };
    Fleet<float> alone(kCount, test::nominal(), o);
    for (int period = 0; period < 101; ++period) alone.step();
    // Samples fall at other times after these starts, and all wings beat together: what is not yet known of a beat differs from
    // period to period, over three beats (44 periods) not by much.
    for (int window = 0; window < 3; ++window) {
      MeanSquares a{}, b{};
      const auto add = [](MeanSquares& sum, const MeanSquares& one, double share) {
        sum.position += share * one.position, sum.velocity += share * one.velocity, sum.angle += share * one.angle;
      };
      for (int period = 0; period < 44; ++period) {
        fresh.step(), again.step(), alone.step();
        add(a, mean_squares(fresh, 0, kCount), 1);
        for (std::size_t i = 0; i < kCount; i += 2) add(b, mean_squares(again, i, i + 1), 2.0 / kCount);
      }
      // sums of squares over 256 and 128 flappers: relative sd below sqrt(2/3 (1/256 + 1/128)) = 9 %
      EXPECT_LT(b.position / a.position, 1.4) << rates[0] << ", " << window;
      EXPECT_LT(b.velocity / a.velocity, 1.4) << rates[0] << ", " << window;
      EXPECT_LT(b.angle / a.angle, 1.4) << rates[0] << ", " << window;
    }
    // and whoever went on did not notice
    std::uint64_t h = 0;
    for (std::size_t i = 1; i < kCount; i += 2) h = sim::mixed(h, alone.hash(i, i + 1));
    EXPECT_EQ(others(), h);
  }
}

}  // namespace
}  // namespace flappy::flight::estimator_test
