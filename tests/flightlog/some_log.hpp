// A flight log that was never flown, for what writes and reads logs.
#pragma once

#include <cmath>

#include "flightlog/flight_log.hpp"

namespace flappy::test {

/// All streams, on a circle; times to the nanosecond.
inline flightlog::FlightLog some_log(double duration_s = 0.5) {
  flightlog::FlightLog log;
  flightlog::FlightHeader& h = log.header;
  h.vehicle = "hummingbird_nominal.toml";
  h.flapping_Hz = 34;
  h.ambient = {1.18, -1000, 1000, {}};
  h.mocap = {200, 4e-3, 1e-4, 5e-3};
  h.imu = {500, 1e-3, 221.5, {0, 0, 0}, 0.0524, {0.02, 0.03, 0.015}, 0.5};
  h.power = {18, 250, 0.5e-3, 0.01, 0.02};
  h.wings = {500, 0.01};
  log.command.inputs.emplace();
  log.command.phase_rad.emplace();
  log.power.emplace();
  log.wings.emplace();
  const auto samples = [&](double rate_hz, double late_s, auto&& add) {
    for (int i = 0; i < duration_s * rate_hz; ++i) add(std::round(1e9 * (i / rate_hz + late_s)) / 1e9, i / rate_hz);
  };
  samples(1000, 0, [&](double t_s, double t) {
    flightlog::CommandStream& c = log.command;
    c.t_s.push_back(t_s);
    c.left_voltage_V.push_back(9 * std::sin(200 * t));
    c.right_voltage_V.push_back(-9 * std::sin(200 * t));
    c.inputs->amplitude_V.push_back(9);
    c.inputs->difference_V.push_back(t);
    c.inputs->bias_V.push_back(-t);
    c.inputs->split_cycle.push_back(0.1);
    c.phase_rad->push_back(200 * t);
  });
  samples(200, h.mocap.latency_s, [&](double t_s, double t) {
    flightlog::MocapStream& m = log.mocap;
    m.t_s.push_back(t_s);
    m.x_m.push_back(std::cos(t));
    m.y_m.push_back(2 * std::sin(t));
    m.z_m.push_back(1 + t);
    const double w = std::cos(t), x = 0.6 * std::sin(t), z = 0.8 * std::sin(t);
    const double length = std::sqrt(w * w + x * x + z * z);
    m.qw.push_back(w / length), m.qx.push_back(x / length), m.qy.push_back(0), m.qz.push_back(z / length);
  });
  samples(500, h.imu.latency_s, [&](double t_s, double t) {
    flightlog::ImuStream& u = log.imu;
    u.t_s.push_back(t_s);
    double k = 0;
    for (flightlog::Column* c :
         {&u.gyro_x_rad_s, &u.gyro_y_rad_s, &u.gyro_z_rad_s, &u.accel_x_m_s2, &u.accel_y_m_s2, &u.accel_z_m_s2})
      c->push_back(std::sin(t + ++k));
  });
  samples(250, h.power->latency_s, [&](double t_s, double t) {
    log.power->t_s.push_back(t_s);
    log.power->battery_V.push_back(17.5);
    log.power->left_current_A.push_back(0.3 + t);
    log.power->right_current_A.push_back(0.2 - t);
  });
  samples(500, 0, [&](double t_s, double t) {
    log.wings->t_s.push_back(t_s);
    log.wings->left_stroke_rad.push_back(t);
    log.wings->left_rotation_rad.push_back(2 * t);
    log.wings->right_stroke_rad.push_back(3 * t);
    log.wings->right_rotation_rad.push_back(4 * t);
  });
  return log;
}

}  // namespace flappy::test
