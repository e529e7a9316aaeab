/* The policy as a module of PX4 (1.14 to 1.16) for a flapper with two motors: estimator, feedback controller, policy and wing-beat
   modulator are those of the exported headers; of PX4 it takes the IMU, motion capture as visual odometry, arming, the motors' outputs
   and the log. Interface: github.com/PX4/PX4-Autopilot, src/examples/work_item, msg/SensorCombined.msg, msg/VehicleOdometry.msg,
   msg/versioned/ActuatorMotors.msg, msg/DebugArray.msg. Start it in place of the multicopter's controllers. */
#include <drivers/drv_hrt.h>
#include <px4_platform_common/module.h>
#include <px4_platform_common/px4_work_queue/ScheduledWorkItem.hpp>
#include <stdint.h>
#include <string.h>
#include <uORB/Publication.hpp>
#include <uORB/Subscription.hpp>
#include <uORB/topics/actuator_armed.h>
#include <uORB/topics/actuator_motors.h>
#include <uORB/topics/debug_array.h>
#include <uORB/topics/sensor_combined.h>
#include <uORB/topics/vehicle_odometry.h>

extern "C" {
#include "onboard.h"
}

/* Voltage at the motors for an output of 1. */
#ifndef FLAPPY_PX4_FULL_V
#define FLAPPY_PX4_FULL_V 18.0F
#endif

class FlappyControl : public ModuleBase<FlappyControl>, public px4::ScheduledWorkItem {
 public:
  FlappyControl() : ScheduledWorkItem(MODULE_NAME, px4::wq_configurations::rate_ctrl) {}

  static int task_spawn(int argc, char *argv[]);
  static int custom_command(int argc, char *argv[]);
  static int print_usage(const char *reason = nullptr);
  int print_status() override;

  void init() {
    onboard_begin(&_vehicle, (uint32_t)hrt_absolute_time());
    ScheduleOnInterval(FLAPPY_CONTROLLER_DRIVE_US);
  }

 private:
  void Run() override;
  void take_samples(uint32_t now_us);
  void take_arming(uint32_t now_us);
  void publish_policy();
  void publish_motors(uint64_t now, float left_V, float right_V, bool turn);

  uORB::Subscription _imu_sub{ORB_ID(sensor_combined)};
  uORB::Subscription _pose_sub{ORB_ID(vehicle_visual_odometry)};
  uORB::Subscription _armed_sub{ORB_ID(actuator_armed)};
  uORB::Publication<actuator_motors_s> _motors_pub{ORB_ID(actuator_motors)};
  uORB::Publication<debug_array_s> _policy_pub{ORB_ID(debug_array)};
  onboard _vehicle{};
  bool _armed{false};
  uint32_t _published{0};
  volatile onboard_wish _wish{ONBOARD_NOTHING}; /* of the pilot, from the task of the command */
};

static_assert(FLAPPY_POLICY_OBS + FLAPPY_POLICY_ACT <= debug_array_s::ARRAY_SIZE, "what the policy sees does not fit into debug_array");

/* From forward, right, down or north, east, down to x forward, y left, z up. */
static flappy_vector turned(const float *x) { return flappy_vector_of(x[0], -x[1], -x[2]); }

void FlappyControl::take_samples(uint32_t now_us) {
  sensor_combined_s imu;
  while (_imu_sub.update(&imu)) {
    onboard_imu_sample sample;
    sample.taken_us = (uint32_t)imu.timestamp;
    sample.gyro_rad_s = turned(imu.gyro_rad);
    sample.accel_m_s2 = turned(imu.accelerometer_m_s2);
    onboard_imu(&_vehicle, now_us, &sample);
  }
  vehicle_odometry_s pose;
  while (_pose_sub.update(&pose)) {
    onboard_pose_sample sample;
    sample.taken_us = (uint32_t)pose.timestamp_sample;
    sample.valid = pose.pose_frame == vehicle_odometry_s::POSE_FRAME_NED ? 1U : 0U;
    sample.position_m = turned(pose.position);
    sample.attitude.w = pose.q[0];
    sample.attitude.x = pose.q[1];
    sample.attitude.y = -pose.q[2];
    sample.attitude.z = -pose.q[3];
    onboard_pose(&_vehicle, now_us, &sample);
  }
}

/* Disarming ends the flight; the next one begins with the self-tests. */
void FlappyControl::take_arming(uint32_t now_us) {
  actuator_armed_s armed;
  if (!_armed_sub.update(&armed)) return;
  const bool before = _armed;
  _armed = armed.armed && !armed.manual_lockdown && !armed.force_failsafe;
  if (before && !_armed) onboard_begin(&_vehicle, now_us);
}

/* What the policy got and gave at its last inference, for flappy-gap. */
void FlappyControl::publish_policy() {
  if (_vehicle.inferences == _published) return;
  _published = _vehicle.inferences;
  debug_array_s all{};
  all.timestamp = hrt_absolute_time();
  memcpy(all.name, "flappy", 7);
  memcpy(all.data, _vehicle.observation, sizeof _vehicle.observation);
  memcpy(all.data + FLAPPY_POLICY_OBS, _vehicle.action, sizeof _vehicle.action);
  _policy_pub.publish(all);
}

void FlappyControl::Run() {
  if (should_exit()) {
    publish_motors(hrt_absolute_time(), 0.0F, 0.0F, false); /* the outputs would hold the last voltage */
    ScheduleClear();
    exit_and_cleanup();
    return;
  }
  const uint64_t now = hrt_absolute_time();
  const uint32_t now_us = (uint32_t)now;
  take_samples(now_us);
  take_arming(now_us);
  const onboard_wish wish = _armed ? _wish : ONBOARD_NOTHING;
  _wish = ONBOARD_NOTHING;
  if (wish == ONBOARD_HOVER) onboard_hover(&_vehicle);
  if (wish == ONBOARD_MANOEUVRE) onboard_manoeuvre(&_vehicle);
  if (wish == ONBOARD_STOP) onboard_stop(&_vehicle);
  if (onboard_due(_vehicle.tick_us, now_us)) {
    onboard_tick(&_vehicle, now_us);
    publish_policy();
  }
  if (!onboard_due(_vehicle.drive_us, now_us)) return;
  float left_V = 0.0F, right_V = 0.0F;
  onboard_drive(&_vehicle, now_us, &left_V, &right_V);
  publish_motors(now, left_V, right_V, _armed && onboard_flies(&_vehicle));
}

/* NaN stops a motor. */
void FlappyControl::publish_motors(uint64_t now, float left_V, float right_V, bool turn) {
  actuator_motors_s motors{};
  motors.timestamp = motors.timestamp_sample = now;
  motors.reversible_flags = 3;
  for (float &control : motors.control) control = __builtin_nanf("");
  if (turn) {
    motors.control[0] = left_V / FLAPPY_PX4_FULL_V;
    motors.control[1] = right_V / FLAPPY_PX4_FULL_V;
  }
  _motors_pub.publish(motors);
}

int FlappyControl::task_spawn(int argc, char *argv[]) {
  (void)argc;
  (void)argv;
  FlappyControl *instance = new FlappyControl();
  if (instance == nullptr) return PX4_ERROR;
  _object.store(instance);
  _task_id = task_id_is_work_queue;
  instance->init();
  return PX4_OK;
}

int FlappyControl::custom_command(int argc, char *argv[]) {
  static const struct {
    const char *name;
    onboard_wish wish;
  } wishes[] = {{"hover", ONBOARD_HOVER}, {"manoeuvre", ONBOARD_MANOEUVRE}, {"drop", ONBOARD_STOP}};
  if (!is_running()) return print_usage("not running");
  for (const auto &w : wishes)
    if (argc == 1 && strcmp(argv[0], w.name) == 0) {
      get_instance()->_wish = w.wish;
      return PX4_OK;
    }
  return print_usage("unknown command");
}

int FlappyControl::print_status() {
  PX4_INFO("state %d (0 refused, 1 waiting, 2 hovering, 3 acting, 4 returned, 5 off), flags %u, armed %d", (int)_vehicle.state,
           (unsigned)_vehicle.flags, (int)_armed);
  return PX4_OK;
}

int FlappyControl::print_usage(const char *reason) {
  if (reason != nullptr) PX4_WARN("%s", reason);
  PRINT_MODULE_DESCRIPTION("A trained policy with its estimator, feedback controller and wing-beat modulator.");
  PRINT_MODULE_USAGE_NAME("flappy_control", "controller");
  PRINT_MODULE_USAGE_COMMAND("start");
  PRINT_MODULE_USAGE_COMMAND_DESCR("hover", "fly to where the task begins, and stay");
  PRINT_MODULE_USAGE_COMMAND_DESCR("manoeuvre", "let the policy act");
  PRINT_MODULE_USAGE_COMMAND_DESCR("drop", "motors off, until disarmed");
  PRINT_MODULE_USAGE_DEFAULT_COMMANDS();
  return 0;
}

extern "C" __EXPORT int flappy_control_main(int argc, char *argv[]) { return FlappyControl::main(argc, argv); }
