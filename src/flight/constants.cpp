#include "flight/constants.hpp"

#include <cmath>

namespace flappy::flight {
namespace {

double square(double x) { return x * x; }

}  // namespace

FlightConstants flight_constants(const FleetOptions& options) {
  const Sensors& s = options.sensors;
  const Controller& c = options.controller;
  const double gravity = options.batch.world.gravity_m_s2, step_s = options.batch.step_s;
  const double period_s = static_cast<double>(std::lround(1 / (options.control_hz * step_s))) * step_s;
  const auto& at = s.imu.position_m;
  const EstimatorNoise& f = s.estimator;
  FlightConstants k{
      period_s,
      {{at.x, at.y, at.z},
       s.imu.gyro_noise_rad_s,
       s.imu.accel_noise_m_s2,
       low_pass_share(s.imu.low_pass_hz, 1 / s.imu.rate_hz),
       gravity},
      {s.mocap.position_noise_m, s.mocap.attitude_noise_rad, s.mocap.loss_probability, 1 / s.mocap.loss_length,
       s.mocap.jitter_s, s.mocap.jitter_exponential ? 1.0 : 0.0, s.mocap.jitter_drawn ? 1.0 : 0.0},
      {square(s.imu.gyro_noise_rad_s) / s.imu.rate_hz + square(f.angle_drift_rad_sqrt_s),
       square(f.gyro_bias_drift_rad_s_sqrt_s),
       square(s.imu.accel_noise_m_s2) / s.imu.rate_hz + square(f.velocity_drift_m_s_sqrt_s),
       square(f.accel_bias_drift_m_s2_sqrt_s),
       square(s.mocap.attitude_noise_rad),
       square(s.mocap.position_noise_m),
       gravity,
       {at.x, at.y, at.z}},
      c.constants,
      options.task.constants};
  with_controller(c.kind, [&]<class C>(C) {
    static_cast<LoopConstants<double>&>(k.controller.of<C>()) = {low_pass_share(c.velocity_low_pass_hz, period_s),
                                                                 low_pass_share(c.body_rate_low_pass_hz, period_s),
                                                                 period_s, 1 / period_s, gravity};
    if constexpr (requires { C::derive(k.controller.of<C>()); }) C::derive(k.controller.of<C>());
  });
  TaskConstants<double>& task = k.task;
  task.tick_s = period_s;
  // place limits half-way between ticks, so that rounding cannot shift them by a tick
  for (double* from : {&task.limits.time_s, &task.hand_back.at_s, &task.success.keep_from_s, &task.reward.until_s})
    *from = (std::ceil(*from / period_s - 1e-6) - 0.5) * period_s;
  for (double* after :
       {&task.limits.faced_by_s, &task.limits.arrived_by_s, &task.success.by_s, &task.success.keep_until_s})
    *after = (std::floor(*after / period_s + 1e-6) + 0.5) * period_s;
  return k;
}

Covariance<double> start_covariance(const Sensors& s) {
  const auto& bias = s.imu.gyro_bias_sd_rad_s;
  Covariance<double> c{};
  c.angle = square(s.mocap.attitude_noise_rad);
  c.gyro_bias = (square(bias.x) + square(bias.y) + square(bias.z)) / 3;
  c.position = square(s.mocap.position_noise_m);
  c.velocity = square(s.estimator.initial_velocity_sd_m_s);
  c.accel_bias = square(s.estimator.accel_bias_sd_m_s2);
  return c;
}

}  // namespace flappy::flight
