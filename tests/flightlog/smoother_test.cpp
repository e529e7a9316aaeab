// The smoothed motion of a flight against motions that are known: made up, with sensors made of them by their definition,
// and simulated.
#include "flightlog/smoother.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <random>

#include "flightlog/some_log.hpp"
#include "io/csv.hpp"
#include "rollout/fly.hpp"
#include "rollout/fly_fixture.hpp"
#include "rollout/recorder.hpp"

namespace flappy::flightlog {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using flight::Folder, flight::kHover, flight::kPi, flight::message;

constexpr double kBeat_Hz = 34;

Vector3d rotation_vector(const Quaterniond& q) {
  const Eigen::AngleAxisd a(q);
  return a.angle() > kPi ? Vector3d((a.angle() - 2 * kPi) * a.axis()) : Vector3d(a.angle() * a.axis());
}

/// Something like a flight: slow motion, and the shaking of the beat.
struct Motions {
  Vector3d position(double t) const {
    const double b = 2 * kPi * kBeat_Hz * t;
    return {0.1 * std::sin(1.3 * t) + 8e-4 * std::cos(b), 0.2 * std::sin(0.7 * t) + 1e-4 * std::sin(b),
            0.4 + 0.05 * std::sin(2 * t) + 2e-4 * std::sin(2 * b)};
  }
  Quaterniond attitude(double t) const {
    const double b = 2 * kPi * kBeat_Hz * t;
    return Quaterniond(Eigen::AngleAxisd(3 * t + 0.03 * std::sin(b), Vector3d::UnitZ()) *
                       Eigen::AngleAxisd(0.2 * std::sin(2.1 * t) + 0.02 * std::cos(b), Vector3d::UnitY()) *
                       Eigen::AngleAxisd(0.3 * std::sin(1.7 * t) + 0.004 * std::sin(2 * b), Vector3d::UnitX()));
  }
  // differences over 2e-5 s: exact to (w 1e-5)^2/6 = 1e-6 of the beat, and 1e-11 in rounding
  static constexpr double kSmall_s = 1e-5;
  Vector3d velocity(double t, const Vector3d& arm = Vector3d::Zero()) const {
    const auto at = [&](double s) -> Vector3d { return position(s) + attitude(s) * arm; };
    return (at(t + kSmall_s) - at(t - kSmall_s)) / (2 * kSmall_s);
  }
  Vector3d rate(double t) const {
    return rotation_vector(attitude(t - kSmall_s).conjugate() * attitude(t + kSmall_s)) / (2 * kSmall_s);
  }
};

struct Biases {
  Vector3d gyro = Vector3d::Zero(), accel = Vector3d::Zero();
};

class Sensors {
 public:
  explicit Sensors(unsigned seed) : random_(seed) {}

  /// `share`: of a new value in the IMU's low-pass.
  flightlog::FlightLog log(flightlog::FlightHeader h, double duration_s, const Biases& bias, bool noisy,
                           double imu_late_s, double share = 1) {
    flightlog::FlightLog log;
    const double noise = noisy ? 1 : 0, T = 1 / h.imu.rate_hz;
    const Vector3d arm(h.imu.position_m.data());
    Vector3d rate = Vector3d::Zero(), force(0, 0, h.gravity_m_s2);
    for (double t = T; t < duration_s; t += T) {
      const Quaterniond a = m_.attitude(t - T), b = m_.attitude(t);
      const Vector3d turn = rotation_vector(a.conjugate() * b);
      const Quaterniond half = a * Quaterniond(Eigen::AngleAxisd(turn.norm() / 2, turn.normalized()));
      const Vector3d gained = m_.velocity(t, arm) - m_.velocity(t - T, arm) + Vector3d(0, 0, T * h.gravity_m_s2);
      rate += share * (turn / T - rate);
      force += share * (half.conjugate() * gained / T - force);
      const Vector3d gyro = rate + bias.gyro + noise * h.imu.gyro_noise_rad_s * three();
      const Vector3d accel = force + bias.accel + noise * h.imu.accel_noise_m_s2 * three();
      log.imu.t_s.push_back(t + imu_late_s);
      log.imu.gyro_x_rad_s.push_back(gyro.x()), log.imu.gyro_y_rad_s.push_back(gyro.y()),
          log.imu.gyro_z_rad_s.push_back(gyro.z());
      log.imu.accel_x_m_s2.push_back(accel.x()), log.imu.accel_y_m_s2.push_back(accel.y()),
          log.imu.accel_z_m_s2.push_back(accel.z());
    }
    for (double t = 0.003; t < duration_s; t += 1 / h.mocap.rate_hz) {
      const Vector3d angle = noise * h.mocap.attitude_noise_rad * three();
      const Vector3d p = m_.position(t) + noise * h.mocap.position_noise_m * three();
      const Quaterniond q =
          m_.attitude(t) *
          Quaterniond(Eigen::AngleAxisd(angle.norm(), angle.norm() > 0 ? angle.normalized() : Vector3d(1, 0, 0)));
      add_pose(log.mocap, t + h.mocap.latency_s, p, q);
    }
    log.command = {{0, duration_s}, {1, 1}, {1, 1}, {}, {}};
    log.header = std::move(h);
    return log;
  }
  Vector3d three() { return {normal_(random_), normal_(random_), normal_(random_)}; }

  static void add_pose(flightlog::MocapStream& m, double t_s, const Vector3d& p, const Quaterniond& q) {
    m.t_s.push_back(t_s);
    m.x_m.push_back(p.x()), m.y_m.push_back(p.y()), m.z_m.push_back(p.z());
    m.qw.push_back(q.w()), m.qx.push_back(q.x()), m.qy.push_back(q.y()), m.qz.push_back(q.z());
  }

 private:
  Motions m_;
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
};

/// Sensors of the paper, with the IMU away from the origin.
flightlog::FlightHeader header(double imu_late_s) {
  flight::ImuSensor imu;
  imu.rate_hz = 500;
  imu.latency_s = imu_late_s;
  imu.position_m = {0.012, -0.004, 0.02};
  imu.gyro_noise_rad_s = 0.0524;
  imu.accel_noise_m_s2 = 0.5;
  imu.gyro_bias_sd_rad_s = {0.02, 0.03, 0.015};
  flightlog::FlightHeader h;
  h.flapping_Hz = kBeat_Hz;
  h.imu = rollout::imu_header(imu);
  h.mocap = {150, 0.03, 1e-4, 0.005};
  return h;
}

struct Off {
  double position_m = 0, angle_rad = 0, velocity_m_s = 0, rate_rad_s = 0;
};
Off largest_off(const flightlog::Smoother& smoother, double from_s, double to_s) {
  const Motions m;
  Off off;
  for (double t = from_s; t < to_s; t += 3.7e-4) {
    const flightlog::TorsoMotion x = smoother.at(t);
    off.position_m = std::max(off.position_m, (x.position_m - m.position(t)).norm());
    off.angle_rad = std::max(off.angle_rad, rotation_vector(x.attitude.conjugate() * m.attitude(t)).norm());
    off.velocity_m_s = std::max(off.velocity_m_s, (x.velocity_m_s - m.velocity(t)).norm());
    off.rate_rad_s = std::max(off.rate_rad_s, (x.body_rate_rad_s - m.rate(t)).norm());
  }
  return off;
}

TEST(Smoother, OfPerfectSensorsIsTheMotion) {
  // The largest rate of the shaking is 6.4 rad/s, its slope 1,370 rad/s^2, and in roll 1.7 rad/s at 68 Hz; a quadratic on
  // 2 ms is off by 3e-3 of the first and 2e-2 of the second, and a mean over a turning interval by T^2/12 w x w' = 3e-3.
  // Nothing else is off: a millisecond would be 1.4 rad/s, the arm 20 mm and 0.1 m/s.
  for (const double late_s : {0.0, 0.004}) {
    const flightlog::FlightLog log =
        Sensors(1).log(header(late_s), 4, {{0.02, -0.03, 0.01}, Vector3d::Zero()}, false, late_s);
    const flightlog::Smoother smoother(log, "flight");
    EXPECT_NEAR(smoother.begin_s(), 0.003, 1e-9);
    const Off off = largest_off(smoother, 0.5, 3.5);
    EXPECT_LT(off.position_m, 1e-5);
    EXPECT_LT(off.angle_rad, 3e-4);
    EXPECT_LT(off.velocity_m_s, 2e-3);
    EXPECT_LT(off.rate_rad_s, 0.05);
    EXPECT_LT((smoother.gyro_bias_rad_s(2) - Vector3d(0.02, -0.03, 0.01)).norm(), 1e-3);
    EXPECT_LT(smoother.angle_normalised_innovation(), 0.05);
    EXPECT_LT(smoother.position_normalised_innovation(), 0.05);
  }
}

TEST(Smoother, UndoesADeclaredLowPass) {
  flight::ImuSensor imu;
  imu.rate_hz = 500;
  imu.low_pass_hz = 80;
  flightlog::FlightHeader h = header(0);
  const flightlog::ImuHeader slow = rollout::imu_header(imu);
  h.imu.bandwidth_hz = slow.bandwidth_hz;
  h.imu.latency_s = slow.latency_s;
  const double share = flight::low_pass_share(80, 0.002);
  const flightlog::FlightLog log = Sensors(1).log(h, 4, {}, false, 0, share);
  const Off off = largest_off(flightlog::Smoother(log, "flight"), 0.5, 3.5);
  EXPECT_LT(off.rate_rad_s, 0.05);  // 7 rad/s at 34 Hz would lose 8 %
  EXPECT_LT(off.velocity_m_s, 2e-3);
  flightlog::FlightLog fast = log;
  fast.header.imu = header(0).imu;
  EXPECT_GT(largest_off(flightlog::Smoother(fast, "flight"), 0.5, 3.5).rate_rad_s, 0.5);
}

/// Squares of errors over their covariance, summed for each of angle, position, velocity, gyro bias, accelerometer bias,
/// and the nine of motion together.
struct Squares {
  double parts[5] = {}, motion = 0, count = 0;
  void add(const flightlog::Smoother& smoother, std::size_t i, const Eigen::Matrix<double, 15, 1>& error) {
    const flightlog::Smoother::Covariance& p = smoother.covariance(i);
    for (Eigen::Index k = 0; k < 5; ++k)
      parts[k] += error.segment<3>(3 * k).dot(p.block<3, 3>(3 * k, 3 * k).llt().solve(error.segment<3>(3 * k)));
    motion += error.head<9>().dot(p.topLeftCorner<9, 9>().llt().solve(error.head<9>()));
    ++count;
  }
};

TEST(Smoother, CovariancesAreHonest) {
  // 16 flights of 6 s at 150 poses/s. What is smoothed remembers about 0.1 s, so of 3 dof there are 16 x 60 x 3 = 2,900
  // independent squares: 3 sd are 8 %. Biases are one draw each in a flight: 48 squares, 3 sd are 61 %. The arm of 11 cm, at
  // which the shaking is 140 m/s^2, makes the error of an angle, 0.7 mrad and at first 5, count in the torso's position.
  Sensors sensors(7);
  Squares squares;
  double innovations[2] = {};
  constexpr int kFlights = 16;
  for (int flight = 0; flight < kFlights; ++flight) {
    flightlog::FlightHeader h = header(0.001);
    h.imu.position_m = {0.06, -0.05, 0.08};
    const Vector3d arm(h.imu.position_m.data());
    Biases bias{sensors.three(), 0.2 * sensors.three()};
    for (int i = 0; i < 3; ++i) bias.gyro[i] *= h.imu.gyro_bias_sd_rad_s[static_cast<std::size_t>(i)];
    const flightlog::FlightLog log = sensors.log(h, 6, bias, true, 0.001);
    const flightlog::Smoother smoother(log, "flight", true);
    innovations[0] += smoother.angle_normalised_innovation() / kFlights;
    innovations[1] += smoother.position_normalised_innovation() / kFlights;
    const Motions m;
    for (std::size_t i = 0; i < smoother.pose_s().size(); ++i) {
      const double t = smoother.pose_s()[i];
      const flightlog::TorsoMotion x = smoother.at(t);
      Eigen::Matrix<double, 15, 1> error;
      error << rotation_vector(x.attitude.conjugate() * m.attitude(t)),
          m.position(t) + m.attitude(t) * arm - x.position_m - x.attitude * arm,
          m.velocity(t, arm) - x.velocity_m_s - x.attitude * x.body_rate_rad_s.cross(arm),
          bias.gyro - smoother.gyro_bias_rad_s(t), bias.accel - smoother.accel_bias_m_s2(t);
      squares.add(smoother, i, error);
    }
  }
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(squares.parts[k] / (3 * squares.count), 1, 0.1) << k;
  EXPECT_NEAR(squares.motion / (9 * squares.count), 1, 0.1);
  for (int k = 3; k < 5; ++k) EXPECT_NEAR(squares.parts[k] / (3 * squares.count), 1, 0.61) << k;
  // of 3 x 900 innovations in each of 16 flights: 3 sd are 2 %
  EXPECT_NEAR(innovations[0], 1, 0.03);
  EXPECT_NEAR(innovations[1], 1, 0.03);
}

template <class Stream>
void drop(Stream& s, double from_s, double to_s) {
  const auto keep = [&, t = s.t_s](std::vector<double>& column) {
    std::vector<double> kept;
    for (std::size_t i = 0; i < t.size(); ++i)
      if (t[i] < from_s || t[i] > to_s) kept.push_back(column[i]);
    column = kept;
  };
  if constexpr (std::is_same_v<Stream, flightlog::ImuStream>)
    for (auto* c :
         {&s.gyro_x_rad_s, &s.gyro_y_rad_s, &s.gyro_z_rad_s, &s.accel_x_m_s2, &s.accel_y_m_s2, &s.accel_z_m_s2})
      keep(*c);
  else
    for (auto* c : {&s.x_m, &s.y_m, &s.z_m, &s.qw, &s.qx, &s.qy, &s.qz}) keep(*c);
  keep(s.t_s);
}

TEST(Smoother, GoesOnOverGaps) {
  flightlog::FlightLog log = Sensors(5).log(header(0), 4, {}, true, 0);
  const flightlog::Smoother whole(log, "flight");
  EXPECT_TRUE(whole.covers(0.5, 3.5));
  EXPECT_FALSE(whole.covers(-0.1, 1));
  EXPECT_FALSE(whole.covers(3, 4.1));
  drop(log.imu, 1.0001, 1.0201);
  drop(log.mocap, 2.03, 2.08);
  for (auto* c :
       {&log.mocap.x_m, &log.mocap.y_m, &log.mocap.z_m, &log.mocap.qw, &log.mocap.qx, &log.mocap.qy, &log.mocap.qz})
    for (std::size_t i = 400; i < 405; ++i) (*c)[i] = (*c)[399];  // a tracker that repeats itself: 2.72 to 2.76 s
  const flightlog::Smoother smoother(log, "flight", true);
  EXPECT_FALSE(smoother.covers(0.9, 1.005));
  EXPECT_TRUE(smoother.covers(0.9, 0.995));
  EXPECT_TRUE(smoother.covers(1.03, 1.9));
  EXPECT_FALSE(smoother.covers(2.02, 2.03));
  EXPECT_FALSE(smoother.covers(2.73, 2.74));
  EXPECT_TRUE(smoother.covers(2.1, 2.7));
  EXPECT_EQ(smoother.pose_s().size() + 5 + 8, whole.pose_s().size());
  const Motions m;
  const auto off = [&](const flightlog::Smoother& x, double t) {
    return (x.at(t).velocity_m_s - m.velocity(t)).norm();
  };
  EXPECT_LT(off(smoother, 0.9), 0.01);
  EXPECT_LT(off(smoother, 1.1), 0.01);
  EXPECT_LT(off(smoother, 2.05), 0.02);  // the IMU alone
  EXPECT_LT(off(smoother, 2.74), 0.02);
  // an unseen beat: within what the covariance says there, which is far wider
  std::size_t i = 0;
  while (smoother.pose_s()[i] < 1.01) ++i;
  EXPECT_GT(smoother.covariance(i)(6, 6), 20 * smoother.covariance(i - 20)(6, 6));
  EXPECT_LT(off(smoother, smoother.pose_s()[i]), 4 * std::sqrt(smoother.covariance(i).diagonal().segment<3>(6).sum()));
}

TEST(Smoother, KnowsTheSampleOfEachInterval) {
  FlightLog log = test::some_log();
  ImuStream& imu = log.imu;
  for (Column* c : {&imu.t_s, &imu.gyro_x_rad_s, &imu.gyro_y_rad_s, &imu.gyro_z_rad_s, &imu.accel_x_m_s2,
                    &imu.accel_y_m_s2, &imu.accel_z_m_s2})
    c->erase(c->begin() + 100, c->begin() + 110);
  const Smoother smoother(log, "here");
  const std::vector<double>& bounds_s = smoother.bounds_s();
  std::size_t seen = 0;
  for (std::size_t k = 0; k + 1 < bounds_s.size(); ++k) {
    const auto sample = smoother.imu_sample((bounds_s[k] + bounds_s[k + 1]) / 2);
    EXPECT_EQ(sample.has_value(), k != 100) << k;
    if (!sample) continue;
    EXPECT_EQ(*sample, seen++);
    EXPECT_NEAR(smoother.mean_force_m_s2(bounds_s[k], bounds_s[k + 1]).x(), imu.accel_x_m_s2[*sample], 1e-12);
  }
  EXPECT_EQ(seen, imu.t_s.size());
}

TEST(Smoother, RefusesStreamsThatShareNoTime) {
  flightlog::FlightLog log = Sensors(1).log(header(0), 2, {}, true, 0);
  for (double& t : log.imu.t_s) t += 1.99;
  EXPECT_EQ(message([&] { flightlog::Smoother smoother(log, "here/it"); }),
            "here/it: motion capture and IMU, less their latencies, share 1 poses; accepted: streams that overlap");
  for (double& t : log.imu.t_s) t += 1;
  EXPECT_NE(message([&] { flightlog::Smoother smoother(log, "here/it"); }).find("share 0 poses"), std::string::npos);
  flightlog::FlightLog good = Sensors(1).log(header(0), 2, {}, true, 0);
  const flightlog::Smoother smoother(good, "flight");
  EXPECT_THROW(smoother.at(-0.1), std::out_of_range);
  EXPECT_THROW(smoother.at(2.1), std::out_of_range);
}

TEST(Smoother, SeesStreamsOfDifferentMotionsByTheirInnovations) {
  flightlog::FlightLog log = Sensors(1).log(header(0), 3, {}, true, 0);
  for (double& w : log.imu.gyro_z_rad_s) w *= -1;
  EXPECT_GT(flightlog::Smoother(log, "flight").angle_normalised_innovation(), 25);
  log = Sensors(1).log(header(0), 3, {}, true, 0);
  for (double& a : log.imu.accel_z_m_s2) a /= 9.81;
  EXPECT_GT(flightlog::Smoother(log, "flight").bias_normalised_innovation(), 25);  // 8.8 m/s^2
}

TEST(Smoother, OfSimulatedFlightsHasHonestCovariances) {
  // Four flights of 6 s of the identified vehicle, whose wings shake it by 10 rad/s and 30 m/s^2 and jerk it where they meet
  // their stops. Torso and IMU at one place. As above, of 4 x 60 x 3 squares 3 sd are 16 %.
  const Folder folder;
  const rollout::FlyConfig config = rollout::read_fly_config(kHover, {"flight.duration_s=6"});
  rollout::FlyOptions options;
  options.count = 4;
  options.log_folder = folder / "flights";
  fly(config, options);
  Squares squares;
  std::vector<double> rate_off;
  double bias_off = 0;
  for (const std::string name : {"0000", "0001", "0002", "0003"}) {
    const std::filesystem::path flight = options.log_folder / name;
    const flightlog::Smoother smoother(flightlog::read_flight_log(flight), flight, true);
    const io::CsvTable truth = io::read_csv(flight / "truth.csv");
    const auto at = [&](std::size_t row, const char* a, const char* b, const char* c) {
      return Vector3d(truth.column(a)[row], truth.column(b)[row], truth.column(c)[row]);
    };
    for (std::size_t i = 0, row = 0; i < smoother.pose_s().size(); ++i) {
      const double t = smoother.pose_s()[i];
      while (row < truth.column("t_s").size() && truth.column("t_s")[row] < t - 1e-9) ++row;
      if (row == truth.column("t_s").size()) break;
      if (std::abs(truth.column("t_s")[row] - t) > 1e-9 || t < 1) continue;  // mocap between control ticks
      const flightlog::TorsoMotion x = smoother.at(t);
      const Quaterniond q(truth.column("qw")[row], truth.column("qx")[row], truth.column("qy")[row],
                          truth.column("qz")[row]);
      const Vector3d gyro = at(row, "gyro_bias_x_rad_s", "gyro_bias_y_rad_s", "gyro_bias_z_rad_s");
      Eigen::Matrix<double, 15, 1> error;
      error << rotation_vector(x.attitude.conjugate() * q), at(row, "x_m", "y_m", "z_m") - x.position_m,
          at(row, "velocity_x_m_s", "velocity_y_m_s", "velocity_z_m_s") - x.velocity_m_s,
          gyro - smoother.gyro_bias_rad_s(t), -smoother.accel_bias_m_s2(t);
      squares.add(smoother, i, error);
      bias_off = std::max(bias_off, error.segment<3>(9).norm());
      const Vector3d rate = at(row, "rate_x_rad_s", "rate_y_rad_s", "rate_z_rad_s") - x.body_rate_rad_s;
      for (int k = 0; k < 3; ++k) rate_off.push_back(std::abs(rate[k]));
    }
  }
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(squares.parts[k] / (3 * squares.count), 1, 0.2) << k;
  EXPECT_NEAR(squares.motion / (9 * squares.count), 1, 0.2);
  EXPECT_LT(bias_off, 0.02);
  // the gyro's noise is 0.052, its median size 0.035; the rest is where wings meet their stops, which jerks the body by 2 rad/s
  std::ranges::sort(rate_off);
  const auto part = [&](double share) {
    return rate_off[static_cast<std::size_t>(share * static_cast<double>(rate_off.size()))];
  };
  std::printf("body rate off by: median %.3f, 90 %% %.3f, 99 %% %.3f rad/s\n", part(0.5), part(0.9), part(0.99));
  EXPECT_LT(part(0.5), 0.08);
  EXPECT_LT(part(0.9), 0.4);
}

TEST(WingAngles, AreCubicBetweenSamples) {
  flightlog::WingsStream w;
  const auto cubic = [](double t) { return 1 + t * (2 + t * (-30 + 400 * t)); };
  for (int i = 0; i < 50; ++i) {
    if (i == 20) continue;
    const double t = 0.002 * i + 1e-4 * (i % 3);
    w.t_s.push_back(t);
    w.left_stroke_rad.push_back(cubic(t));
    w.right_stroke_rad.push_back(-cubic(t));
    w.left_rotation_rad.push_back(2 * cubic(t));
    w.right_rotation_rad.push_back(-2 * cubic(t));
  }
  for (const double t : {0.0031, 0.01, 0.0333, 0.0499, 0.093}) {
    constexpr double kTimes[] = {1, -1, 2, -2};
    for (std::size_t i = 0; i < 4; ++i)
      EXPECT_NEAR(wing_angles_at(w, 500, t)[i], kTimes[i] * cubic(t), 1e-12) << t << " " << i;
  }
  for (const double t : {-1.0, 0.001, 0.041, 0.097, 1.0}) EXPECT_TRUE(std::isnan(wing_angles_at(w, 500, t)[3])) << t;
}

TEST(MotorVoltages, FollowTheBattery) {
  flightlog::FlightLog log;
  log.command = {{0, 0.1, 0.2}, {1, 2, -3}, {4, 5, 6}, {}, {}};
  EXPECT_EQ(motor_voltages(log).left_V, log.command.left_voltage_V);
  log.header.power = flightlog::PowerHeader{10, 10, 0.05, 0, 0};
  log.power = flightlog::PowerStream{{0.1, 0.2, 0.3}, {9, 8, 6}, {0, 0, 0}, {0, 0, 0}};  // at 0.05, 0.15, 0.25 s
  const sim::VoltageScript v = motor_voltages(log);
  EXPECT_EQ(v.t_s, log.command.t_s);
  const double scale[3] = {0.9, 0.85, 0.7};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(v.left_V[i], log.command.left_voltage_V[i] * scale[i], 1e-12);
    EXPECT_NEAR(v.right_V[i], log.command.right_voltage_V[i] * scale[i], 1e-12);
  }
}

}  // namespace
}  // namespace flappy::flightlog
