/* HAL over a byte stream (board.h): the simulator provides clock, sensors and motors. */
#include "hal_simulated.h"

#include "board.h"
#include "hal.h"

static loop_input in;
static loop_output out;
static uint32_t now_us, imu_taken, pose_taken;
static int goes_on;

static void receive(void) {
  goes_on = board_read(&in, (unsigned)sizeof in) && in.wish >= 0;
  now_us = in.now_us;
  imu_taken = pose_taken = out.drive_count = 0;
}

void hal_start(void) { receive(); }

uint32_t hal_now_us(void) { return now_us; }

int hal_wait_us(uint32_t until_us) {
  if (!onboard_due(in.until_us, until_us)) {
    now_us = until_us;
    return goes_on;
  }
  board_write(&out, (unsigned)sizeof out);
  receive();
  return goes_on;
}

static flappy_vector vector(const float *x) { return flappy_vector_of(x[0], x[1], x[2]); }

int hal_imu(onboard_imu_sample *sample) {
  if (imu_taken == in.imu_count || imu_taken == LOOP_IMU) return 0;
  sample->taken_us = in.imu[imu_taken].taken_us;
  sample->gyro_rad_s = vector(in.imu[imu_taken].gyro_rad_s);
  sample->accel_m_s2 = vector(in.imu[imu_taken].accel_m_s2);
  ++imu_taken;
  return 1;
}

int hal_pose(onboard_pose_sample *sample) {
  const float *q = in.pose[pose_taken % LOOP_POSES].attitude;
  if (pose_taken == in.pose_count || pose_taken == LOOP_POSES) return 0;
  sample->taken_us = in.pose[pose_taken].taken_us;
  sample->valid = in.pose[pose_taken].valid;
  sample->position_m = vector(in.pose[pose_taken].position_m);
  sample->attitude.w = q[0];
  sample->attitude.x = q[1];
  sample->attitude.y = q[2];
  sample->attitude.z = q[3];
  ++pose_taken;
  return 1;
}

onboard_wish hal_wish(void) { return (onboard_wish)in.wish; }

void hal_motors(float left_V, float right_V) {
  if (out.drive_count == LOOP_DRIVES) return;
  out.volts[out.drive_count][0] = left_V;
  out.volts[out.drive_count][1] = right_V;
  ++out.drive_count;
}

void hal_telemetry(const onboard *o) {
  const flappy_wing_beat *u = &o->controller.input;
  const int flies = onboard_flies(o);
  out.state = (uint32_t)o->state;
  out.flags = o->flags;
  out.input[0] = flies ? u->amplitude_V : 0.0F;
  out.input[1] = flies ? u->difference_V : 0.0F;
  out.input[2] = flies ? u->bias_V : 0.0F;
  out.input[3] = flies ? u->split_cycle : 0.0F;
}
