#include "flight/setup.hpp"

#include <numbers>

#include "model/math.hpp"

namespace flappy::flight {
namespace {

model::Triple triple(const io::Table& table, const std::string& key, io::Range range) {
  return {table.number(key + ".x", range), table.number(key + ".y", range), table.number(key + ".z", range)};
}

}  // namespace

double low_pass_share(double cutoff_hz, double interval_s) {
  return cutoff_hz > 0 ? 1 - model::exp(-2 * std::numbers::pi * cutoff_hz * interval_s) : 1;
}

double low_pass_lag_s(const ImuSensor& imu) {
  const double share = low_pass_share(imu.low_pass_hz, 1 / imu.rate_hz);
  return (1 - share) / share / imu.rate_hz;
}

Sensors read_sensors(const io::Table& table) {
  constexpr io::Range kRate{10, 10000}, kNoise = io::non_negative(100);
  table.schema(1);
  Sensors s;
  s.imu.rate_hz = table.number("imu.rate_hz", kRate);
  s.imu.latency_s = table.number("imu.latency_s", io::non_negative(0.1));
  s.imu.low_pass_hz = table.number_or("imu.low_pass_hz", 0, io::non_negative(10000));
  s.imu.position_m = triple(table, "imu.position_m", {-1, 1});
  s.imu.gyro_noise_rad_s = table.number("imu.gyro_noise_rad_s", kNoise);
  s.imu.accel_noise_m_s2 = table.number("imu.accel_noise_m_s2", kNoise);
  s.imu.gyro_bias_sd_rad_s = triple(table, "imu.gyro_bias_sd_rad_s", kNoise);
  s.mocap.rate_hz = table.number("mocap.rate_hz", kRate);
  s.mocap.latency_s = table.number("mocap.latency_s", io::non_negative(0.5));
  s.mocap.position_noise_m = table.number("mocap.position_noise_m", io::positive(1));
  s.mocap.attitude_noise_rad =
      table.number("mocap.attitude_noise_rad", io::positive(0.05));  // drawn as a small rotation
  s.mocap.loss_probability = table.number_or("mocap.loss_probability", 0, {0, 0.5});
  s.mocap.loss_length = table.number_or("mocap.loss_length", 1, {1, 1e6});
  s.mocap.jitter_s = table.number_or("mocap.jitter_s", 0, io::non_negative(0.1));
  s.mocap.jitter_exponential =
      table.choice_or("mocap.jitter_law", "uniform", {"uniform", "exponential"}) == "exponential";
  s.estimator.angle_drift_rad_sqrt_s = table.number("estimator.angle_drift_rad_sqrt_s", kNoise);
  s.estimator.velocity_drift_m_s_sqrt_s = table.number("estimator.velocity_drift_m_s_sqrt_s", kNoise);
  s.estimator.gyro_bias_drift_rad_s_sqrt_s = table.number("estimator.gyro_bias_drift_rad_s_sqrt_s", kNoise);
  s.estimator.accel_bias_sd_m_s2 = table.number("estimator.accel_bias_sd_m_s2", kNoise);
  s.estimator.accel_bias_drift_m_s2_sqrt_s = table.number("estimator.accel_bias_drift_m_s2_sqrt_s", kNoise);
  s.estimator.initial_velocity_sd_m_s = table.number("estimator.initial_velocity_sd_m_s", kNoise);
  table.finish();
  return s;
}

std::vector<ControllerField> fields(Controller& c) {
  std::vector<ControllerField> list;
  const auto add = [&](const std::string& path, double& value, io::Range range, std::optional<double> otherwise = {}) {
    list.push_back({path, &value, range, otherwise});
  };
  with_controller(c.kind, [&]<class C>(C) {
    C::fields(c.constants.of<C>(), add);
    add("low_pass.velocity_hz", c.velocity_low_pass_hz, io::non_negative(1e4));
    add("low_pass.body_rate_hz", c.body_rate_low_pass_hz, io::non_negative(1e4));
  });
  return list;
}

std::string controller_name(int kind) {
  std::string name = "none";
  with_controller(kind, [&]<class C>(C) { name = C::kName; });
  return name;
}

int controller_kind(const std::string& name) {
  int kind = kNoController;
  for (int i = 0; i < kControllers; ++i)
    if (controller_name(i) == name) kind = i;
  return kind;
}

Controller read_controller(const io::Table& table, double control_hz) {
  table.schema(1);
  std::vector<std::string> names;
  for (int i = kNoController; i < kControllers; ++i) names.push_back(controller_name(i));
  Controller c;
  c.kind = controller_kind(table.choice("kind", names));
  for (const ControllerField& f : fields(c))
    *f.value = f.otherwise ? table.number_or(f.path, *f.otherwise, f.range) : table.number(f.path, f.range);
  with_controller(c.kind, [&]<class C>(C) {
    if constexpr (requires { c.constants.of<C>().notch_hz; })
      if (c.constants.of<C>().notch_hz >= control_hz / 2)
        table.fail("notch.frequency_hz", "is too high for the control rate", "less than half of flight.control_hz");
  });
  table.finish();
  return c;
}

}  // namespace flappy::flight
