#include "lab/blind/b/b_sensors.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flappy::blind::b {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;
constexpr double kGyroStep_rad_s = 2 * 2000 * kTurn / 360 / 65536, kGyroRange_rad_s = 2000 * kTurn / 360;
constexpr double kAccelStep_m_s2 = 2 * 16 * kGravity_m_s2 / 65536, kAccelRange_m_s2 = 16 * kGravity_m_s2;
constexpr double kCurrentStep_A = 4.0 / 4096, kVoltageStep_V = 24.0 / 4096, kWingStep_rad = kTurn / 4096;

Vector3d normals(Random& random) { return {random.normal(), random.normal(), random.normal()}; }

}  // namespace

Matrix3d turned(const Vector3d& rotation) {
  const double angle = rotation.norm();
  if (angle == 0) return Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, rotation / angle).toRotationMatrix();
}

SoftMount::SoftMount(double magnitude)
    : frequency_rad_s_(magnitude > 0 ? std::min(kTurn * 90 / std::sqrt(magnitude), 0.8 / kStep_s) : 0) {}

Vector3d SoftMount::shaken(const Vector3d& by) {
  if (frequency_rad_s_ == 0) return by;
  if (!begun_) now_ = by;
  begun_ = true;
  // damping ratio 0.2
  rate_ += kStep_s * frequency_rad_s_ * (frequency_rad_s_ * (by - now_) - 0.4 * rate_);
  now_ += kStep_s * rate_;
  return now_;
}

SensorTruth draw_sensors(const Assignment& a, double battery_nominal_V, flightlog::FlightHeader& header) {
  SensorTruth t;
  Random random(a.seed, 0, Stream::kSensors);
  const std::array<double, 4> imu_rates = {500, 625, 800, 1000}, mocap_rates = {150, 180, 200, 240};
  t.imu_rate_hz = imu_rates[random.below(4)];
  t.imu_late_s = random.uniform(0.8e-3, 2.5e-3);
  t.bandwidth_hz = random.uniform(180, 350);
  t.imu_place_m.z() = random.uniform(-12e-3, 4e-3);
  t.imu_place_m.y() = random.uniform(-4e-3, 4e-3);
  t.imu_place_m.x() = random.uniform(-6e-3, 6e-3);
  t.gyro_noise_rad_s = 0.04 * random.uniform(0.7, 1.4);
  t.accel_noise_m_s2 = 0.4 * random.uniform(0.7, 1.4);
  t.mocap_rate_hz = mocap_rates[random.below(4)];
  t.mocap_late_s = random.uniform(8e-3, 24e-3);
  t.position_noise_m = 1e-4 * random.uniform(0.7, 2);
  t.attitude_noise_rad = 4e-3 * random.uniform(0.5, 1.4);
  t.power_rate_hz = random.uniform() < 0.5 ? 500 : 1000;
  t.power_late_s = random.uniform(1e-4, 4e-4);
  t.wings_noise_rad = random.uniform(0.5e-3, 2e-3);

  const double wings_noise = std::hypot(t.wings_noise_rad, kWingStep_rad / std::sqrt(12.0));
  header.imu = {t.imu_rate_hz,      t.imu_late_s,
                t.bandwidth_hz,     {t.imu_place_m.x(), t.imu_place_m.y(), t.imu_place_m.z()},
                t.gyro_noise_rad_s, {0.02, 0.03, 0.015},
                t.accel_noise_m_s2};
  header.mocap = {t.mocap_rate_hz, t.mocap_late_s, t.position_noise_m, t.attitude_noise_rad};
  if (a.power)
    header.power = flightlog::PowerHeader{battery_nominal_V, t.power_rate_hz, t.power_late_s, t.voltage_noise_V,
                                          t.current_noise_A};
  if (a.wings) header.wings = flightlog::WingsHeader{t.wings_rate_hz, wings_noise};

  // All draws are made in any case, so that one convention does not shift the others.
  Random c(a.seed, 0, Stream::kConventions);
  const std::size_t kind = c.below(3);
  const double averaging = c.uniform(0.3e-3, 1e-3), own_clock = c.uniform(1000, 1600);
  const bool with_interval = c.uniform() < 0.5;
  const double imu_rate = c.uniform(0.98, 1.02), mocap_rate = c.uniform(0.99, 1.01);
  Vector3d place = normals(c);
  place *= std::min(1.0, 3 / place.norm()) * 1e-3;  // sd 1 mm for each axis, at most 3 mm in all
  Vector3d mount = normals(c);
  mount *= c.uniform(0, 1) * kTurn / 360 / mount.norm();
  const bool after = c.uniform() < 0.5;
  std::array<double, 6> noise{};
  for (double& x : noise) x = 0.7 * std::pow(1.5 / 0.7, c.uniform());
  const std::size_t fast = c.below(4);
  const double clock = 1 + c.uniform(0, 50e-6);
  if (!a.conventions) return t;

  t.sample = kind == 0 ? Sample::kInstant : kind == 1 ? Sample::kMean : Sample::kHeld;
  t.averaging_s = averaging;
  t.own_clock_hz = own_clock;
  // By the log format, latency is the mean delay from the measured instant, half of averaging or holding included.
  if (with_interval && t.sample == Sample::kMean) header.imu.latency_s += averaging / 2;
  if (with_interval && t.sample == Sample::kHeld) header.imu.latency_s += 0.5 / own_clock;
  t.imu_rate_hz *= imu_rate;
  t.mocap_rate_hz *= mocap_rate;
  t.imu_place_m += place;
  t.imu_turn = turned(mount);
  t.power_step = after ? 2 : 0;
  header.imu.gyro_noise_rad_s *= noise[0];
  header.imu.accel_noise_m_s2 *= noise[1];
  header.mocap.position_noise_m *= noise[2];
  header.mocap.attitude_noise_rad *= noise[3];
  if (header.power) header.power->current_noise_A *= noise[4];
  if (header.wings) header.wings->noise_rad *= noise[5];
  if (fast == 1) t.imu_clock = clock;
  if (fast == 2) t.mocap_clock = clock;
  if (fast == 3) t.power_clock = clock;
  return t;
}

Sensors::Sensors(const Assignment& a, const SensorTruth& truth, const Robot& robot, std::uint64_t flight, double trim_s,
                 bool power, bool wings)
    : truth_(truth),
      effect_magnitudes_(robot.plant().effect_magnitudes()),
      trim_s_(trim_s),
      power_(power),
      wings_(wings),
      imu_random_(a.seed, flight, Stream::kImu),
      mocap_random_(a.seed, flight, Stream::kMocap),
      power_random_(a.seed, flight, Stream::kPower),
      wings_random_(a.seed, flight, Stream::kWings),
      drift_random_(a.seed, flight, Stream::kEffect, kGyroBias),
      gyro_mount_(effect_magnitudes_[kSoftImuMount]),
      accel_mount_(effect_magnitudes_[kSoftImuMount]),
      nominal_V_(robot.plant().parameters().side[0].motor.voltage_limit_V) {
  gyro_bias_ = normals(imu_random_).cwiseProduct(Vector3d(0.02, 0.03, 0.015));
  accel_bias_ = 0.02 * normals(imu_random_);
  warming_ = 1e-3 * normals(imu_random_);
  const double tilt = kTilt_rad * effect_magnitudes_[kMocapTilt], way = effect_magnitudes_.mocap_tilt_direction_rad;
  scale_ = kWand * effect_magnitudes_[kMocapTilt] * effect_magnitudes_.mocap_scale_sign;
  misfit_ = misfit(effect_magnitudes_.marker, effect_magnitudes_[kMarkerOffset] * effect_magnitudes_.marker_m);
  tilt_ = Eigen::Quaterniond(Eigen::AngleAxisd(tilt, Vector3d(std::cos(way), std::sin(way), 0)));
  next_imu_s_ = -trim_s + imu_random_.uniform(0.001, 0.003);
  next_own_s_ = -trim_s + imu_random_.uniform(0, 1e-3);
  next_mocap_s_ = -trim_s + mocap_random_.uniform(0, 5e-3);
  next_wings_s_ = -trim_s + wings_random_.uniform(0, 2e-3);
  next_power_s_ = -trim_s;
}

void Sensors::imu_step(const Robot& robot, double time) {
  // felt() belongs to the start of the step, at `time`; the filters get the mean of this and the previous value.
  const Felt& felt = robot.felt();
  const Vector3d gyro_now = truth_.imu_turn * felt.motion.w, accel_now = truth_.imu_turn * felt.at(truth_.imu_place_m);
  if (!settled_) {
    gyro_ = gyro_felt_ = gyro_now;
    accel_ = accel_felt_ = accel_now;
    settled_ = true;
  }
  Vector3d gyro = 0.5 * (gyro_felt_ + gyro_now), accel = 0.5 * (accel_felt_ + accel_now);
  gyro_felt_ = gyro_now;
  accel_felt_ = accel_now;
  if (effect_magnitudes_.any(kAccelerometerMisalignment))
    accel = skewed(accel, effect_magnitudes_[kAccelerometerMisalignment] * effect_magnitudes_.skew);
  gyro = gyro_mount_.shaken(gyro);
  accel = accel_mount_.shaken(accel);
  gyro_before_ = gyro_;
  accel_before_ = accel_;
  gyro_ = low_pass(gyro_, gyro, truth_.bandwidth_hz, kStep_s);
  accel_ = low_pass(accel_, accel, truth_.bandwidth_hz, kStep_s);
  if (truth_.sample == Sample::kMean) {
    window_.push_back({gyro_, accel_});
    while (static_cast<double>(window_.size()) > truth_.averaging_s / kStep_s) window_.pop_front();
  }
  if (truth_.sample == Sample::kHeld && time >= next_own_s_) {
    held_ = {gyro_, accel_};
    next_own_s_ += 1 / truth_.own_clock_hz;
  }
  while (time >= next_imu_s_ + imu_jitter_s_) {
    if (truth_.sample == Sample::kMean) {
      Vector3d g = Vector3d::Zero(), f = Vector3d::Zero();
      for (const auto& each : window_) g += each[0], f += each[1];
      const double count = static_cast<double>(window_.size());
      imu_sample(next_imu_s_ + imu_jitter_s_, g / count, f / count);
    } else if (truth_.sample == Sample::kHeld) {
      imu_sample(next_imu_s_ + imu_jitter_s_, held_[0], held_[1]);
    } else {
      const double k = std::clamp((time - next_imu_s_ - imu_jitter_s_) / kStep_s, 0.0, 1.0);
      imu_sample(next_imu_s_ + imu_jitter_s_, gyro_ + k * (gyro_before_ - gyro_),
                 accel_ + k * (accel_before_ - accel_));
    }
    next_imu_s_ += 1 / truth_.imu_rate_hz;
    imu_jitter_s_ = 20e-6 * imu_random_.normal_within_three();
  }
}

void Sensors::imu_sample(double time, const Vector3d& gyro, const Vector3d& accel) {
  const double on = time + trim_s_;
  Vector3d rate = gyro + gyro_bias_ + warming_ * (1 - std::exp(-on / 40));
  if (effect_magnitudes_.any(kGyroBias)) {
    const double keep = gyro_keeps(1 / truth_.imu_rate_hz);
    wandering_ = keep * wandering_ + std::sqrt(1 - keep * keep) * kGyroWanders_rad_s * normals(drift_random_);
    rate += effect_magnitudes_[kGyroBias] * (effect_magnitudes_.gyro_drift * gyro_warm_up(on) + wandering_);
  }
  rate += truth_.gyro_noise_rad_s * normals(imu_random_);
  const Vector3d curved = rectified(accel, effect_magnitudes_[kVibrationRectification]);
  const Vector3d force = accel + curved + accel_bias_ + truth_.accel_noise_m_s2 * normals(imu_random_);
  ImuSample s;
  s.arrival_s = time + truth_.imu_late_s;
  for (int k = 0; k < 3; ++k) {
    s.gyro_rad_s[k] = in_steps(std::clamp(rate[k], -kGyroRange_rad_s, kGyroRange_rad_s), kGyroStep_rad_s);
    s.accel_m_s2[k] = in_steps(std::clamp(force[k], -kAccelRange_m_s2, kAccelRange_m_s2), kAccelStep_m_s2);
  }
  imu_samples_.push_back(s);
}

void Sensors::mocap_step(const Robot& robot, double time) {
  if (time < next_mocap_s_) return;
  next_mocap_s_ += 1 / truth_.mocap_rate_hz;
  Random& random = mocap_random_;
  // Each frame draws the same count of numbers, also if it is lost or swapped.
  const Vector3d noise = truth_.position_noise_m * normals(random), turn = truth_.attitude_noise_rad * normals(random);
  const double lost = random.uniform(), burst = random.uniform(), swapped = random.uniform(), late = random.uniform(),
               where = random.uniform(0, kTurn);
  if (lost_ > 0) --lost_;
  else if (lost < 0.0015) lost_ = 3 + static_cast<int>(20 * burst);
  if (lost_ > 0) return;
  const State& x = robot.state();
  Eigen::Quaterniond attitude(x[kQuaternion], x[kQuaternion + 1], x[kQuaternion + 2], x[kQuaternion + 3]);
  Vector3d position = robot.position();
  if (effect_magnitudes_.any(kMarkerOffset)) {
    position += attitude * misfit_.shift_m;
    attitude = attitude * Eigen::Quaterniond(turned(misfit_.turn_rad));
  }
  if (!truth_.marker_m.isZero(0)) {
    position += attitude * truth_.marker_m;
    attitude = attitude * Eigen::Quaterniond(truth_.marker_turn);
  }
  if (swapped < 6e-4) {
    position += Vector3d(0.03 * std::cos(where), 0.03 * std::sin(where), 0.01);
    attitude = attitude * Eigen::Quaterniond(Eigen::AngleAxisd(kTurn / 3, Vector3d::UnitZ()));
  }
  if (effect_magnitudes_.any(kMocapTilt)) {
    position = misplaced(position, tilt_, scale_);
    attitude = tilt_ * attitude;
  }
  attitude = attitude * Eigen::Quaterniond(turned(turn));
  attitude.normalize();
  if (attitude.dot(last_attitude_) < 0) attitude.coeffs() *= -1;
  last_attitude_ = attitude;
  // Waiting for the network: exponential jitter, less its mean, so that the declared mean latency holds.
  const double jitter = 0.5 * std::min(1e-3 * -std::log(1 - late) - 1e-3, 5e-3);
  MocapSample s{time + truth_.mocap_late_s + jitter, 0, position + noise, attitude};
  if (!mocap_samples_.empty()) s.arrival_s = std::max(s.arrival_s, mocap_samples_.back().arrival_s + 1e-5);
  s.stamp_s = s.arrival_s + effect_magnitudes_.delay_sign * clock_late_s(time, effect_magnitudes_[kMocapDelay]);
  mocap_samples_.push_back(s);
}

void Sensors::power_sample(const Robot& robot, double time) {
  const auto current = [&](std::size_t j) {
    return in_steps(robot.current_A()[j] + truth_.current_noise_A * power_random_.normal(), kCurrentStep_A);
  };
  power_samples_.t_s.push_back(time + truth_.power_late_s);
  power_samples_.battery_V.push_back(
      in_steps(nominal_V_ * robot.supply() + truth_.voltage_noise_V * power_random_.normal(), kVoltageStep_V));
  power_samples_.left_current_A.push_back(current(0));
  power_samples_.right_current_A.push_back(current(1));
}

void Sensors::before_tick(const Robot& robot, double time) {
  if (!power_ || truth_.power_step != 0 || time < next_power_s_ - 1e-7) return;
  next_power_s_ += 1 / truth_.power_rate_hz;
  power_sample(robot, time);
}

void Sensors::after_step(const Robot& robot, double time, int step) {
  imu_step(robot, time - kStep_s);
  mocap_step(robot, time);
  if (power_ && step == truth_.power_step && time >= next_power_s_ - 1e-7) {
    next_power_s_ += 1 / truth_.power_rate_hz;
    // A converter triggered by the driver reports the trigger's time; one in mid-tick its own.
    power_sample(robot, truth_.power_step == kStepsPerTick / 2 ? time : time - truth_.power_step * kStep_s);
  }
  if (wings_ && time >= next_wings_s_) {
    next_wings_s_ += 1 / truth_.wings_rate_hz;
    const State& x = robot.state();
    const auto angle = [&](double a) {
      return in_steps(a + truth_.wings_noise_rad * wings_random_.normal(), kWingStep_rad);
    };
    wings_samples_.t_s.push_back(time);
    wings_samples_.left_stroke_rad.push_back(angle(x[kStroke]));
    wings_samples_.left_rotation_rad.push_back(angle(x[kRotation]));
    wings_samples_.right_stroke_rad.push_back(angle(x[kStroke + 1]));
    wings_samples_.right_rotation_rad.push_back(angle(x[kRotation + 1]));
  }
}

std::optional<ImuSample> Sensors::imu(double now) {
  if (imu_taken_ >= imu_samples_.size() || imu_samples_[imu_taken_].arrival_s > now) return {};
  return imu_samples_[imu_taken_++];
}

std::optional<MocapSample> Sensors::mocap(double now) {
  if (mocap_taken_ >= mocap_samples_.size() || mocap_samples_[mocap_taken_].arrival_s > now) return {};
  return mocap_samples_[mocap_taken_++];
}

void Sensors::write(double end, flightlog::FlightLog& log) const {
  const auto within = [&](double t) { return t >= 0 && t <= end; };
  for (const ImuSample& s : imu_samples_) {
    const double t = s.arrival_s * truth_.imu_clock;
    if (!within(t)) continue;
    log.imu.t_s.push_back(t);
    log.imu.gyro_x_rad_s.push_back(s.gyro_rad_s.x());
    log.imu.gyro_y_rad_s.push_back(s.gyro_rad_s.y());
    log.imu.gyro_z_rad_s.push_back(s.gyro_rad_s.z());
    log.imu.accel_x_m_s2.push_back(s.accel_m_s2.x());
    log.imu.accel_y_m_s2.push_back(s.accel_m_s2.y());
    log.imu.accel_z_m_s2.push_back(s.accel_m_s2.z());
  }
  for (const MocapSample& s : mocap_samples_) {
    const double t = s.stamp_s * truth_.mocap_clock;
    if (!within(t)) continue;
    log.mocap.t_s.push_back(t);
    log.mocap.x_m.push_back(s.position_m.x());
    log.mocap.y_m.push_back(s.position_m.y());
    log.mocap.z_m.push_back(s.position_m.z());
    log.mocap.qw.push_back(s.attitude.w());
    log.mocap.qx.push_back(s.attitude.x());
    log.mocap.qy.push_back(s.attitude.y());
    log.mocap.qz.push_back(s.attitude.z());
  }
  const auto kept = [&](const flightlog::Column& times, double clock, const flightlog::Column& from) {
    flightlog::Column out;
    for (std::size_t i = 0; i < times.size(); ++i)
      if (within(times[i] * clock)) out.push_back(&times == &from ? times[i] * clock : from[i]);
    return out;
  };
  if (power_) {
    const flightlog::PowerStream& p = power_samples_;
    const double clock = truth_.power_clock;
    log.power = flightlog::PowerStream{kept(p.t_s, clock, p.t_s), kept(p.t_s, clock, p.battery_V),
                                       kept(p.t_s, clock, p.left_current_A), kept(p.t_s, clock, p.right_current_A)};
  }
  if (wings_) {
    const flightlog::WingsStream& w = wings_samples_;
    log.wings = flightlog::WingsStream{kept(w.t_s, 1, w.t_s), kept(w.t_s, 1, w.left_stroke_rad),
                                       kept(w.t_s, 1, w.left_rotation_rad), kept(w.t_s, 1, w.right_stroke_rad),
                                       kept(w.t_s, 1, w.right_rotation_rad)};
  }
}

}  // namespace flappy::blind::b
