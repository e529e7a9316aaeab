// Sensors: their equations against motion whose specific force is known, and their noise, delay and losses as a whole fleet
// shows them.
#include "flight/sensors.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "flight/fleets.hpp"

namespace flappy::flight::sensors_test {
namespace {

using V = model::Vec3<double>;
using Q = model::Quaternion<double>;
constexpr double kGravity = 9.81;
constexpr double kSigmas = 4.5;  // 1 in 150,000 for each statistic

void expect_near(const V& a, const V& b, double tolerance, const char* what) {
  EXPECT_NEAR(a.x, b.x, tolerance) << what;
  EXPECT_NEAR(a.y, b.y, tolerance) << what;
  EXPECT_NEAR(a.z, b.z, tolerance) << what;
}

/// Attitude after turning by the rotation vector `turn` in body axes from `from`.
Q after(const Q& from, const V& turn) {
  const double angle = std::sqrt(model::dot(turn, turn));
  const double s = angle > 0 ? std::sin(angle / 2) / angle : 0.5, c = std::cos(angle / 2);
  const Q r{c, s * turn.x, s * turn.y, s * turn.z};
  return {from.w * r.w - from.x * r.x - from.y * r.y - from.z * r.z,
          from.w * r.x + from.x * r.w + from.y * r.z - from.z * r.y,
          from.w * r.y + from.y * r.w + from.z * r.x - from.x * r.z,
          from.w * r.z + from.z * r.w + from.x * r.y - from.y * r.x};
}

ImuConstants<double> quiet(const V& position_m, double low_pass_share = 1) {
  return {{position_m.x, position_m.y, position_m.z}, 0, 0, low_pass_share, kGravity};
}

/// One sample of an IMU between two true states.
ImuSample<double> between(const ImuConstants<double>& k, double interval_s, const Truth<double>& a,
                          const Truth<double>& b) {
  Imu<double> imu{};
  imu.attitude = a.attitude;
  imu.velocity_m_s = point_velocity(a, {k.position_m[0], k.position_m[1], k.position_m[2]});
  return sample_imu<double>(k, 1 / interval_s, b, imu, {}, {});
}

TEST(Imu, AtRestReadsGravityUpwardAndNoRate) {
  for (const V& turn : {V{0, 0, 0}, V{0.4, 0, 0}, V{0.3, -1.1, 2}}) {
    const Truth<double> t{{1, 2, 3}, after({1, 0, 0, 0}, turn), {0, 0, 0}, {0, 0, 0}};
    const ImuSample<double> y = between(quiet({0.01, 0.02, -0.03}), 0.002, t, t);
    expect_near(y.gyro_rad_s, {0, 0, 0}, 1e-15, "gyro");
    expect_near(y.accel_m_s2, transpose_times(rotation_matrix(t.attitude), {0, 0, kGravity}), 1e-14, "accel");
  }
  // level, and rolled to the left side: up is then to the right, -y... of a body whose +y axis points down
  const Truth<double> left_down{{}, after({1, 0, 0, 0}, {-M_PI / 2, 0, 0}), {0, 0, 0}, {0, 0, 0}};
  expect_near(between(quiet({}), 0.002, left_down, left_down).accel_m_s2, {0, -kGravity, 0}, 1e-14,
              "rolled to the left");
}

/// A body that starts at rate w, turns ever faster about a fixed axis, and whose origin accelerates: all in closed form.
struct Spin {
  V axis;  // of unit length, in B and W alike but for `start`
  double rate, growth;
  V acceleration;
  Q start{0.8, 0, 0.6, 0};

  Truth<double> at(double t) const {
    return {{0, 0, 0},
            after(start, (rate * t + growth * t * t / 2) * axis),
            t * acceleration + V{0.3, -0.2, 0.1},
            (rate + growth * t) * axis};
  }
  /// Specific force of a point r in B.
  V force(double t, const V& r) const {
    const V w = (rate + growth * t) * axis, alpha = growth * axis;
    const V up{0, 0, kGravity};
    return transpose_times(rotation_matrix(at(t).attitude), acceleration + up) + cross(alpha, r) +
           cross(w, cross(w, r));
  }
};

TEST(Imu, FeelsTurningAcceleratingAndItsLeverArm) {
  const V arm{0.02, -0.01, 0.03};
  for (const V& axis : {V{1, 0, 0}, V{0, 1, 0}, V{0, 0, 1}, V{2.0 / 3, -1.0 / 3, 2.0 / 3}}) {
    const Spin spin{axis, 9, 120, {1.5, -2, 0.7}};
    double former = 0;
    for (const double dt : {4e-3, 2e-3, 1e-3}) {
      const double t = 0.01;
      const ImuSample<double> y = between(quiet(arm), dt, spin.at(t - dt / 2), spin.at(t + dt / 2));
      // about a fixed axis the turn is the integral of the rate; rotation_vector leaves out 3/20 n^5, n = half the turn
      expect_near(y.gyro_rad_s, (9 + 120 * t) * axis, 0.15 * std::pow((9 + 120 * t) * dt / 2, 5) / dt + 1e-12, "gyro");
      // the mean over dt, against the value at its middle: dt^2/24 times its second derivative, of size
      // (w^2 + alpha)(a + g) + w^4 r and less than 0.1 dt^2 10^4.. 10^5; and it must fall as dt^2
      const V off = y.accel_m_s2 - spin.force(t, arm);
      const double error = std::sqrt(dot(off, off));
      EXPECT_LT(error, 700 * dt * dt * kGravity) << dt;
      if (former > 1e-9) EXPECT_NEAR(former / error, 4, 0.1) << dt;
      former = error;
    }
    // the arm alone, without the body's own acceleration: tangential and centripetal
    const Spin still{axis, 9, 120, {0, 0, -kGravity}};
    const V w = (9 + 120 * 0.01) * axis;
    expect_near(between(quiet(arm), 2e-4, still.at(0.0099), still.at(0.0101)).accel_m_s2,
                cross(120 * axis, arm) + cross(w, cross(w, arm)), 2e-4, "lever arm");
  }
}

TEST(Imu, LowPassesWhatItMeasures) {
  // constant from the second sample on: share, then the rest decays by 1 - share
  const double share = 0.3, dt = 0.002;
  const ImuConstants<double> k = quiet({}, share);
  const Spin spin{{0, 0, 1}, 5, 0, {0, 0, 0}, {1, 0, 0, 0}};
  Imu<double> imu{};
  imu.attitude = spin.at(0).attitude;
  imu.low_passed.accel_m_s2 = {0, 0, kGravity};
  imu.velocity_m_s = point_velocity(spin.at(0), {0, 0, 0});
  for (int i = 1; i < 20; ++i) {
    const ImuSample<double> y = sample_imu<double>(k, 1 / dt, spin.at(i * dt), imu, {}, {});
    EXPECT_NEAR(y.gyro_rad_s.z, 5 * (1 - std::pow(1 - share, i)), 1e-9);
    EXPECT_NEAR(y.accel_m_s2.z, kGravity, 1e-12);
  }
}

TEST(Imu, AddsBiasAndNoiseToTheRightAxes) {
  const ImuConstants<double> k{{0, 0, 0}, 0.5, 2, 1, kGravity};
  Imu<double> imu{};
  imu.attitude = {1, 0, 0, 0};
  imu.gyro_bias_rad_s = {0.1, 0.2, 0.3};
  const Truth<double> t{{}, {1, 0, 0, 0}, {}, {}};
  const ImuSample<double> y = sample_imu<double>(k, 500, t, imu, {{1, 2, 3, 4}}, {{5, 6, 7, 8}});
  expect_near(y.gyro_rad_s, {0.6, 1.2, 1.8}, 1e-12, "gyro");
  expect_near(y.accel_m_s2, {8, 10, kGravity + 12}, 1e-12, "accel");
}

TEST(RotationVector, IsThatOfEitherSignOfTheQuaternion) {
  for (const V& turn : {V{1e-9, 0, 0}, V{0.05, -0.1, 0.2}, V{0, 0, -0.3}}) {
    const Q q = after({1, 0, 0, 0}, turn);
    const double n = std::sqrt(dot(turn, turn));
    const double tolerance = 3.0 / 40 * std::pow(n / 2, 5) * 2.1 + 1e-16;
    expect_near(rotation_vector(q), turn, tolerance, "q");
    expect_near(rotation_vector(Q{-q.w, -q.x, -q.y, -q.z}), turn, tolerance, "-q");
  }
  const Q a = after({0.8, 0, 0.6, 0}, {0.1, 0.2, 0.3});
  expect_near(rotation_vector(from_to({0.8, 0, 0.6, 0}, a)), {0.1, 0.2, 0.3}, 1e-4, "in axes of the first");
}

/// Standing flappers without voltage: all that sensors show of them is noise.
template <class T>
Fleet<T> standing(std::size_t count, const Sensors& s) {
  FleetOptions o = fleet_options(s, {}, task(staying("kind = \"standing\"")));
  o.batch.world.ground_z_m = 0;
  return Fleet<T>(count, test::nominal(), o);
}

/// Sums over samples of one noise: how wide, and how much like its neighbour's.
struct Statistic {
  double n = 0, sum = 0, square = 0, neighbour = 0;
};

class Presets : public testing::TestWithParam<const char*> {};

TEST_P(Presets, NoiseIsWhiteAndAsWideAsStated) {
  constexpr std::size_t kCount = 2048;
  const Sensors s = sensors(GetParam());
  Fleet<float> fleet = standing<float>(kCount, s);
  fleet.record(true);
  constexpr std::size_t kNoises = 12;  // gyro, accel, position, attitude
  std::vector<std::array<std::vector<double>, kNoises>> seen(kCount);
  for (int period = 0; period < 50; ++period) {
    fleet.step();
    for (std::size_t i = 0; i < kCount; ++i) {
      for (const auto& y : fleet.imu_samples(i))
        for (std::size_t k = 0; k < 3; ++k) {
          seen[i][k].push_back(y.gyro_rad_s[k]);
          seen[i][3 + k].push_back(y.accel_m_s2[k] - (k == 2 ? kGravity : 0));
        }
      for (const auto& z : fleet.mocap_samples(i))
        for (std::size_t k = 0; k < 3; ++k) {
          seen[i][6 + k].push_back(z.position_m[k]);
          seen[i][9 + k].push_back(2 * z.attitude[1 + k]);
        }
    }
  }
  const double imu_samples = std::floor(0.1 * s.imu.rate_hz + 1e-9), poses = std::floor(0.1 * s.mocap.rate_hz + 1e-9);
  ASSERT_EQ(static_cast<double>(seen[0][0].size()), imu_samples);
  ASSERT_EQ(static_cast<double>(seen[0][6].size()), poses);

  // a flight's gyro bias is its mean, which noise blurs; mean over flights 0
  const double bias_sd[3] = {s.imu.gyro_bias_sd_rad_s.x, s.imu.gyro_bias_sd_rad_s.y, s.imu.gyro_bias_sd_rad_s.z};
  Statistic bias[3];
  double other_axis[3] = {0, 0, 0};
  std::vector<std::array<double, 3>> mean(kCount);
  for (std::size_t i = 0; i < kCount; ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      double sum = 0;
      for (const double x : seen[i][k]) sum += x;
      mean[i][k] = sum / imu_samples;
      for (double& x : seen[i][k]) x -= mean[i][k];
    }
  for (std::size_t i = 0; i < kCount; ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      const double x = mean[i][k];
      bias[k].n += 1, bias[k].sum += x, bias[k].square += x * x;
      bias[k].neighbour += x * mean[(i + 1) % kCount][k];
      other_axis[k] += x * mean[i][(k + 1) % 3];
    }
  const double blur = s.imu.gyro_noise_rad_s / std::sqrt(imu_samples);
  for (std::size_t k = 0; k < 3; ++k) {
    const double wide = std::hypot(bias_sd[k], blur);
    EXPECT_NEAR(std::sqrt(bias[k].square / kCount) / wide, 1, kSigmas / std::sqrt(2.0 * kCount)) << "bias " << k;
    EXPECT_NEAR(bias[k].sum / kCount / wide, 0, kSigmas / std::sqrt(kCount)) << "bias " << k;
    EXPECT_NEAR(bias[k].neighbour / bias[k].square, 0, 1.1 * kSigmas / std::sqrt(kCount)) << "bias " << k;
    const double other_sd = std::hypot(bias_sd[(k + 1) % 3], blur);
    EXPECT_NEAR(other_axis[k] / (kCount * wide * other_sd), 0, 1.1 * kSigmas / std::sqrt(kCount)) << "bias " << k;
  }

  const double stated[4] = {s.imu.gyro_noise_rad_s, s.imu.accel_noise_m_s2, s.mocap.position_noise_m,
                            s.mocap.attitude_noise_rad};
  const std::string what = std::string(GetParam()) + ", noise ";
  double sd[kNoises];
  for (std::size_t k = 0; k < kNoises; ++k) {
    Statistic all;
    for (std::size_t i = 0; i < kCount; ++i)
      for (std::size_t j = 0; j < seen[i][k].size(); ++j) {
        const double x = seen[i][k][j];
        all.n += 1, all.sum += x, all.square += x * x;
        all.neighbour += x * seen[(i + 1) % kCount][k][j];
      }
    sd[k] = stated[k / 3];
    if (k < 3)
      sd[k] *= std::sqrt(1 - 1 / imu_samples);  // its own mean was taken out: one degree of freedom for each flight
    const double root = std::sqrt(all.n);
    EXPECT_NEAR(std::sqrt(all.square / all.n) / sd[k], 1, kSigmas / root / std::sqrt(2)) << what << k;
    EXPECT_NEAR(all.sum / all.n / sd[k], 0, kSigmas / root) << what << k;
    EXPECT_NEAR(all.neighbour / all.square, 0, 1.02 * kSigmas / root) << what << k << ": like the next flapper's";
  }
  // no noise is like another, or like any of the sample before: correlations of 0 within 1/sqrt(n)
  for (std::size_t k = 0; k < kNoises; ++k)
    for (std::size_t m = 0; m < kNoises; ++m)
      for (const std::size_t lag : {std::size_t{0}, std::size_t{1}}) {
        if (lag == 0 && m >= k) continue;
        double n = 0, product = 0;
        for (std::size_t i = 0; i < kCount; ++i)
          for (std::size_t j = lag; j < std::min(seen[i][k].size(), seen[i][m].size()); ++j)
            n += 1, product += seen[i][k][j] * seen[i][m][j - lag];
        const double own_mean = k == m && k < 3 ? 1 / imu_samples : 0;  // what is left of a mean taken out
        EXPECT_NEAR(product / n / (sd[k] * sd[m]) + own_mean, 0, 1.02 * kSigmas / std::sqrt(n))
            << what << k << " and " << m << ", lag " << lag;
      }
}

TEST_P(Presets, SamplesArriveLateAsStated) {
  const Sensors s = sensors(GetParam());
  Fleet<float> fleet = standing<float>(1, s);
  fleet.record(true);
  constexpr double h = sim::kDefaultStep_s;
  int imu = 0, pose = 0;
  for (int period = 0; period < 100; ++period) {
    fleet.step();
    for (const auto& y : fleet.imu_samples(0))
      EXPECT_NEAR(y.arrival_s, std::ceil(++imu / s.imu.rate_hz / h - 1e-6) * h + s.imu.latency_s, 1e-9);
    for (const auto& z : fleet.mocap_samples(0))
      EXPECT_NEAR(z.arrival_s, std::ceil(++pose / s.mocap.rate_hz / h - 1e-6) * h + s.mocap.latency_s, 1e-9);
  }
  EXPECT_EQ(imu, static_cast<int>(0.2 * s.imu.rate_hz));
  EXPECT_EQ(pose, static_cast<int>(0.2 * s.mocap.rate_hz));
}

INSTANTIATE_TEST_SUITE_P(Sensors, Presets, testing::Values("paper", "code"));

TEST(Mocap, LosesBurstsOfSamples) {
  constexpr std::size_t kCount = 512;
  constexpr double kBegins = 0.02, kLength = 5;
  // one sample in each period
  const Sensors s = sensors("paper", {"mocap.rate_hz=500.0", "mocap.loss_probability=0.02", "mocap.loss_length=5.0"});
  Fleet<float> fleet = standing<float>(kCount, s);
  fleet.record(true);
  constexpr int kPeriods = 400, kSettled = 60;  // 0.78^60: stationary
  std::vector<int> run(kCount, 0);
  double lost = 0, bursts = 0, in_bursts = 0, long_bursts = 0;
  for (int period = 0; period < kPeriods; ++period) {
    fleet.step();
    for (std::size_t i = 0; i < kCount; ++i) {
      const auto poses = fleet.mocap_samples(i);
      ASSERT_EQ(poses.size(), 1u);
      const bool gone = !poses[0].valid;
      if (period >= kSettled) lost += gone;
      if (!gone && run[i] > 0) {  // bursts from their first sample to their last
        ++bursts, in_bursts += run[i];
        long_bursts += run[i] > 10;
      }
      run[i] = gone ? run[i] + 1 : 0;
    }
  }
  // two states with memory rho = 1 - 0.02 - 1/5: the variance of a mean is (1 + rho)/(1 - rho) times that of free draws
  constexpr double kFraction = kBegins / (kBegins + 1 / kLength), kRho = 1 - kBegins - 1 / kLength;
  const double n = kCount * (kPeriods - kSettled);
  EXPECT_NEAR(lost / n, kFraction, kSigmas * std::sqrt(kFraction * (1 - kFraction) / n * (1 + kRho) / (1 - kRho)));
  // geometric lengths: mean L, variance L (L - 1); the fraction above 10 is (1 - 1/L)^10. Bursts that the end cuts off are
  // left out, which shortens the mean by no more than L/400 of L.
  EXPECT_NEAR(in_bursts / bursts, kLength,
              kSigmas * std::sqrt(kLength * (kLength - 1) / bursts) + kLength * kLength / 400);
  const double longer = std::pow(1 - 1 / kLength, 10);
  EXPECT_NEAR(long_bursts / bursts, longer, kSigmas * std::sqrt(longer / bursts) + 0.01);
}

TEST(Mocap, WithoutLossesSeesEverySample) {
  Fleet<double> fleet = standing<double>(9, sensors("paper", {"mocap.rate_hz=500.0"}));
  fleet.record(true);
  for (int period = 0; period < 200; ++period) {
    fleet.step();
    for (std::size_t i = 0; i < 9; ++i) ASSERT_TRUE(fleet.mocap_samples(i).at(0).valid);
  }
}

/// The true velocity that the sensors start from is that of the torso origin, wings beating or not.
TEST(Truth, IsWhatTheBatchSays) {
  const Controller none;
  FleetOptions o = fleet_options(sensors("paper"), none, task(staying()));
  Fleet<double> fleet(3, test::identified(), o);
  for (std::size_t i = 0; i < 3; ++i) fleet.set_added(i, {9 + 2.0 * static_cast<double>(i), 0.3, -0.2, 0.02});
  for (int period = 0; period < 40; ++period) {
    fleet.step();
    for (std::size_t i = 0; i < 3; ++i) {
      const Motion m = fleet.truth(i);
      const sim::FlapperState s = fleet.batch().state(i);
      for (int k = 0; k < 3; ++k) {
        ASSERT_EQ(m.position_m[k], s.position_m[k]);
        ASSERT_NEAR(m.velocity_m_s[k], s.velocity_m_s[k], 1e-12);
        ASSERT_EQ(m.body_rate_rad_s[k], s.body_rate_rad_s[k]);
      }
    }
  }
  EXPECT_GT(std::abs(fleet.truth(2).velocity_m_s[2]), 0.05);  // it did fly
}

}  // namespace
}  // namespace flappy::flight::sensors_test
