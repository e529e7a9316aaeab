// A synthetic log of a robot that is known by its inputs: the motion and the sensors of the others, and a second estimator's attitude.
#pragma once

#include "flightlog/check/synthetic_log.hpp"

namespace flappy::flightlog {

/// A motor that carries its weight and a servo about 0, at 100 Hz; 12 s.
inline FlightLog inputs_log(SyntheticMotion motion = {.duration_s = 12, .rotation = 2}) {
  FlightLog log = synthetic_log(motion);
  FlightHeader& h = log.header;
  h.inputs = {"motor", "servo"};
  h.imu.gyro = false, h.imu.gyro_noise_rad_s = 0, h.imu.gyro_bias_sd_rad_s = {0, 0, 0};
  ImuStream& u = log.imu;
  u.gyro_x_rad_s.clear(), u.gyro_y_rad_s.clear(), u.gyro_z_rad_s.clear();
  h.power->currents = false, h.power->current_noise_A = 0;
  log.power->left_current_A.clear(), log.power->right_current_A.clear();
  h.wings.reset(), log.wings.reset();
  log.command = {};
  const double begin_s = log.mocap.t_s.front();
  Column motor, servo;
  for (int i = 0; i < 100 * motion.duration_s; ++i) {
    const double t = 0.01 * i;
    log.command.t_s.push_back(begin_s + t);
    motor.push_back(0.6 + 0.03 * std::sin(3 * t) + 0.001 * t);
    servo.push_back(0.1 * std::sin(2 * t));
  }
  log.command.declared = {motor, servo};
  // Its yaw begins at 0, and it is a degree off.
  h.attitude = {100, 0.002, 0.01};
  log.attitude.emplace();
  const MocapStream& m = log.mocap;
  const Eigen::Quaterniond offset(Eigen::AngleAxisd(-motion.yaw_offset_rad, Eigen::Vector3d::UnitZ())),
      mount(Eigen::AngleAxisd(0.02, Eigen::Vector3d::UnitX()));
  for (std::size_t i = 0; i < m.t_s.size(); i += 2) {
    const Eigen::Quaterniond q = offset * Eigen::Quaterniond(m.qw[i], m.qx[i], m.qy[i], m.qz[i]) * mount;
    log.attitude->t_s.push_back(m.t_s[i] - h.mocap.latency_s + h.attitude->latency_s);
    log.attitude->qw.push_back(q.w()), log.attitude->qx.push_back(q.x());
    log.attitude->qy.push_back(q.y()), log.attitude->qz.push_back(q.z());
  }
  return log;
}

}  // namespace flappy::flightlog
