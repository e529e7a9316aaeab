/* Estimator: error-state Kalman filter with delayed motion capture. A late pose belongs to the past: the filter keeps its
   state at the time of the last pose (the horizon) and the IMU's increments since. A new pose moves the horizon up to its
   own time through them and corrects there; the rest of them is run again up to now. Errors, true = estimate + error:
     angle' = -bias_g - noise_g      position' = velocity      velocity' = -R bias_a - R noise_a      biases drift */

static inline float flappy_seconds(uint32_t us) { return (float)us / 1e6F; }

/* a is later than b; differences of times may wrap. */
static inline int flappy_after(uint32_t a, uint32_t b) { return (int32_t)(a - b) > 0; }

/* Moves a pose by what the IMU gained in part_us of whole_us. */
static inline void flappy_estimator_move(const flappy_estimator *e, flappy_pose *x, const flappy_increment *gained,
                                         uint32_t part_us, uint32_t whole_us) {
  const float share = (float)part_us / (float)whole_us, duration = flappy_seconds(whole_us), time = share * duration;
  const flappy_vector turn = flappy_minus(gained->rotation_rad, flappy_times(duration, e->gyro_bias_rad_s));
  const flappy_vector quarter = flappy_times(0.25F * share, turn);
  const flappy_quaternion middle = flappy_rotated(x->attitude, quarter);
  const flappy_matrix R = flappy_rotation_matrix(middle);
  flappy_vector v = flappy_minus(gained->velocity_m_s, flappy_times(duration, e->accel_bias_m_s2));
  v = flappy_rotate(&R, flappy_times(share, v));
  v.z = flappy_fma(-time, flappy_controller_k.gravity_m_s2, v.z);
  x->position_m = flappy_add_scaled(x->position_m, time, flappy_add_scaled(x->velocity_m_s, 0.5F, v));
  x->velocity_m_s = flappy_plus(x->velocity_m_s, v);
  x->attitude = flappy_rotated(middle, quarter);
}

/* Uncertainty grows with time. */
static inline void flappy_estimator_spread(flappy_estimator *e, float time) {
  const flappy_controller_constants *k = &flappy_controller_k;
  e->angle = flappy_fma(
      time, k->angle_noise_rad2_s + flappy_difference2(time, e->gyro_bias, 2.0F, e->angle_bias), e->angle);
  e->angle_bias = flappy_fma(-time, e->gyro_bias, e->angle_bias);
  e->gyro_bias = flappy_fma(time, k->gyro_bias_drift_rad2_s3, e->gyro_bias);
  e->position = flappy_fma(time, flappy_sum2(2.0F, e->position_velocity, time, e->velocity), e->position);
  e->position_velocity = flappy_fma(
      time, e->velocity - flappy_fma(time, e->velocity_bias, e->position_bias), e->position_velocity);
  e->position_bias = flappy_fma(time, e->velocity_bias, e->position_bias);
  e->velocity = flappy_fma(
      time, k->velocity_noise_m2_s3 + flappy_difference2(time, e->accel_bias, 2.0F, e->velocity_bias), e->velocity);
  e->velocity_bias = flappy_fma(-time, e->accel_bias, e->velocity_bias);
  e->accel_bias = flappy_fma(time, k->accel_bias_drift_m2_s5, e->accel_bias);
}

/* Corrects the horizon by a pose taken at its time; a frame that is not valid changes nothing. */
static inline void flappy_estimator_correct(flappy_estimator *e, const flappy_frame *z) {
  const flappy_controller_constants *k = &flappy_controller_k;
  const int seen = z->valid > 0.0F;
  const flappy_vector angle = flappy_rotation_between(e->horizon.attitude, z->attitude);
  const float per_angle = 1.0F / (e->angle + k->mocap_angle_rad2);
  const float to_angle = seen ? e->angle * per_angle : 0.0F, to_gyro = seen ? e->angle_bias * per_angle : 0.0F;
  flappy_matrix R;
  flappy_vector offset;
  float per_position, to_position, to_velocity, to_accel;
  if (seen) e->angle_innovation = flappy_dot(angle, angle) * per_angle;
  e->horizon.attitude = flappy_rotated(e->horizon.attitude, flappy_times(0.5F * to_angle, angle));
  e->gyro_bias_rad_s = flappy_add_scaled(e->gyro_bias_rad_s, to_gyro, angle);
  e->gyro_bias = flappy_fma(-to_gyro, e->angle_bias, e->gyro_bias);
  e->angle_bias = flappy_fma(-to_angle, e->angle_bias, e->angle_bias);
  e->angle = flappy_fma(-to_angle, e->angle, e->angle);

  R = flappy_rotation_matrix(e->horizon.attitude);
  offset = flappy_minus(z->position_m, flappy_minus(e->horizon.position_m, flappy_rotate(&R, k->imu_position_m)));
  per_position = 1.0F / (e->position + k->mocap_position_m2);
  if (seen) e->position_innovation = flappy_dot(offset, offset) * per_position;
  to_position = seen ? e->position * per_position : 0.0F;
  to_velocity = seen ? e->position_velocity * per_position : 0.0F;
  to_accel = seen ? e->position_bias * per_position : 0.0F;
  e->horizon.position_m = flappy_add_scaled(e->horizon.position_m, to_position, offset);
  e->horizon.velocity_m_s = flappy_add_scaled(e->horizon.velocity_m_s, to_velocity, offset);
  e->accel_bias_m_s2 = flappy_add_scaled(e->accel_bias_m_s2, to_accel, flappy_rotate_back(&R, offset));
  e->accel_bias = flappy_fma(-to_accel, e->position_bias, e->accel_bias);
  e->velocity_bias = flappy_fma(-to_velocity, e->position_bias, e->velocity_bias);
  e->velocity = flappy_fma(-to_velocity, e->position_velocity, e->velocity);
  e->position_bias = flappy_fma(-to_position, e->position_bias, e->position_bias);
  e->position_velocity = flappy_fma(-to_position, e->position_velocity, e->position_velocity);
  e->position = flappy_fma(-to_position, e->position, e->position);
}

/* Moves the horizon up to a time through the oldest increments; what lies behind it leaves the ring. */
static inline void flappy_controller_move_horizon(flappy_controller *c, uint32_t target_us) {
  while (c->in_ring > 0) {
    const flappy_period *oldest = &c->ring[c->oldest];
    const uint32_t until_us = flappy_after(oldest->to_us, target_us) ? target_us : oldest->to_us;
    if (!flappy_after(target_us, oldest->from_us)) return;
    if (flappy_after(until_us, c->horizon_us)) {
      const uint32_t part_us = until_us - c->horizon_us;
      flappy_estimator_move(&c->estimator, &c->estimator.horizon, &oldest->gained, part_us,
                            oldest->to_us - oldest->from_us);
      flappy_estimator_spread(&c->estimator, flappy_seconds(part_us));
      c->horizon_us = until_us;
    }
    if (flappy_after(oldest->to_us, target_us)) return;
    c->oldest = (c->oldest + 1) % FLAPPY_CONTROLLER_RING;
    --c->in_ring;
  }
}

/* Moves the present through an increment, or the part of it beyond the horizon. */
static inline void flappy_controller_replay(flappy_controller *c, const flappy_period *p) {
  const uint32_t from_us = flappy_after(c->horizon_us, p->from_us) ? c->horizon_us : p->from_us;
  flappy_estimator_move(&c->estimator, &c->estimator.now, &p->gained, p->to_us - from_us, p->to_us - p->from_us);
  c->present_us = p->to_us;
}

/* What was gathered becomes the newest increment; for want of room the oldest one joins the horizon. */
static inline int flappy_controller_push(flappy_controller *c) {
  flappy_period *p;
  const flappy_vector none = flappy_vector_of(0.0F, 0.0F, 0.0F);
  if (c->pushed_us == c->last_imu_us) return 0;
  if (c->in_ring == FLAPPY_CONTROLLER_RING) flappy_controller_move_horizon(c, c->ring[c->oldest].to_us);
  p = &c->ring[(c->oldest + c->in_ring) % FLAPPY_CONTROLLER_RING];
  ++c->in_ring;
  p->gained = c->newest = c->estimator.gathered;
  p->from_us = c->pushed_us - FLAPPY_CONTROLLER_IMU_LAG_US;
  p->to_us = c->last_imu_us - FLAPPY_CONTROLLER_IMU_LAG_US;
  c->newest_us = p->to_us - p->from_us;
  c->pushed_us = c->last_imu_us;
  c->estimator.gathered.rotation_rad = c->estimator.gathered.velocity_m_s = none;
  return 1;
}

/* Fuses the frames whose time the IMU has covered, oldest first; says how many. */
static inline uint32_t flappy_controller_fuse(flappy_controller *c) {
  const uint32_t covered_us =
      c->in_ring > 0 ? c->ring[(c->oldest + c->in_ring - 1) % FLAPPY_CONTROLLER_RING].to_us : c->horizon_us;
  uint32_t fused = 0, i;
  while (fused < c->in_frames && !flappy_after(c->frames[fused].taken_us, covered_us)) {
    const flappy_frame *f = &c->frames[fused++];
    if (flappy_after(c->horizon_us, f->taken_us)) continue; /* for want of room in the ring */
    flappy_controller_move_horizon(c, f->taken_us);
    flappy_estimator_correct(&c->estimator, f);
  }
  c->in_frames -= fused;
  for (i = 0; i < c->in_frames; ++i) c->frames[i] = c->frames[i + fused];
  return fused;
}

/* The estimate at now_us, from all that has arrived. */
static inline void flappy_controller_estimate(flappy_controller *c) {
  flappy_estimator *e = &c->estimator;
  const flappy_vector arm = flappy_controller_k.imu_position_m;
  flappy_matrix R;
  flappy_pose ahead;
  uint32_t i, ahead_us;
  const int pushed = flappy_controller_push(c);
  if (flappy_controller_fuse(c) > 0) {
    e->now = e->horizon;
    c->present_us = c->horizon_us;
    for (i = 0; i < c->in_ring; ++i) flappy_controller_replay(c, &c->ring[(c->oldest + i) % FLAPPY_CONTROLLER_RING]);
  } else if (pushed) {
    flappy_controller_replay(c, &c->ring[(c->oldest + c->in_ring - 1) % FLAPPY_CONTROLLER_RING]);
  }
  ahead = e->now;
  if (c->newest_us > 0) {
    const float per_duration = 1e6F / (float)c->newest_us;
    e->body_rate_rad_s = flappy_minus(flappy_times(per_duration, c->newest.rotation_rad), e->gyro_bias_rad_s);
    ahead_us = flappy_after(c->now_us, c->present_us) ? c->now_us - c->present_us : 0;
    if (ahead_us > FLAPPY_CONTROLLER_AHEAD_US) ahead_us = FLAPPY_CONTROLLER_AHEAD_US;
    if (ahead_us > 0) flappy_estimator_move(e, &ahead, &c->newest, ahead_us, c->newest_us);
  }
  R = flappy_rotation_matrix(ahead.attitude);
  c->estimate.position_m = flappy_minus(ahead.position_m, flappy_rotate(&R, arm));
  c->estimate.attitude = ahead.attitude;
  c->estimate.velocity_m_s =
      flappy_minus(ahead.velocity_m_s, flappy_rotate(&R, flappy_cross(e->body_rate_rad_s, arm)));
  c->estimate.body_rate_rad_s = e->body_rate_rad_s;
}
