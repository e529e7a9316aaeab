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
  table.integer("schema", 1, 1);
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
  s.mocap.attitude_noise_rad = table.number("mocap.attitude_noise_rad", io::positive(1));
  s.mocap.loss_probability = table.number_or("mocap.loss_probability", 0, {0, 0.5});
  s.mocap.loss_length = table.number_or("mocap.loss_length", 1, {1, 1e6});
  s.fusion.angle_drift_rad_sqrt_s = table.number("fusion.angle_drift_rad_sqrt_s", kNoise);
  s.fusion.velocity_drift_m_s_sqrt_s = table.number("fusion.velocity_drift_m_s_sqrt_s", kNoise);
  s.fusion.gyro_bias_drift_rad_s_sqrt_s = table.number("fusion.gyro_bias_drift_rad_s_sqrt_s", kNoise);
  s.fusion.accel_bias_sd_m_s2 = table.number("fusion.accel_bias_sd_m_s2", kNoise);
  s.fusion.accel_bias_drift_m_s2_sqrt_s = table.number("fusion.accel_bias_drift_m_s2_sqrt_s", kNoise);
  s.fusion.initial_velocity_sd_m_s = table.number("fusion.initial_velocity_sd_m_s", kNoise);
  table.finish();
  return s;
}

namespace {

using List = std::vector<ControllerField>;

void add_pid_gains(List& list, const std::string& path, PidGains<double>& g) {
  list.push_back({path + ".p", &g.p, io::non_negative(1000)});
  list.push_back({path + ".i", &g.i, io::non_negative(1000)});
  list.push_back({path + ".d", &g.d, io::non_negative(1000)});
  list.push_back({path + ".integral_limit", &g.integral_limit, io::non_negative(1000)});
}

void add_limits(List& list, auto& k) {
  list.push_back({"limits.difference_V", &k.difference_limit_V, io::positive(18)});
  list.push_back({"limits.bias_V", &k.bias_limit_V, io::positive(18)});
  list.push_back({"limits.split_cycle", &k.split_cycle_limit, io::positive(0.4)});
}

List pid_fields(PidConstants<double>& k) {
  List list = {{"position.xy_1_s", &k.position_xy_1_s, io::non_negative(100)},
               {"position.z_1_s", &k.position_z_1_s, io::non_negative(100)},
               {"position.speed_limit_m_s", &k.speed_limit_m_s, io::positive(100)},
               {"position.climb_limit_m_s", &k.climb_limit_m_s, io::positive(100)}};
  add_pid_gains(list, "velocity.forward", k.forward);
  add_pid_gains(list, "velocity.left", k.left);
  add_pid_gains(list, "velocity.up", k.up);
  add_pid_gains(list, "attitude.roll", k.roll);
  add_pid_gains(list, "attitude.pitch", k.pitch);
  add_pid_gains(list, "attitude.yaw", k.yaw);
  list.push_back({"limits.acceleration_m_s2", &k.acceleration_limit_m_s2, io::positive(100)});
  list.push_back({"limits.roll_rad", &k.roll_limit_rad, io::positive(1.5)});
  list.push_back({"limits.pitch_rad", &k.pitch_limit_rad, io::positive(1.5)});
  list.push_back({"limits.yaw_error_rad", &k.yaw_error_limit_rad, io::positive(3.2)});
  list.push_back({"hover_V", &k.hover_V, io::non_negative(18)});
  list.push_back({"limits.amplitude_below_V", &k.lower_V, {-18, 0}});
  list.push_back({"limits.amplitude_above_V", &k.upper_V, {0, 18}});
  add_limits(list, k);
  return list;
}

List arc_fields(ArcConstants<double>& k) {
  List list;
  const auto sliding = [&](const std::string& path, Sliding<double>& s) {
    list.push_back({path + ".lambda_1_s", &s.lambda_1_s, io::non_negative(1000)});
    list.push_back({path + ".k_1_s", &s.k_1_s, io::non_negative(1000)});
  };
  const auto adapted = [&](const std::string& path, Adapted<double>& a) {
    list.push_back({path + ".gain", &a.gain, io::non_negative(1e6)});
    list.push_back({path + ".low", &a.low, {-1e3, 1e3}});
    list.push_back({path + ".high", &a.high, {-1e3, 1e3}});
  };
  sliding("horizontal", k.horizontal);
  sliding("height", k.height);
  sliding("heading", k.heading);
  list.push_back({"limits.position_error_m", &k.position_error_limit_m, io::positive(100)});
  list.push_back({"limits.velocity_error_m_s", &k.velocity_error_limit_m_s, io::positive(100)});
  list.push_back({"limits.yaw_error_rad", &k.yaw_error_limit_rad, io::positive(3.2)});
  adapted("adapted.mass_kg", k.mass_kg);
  adapted("adapted.roll_Nm", k.roll_Nm);
  adapted("adapted.pitch_Nm", k.pitch_Nm);
  adapted("adapted.yaw_Nm", k.yaw_Nm);
  adapted("adapted.disturbance_m_s2", k.disturbance_m_s2);
  list.push_back({"adapted.initial_mass_kg", &k.initial_mass_kg, io::positive(1)});
  list.push_back({"adapted.predictor_1_s", &k.predictor_1_s, io::non_negative(1000)});
  list.push_back({"force_map.thrust_N_V", &k.thrust_N_V, io::positive(1)});
  list.push_back({"force_map.thrust_offset_V", &k.thrust_offset_V, {-18, 18}});
  list.push_back({"force_map.roll_Nm_V", &k.roll_Nm_V, io::positive(1)});
  list.push_back({"force_map.pitch_Nm_V", &k.pitch_Nm_V, io::positive(1)});
  list.push_back({"force_map.yaw_Nm_split", &k.yaw_Nm_split, io::positive(1)});
  list.push_back({"inertia.x_kg_m2", &k.inertia_x_kg_m2, io::positive(1)});
  list.push_back({"inertia.y_kg_m2", &k.inertia_y_kg_m2, io::positive(1)});
  list.push_back({"inertia.z_kg_m2", &k.inertia_z_kg_m2, io::positive(1)});
  list.push_back({"limits.amplitude_low_V", &k.amplitude_low_V, io::non_negative(18)});
  list.push_back({"limits.amplitude_high_V", &k.amplitude_high_V, io::non_negative(18)});
  add_limits(list, k);
  return list;
}

}  // namespace

std::vector<ControllerField> fields(Controller& c) {
  List list;
  if (c.kind == Controller::Kind::pid) list = pid_fields(c.pid);
  if (c.kind == Controller::Kind::arc) list = arc_fields(c.arc);
  if (c.kind != Controller::Kind::none) {
    list.push_back({"low_pass.velocity_hz", &c.velocity_low_pass_hz, io::non_negative(1e4)});
    list.push_back({"low_pass.body_rate_hz", &c.body_rate_low_pass_hz, io::non_negative(1e4)});
  }
  return list;
}

Controller read_controller(const io::Table& table) {
  table.integer("schema", 1, 1);
  const std::string kind = table.choice("kind", {"none", "pid", "arc"});
  Controller c;
  c.kind = kind == "pid" ? Controller::Kind::pid : kind == "arc" ? Controller::Kind::arc : Controller::Kind::none;
  for (const ControllerField& f : fields(c)) *f.value = table.number(f.path, f.range);
  table.finish();
  return c;
}

}  // namespace flappy::flight
