// The topics of one flapper, under /flappy, /flappy_1 and on:
//
//   pose           PoseStamped   torso origin and attitude in "world"; best effort, like other sensor data
//   imu            Imu           angular rates and specific force in the torso's frame, declared noise; no attitude
//   joint_states   JointState    left_stroke, left_rotation, right_stroke, right_rotation: rad, rad/s
//   wing_input     WingInput     inputs set by controller and actor; if the actor sets voltages, these, the rest NaN
//   battery        BatteryState  where it is known
//   motors         JointState    published with battery: effort is the current in A of left_motor and right_motor
//   driver         WingInput     inputs that a simulated driver applied, with its voltages and phase
//   /tf            TFMessage     "world" to the torso's frame: "flappy/torso"
//
// Frames: world z up, x and y level; torso x forward, y left, z up (REP 103). Stamps are flight times.
#pragma once

#include <array>

#include "flight/setup.hpp"
#include "rollout/watch.hpp"
#include "server/dds/participant.hpp"

namespace flappy::server {

struct BatterySample {
  double t_s, voltage_V, left_current_A, right_current_A;  // motor currents, signed
};

/// One update of the driver.
struct AppliedSample {
  double t_s;
  std::uint64_t update;
  sim::Input input;
  double left_V, right_V, phase_rad;
};

struct PoseSample {
  double t_s, position_m[3], attitude[4];
};

struct ImuReading {
  double t_s, gyro_rad_s[3], accel_m_s2[3];
};

class FlapperTopics {
 public:
  /// `slot`: index in the list of watched flappers. `samples`: quality of service of pose, imu and driver.
  FlapperTopics(const Participant& participant, const std::string& name_space, std::size_t slot,
                const flight::Sensors& sensors, const Quality& samples = kSensorData);

  /// Publishes the true pose and joint angles, the IMU without noise, the transform and the inputs.
  void write(const rollout::FlightSample& s) const;
  void write(const PoseSample& pose) const;
  void write(const ImuReading& imu) const;
  void write(const BatterySample& battery) const;
  void write(double t_s, const sim::FlapperState& s) const;
  void write(double t_s, std::uint64_t tick, const sim::Input& u) const;
  void write(const AppliedSample& a) const;
  void write_transform(const PoseSample& pose) const;

 private:
  std::string frame_;
  double imu_covariance_[2];  // variance per axis of angular rate and of specific force
  Writer<PoseStamped> pose_;
  Writer<Imu> imu_;
  Writer<JointState> joints_;
  Writer<WingInput> input_;
  Writer<BatteryState> battery_;
  Writer<JointState> motors_;
  Writer<WingInput> driver_;
  Writer<TFMessage> tf_;
};

}  // namespace flappy::server
