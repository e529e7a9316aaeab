#include "lab/blind/a/robot_sensors.hpp"

namespace flappy::blind {
double bandwidth_hz(double interval_s, double low_pass_hz) {
  const auto passes = [&](double hz) {
    const double x = kPi * hz * interval_s, ratio = hz / low_pass_hz;
    return sin_cos(x).sin / x / std::sqrt(1 + ratio * ratio);
  };
  double low = 0, high = 1 / interval_s;
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (passes(middle) > std::numbers::sqrt2 / 2 ? low : high) = middle;
  }
  return high;
}

void declare_imu(SensorSet& s) {
  const double interval_s = 1 / s.imu.rate_hz;
  s.imu.bandwidth_hz = std::round(bandwidth_hz(interval_s, s.imu_low_pass_hz) * 10) / 10;
  // a reader of the log models one low-pass of the declared bandwidth; other delay is declared as latency
  const double late_s = s.imu_transport_s + interval_s / 2 + 1 / (2 * kPi * s.imu_low_pass_hz);
  s.imu.latency_s = std::round((late_s - 1 / (2 * kPi * s.imu.bandwidth_hz)) * 1e7) / 1e7;
}

SensorSet sensors_of(std::uint64_t seed, bool power, bool wings) {
  Random random(seed, Purpose::sensors);
  SensorSet s;
  s.mocap = {random.uniform() < 0.5 ? 150.0 : 200.0, 0.02, 1e-4, 0.005};
  s.imu.rate_hz = random.uniform() < 0.5 ? 500 : 1000;
  s.imu_low_pass_hz = 0.45 * s.imu.rate_hz;
  s.imu_transport_s = 1e-3;
  declare_imu(s);
  s.imu.position_m = {2e-3, -1e-3, -4e-3};
  s.imu.gyro_noise_rad_s = 0.05;
  s.imu.gyro_bias_sd_rad_s = {0.04, 0.04, 0.04};
  s.imu.accel_noise_m_s2 = 0.5;
  if (power) s.power = flightlog::PowerHeader{kBattery_V, 500, 1e-3, 0.02, 0.01};
  if (wings) s.wings = flightlog::WingsHeader{500, 0.01};
  return s;
}

RobotImu::RobotImu(const SensorSet& set, const Magnitudes& magnitudes, std::uint64_t seed, std::uint64_t flight,
                   double step_s)
    : set_(set),
      magnitudes_(magnitudes),
      step_s_(step_s),
      share_(1 - exponential(-2 * kPi * set.imu_low_pass_hz * step_s)),
      steps_(static_cast<int>(std::lround(1 / (set.imu.rate_hz * step_s)))),
      random_(seed, Purpose::imu_noise, flight),
      drift_random_(seed, Purpose::gyro_walk, flight) {
  // the true sd is half the declared one, as in a cautious datasheet
  for (int k = 0; k < 3; ++k)
    bias_(k) = 0.5 * set.imu.gyro_bias_sd_rad_s[static_cast<std::size_t>(k)] * std::clamp(random_.normal(), -2.0, 2.0);
  Random fixed(seed, Purpose::warm_up);
  const Vector3d normals = fixed.normals();
  warm_up_ = normals / std::sqrt(normals.squaredNorm());
  for (int k = 0; k < 3; ++k) rectifies_(k) = fixed.between(0.63, 1.37);
  if (const double magnitude = magnitudes[Effect::accelerometer_misalignment]; magnitude > 0) {
    Random axes(seed, Purpose::accelerometer);
    misaligned_ = laws::misalignment(axes, magnitude);
  }
}

std::optional<RobotImu::Sample> RobotImu::after_step(const Robot& robot, double t_s) {
  const auto& at = set_.imu.position_m;
  Vector3d rate = robot.torso().rate_rad_s, force = robot.specific_force({at[0], at[1], at[2]});
  if (!set_.imu_turned.isIdentity(0)) rate = set_.imu_turned * rate, force = set_.imu_turned * force;
  if (!begun_) gyro_ = rate, accel_ = element_.steady = force, begun_ = true;
  if (const double magnitude = magnitudes_[Effect::vibration_rectification]; magnitude > 0)
    force += magnitude * laws::rectified(element_, force, rectifies_, step_s_);
  gyro_ += share_ * (rate - gyro_);
  accel_ += share_ * (force - accel_);
  gyro_sum_ += gyro_;
  accel_sum_ += accel_;
  if (++count_ < steps_) return std::nullopt;

  const double interval_s = steps_ * step_s_, fades = interval_s / 0.02;
  gyro_drift_ += std::sqrt(2 * fades) * 0.1 * set_.imu.gyro_noise_rad_s * random_.normals() - fades * gyro_drift_;
  accel_drift_ += std::sqrt(2 * fades) * 0.1 * set_.imu.accel_noise_m_s2 * random_.normals() - fades * accel_drift_;
  Sample s;
  s.gyro_rad_s = gyro_sum_ / count_ + bias_ + gyro_drift_ + set_.imu.gyro_noise_rad_s * random_.normals();
  s.accel_m_s2 = misaligned_ * (accel_sum_ / count_) + accel_drift_ + set_.imu.accel_noise_m_s2 * random_.normals();
  if (const double magnitude = magnitudes_[Effect::gyro_bias]; magnitude > 0) {
    walk_ += laws::kGyroWalk_rad_s15 * std::sqrt(interval_s) * drift_random_.normals();
    s.gyro_rad_s += magnitude * (laws::gyro_warm(robot.state().t_s) * warm_up_ + walk_);
  }
  s.arrival_s = t_s + set_.imu_transport_s + 2e-5 * std::clamp(random_.normal(), -4.0, 4.0);
  count_ = 0;
  gyro_sum_.setZero();
  accel_sum_.setZero();
  return s;
}

RobotMocap::RobotMocap(const SensorSet& set, const Magnitudes& magnitudes, std::uint64_t seed, std::uint64_t flight)
    : set_(set), magnitudes_(magnitudes), random_(seed, Purpose::mocap_noise, flight) {
  Random level(seed, Purpose::level), markers(seed, Purpose::markers);
  frame_ = laws::levelled(level, magnitudes[Effect::mocap_tilt]);
  marker_ = laws::marker(markers, magnitudes[Effect::marker_offset]);
}

std::optional<RobotMocap::Sample> RobotMocap::look(const Torso& torso, double t_s) {
  const Vector3d noise_m = set_.mocap.position_noise_m * random_.normals(),
                 noise_rad = set_.mocap.attitude_noise_rad * random_.normals();
  const double jitter_s = 3e-4 * std::clamp(random_.normal(), -3.0, 3.0), chance = random_.uniform();
  ++seen_;
  // bursts of one to five samples, less than 1 % in all
  if (to_lose_ == 0 && seen_ > 300 && chance < 0.002 && lost_ + 5 < 0.009 * seen_)
    to_lose_ = 1 + static_cast<int>(chance / 0.002 * 5);
  if (to_lose_ > 0) {
    --to_lose_;
    ++lost_;
    return std::nullopt;
  }
  Sample s;
  s.position_m = torso.position_m + torso.attitude * (set_.marker_m + marker_.at_m);
  if (const double magnitude = magnitudes_[Effect::outside_mocap_lens]; magnitude > 0)
    // the calibration is worse towards the edges of the volume
    s.position_m += laws::kLens_1_m2 * magnitude * s.position_m * s.position_m.head<2>().squaredNorm();
  s.position_m = frame_.place(s.position_m) + noise_m;
  s.attitude =
      (frame_.turned * torso.attitude * set_.marker_turned * marker_.turned * turned_by(noise_rad)).normalized();
  s.arrival_s = t_s + set_.mocap.latency_s + set_.mocap_late_s + jitter_s;
  if (const double magnitude = magnitudes_[Effect::mocap_delay]; magnitude > 0)
    s.arrival_s += magnitude * laws::mocap_delay(t_s);
  s.arrival_s = std::max(s.arrival_s, last_s_ + 1e-5);
  last_s_ = s.arrival_s;
  return s;
}

}  // namespace flappy::blind
