/* A firmware as somebody may write it around the exported headers: samples in, voltages out. MISTAKE is one of the names
   below, or none. Compiled after flappy_policy.h and flappy_controller.h. */
#include <math.h>
#include <string.h>

#define MISTAKE_IS(name) (FIRMWARE_MISTAKE == firmware_##name)
enum {
  firmware_none,
  /* what goes in */
  firmware_gyro_degrees,
  firmware_accel_g,
  firmware_accel_sign,
  firmware_accel_z_sign,
  firmware_gyro_x_sign,
  firmware_gyro_y_sign,
  firmware_gyro_z_sign,
  firmware_gyro_xy_swapped,
  firmware_gyro_yz_swapped,
  firmware_accel_xy_swapped,
  firmware_imu_quarter_turn,
  firmware_imu_upside_down,
  firmware_quaternion_xyzw,
  firmware_quaternion_to_body,
  firmware_yaw_quarter_turn,
  firmware_yaw_third_turn,
  firmware_heading_half_turn,
  firmware_mocap_z_down,
  firmware_mocap_y_up,
  firmware_position_mm,
  /* observation */
  firmware_position_and_velocity_swapped,
  firmware_velocity_and_rate_swapped,
  firmware_rate_and_phase_swapped,
  firmware_no_mean,
  firmware_no_scale,
  firmware_no_normalisation,
  firmware_rate_zero,
  firmware_velocity_zero,
  firmware_previous_zero,
  firmware_trim_zero,
  firmware_rotation_transposed,
  firmware_goal_elsewhere,
  /* time */
  firmware_every_second,
  firmware_every_third,
  firmware_one_period_late,
  firmware_two_periods_late,
  firmware_imu_held,
  firmware_pose_held,
  firmware_clock_1024,
  firmware_never_back,
  firmware_back_early,
  /* what comes out */
  firmware_difference_and_bias_swapped,
  firmware_bias_sign,
  firmware_split_mirrored,
  firmware_policy_difference_sign,
  firmware_not_clipped,
  firmware_clipped_low,
  firmware_shares,
  firmware_wings_swapped,
  /* what flies, by another header or compiler */
  firmware_int8,
  firmware_contracted,
  firmware_another_export
};

static flappy_controller firmware_controller;
static flappy_policy_state firmware_policy;
static uint32_t firmware_tick_us, firmware_drive_us, firmware_begin_us, firmware_acted, firmware_samples, firmware_frames;
static int firmware_ticks, firmware_wants, firmware_acts;
static double firmware_held[2];
static float firmware_waiting[3][4];

static int firmware_index(const char *name) {
  int i;
  for (i = 0; i < FLAPPY_POLICY_OBS; ++i)
    if (strcmp(flappy_policy_observation[i].name, name) == 0) return i;
  return -1;
}

/* Time on the firmware's own clock. */
static uint32_t firmware_clock(double us) {
  if (MISTAKE_IS(clock_1024)) us *= 1000.0 / 1024.0; /* ticks of 1/1024 s taken for ms */
  return (uint32_t)(int64_t)llround(us) + 77000000U;
}

static void firmware_turn_z(double *v, double degrees) {
  const double a = degrees * 3.14159265358979323846 / 180.0, x = v[0], y = v[1];
  v[0] = cos(a) * x - sin(a) * y;
  v[1] = sin(a) * x + cos(a) * y;
}
static void firmware_multiply(const double *p, const double *q, double *r) {
  r[0] = p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3];
  r[1] = p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2];
  r[2] = p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1];
  r[3] = p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0];
}
static void firmware_yaw(double *q, double degrees) {
  const double h = degrees * 3.14159265358979323846 / 360.0;
  const double turn[4] = {cos(h), 0, 0, sin(h)};
  double r[4];
  firmware_multiply(turn, q, r);
  memcpy(q, r, sizeof r);
}

/* A pose of seven numbers as this firmware reads it. */
static void firmware_read_pose(const double *from, flappy_vector *position, flappy_quaternion *attitude) {
  double x[3], q[4], y;
  memcpy(x, from, sizeof x);
  memcpy(q, from + 3, sizeof q);
  if (MISTAKE_IS(yaw_quarter_turn)) firmware_turn_z(x, 90), firmware_yaw(q, 90);
  if (MISTAKE_IS(yaw_third_turn)) firmware_turn_z(x, 30), firmware_yaw(q, 30);
  if (MISTAKE_IS(heading_half_turn)) firmware_yaw(q, 180);
  if (MISTAKE_IS(mocap_z_down)) x[1] = -x[1], x[2] = -x[2], q[2] = -q[2], q[3] = -q[3];
  if (MISTAKE_IS(mocap_y_up)) {
    const double h = sqrt(0.5), turn[4] = {h, -h, 0, 0};
    double r[4];
    y = x[1], x[1] = x[2], x[2] = -y;
    firmware_multiply(turn, q, r);
    memcpy(q, r, sizeof r);
  }
  if (MISTAKE_IS(position_mm)) x[0] *= 1000, x[1] *= 1000, x[2] *= 1000;
  *position = flappy_vector_of((float)x[0], (float)x[1], (float)x[2]);
  if (MISTAKE_IS(quaternion_xyzw)) {
    attitude->w = (float)q[1], attitude->x = (float)q[2], attitude->y = (float)q[3], attitude->z = (float)q[0];
  } else {
    attitude->w = (float)q[0], attitude->x = (float)q[1], attitude->y = (float)q[2], attitude->z = (float)q[3];
    if (MISTAKE_IS(quaternion_to_body)) attitude->x = -attitude->x, attitude->y = -attitude->y, attitude->z = -attitude->z;
  }
}

void firmware_start(double now_us, const double *pose) {
  flappy_vector position;
  flappy_quaternion attitude;
  firmware_read_pose(pose, &position, &attitude);
  firmware_tick_us = firmware_drive_us = firmware_clock(now_us);
  firmware_acted = firmware_samples = firmware_frames = 0;
  firmware_ticks = firmware_acts = firmware_wants = 0;
  memset(firmware_waiting, 0, sizeof firmware_waiting);
  flappy_controller_start(&firmware_controller, firmware_tick_us, position, attitude);
}

void firmware_go(void) { firmware_wants = 1; }

void firmware_take_imu(double taken_us, const double *gyro, const double *accel) {
  double w[3], a[3], y;
  int i;
  memcpy(w, gyro, sizeof w);
  memcpy(a, accel, sizeof a);
  if (MISTAKE_IS(imu_held) && firmware_samples++ % 2 != 0) return;
  for (i = 0; i < 3; ++i) {
    if (MISTAKE_IS(gyro_degrees)) w[i] *= 57.29577951308232;
    if (MISTAKE_IS(accel_g)) a[i] /= 9.80665;
    if (MISTAKE_IS(accel_sign)) a[i] = -a[i];
  }
  if (MISTAKE_IS(accel_z_sign)) a[2] = -a[2];
  if (MISTAKE_IS(gyro_x_sign)) w[0] = -w[0];
  if (MISTAKE_IS(gyro_y_sign)) w[1] = -w[1];
  if (MISTAKE_IS(gyro_z_sign)) w[2] = -w[2];
  if (MISTAKE_IS(gyro_xy_swapped)) y = w[0], w[0] = w[1], w[1] = y;
  if (MISTAKE_IS(gyro_yz_swapped)) y = w[1], w[1] = w[2], w[2] = y;
  if (MISTAKE_IS(accel_xy_swapped)) y = a[0], a[0] = a[1], a[1] = y;
  if (MISTAKE_IS(imu_quarter_turn)) firmware_turn_z(w, 90), firmware_turn_z(a, 90);
  if (MISTAKE_IS(imu_upside_down)) w[1] = -w[1], w[2] = -w[2], a[1] = -a[1], a[2] = -a[2];
  (void)flappy_controller_imu(&firmware_controller, firmware_clock(taken_us),
                              flappy_vector_of((float)w[0], (float)w[1], (float)w[2]),
                              flappy_vector_of((float)a[0], (float)a[1], (float)a[2]));
}

void firmware_take_pose(double taken_us, const double *pose) {
  flappy_vector position;
  flappy_quaternion attitude;
  if (MISTAKE_IS(pose_held) && firmware_frames++ % 3 != 0) return;
  firmware_read_pose(pose, &position, &attitude);
  (void)flappy_controller_pose(&firmware_controller, firmware_clock(taken_us), 1, position, attitude);
}

static void firmware_swap_parts(float *obs, const char *first, const char *second, int size) {
  const int a = firmware_index(first), b = firmware_index(second);
  int i;
  if (a < 0 || b < 0) return;
  for (i = 0; i < size; ++i) {
    const float x = obs[a + i];
    obs[a + i] = obs[b + i];
    obs[b + i] = x;
  }
}
static void firmware_clear(float *obs, const char *first, int size) {
  const int a = firmware_index(first);
  int i;
  for (i = 0; a >= 0 && i < size; ++i) obs[a + i] = 0.0F;
}

static void firmware_spoil(float *obs) {
  int i, k;
  if (MISTAKE_IS(position_and_velocity_swapped)) firmware_swap_parts(obs, "x_error", "x_velocity", 3);
  if (MISTAKE_IS(velocity_and_rate_swapped)) firmware_swap_parts(obs, "x_velocity", "roll_rate", 3);
  if (MISTAKE_IS(rate_and_phase_swapped)) { /* written in the other order: phase, then rates */
    const int a = firmware_index("roll_rate");
    const float sin = obs[a + 3], cos = obs[a + 4];
    for (i = 2; i >= 0; --i) obs[a + 2 + i] = obs[a + i];
    obs[a] = sin;
    obs[a + 1] = cos;
  }
  if (MISTAKE_IS(rate_zero)) firmware_clear(obs, "roll_rate", 3);
  if (MISTAKE_IS(velocity_zero)) firmware_clear(obs, "x_velocity", 3);
  if (MISTAKE_IS(previous_zero)) firmware_clear(obs, "added_amplitude", 4);
  if (MISTAKE_IS(trim_zero)) firmware_clear(obs, "trim_amplitude", 4);
  if (MISTAKE_IS(rotation_transposed)) {
    const int a = firmware_index("goal_R_xx");
    for (i = 0; i < 3; ++i)
      for (k = i + 1; k < 3; ++k) {
        const float x = obs[a + 3 * i + k];
        obs[a + 3 * i + k] = obs[a + 3 * k + i];
        obs[a + 3 * k + i] = x;
      }
  }
  if (MISTAKE_IS(goal_elsewhere)) { /* of last week's set-up */
    const int a = firmware_index("x_error");
    obs[a] -= 0.3F;
    obs[a + 1] += 0.12F;
    obs[a + 2] -= 0.2F;
  }
  for (i = 0; i < FLAPPY_POLICY_OBS; ++i) { /* undoes what flappy_policy_step() will do */
    if (MISTAKE_IS(no_mean)) obs[i] += flappy_policy_mean[i];
    if (MISTAKE_IS(no_scale)) obs[i] = (obs[i] - flappy_policy_mean[i]) / flappy_policy_scale[i] + flappy_policy_mean[i];
    if (MISTAKE_IS(no_normalisation)) obs[i] = obs[i] / flappy_policy_scale[i] + flappy_policy_mean[i];
  }
}

static void firmware_act(void) {
  float obs[FLAPPY_POLICY_OBS], action[FLAPPY_POLICY_ACT];
  flappy_controller *c = &firmware_controller;
  const uint32_t rarely = MISTAKE_IS(every_second) ? 2 : MISTAKE_IS(every_third) ? 3 : 1;
  if (!flappy_controller_policy_due(c)) return;
  if (firmware_acted++ % rarely != 0) return;
  flappy_controller_observe(c, obs);
  firmware_spoil(obs);
  (void)flappy_policy_step_with(&firmware_policy, obs, action);
  if (MISTAKE_IS(policy_difference_sign)) action[1] = -action[1];
  if (MISTAKE_IS(one_period_late) || MISTAKE_IS(two_periods_late)) {
    const uint32_t late = MISTAKE_IS(one_period_late) ? 1 : 2, now = firmware_acted - 1;
    memcpy(firmware_waiting[now % 3], action, sizeof action);
    if (now < late) return;
    flappy_controller_act(c, firmware_waiting[(now - late) % 3]);
    return;
  }
  flappy_controller_act(c, action);
}

static void firmware_tick(uint32_t now_us) {
  flappy_controller *c = &firmware_controller;
  float y;
  if (firmware_ticks++ > 0) (void)flappy_controller_tick(c, now_us);
  if (firmware_wants) {
    flappy_controller_begin(c);
    flappy_policy_reset(&firmware_policy);
    firmware_begin_us = now_us;
    firmware_wants = 0;
    firmware_acts = 1;
  }
  if (MISTAKE_IS(never_back) && firmware_acts) c->handed_back = 0;
  if (MISTAKE_IS(back_early) && firmware_acts && now_us - firmware_begin_us >= 260000U) c->handed_back = 1;
  if (firmware_acts) firmware_act();
  flappy_controller_steer(c);
  if (MISTAKE_IS(difference_and_bias_swapped)) {
    y = c->input.difference_V;
    c->input.difference_V = c->input.bias_V;
    c->input.bias_V = y;
  }
  if (MISTAKE_IS(bias_sign)) c->input.bias_V = -c->input.bias_V;
  if (MISTAKE_IS(split_mirrored)) c->input.split_cycle = -c->input.split_cycle;
}

/* Voltages of the left and of the right motor from now on. */
void firmware_volts(double at_us, double *volts) {
  const uint32_t now_us = firmware_clock(at_us);
  flappy_controller *c = &firmware_controller;
  while ((int32_t)(now_us - firmware_tick_us) >= 0) {
    firmware_tick(firmware_tick_us);
    firmware_tick_us += FLAPPY_CONTROLLER_CONTROL_US;
  }
  for (; (int32_t)(now_us - firmware_drive_us) >= 0; firmware_drive_us += FLAPPY_CONTROLLER_DRIVE_US) {
    const float fraction = flappy_beat_fraction(c->phase), most = 9.0F;
    float left, right;
    flappy_controller_drive(c, &left, &right);
    if (MISTAKE_IS(not_clipped)) {
      left = flappy_voltage(1.0F, &c->input, fraction, 1e6F);
      right = flappy_voltage(-1.0F, &c->input, fraction, 1e6F);
    }
    if (MISTAKE_IS(clipped_low)) left = flappy_within(left, most), right = flappy_within(right, most);
    firmware_held[0] = left;
    firmware_held[1] = right;
    if (MISTAKE_IS(shares)) firmware_held[0] *= 0.45, firmware_held[1] *= 0.45;
    if (MISTAKE_IS(wings_swapped)) firmware_held[0] = right, firmware_held[1] = left;
  }
  memcpy(volts, firmware_held, sizeof firmware_held);
}
