#include "server/telemetry/flapper_topics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace flappy::server {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
constexpr char kWorld[] = "world";

/// For char* of messages, of which write() only reads the text.
char* text(const char* of) { return const_cast<char*>(of); }

Header header(double t_s, const char* frame) { return {time_of(t_s), text(frame)}; }

void put_pose(const double (&position)[3], const double (&attitude)[4], auto& p, auto& q) {
  p = {position[0], position[1], position[2]};
  q = {attitude[1], attitude[2], attitude[3], attitude[0]};
}

void put_diagonal(double (&covariance)[9], double variance) {
  std::ranges::fill(covariance, 0.0);
  covariance[0] = covariance[4] = covariance[8] = variance;
}

WingInput message(double t_s, std::uint64_t tick, const sim::Input& u, const std::string& frame) {
  return {header(t_s, frame.c_str()),
          tick,
          u.amplitude_V,
          u.difference_V,
          u.bias_V,
          u.split_cycle,
          kUnknown,
          kUnknown,
          kUnknown};
}

}  // namespace

FlapperTopics::FlapperTopics(const Participant& p, const std::string& name_space, std::size_t slot,
                             const flight::Sensors& sensors, const Quality& samples)
    : frame_(topic_name(name_space, slot, "torso").substr(1)),
      imu_covariance_{sensors.imu.gyro_noise_rad_s * sensors.imu.gyro_noise_rad_s,
                      sensors.imu.accel_noise_m_s2 * sensors.imu.accel_noise_m_s2},
      pose_(p, topic_name(name_space, slot, "pose"), samples),
      imu_(p, topic_name(name_space, slot, "imu"), samples),
      joints_(p, topic_name(name_space, slot, "joint_states"), kSensorData),
      input_(p, topic_name(name_space, slot, "wing_input"), kSensorData),
      battery_(p, topic_name(name_space, slot, "battery"), kSensorData),
      motors_(p, topic_name(name_space, slot, "motors"), kSensorData),
      driver_(p, topic_name(name_space, slot, "driver"), samples),
      tf_(p, "/tf", {true, false, 100}) {}

void FlapperTopics::write(const PoseSample& pose) const {
  PoseStamped m{};
  m.header = header(pose.t_s, kWorld);
  put_pose(pose.position_m, pose.attitude, m.pose.position, m.pose.orientation);
  pose_.write(m);
}

void FlapperTopics::write_transform(const PoseSample& pose) const {
  TransformStamped t{};
  t.header = header(pose.t_s, kWorld);
  t.child_frame_id = text(frame_.c_str());
  put_pose(pose.position_m, pose.attitude, t.transform.translation, t.transform.rotation);
  TFMessage m{};
  m.transforms._length = m.transforms._maximum = 1;
  m.transforms._buffer = &t;
  tf_.write(m);
}

void FlapperTopics::write(const ImuReading& imu) const {
  Imu m{};
  m.header = header(imu.t_s, frame_.c_str());
  m.orientation.w = 1;
  m.orientation_covariance[0] = -1;  // no orientation
  m.angular_velocity = {imu.gyro_rad_s[0], imu.gyro_rad_s[1], imu.gyro_rad_s[2]};
  m.linear_acceleration = {imu.accel_m_s2[0], imu.accel_m_s2[1], imu.accel_m_s2[2]};
  put_diagonal(m.angular_velocity_covariance, imu_covariance_[0]);
  put_diagonal(m.linear_acceleration_covariance, imu_covariance_[1]);
  imu_.write(m);
}

void FlapperTopics::write(const BatterySample& battery) const {
  BatteryState m{};
  const auto unknown = static_cast<float>(kUnknown);
  m.header = header(battery.t_s, frame_.c_str());
  m.voltage = static_cast<float>(battery.voltage_V);
  m.current = static_cast<float>(-(battery.left_current_A + battery.right_current_A));  // negative when it discharges
  m.temperature = m.charge = m.capacity = m.design_capacity = m.percentage = unknown;
  m.power_supply_status = 2;  // discharging
  m.present = true;
  m.location = m.serial_number = text("");
  battery_.write(m);
  char* names[] = {text("left_motor"), text("right_motor")};
  double effort[] = {battery.left_current_A, battery.right_current_A};
  JointState motors{};
  motors.header = m.header;
  motors.name = {2, 2, names, false};
  motors.effort = {2, 2, effort, false};
  motors_.write(motors);
}

void FlapperTopics::write(double t_s, const sim::FlapperState& s) const {
  char* names[] = {text("left_stroke"), text("left_rotation"), text("right_stroke"), text("right_rotation")};
  double position[] = {s.stroke_rad[0], s.rotation_rad[0], s.stroke_rad[1], s.rotation_rad[1]};
  double velocity[] = {s.stroke_rate_rad_s[0], s.rotation_rate_rad_s[0], s.stroke_rate_rad_s[1],
                       s.rotation_rate_rad_s[1]};
  JointState m{};
  m.header = header(t_s, frame_.c_str());
  m.name = {4, 4, names, false};
  m.position = {4, 4, position, false};
  m.velocity = {4, 4, velocity, false};
  joints_.write(m);
}

void FlapperTopics::write(double t_s, std::uint64_t tick, const sim::Input& u) const {
  input_.write(message(t_s, tick, u, frame_));
}

void FlapperTopics::write(const AppliedSample& a) const {
  WingInput m = message(a.t_s, a.update, a.input, frame_);
  m.left_voltage_v = a.left_V;
  m.right_voltage_v = a.right_V;
  m.phase_rad = a.phase_rad;
  driver_.write(m);
}

void FlapperTopics::write(const rollout::FlightSample& s) const {
  PoseSample pose{s.t_s, {}, {}};
  std::ranges::copy(s.state.position_m, pose.position_m);
  std::ranges::copy(s.state.attitude, pose.attitude);
  ImuReading imu{s.t_s, {}, {}};
  std::ranges::copy(s.gyro_rad_s, imu.gyro_rad_s);
  std::ranges::copy(s.accel_m_s2, imu.accel_m_s2);
  write(pose);
  write_transform(pose);
  write(imu);
  write(s.t_s, s.state);
  if (!s.sets_voltages) return write(s.t_s, s.tick, s.input);
  WingInput m = message(s.t_s, s.tick, {kUnknown, kUnknown, kUnknown, kUnknown}, frame_);
  m.left_voltage_v = s.left_V;
  m.right_voltage_v = s.right_V;
  input_.write(m);
}

}  // namespace flappy::server
