#include <algorithm>

#include "lab/blind/c/c_sensors.hpp"
#include "lab/blind/c/c_session.hpp"

namespace flappy::blind::c {
namespace {

Eigen::Matrix3d turned(const Eigen::Vector3d& by) {
  return by.norm() > 0 ? Eigen::AngleAxisd(by.norm(), by.normalized()).toRotationMatrix() : Eigen::Matrix3d::Identity();
}

/// Errors of 0.2 % in scale and orthogonality.
Eigen::Matrix3d imperfect_axes(Random& random) {
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j <= i; ++j) axes(i, j) += 2e-3 * random.cut_normal();
  return axes;
}

/// Position (m), attitude (rad) of a fit to the markers, to first order in their noise, rms over the axes.
std::pair<double, double> pose_noise(const SensorParameters::Mocap& m) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& marker : m.markers_m) mean += marker / 4;
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& marker : m.markers_m) {
    const Eigen::Vector3d d = marker - mean;
    spread += d.squaredNorm() * Eigen::Matrix3d::Identity() - d * d.transpose();
  }
  const double variance = m.marker_noise_m * m.marker_noise_m;
  const Eigen::Matrix3d attitude = variance * spread.inverse();
  Eigen::Matrix3d cross;
  cross << 0, -mean.z(), mean.y(), mean.z(), 0, -mean.x(), -mean.y(), mean.x(), 0;
  const Eigen::Matrix3d position = variance / 4 * Eigen::Matrix3d::Identity() + cross * attitude * cross.transpose();
  return {std::sqrt(position.trace() / 3), std::sqrt(attitude.trace() / 3)};
}

double rounded(double rate_hz) { return rate_hz > 400 ? 10 * std::round(rate_hz / 10) : 5 * std::round(rate_hz / 5); }

/// Makes declarations inexact. It has its own random numbers, so draws of true values do not depend on it.
void declare_loosely(SensorParameters& f, const Robot& robot, Random random) {
  flightlog::FlightHeader& h = f.declared;
  const double interval_s = static_cast<double>(f.imu.steps) * robot.step_s();
  const std::array<Sampling, 3> kinds = {Sampling::kInstant, Sampling::kMean, Sampling::kHeld};
  f.imu.sampling = kinds[random.below(3)];
  // a mean, and on average a held sample, is half an interval late; declared or not, the error is within 0.5 ms
  const double half_s = f.imu.sampling == Sampling::kInstant ? 0 : interval_s / 2;
  const bool counted = random.uniform() < 0.5;
  h.imu.latency_s =
      std::clamp(f.imu.latency_s + (counted ? half_s : 0), f.imu.latency_s + half_s - 0.5e-3, f.imu.latency_s + half_s);
  h.mocap.latency_s += random.uniform(-0.5e-3, 0.5e-3);
  h.imu.rate_hz = rounded(h.imu.rate_hz);
  h.mocap.rate_hz = rounded(h.mocap.rate_hz);
  const Eigen::Vector3d way = random.direction();
  const Eigen::Vector3d off = random.uniform(0.5e-3, 2e-3) * way;
  for (int i = 0; i < 3; ++i) h.imu.position_m[static_cast<std::size_t>(i)] += off[i];
  const Eigen::Vector3d axis = random.direction();
  const Eigen::Matrix3d mounting = turned(random.uniform(0.1, 1.0) * kDegree * axis);
  f.imu.gyro_axes = f.imu.gyro_axes * mounting;
  f.imu.accel_axes = f.imu.accel_axes * mounting;
  for (double* noise :
       {&h.mocap.position_noise_m, &h.mocap.attitude_noise_rad, &h.imu.gyro_noise_rad_s, &h.imu.accel_noise_m_s2})
    *noise *= random.uniform(0.7, 1.5);
  const double fast = random.uniform(0, 50e-6), power_noise = random.uniform(0.7, 1.5),
               wing_noise = random.uniform(0.7, 1.5);
  (random.uniform() < 0.5 ? f.fast_imu : f.fast_mocap) = fast;
  const double power_late_s = random.uniform(-0.5e-3, 0.5e-3);
  f.power.battery_side = random.uniform() < 0.5;
  if (h.power) {
    h.power->latency_s = std::max(0.0, h.power->latency_s + power_late_s);
    h.power->current_noise_A *= power_noise;
    h.power->voltage_noise_V *= power_noise;
    h.power->rate_hz = rounded(h.power->rate_hz);
  }
  if (h.wings) {
    h.wings->noise_rad *= wing_noise;
    h.wings->rate_hz = rounded(h.wings->rate_hz);
  }
}

/// What is declared and what the cameras believe stay.
void change(SensorParameters& f, const SessionChange& day) {
  const Eigen::Matrix3d mounting = turned(day.imu_turn_rad), glued = turned(day.markers_turn_rad);
  f.imu.gyro_axes = f.imu.gyro_axes * mounting;
  f.imu.accel_axes = f.imu.accel_axes * mounting;
  f.imu.gyro_bias += day.gyro_bias_rad_s;
  for (Eigen::Vector3d& marker : f.mocap.markers_m) marker = glued * marker + day.markers_m;
  f.imu.latency_s += day.imu_late_s;
  f.mocap.latency_s += day.mocap_late_s;
}

}  // namespace

SensorParameters sensor_parameters(const Assignment& a, const Robot& robot) {
  Random random(a.seed, "sensors");
  SensorParameters f;
  const auto rate = [&](std::size_t steps) { return 1 / (static_cast<double>(steps) * robot.step_s()); };
  const std::array<std::size_t, 5> imu_steps = {10, 12, 14, 16, 20}, mocap_steps = {40, 45, 50, 60, 66};
  const std::size_t tenths =
      static_cast<std::size_t>(std::max(1L, std::lround(1e-4 / robot.step_s())));  // steps per 0.1 ms
  f.imu.steps = tenths * imu_steps[random.below(5)];
  f.imu.bandwidth_hz = random.uniform(150, 320);
  f.imu.latency_s = random.uniform(0.5e-3, 2e-3);
  for (int i = 0; i < 3; ++i) f.imu.position_m[i] = 4e-3 * random.uniform(-1, 1);
  f.imu.position_m.z() -= 3e-3;
  f.imu.gyro_axes = imperfect_axes(random);
  f.imu.accel_axes = imperfect_axes(random);
  for (int i = 0; i < 3; ++i) f.imu.gyro_bias[i] = f.imu.gyro_bias_sd[i] * random.cut_normal();
  f.imu.gyro_noise = random.uniform(0.01, 0.05);
  f.imu.accel_noise = random.uniform(0.2, 0.5);
  f.mocap.steps = tenths * mocap_steps[random.below(5)];
  f.mocap.latency_s = random.uniform(6e-3, 20e-3);
  f.mocap.marker_noise_m = random.uniform(0.1e-3, 0.25e-3);
  f.mocap.markers_m = {Eigen::Vector3d(0.022, 0.004, 0.020), Eigen::Vector3d(-0.020, 0.008, 0.028),
                       Eigen::Vector3d(0.003, 0.021, -0.012), Eigen::Vector3d(-0.005, -0.022, -0.006)};
  for (Eigen::Vector3d& marker : f.mocap.markers_m) marker += 2e-3 * random.normal3();
  f.mocap.model_m = f.mocap.markers_m;
  for (std::size_t i = 0; i < 6; ++i) {
    const double around = M_PI / 3 * static_cast<double>(i) + random.uniform(-0.3, 0.3), up = random.uniform(0.2, 0.6);
    f.mocap.cameras_W[i] =
        Eigen::Vector3d(std::cos(around) * std::cos(up), std::sin(around) * std::cos(up), std::sin(up));
  }
  f.power.steps = f.wings.steps = 10 * tenths;
  f.power.latency_s = random.uniform(0.2e-3, 1.5e-3);
  for (double& offset : f.power.offset_A) offset = 4e-3 * random.cut_normal();
  for (std::size_t i = 0; i < 4; ++i) {
    f.wings.bend_rad[i] = 0.4 * kDegree * random.cut_normal();
    f.wings.bend_phase[i] = random.uniform(0, 2 * M_PI);
  }

  flightlog::FlightHeader& h = f.declared;
  h.vehicle = a.vehicle_file.filename().string();
  h.flapping_Hz = robot.parameters().flapping_Hz;
  h.gravity_m_s2 = Mechanism::kGravity_m_s2;
  h.ambient = {robot.parameters().density_kg_m3, Room::kGround_m, Room::kCeiling_m, {{0, Room::kWall_m, 0, -1}}};
  const auto [position_noise, attitude_noise] = pose_noise(f.mocap);
  h.mocap = {rate(f.mocap.steps), f.mocap.latency_s, position_noise, attitude_noise};
  h.imu = {rate(f.imu.steps),  f.imu.latency_s,
           f.imu.bandwidth_hz, {f.imu.position_m.x(), f.imu.position_m.y(), f.imu.position_m.z()},
           f.imu.gyro_noise,   {f.imu.gyro_bias_sd.x(), f.imu.gyro_bias_sd.y(), f.imu.gyro_bias_sd.z()},
           f.imu.accel_noise};
  if (a.power)
    h.power = flightlog::PowerHeader{Drive::kBattery_V, rate(f.power.steps), f.power.latency_s, f.power.voltage_noise,
                                     f.power.current_noise};
  if (a.wings && !a.bench) h.wings = flightlog::WingsHeader{rate(f.wings.steps), f.wings.noise_rad};
  h.changes = a.changes;
  if (a.conventions) declare_loosely(f, robot, Random(a.seed, "conventions"));
  if (a.session > 0) change(f, session_change(a));
  return f;
}

}  // namespace flappy::blind::c
