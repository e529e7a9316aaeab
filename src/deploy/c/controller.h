/* Of the beat, in [-1/2, 1/2). */
static inline float flappy_beat_fraction(uint32_t phase) { return (float)(int32_t)phase * 0x1p-32F; }

/* Hand-back. */

static inline int flappy_shorter(flappy_vector v, float limit) { return flappy_dot(v, v) < limit * limit; }

/* Whether the policy's work is done. */
static inline int flappy_controller_arrived(const flappy_controller *c, const flappy_setpoint *ref, float time_s) {
  const flappy_controller_constants *k = &flappy_controller_k;
  const flappy_matrix R = flappy_rotation_matrix(c->estimate.attitude);
  const flappy_vector position = flappy_minus(c->estimate.position_m, ref->position_m);
  const flappy_vector velocity = flappy_minus(c->estimate.velocity_m_s, ref->velocity_m_s);
  const float facing = flappy_sum2(ref->heading.cos, R.x.x, ref->heading.sin, R.y.x);
  const float aside = flappy_difference2(ref->heading.cos, R.y.x, ref->heading.sin, R.x.x);
  const float heading_cos =
      facing / flappy_sqrt(flappy_max(flappy_sum2(facing, facing, aside, aside), (float)1e-12));
  const int there = position.x > k->hand_back_x_m && flappy_shorter(position, k->hand_back_distance_m) &&
                    flappy_abs(velocity.x) < k->hand_back_speed_x_m_s &&
                    flappy_shorter(velocity, k->hand_back_speed_m_s) && heading_cos > k->hand_back_heading_cos &&
                    R.z.z > k->hand_back_tilt_cos &&
                    flappy_shorter(c->estimate.body_rate_rad_s, k->hand_back_body_rate_rad_s);
  return FLAPPY_CONTROLLER_HANDS_BACK && (there || time_s >= k->hand_back_at_s);
}

/* Interface. */

/* What no sensor shows, along an axis: in the simulator a tumbling vehicle reaches 106 rad/s, and 512 m/s^2 with the IMU 4 cm
   from the origin. Of a quaternion: by how much the square of its length may differ from 1. */
#define FLAPPY_CONTROLLER_GYRO_LIMIT_RAD_S 200.0F
#define FLAPPY_CONTROLLER_ACCEL_LIMIT_M_S2 1000.0F
#define FLAPPY_CONTROLLER_POSITION_LIMIT_M 20000.0F
#define FLAPPY_CONTROLLER_LENGTH_LIMIT 0.1F

/* False for NaN and infinity too. */
static inline int flappy_plausible(flappy_vector v, float limit) {
  return flappy_abs(v.x) <= limit && flappy_abs(v.y) <= limit && flappy_abs(v.z) <= limit;
}
static inline int flappy_plausible_imu(flappy_vector gyro_rad_s, flappy_vector accel_m_s2) {
  return flappy_plausible(gyro_rad_s, FLAPPY_CONTROLLER_GYRO_LIMIT_RAD_S) &&
         flappy_plausible(accel_m_s2, FLAPPY_CONTROLLER_ACCEL_LIMIT_M_S2);
}
static inline int flappy_plausible_pose(flappy_vector position_m, flappy_quaternion q) {
  const float square = flappy_sum2(q.w, q.w, q.x, q.x) + flappy_sum2(q.y, q.y, q.z, q.z);
  return flappy_plausible(position_m, FLAPPY_CONTROLLER_POSITION_LIMIT_M) &&
         flappy_abs(square - 1.0F) < FLAPPY_CONTROLLER_LENGTH_LIMIT;
}

static inline int flappy_plausible_motion(const flappy_motion *x) {
  return flappy_plausible_pose(x->position_m, x->attitude) && flappy_plausible(x->velocity_m_s, 1e4F) &&
         flappy_plausible(x->body_rate_rad_s, 1e4F);
}

/* A sample of an instant that is after b, but no more than two control periods after the last tick: one from further ahead
   would have every good one refused until the clock has caught up. */
static inline int flappy_controller_timely(const flappy_controller *c, uint32_t taken_us, uint32_t b) {
  return flappy_after(taken_us, b) && !flappy_after(taken_us, c->now_us + 2U * FLAPPY_CONTROLLER_CONTROL_US);
}

/* The set point now. */
static inline flappy_setpoint flappy_controller_reference(const flappy_controller *c, uint32_t *segment) {
  flappy_setpoint s;
  if (!c->hovering) return flappy_controller_setpoint(c->tick, segment);
  s.position_m = c->hover_m;
  s.velocity_m_s = s.acceleration_m_s2 = flappy_vector_of(0.0F, 0.0F, 0.0F);
  s.heading = c->hover_heading;
  s.heading_rate_rad_s = 0.0F;
  return s;
}

/* A new task: its clock is at 0 and the policy acts; what estimator and controller have learnt stays. */
static inline void flappy_controller_begin(flappy_controller *c) {
  uint32_t i;
  c->tick = c->segment = 0;
  c->handed_back = c->hovering = 0;
  for (i = 0; i < 4; ++i) c->added[i] = flappy_controller_k.start_added[i];
#if FLAPPY_CONTROLLER_PAST > 0
  c->remembers = 0;
#endif
}

/* Feedback alone, to where the task begins and to stay there until flappy_controller_begin(): so the trim is learnt, to
   which a task that holds it adds no feedback until the hand-back. */
static inline void flappy_controller_hover(flappy_controller *c) {
  c->handed_back = c->hovering = 1;
  c->hover_m = flappy_controller_k.start_position_m;
  c->hover_heading = flappy_sin_cos_wide(flappy_controller_k.start_heading_rad);
}

/* Feedback alone, to stay at the present estimate. */
static inline void flappy_controller_stay(flappy_controller *c) {
  const flappy_matrix R = flappy_rotation_matrix(c->estimate.attitude);
  c->handed_back = c->hovering = 1;
  c->hover_m = c->estimate.position_m;
  c->hover_heading = flappy_heading(&R);
}

/* At rest at this pose of the torso, integrators at 0; the task begins. Returns 0, and starts level at the origin, if the pose is
   not finite or its quaternion not of length 1. */
static inline int flappy_controller_start(flappy_controller *c, uint32_t now_us, flappy_vector position_m,
                                          flappy_quaternion attitude) {
  const flappy_controller_constants *k = &flappy_controller_k;
  const flappy_vector none = flappy_vector_of(0.0F, 0.0F, 0.0F);
  const int plausible = flappy_plausible_pose(position_m, attitude);
  flappy_estimator *e = &c->estimator;
  flappy_matrix R;
  if (!plausible) {
    position_m = none;
    attitude.w = 1.0F;
    attitude.x = attitude.y = attitude.z = 0.0F;
  }
  R = flappy_rotation_matrix(attitude);
  e->horizon.attitude = attitude;
  e->horizon.position_m = flappy_plus(position_m, flappy_rotate(&R, k->imu_position_m));
  e->horizon.velocity_m_s = none;
  e->now = e->horizon;
  e->gyro_bias_rad_s = e->accel_bias_m_s2 = e->body_rate_rad_s = none;
  e->angle = k->start_angle_rad2;
  e->gyro_bias = k->start_gyro_bias_rad2_s2;
  e->position = k->start_position_m2;
  e->velocity = k->start_velocity_m2_s2;
  e->accel_bias = k->start_accel_bias_m2_s4;
  e->angle_bias = e->position_velocity = e->position_bias = e->velocity_bias = 0.0F;
  e->gathered.rotation_rad = e->gathered.velocity_m_s = none;
  e->angle_innovation = e->position_innovation = 0.0F;
  c->estimate.position_m = position_m;
  c->estimate.attitude = attitude;
  c->estimate.velocity_m_s = c->estimate.body_rate_rad_s = none;
  flappy_feedback_start(&c->feedback, &c->estimate);
  c->input.amplitude_V = c->input.difference_V = c->input.bias_V = c->input.split_cycle = 0.0F;
  c->phase = 0;
  c->now_us = c->last_imu_us = c->pushed_us = now_us;
  c->horizon_us = c->present_us = now_us - FLAPPY_CONTROLLER_IMU_LAG_US;
  c->newest.rotation_rad = c->newest.velocity_m_s = none;
  c->newest_us = c->oldest = c->in_ring = c->in_frames = 0;
  flappy_controller_hover(c);
  flappy_controller_begin(c);
  return plausible;
}

/* A sample of the IMU: its mean since the one before. It is dropped, and 0 returned, unless it is newer than that one, no
   more than two control periods after the last tick, and within the limits above: NaN and infinity never get in. */
static inline int flappy_controller_imu(flappy_controller *c, uint32_t taken_us, flappy_vector gyro_rad_s,
                                        flappy_vector accel_m_s2) {
  flappy_increment *sum = &c->estimator.gathered;
  flappy_vector turn, gained;
  float interval_s;
  if (!flappy_controller_timely(c, taken_us, c->last_imu_us)) return 0;
  if (!flappy_plausible_imu(gyro_rad_s, accel_m_s2)) return 0;
  interval_s = flappy_seconds(taken_us - c->last_imu_us);
  c->last_imu_us = taken_us;
  turn = flappy_times(interval_s, gyro_rad_s);
  gained = flappy_times(interval_s, accel_m_s2);
  /* the later sample, seen from the frame of the earlier ones */
  gained = flappy_plus(gained, flappy_times(0.5F, flappy_cross(sum->rotation_rad, gained)));
  sum->velocity_m_s = flappy_minus(flappy_plus(sum->velocity_m_s, gained),
                                   flappy_times(0.5F, flappy_cross(turn, sum->velocity_m_s)));
  sum->rotation_rad = flappy_plus(sum->rotation_rad, turn);
  return 1;
}

/* A frame of the motion capture: the torso's pose when it was taken. A frame that is not valid (not tracked), not finite, or
   whose quaternion is not of length 1, moves the horizon and corrects nothing. It is dropped, and 0 returned, unless it is
   newer than the one before and than the horizon, and no more than two control periods after the last tick. */
static inline int flappy_controller_pose(flappy_controller *c, uint32_t taken_us, int valid, flappy_vector position_m,
                                         flappy_quaternion attitude) {
  flappy_frame *f = &c->frames[c->in_frames < FLAPPY_CONTROLLER_FRAMES ? c->in_frames : 0];
  const uint32_t newest_us = c->in_frames > 0 ? c->frames[c->in_frames - 1].taken_us : c->horizon_us;
  if (c->in_frames == FLAPPY_CONTROLLER_FRAMES || !flappy_controller_timely(c, taken_us, newest_us)) return 0;
  if (!flappy_plausible_pose(position_m, attitude)) {
    valid = 0;
    position_m = flappy_vector_of(0.0F, 0.0F, 0.0F);
    attitude.w = 1.0F;
    attitude.x = attitude.y = attitude.z = 0.0F;
  }
  f->position_m = position_m;
  f->attitude = attitude;
  f->valid = valid ? 1.0F : 0.0F;
  f->taken_us = taken_us;
  ++c->in_frames;
  return 1;
}

/* Set point and hand-back at the end of a control period. */
static inline int flappy_controller_advance(flappy_controller *c) {
  flappy_setpoint ref;
  ++c->tick;
  ref = flappy_controller_reference(c, &c->segment);
  if (flappy_controller_arrived(c, &ref, (float)c->tick * flappy_controller_k.period_s)) c->handed_back = 1;
  return c->handed_back;
}

/* End of a control period: estimate, set point, hand-back. Returns whether it is handed back. */
static inline int flappy_controller_tick(flappy_controller *c, uint32_t now_us) {
  c->now_us = now_us;
  flappy_controller_estimate(c);
  return flappy_controller_advance(c);
}

/* The same where the autopilot around it estimates: no sample is passed then. An estimate that is not finite, or whose quaternion
   is not of length 1, is dropped: the last one stays. */
static inline int flappy_controller_tick_with(flappy_controller *c, uint32_t now_us, const flappy_motion *estimate) {
  c->now_us = now_us;
  if (flappy_plausible_motion(estimate)) c->estimate = *estimate;
  return flappy_controller_advance(c);
}

static inline float *flappy_put(float *row, flappy_vector v) {
  row[0] = v.x;
  row[1] = v.y;
  row[2] = v.z;
  return row + 3;
}
static inline float *flappy_put4(float *row, float a, float b, float c, float d) {
  row[0] = a;
  row[1] = b;
  row[2] = c;
  row[3] = d;
  return row + 4;
}

/* The parts that the task shows, in this order, as they are now. */
static inline void flappy_controller_see(const flappy_controller *c, float *obs) {
  const uint32_t parts = FLAPPY_CONTROLLER_PARTS;
  const flappy_motion *x = &c->estimate;
  const flappy_matrix R = flappy_rotation_matrix(x->attitude);
  const flappy_wing_beat trim = flappy_feedback_trim(&c->feedback);
  uint32_t segment = c->segment;
  const flappy_setpoint ref = flappy_controller_reference(c, &segment);
  const float cos = ref.heading.cos, sin = ref.heading.sin;
  float *row = obs;
  if (parts & 1U) row = flappy_put(flappy_put(flappy_put(row, R.x), R.y), R.z); /* rotation matrix */
  if (parts & 2U) row = flappy_put(row, flappy_minus(x->position_m, ref.position_m));
  if (parts & 4U) row = flappy_put(row, flappy_minus(x->velocity_m_s, ref.velocity_m_s));
  if (parts & 8U) row = flappy_put(row, x->body_rate_rad_s);
  if (parts & 16U) { /* phase of the wing beat */
    const float fraction = flappy_beat_fraction(c->phase);
    const flappy_sin_cos beat = flappy_sin_cos_pi(fraction + fraction);
    *row++ = beat.sin;
    *row++ = beat.cos;
  }
  if (parts & 32U) { /* heading error */
    const flappy_sin_cos yaw = flappy_heading(&R);
    *row++ = flappy_difference2(yaw.sin, cos, yaw.cos, sin);
    *row++ = flappy_sum2(yaw.cos, cos, yaw.sin, sin);
  }
  if (parts & 64U) row = flappy_put4(row, c->added[0], c->added[1], c->added[2], c->added[3]);
  if (parts & 128U) { /* attitude as seen from the heading of the set point */
    const flappy_vector minus_x = flappy_vector_of(-R.x.x, -R.x.y, -R.x.z);
    row = flappy_put(row, flappy_add_scaled(flappy_times(cos, R.x), sin, R.y));
    row = flappy_put(row, flappy_add_scaled(flappy_times(cos, R.y), sin, minus_x));
    row = flappy_put(row, R.z);
  }
  if (parts & 256U) *row++ = (float)c->tick * flappy_controller_k.period_s;
  if (parts & 512U) row = flappy_put4(row, trim.amplitude_V, trim.difference_V, trim.bias_V, trim.split_cycle);
  (void)row;
}

/* What the policy sees: the parts as they are now, then as they were at its last actions. */
static inline void flappy_controller_observe(const flappy_controller *c, float obs[FLAPPY_CONTROLLER_OBS]) {
  flappy_controller_see(c, obs);
#if FLAPPY_CONTROLLER_PAST > 0
  {
    const uint32_t now = FLAPPY_CONTROLLER_OBS - FLAPPY_CONTROLLER_PAST;
    uint32_t i;
    for (i = 0; i < FLAPPY_CONTROLLER_PAST; ++i) obs[now + i] = c->remembers ? c->past[i] : obs[i % now];
  }
#endif
}

/* Whether the policy is to act now. */
static inline int flappy_controller_policy_due(const flappy_controller *c) {
  return !c->handed_back && c->tick % FLAPPY_CONTROLLER_ACTION_REPEAT == 0;
}

/* What the policy adds from now on until the hand-back; what is not finite adds nothing. */
static inline void flappy_controller_act(flappy_controller *c, const float added[4]) {
  uint32_t i;
#if FLAPPY_CONTROLLER_PAST > 0
  float obs[FLAPPY_CONTROLLER_OBS];
  flappy_controller_observe(c, obs);
  for (i = 0; i < FLAPPY_CONTROLLER_PAST; ++i) c->past[i] = obs[i];
  c->remembers = 1;
#endif
  for (i = 0; i < 4; ++i) c->added[i] = flappy_abs(added[i]) <= 1e6F ? added[i] : 0.0F;
}

/* Start of a control period: sets the inputs of the wing beat. */
static inline void flappy_controller_steer(flappy_controller *c) {
  const flappy_setpoint ref = flappy_controller_reference(c, &c->segment);
  const flappy_feedback before = c->feedback;
  flappy_wing_beat u = flappy_feedback_update(&c->feedback, &c->estimate, &ref);
  if (FLAPPY_CONTROLLER_HOLDS_TRIM && !c->handed_back) {
    u = flappy_feedback_trim(&before);
    flappy_feedback_unlearn(&before, &c->feedback);
  }
  c->input.amplitude_V = u.amplitude_V + (0.0F + (c->handed_back ? 0.0F : c->added[0]));
  c->input.difference_V = u.difference_V + (0.0F + (c->handed_back ? 0.0F : c->added[1]));
  c->input.bias_V = u.bias_V + (0.0F + (c->handed_back ? 0.0F : c->added[2]));
  c->input.split_cycle = u.split_cycle + (0.0F + (c->handed_back ? 0.0F : c->added[3]));
}

#if FLAPPY_CONTROLLER_INPUTS > 0
/* After flappy_controller_steer(): the robot's inputs for a control period; their places are FLAPPY_CONTROLLER_INPUT_<name>. */
static inline void flappy_controller_inputs(const flappy_controller *c, float inputs[FLAPPY_CONTROLLER_INPUTS]) {
  const flappy_wing_beat *u = &c->input;
  uint32_t i;
  for (i = 0; i < FLAPPY_CONTROLLER_INPUTS; ++i) {
    const float *k = flappy_controller_mix + 7 * i; /* neutral, of each of the four, lowest, highest */
    float sum = flappy_fma(k[1], u->amplitude_V, k[0]);
    sum = flappy_fma(k[2], u->difference_V, sum);
    sum = flappy_fma(k[3], u->bias_V, sum);
    sum = flappy_fma(k[4], u->split_cycle, sum);
    inputs[i] = flappy_clamp(sum, k[5], k[6]);
  }
}
#else
/* Driver. Within a beat of fraction t in [0, 1):
     V = A cos(pi t / s) + V_0              for t < s
     V = A cos(pi (t - 1) / (1 - s)) + V_0  after
     left:  A = V_amp + V_d, s = 0.5 - d_sigma      right: A = V_amp - V_d, s = 0.5 + d_sigma */
static inline float flappy_voltage(float side, const flappy_wing_beat *u, float fraction, float limit) {
  const float s = 0.5F - side * u->split_cycle;
  const float t = fraction < 0.0F ? fraction + 1.0F : fraction;
  const float x = t < s ? t / s : (t - 1.0F) / (1.0F - s);
  const float amplitude = flappy_fma(side, u->difference_V, u->amplitude_V);
  return flappy_within(flappy_fma(amplitude, flappy_cos_pi(x), u->bias_V), limit);
}

/* Every FLAPPY_CONTROLLER_DRIVE_US: voltages that hold until the next call. */
static inline void flappy_controller_drive(flappy_controller *c, float *left_V, float *right_V) {
  const flappy_controller_constants *k = &flappy_controller_k;
  const float fraction = flappy_beat_fraction(c->phase);
  flappy_wing_beat u;
  u.amplitude_V = flappy_clamp(c->input.amplitude_V, 0.0F, k->driver_amplitude_V);
  u.difference_V = flappy_within(c->input.difference_V, k->driver_difference_V);
  u.bias_V = flappy_within(c->input.bias_V, k->driver_bias_V);
  u.split_cycle = flappy_within(c->input.split_cycle, k->driver_split_cycle);
  *left_V = flappy_voltage(1.0F, &u, fraction, k->left_limit_V);
  *right_V = flappy_voltage(-1.0F, &u, fraction, k->right_limit_V);
  c->phase += FLAPPY_CONTROLLER_PHASE_STEP;
}
#endif
