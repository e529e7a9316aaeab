#include "gap/replay/sensor_correction.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "flightlog/rotation.hpp"
#include "model/effects/registry.hpp"

namespace flappy::gap {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using Values = std::map<std::string, double>;

Vector3d vector(const Values& v, const char* x, const char* y, const char* z) {
  return {v.at(x), v.at(y), z ? v.at(z) : 0};
}

/// The three columns of a stream that hold a vector.
struct Columns {
  flightlog::Column &x, &y, &z;
  Vector3d at(std::size_t i) const { return {x[i], y[i], z[i]}; }
  void put(std::size_t i, const Vector3d& v) const { x[i] = v.x(), y[i] = v.y(), z[i] = v.z(); }
};

void undo_gyro_bias(const Values& v, flightlog::ImuStream& imu) {
  const Vector3d drift = vector(v, "x_rad_s", "y_rad_s", "z_rad_s");
  const double warm_up_s = v.at("warm_up_s");
  const Columns gyro{imu.gyro_x_rad_s, imu.gyro_y_rad_s, imu.gyro_z_rad_s};
  const auto share = [&](std::size_t i) { return -std::expm1(-(imu.t_s[i] - imu.t_s[0]) / warm_up_s); };
  double mean = 0;
  for (std::size_t i = 0; i < imu.t_s.size(); ++i) mean += share(i) / static_cast<double>(imu.t_s.size());
  for (std::size_t i = 0; i < imu.t_s.size(); ++i) gyro.put(i, gyro.at(i) - (share(i) - mean) * drift);
}

void undo_misalignment(const Values& v, flightlog::ImuStream& imu) {
  const Quaterniond back = flightlog::exponential(-vector(v, "x_rad", "y_rad", "z_rad"));
  const Columns force{imu.accel_x_m_s2, imu.accel_y_m_s2, imu.accel_z_m_s2};
  for (std::size_t i = 0; i < imu.t_s.size(); ++i) force.put(i, back * force.at(i));
}

void undo_mounting(const Values& v, flightlog::ImuStream& imu) {
  const Quaterniond back = flightlog::exponential(-vector(v, "x_rad", "y_rad", "z_rad"));
  const Columns force{imu.accel_x_m_s2, imu.accel_y_m_s2, imu.accel_z_m_s2};
  const Columns gyro{imu.gyro_x_rad_s, imu.gyro_y_rad_s, imu.gyro_z_rad_s};
  for (std::size_t i = 0; i < imu.t_s.size(); ++i) {
    force.put(i, back * force.at(i));
    gyro.put(i, back * gyro.at(i));
  }
}

void undo_rectification(const Values& v, double flapping_Hz, flightlog::ImuStream& imu) {
  const double gain = v.at("gain_s2_m");
  const Columns force{imu.accel_x_m_s2, imu.accel_y_m_s2, imu.accel_z_m_s2};
  const std::size_t n = imu.t_s.size();
  std::vector<Vector3d> sum(n + 1, Vector3d::Zero()), squares(n + 1, Vector3d::Zero());
  for (std::size_t i = 0; i < n; ++i) {
    const Vector3d f = force.at(i);
    sum[i + 1] = sum[i] + f;
    squares[i + 1] = squares[i] + f.cwiseProduct(f);
  }
  // mean and mean square over one beat around each sample
  const double rate_hz = static_cast<double>(n - 1) / (imu.t_s.back() - imu.t_s.front());
  const auto half = static_cast<std::size_t>(std::max(1L, std::lround(rate_hz / flapping_Hz / 2)));
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t from = i > half ? i - half : 0, to = std::min(n, i + half);
    const double count = static_cast<double>(to - from);
    const Vector3d mean = (sum[to] - sum[from]) / count;
    const Vector3d variance = (squares[to] - squares[from]) / count - mean.cwiseProduct(mean);
    force.put(i, force.at(i) - gain * variance);
  }
}

void undo_clock(const Values& v, flightlog::Column& t_s) {
  const double rate = v.at("rate"), middle_s = (t_s.front() + t_s.back()) / 2;
  for (double& t : t_s) t -= rate * (t - middle_s);
}

template <class Change>
void change_poses(flightlog::MocapStream& m, const Change& change) {
  for (std::size_t i = 0; i < m.t_s.size(); ++i) {
    Vector3d p(m.x_m[i], m.y_m[i], m.z_m[i]);
    Quaterniond q(m.qw[i], m.qx[i], m.qy[i], m.qz[i]);
    change(p, q);
    m.x_m[i] = p.x(), m.y_m[i] = p.y(), m.z_m[i] = p.z();
    m.qw[i] = q.w(), m.qx[i] = q.x(), m.qy[i] = q.y(), m.qz[i] = q.z();
  }
}

}  // namespace

EffectValues sensor_effects(const EffectValues& effects) {
  EffectValues found;
  for (const auto& [id, values] : effects) {
    const int index = model::effect_index(id.c_str());
    if (index >= 0 && model::effects()[static_cast<std::size_t>(index)].info.stage == model::Stage::sensor)
      found.emplace(id, values);
  }
  return found;
}

flightlog::FlightLog without(const EffectValues& effects, flightlog::FlightLog log) {
  const auto given = [&](const char* id) -> const Values* {
    const auto at = effects.find(id);
    return at == effects.end() ? nullptr : &at->second;
  };
  // errors are undone in reverse of the order in which the sensor makes them
  if (const Values* v = given("imu_clock")) undo_clock(*v, log.imu.t_s);
  if (const Values* v = given("mocap_clock")) undo_clock(*v, log.mocap.t_s);
  if (const Values* v = given("power_clock"); v && log.power) undo_clock(*v, log.power->t_s);
  if (const Values* v = given("gyro_bias")) undo_gyro_bias(*v, log.imu);
  if (const Values* v = given("vibration_rectification")) undo_rectification(*v, log.header.flapping_Hz, log.imu);
  if (const Values* v = given("accelerometer_misalignment")) undo_misalignment(*v, log.imu);
  if (const Values* v = given("imu_mounting")) undo_mounting(*v, log.imu);
  if (const Values* v = given("imu_place")) {
    const Vector3d off = vector(*v, "x_m", "y_m", "z_m");
    for (std::size_t i = 0; i < 3; ++i) log.header.imu.position_m[i] += off[static_cast<Eigen::Index>(i)];
  }
  if (const Values* v = given("power_delay"); v && log.header.power) log.header.power->latency_s += v->at("delay_s");
  if (const Values* v = given("mocap_delay")) log.header.mocap.latency_s += v->at("delay_s");
  if (const Values* v = given("mocap_tilt")) {
    const Quaterniond back = flightlog::exponential(-vector(*v, "x_rad", "y_rad", nullptr));
    change_poses(log.mocap, [&](Vector3d& p, Quaterniond& q) { p = back * p, q = back * q; });
  }
  if (const Values* v = given("marker_offset")) {
    const Vector3d offset = vector(*v, "x_m", "y_m", "z_m");
    change_poses(log.mocap, [&](Vector3d& p, Quaterniond& q) { p -= q * offset; });
  }
  return log;
}

}  // namespace flappy::gap
