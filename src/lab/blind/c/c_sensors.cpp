#include "lab/blind/c/c_sensors.hpp"

#include <algorithm>

#include "lab/blind/c/c_laws.hpp"
#include "lab/blind/c/c_session.hpp"

namespace flappy::blind::c {
namespace {

constexpr double kGyroLimit_rad_s = 34.9, kGyroDigit_rad_s = 34.9 / 32768;    // 2000 deg/s in 16 bits
constexpr double kAccelLimit_m_s2 = 156.9, kAccelDigit_m_s2 = 156.9 / 32768;  // 16 g
constexpr double kCurrentDigit_A = 2.0 / 4096;                                // 12 bits

double digital(double value, double limit, double digit) {
  return std::clamp(digit * std::round(value / digit), -limit, limit);
}

Eigen::Matrix3d turned(double angle, const Eigen::Vector3d& axis) {
  return Eigen::AngleAxisd(angle, axis).toRotationMatrix();
}

}  // namespace

SensorFaults sensor_faults(const Magnitudes& magnitudes, std::uint64_t seed) {
  Random random(seed, "sensor faults");
  SensorFaults f;
  f.warm = random.direction();
  const Eigen::Vector3d axis = random.direction();
  f.axes.setIdentity();
  if (const double wrong = magnitudes[Effect::kAccelerometerMisalignment]; wrong > 0) {
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        if (i != j) f.axes(i, j) = wrong * laws::kCrossAxis * random.sign();
    f.axes *= turned(wrong * laws::kDieTurn_rad, axis);
  }
  Random level(seed, "mocap faults");
  const double lean = level.uniform(0, 2 * M_PI), set = level.uniform(0, 2 * M_PI);
  f.bend = {std::cos(lean), std::sin(lean), 0};
  f.stalk = {std::cos(set), std::sin(set), 0};
  f.buffer_phase = level.uniform();
  return f;
}

Sensors::Sensors(const Assignment& a, std::size_t flight, const Robot& robot, SensorParameters parameters)
    : f_(std::move(parameters)),
      clamped_(a.bench),
      power_(a.power),
      wings_(a.wings && !a.bench),
      imu_noise_(a.seed, "imu", stream_of(a, flight)),
      mocap_noise_(a.seed, "mocap", stream_of(a, flight)),
      power_noise_(a.seed, "power", stream_of(a, flight)),
      wing_noise_(a.seed, "wings", stream_of(a, flight)),
      walk_(a.seed, "gyro walk", stream_of(a, flight)),
      step_s_(robot.step_s()),
      faults_(sensor_faults(robot.magnitudes(), a.seed)) {
  const Magnitudes& magnitudes = robot.magnitudes();
  bias_ = magnitudes[Effect::kGyroBias];
  rectification_ = magnitudes[Effect::kVibrationRectification];
  g_sensitivity_ = 1e-3 * magnitudes[Effect::kGyroGSensitivity];
  buffer_ = magnitudes[Effect::kMocapDelay];
  bend_ = magnitudes[Effect::kMocapTilt];
  stalk_ = magnitudes[Effect::kMarkerOffset];
  notch_ = std::min(1.0, laws::kNotchDepth * magnitudes[Effect::kGyroNotch]);
}

void Sensors::after_step(const Robot& robot, double t_s) {
  ++count_;
  if (!clamped_) imu(robot, t_s);
  if (!clamped_ && stalk_ > 0) swing(robot.mechanism().motion());
  if (!clamped_ && count_ % f_.mocap.steps == 0) mocap(robot, t_s);
  if (power_ && count_ % f_.power.steps == 0) power(robot, t_s);
  if (wings_ && count_ % f_.wings.steps == 0) wings(robot, t_s);
}

// A linear oscillator, driven by the torso's specific force.
void Sensors::swing(const Motion& now) {
  const double rate = 2 * M_PI * laws::kStalk_Hz / std::sqrt(stalk_);
  const Eigen::Vector3d rest =
      laws::stalk_rest_m(specific_force_B(now, Eigen::Vector3d::Zero()), faults_.stalk, stalk_);
  if (count_ == 1) stalk_m_ = rest;
  stalk_m_s_ += step_s_ * (rate * rate * (rest - stalk_m_) - 2 * laws::kStalkDamping * rate * stalk_m_s_);
  stalk_m_ += step_s_ * stalk_m_s_;
}

// Signal chain: position, misalignment, rectification, axes, notch, low-pass; then bias, noise and resolution.
void Sensors::imu(const Robot& robot, double t_s) {
  const Motion now = robot.mechanism().motion();
  const Eigen::Vector3d acts = specific_force_B(now, f_.imu.position_m);
  Eigen::Vector3d force = faults_.axes * acts;
  if (rectification_ > 0) {
    if (!settled_) level_ = force;
    level_ += (1 - std::exp(-2 * M_PI * laws::kRectifiedFrom_Hz * step_s_)) * (force - level_);
    for (int i = 0; i < 3; ++i) force[i] += rectification_ * laws::rectified_m_s2(force[i] - level_[i]);
  }
  Eigen::Vector3d rate = f_.imu.gyro_axes * now.rate_B + g_sensitivity_ * acts;
  if (notch_ > 0) {  // less a band around the notch: b' = (w/Q)(x - b) - w s, s' = w b
    const double w = 2 * M_PI * laws::kNotch_Hz;
    notched_ += step_s_ * (w / laws::kNotchQuality * (rate - notched_) - w * notched_sum_);
    notched_sum_ += step_s_ * w * notched_;
    rate -= notch_ * notched_;
  }
  Vector6 raw;
  raw << rate, f_.imu.accel_axes * force;
  const double passed = 1 - std::exp(-2 * M_PI * f_.imu.bandwidth_hz * step_s_);
  if (!settled_) passed_ = raw;
  settled_ = true;
  passed_ += passed * (raw - passed_);
  sum_ += passed_;
  if (bias_ > 0) walked_ += bias_ * laws::kGyroWalk_rad_s * std::sqrt(step_s_) * walk_.normal3();
  // kHeld: the sensor took its value half an interval earlier
  if (count_ % f_.imu.steps == f_.imu.steps / 2) held_ = passed_;
  if (count_ % f_.imu.steps != 0) return;
  Vector6 sample = f_.imu.sampling == Sampling::kInstant ? passed_
                   : f_.imu.sampling == Sampling::kHeld  ? held_
                                                         : Vector6(sum_ / static_cast<double>(f_.imu.steps));
  sum_.setZero();
  Eigen::Vector3d bias = f_.imu.gyro_bias;
  if (bias_ > 0)
    bias += bias_ * laws::gyro_warmth_rad_s(static_cast<double>(count_) * step_s_) * faults_.warm + walked_;
  sample.head<3>() += bias + f_.imu.gyro_noise * imu_noise_.normal3();
  sample.tail<3>() += f_.imu.accel_noise * imu_noise_.normal3();
  const double arrives_s = (t_s + f_.imu.latency_s) * (1 + f_.fast_imu);
  if (arrives_s < 0) return;
  imu_.t_s.push_back(arrives_s);
  flightlog::Column* columns[6] = {&imu_.gyro_x_rad_s, &imu_.gyro_y_rad_s, &imu_.gyro_z_rad_s,
                                   &imu_.accel_x_m_s2, &imu_.accel_y_m_s2, &imu_.accel_z_m_s2};
  for (int i = 0; i < 6; ++i)
    columns[i]->push_back(i < 3 ? digital(sample[i], kGyroLimit_rad_s, kGyroDigit_rad_s)
                                : digital(sample[i], kAccelLimit_m_s2, kAccelDigit_m_s2));
}

// Fits a rigid body to the markers that at least two cameras see (Kabsch's solution by singular values).
void Sensors::mocap(const Robot& robot, double t_s) {
  const Motion now = robot.mechanism().motion();
  std::array<Eigen::Vector3d, 4> seen_W, model_B;
  std::size_t seen = 0;
  for (std::size_t i = 0; i < f_.mocap.markers_m.size(); ++i) {
    const Eigen::Vector3d marker = f_.mocap.markers_m[i] + stalk_m_;
    const Eigen::Vector3d noise = f_.mocap.marker_noise_m * mocap_noise_.normal3();
    std::size_t cameras = 0;
    for (const Eigen::Vector3d& camera : f_.mocap.cameras_W)
      cameras += (now.R_WB * marker.normalized()).dot(camera) > -0.45;
    if (cameras < 2) continue;
    seen_W[seen] = now.position_W + now.R_WB * marker + noise;
    model_B[seen++] = f_.mocap.model_m[i];
  }
  const double loss = mocap_noise_.uniform(), length = mocap_noise_.uniform();
  if (lost_ > 0) --lost_;
  else if (loss < f_.mocap.loss) lost_ = 1 + static_cast<std::size_t>(6 * length);
  if (seen < 3 || lost_ > 0) return;
  Eigen::Vector3d mean_W = Eigen::Vector3d::Zero(), mean_B = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < seen; ++i) {
    mean_W += seen_W[i] / static_cast<double>(seen);
    mean_B += model_B[i] / static_cast<double>(seen);
  }
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < seen; ++i) covariance += (seen_W[i] - mean_W) * (model_B[i] - mean_B).transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double handed = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  const Eigen::Matrix3d R = svd.matrixU() * Eigen::Vector3d(1, 1, handed).asDiagonal() * svd.matrixV().transpose();
  Eigen::Vector3d position = mean_W - R * mean_B;
  Eigen::Quaterniond q(R);
  if (bend_ > 0) {
    const double lean = laws::bend_rad(position.z(), bend_);
    q = Eigen::AngleAxisd(lean, Eigen::Vector3d::UnitZ().cross(faults_.bend)) * q;
    position += laws::bent_by(position, faults_.bend, bend_);
  }
  q.normalize();
  if (q.w() < 0) q.coeffs() *= -1;
  const double buffered_s = buffer_ > 0 ? laws::buffer_delay_s(t_s, faults_.buffer_phase, buffer_) : 0;
  const double arrives_s = (t_s + f_.mocap.latency_s + buffered_s) * (1 + f_.fast_mocap);
  if (arrives_s < 0 || (!mocap_.t_s.empty() && arrives_s <= mocap_.t_s.back())) return;  // thrown away by the buffer
  flightlog::Column* columns[8] = {&mocap_.t_s, &mocap_.x_m, &mocap_.y_m, &mocap_.z_m,
                                   &mocap_.qw,  &mocap_.qx,  &mocap_.qy,  &mocap_.qz};
  const double values[8] = {arrives_s, position.x(), position.y(), position.z(), q.w(), q.x(), q.y(), q.z()};
  for (std::size_t i = 0; i < 8; ++i) columns[i]->push_back(values[i]);
}

void Sensors::power(const Robot& robot, double t_s) {
  const double battery = robot.drive().battery_V() + f_.power.voltage_noise * power_noise_.normal();
  std::array<double, 2> currents{};
  for (std::size_t side = 0; side < 2; ++side) {
    double current = robot.drive().currents()[side];
    // on the battery's side of the bridge the mean current is scaled by the duty cycle
    if (f_.power.battery_side) current *= std::abs(robot.drive().voltages()[side]) / robot.drive().battery_V();
    currents[side] =
        digital(current + f_.power.offset_A[side] + f_.power.current_noise * power_noise_.normal(), 2, kCurrentDigit_A);
  }
  if (t_s + f_.power.latency_s < 0) return;
  power_log_.t_s.push_back(t_s + f_.power.latency_s);
  power_log_.battery_V.push_back(battery);
  power_log_.left_current_A.push_back(currents[0]);
  power_log_.right_current_A.push_back(currents[1]);
}

void Sensors::wings(const Robot& robot, double t_s) {
  const Mechanism& m = robot.mechanism();
  const double angles[4] = {m.stroke(0), m.rotation(0), m.stroke(1), m.rotation(1)};
  flightlog::Column* columns[4] = {&wings_log_.left_stroke_rad, &wings_log_.left_rotation_rad,
                                   &wings_log_.right_stroke_rad, &wings_log_.right_rotation_rad};
  double read[4];
  for (std::size_t i = 0; i < 4; ++i)  // nonlinearity: a Hall sensor's field is not a pure sine
    read[i] = angles[i] + f_.wings.bend_rad[i] * std::sin(2 * angles[i] + f_.wings.bend_phase[i]) +
              f_.wings.noise_rad * wing_noise_.normal();
  if (t_s < 0) return;
  wings_log_.t_s.push_back(t_s);
  for (std::size_t i = 0; i < 4; ++i) columns[i]->push_back(read[i]);
}

void Sensors::hand_over(OnBoard& firmware, double now_s) {
  for (std::size_t& i = imu_given_; i < imu_.t_s.size() && imu_.t_s[i] <= now_s; ++i)
    firmware.imu(imu_.t_s[i], {imu_.gyro_x_rad_s[i], imu_.gyro_y_rad_s[i], imu_.gyro_z_rad_s[i]},
                 {imu_.accel_x_m_s2[i], imu_.accel_y_m_s2[i], imu_.accel_z_m_s2[i]});
  for (std::size_t& i = mocap_given_; i < mocap_.t_s.size() && mocap_.t_s[i] <= now_s; ++i)
    firmware.pose(mocap_.t_s[i], {mocap_.x_m[i], mocap_.y_m[i], mocap_.z_m[i], mocap_.qw[i], mocap_.qx[i], mocap_.qy[i],
                                  mocap_.qz[i]});
}

void Sensors::finish(flightlog::FlightLog& log, double end_s) const {
  log.header = f_.declared;
  log.mocap = mocap_;
  log.imu = imu_;
  if (power_) log.power = power_log_;
  if (wings_) log.wings = wings_log_;
  // arrived after the end of the recording
  const auto cut = [end_s](std::vector<flightlog::Column*> columns) {
    while (!columns[0]->empty() && columns[0]->back() > end_s)
      for (flightlog::Column* column : columns) column->pop_back();
  };
  flightlog::MocapStream& m = log.mocap;
  flightlog::ImuStream& i = log.imu;
  cut({&m.t_s, &m.x_m, &m.y_m, &m.z_m, &m.qw, &m.qx, &m.qy, &m.qz});
  cut({&i.t_s, &i.gyro_x_rad_s, &i.gyro_y_rad_s, &i.gyro_z_rad_s, &i.accel_x_m_s2, &i.accel_y_m_s2, &i.accel_z_m_s2});
  if (log.power) cut({&log.power->t_s, &log.power->battery_V, &log.power->left_current_A, &log.power->right_current_A});
  if (log.wings)
    cut({&log.wings->t_s, &log.wings->left_stroke_rad, &log.wings->left_rotation_rad, &log.wings->right_stroke_rad,
         &log.wings->right_rotation_rad});
}

}  // namespace flappy::blind::c
