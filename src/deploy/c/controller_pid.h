/* Cascaded PID: position P -> velocity PID -> lean angles -> attitude PID -> wing beat. f: forward, l: left, in the
   heading frame.
     v_sp = v_ref + k (p_ref - p)             e = v_sp - v        a_f,l = a_ref + PID(e)       V_z = PID(e_z)
     pitch_sp = atan(a_f / g)                 roll_sp = -atan(a_l cos(pitch_sp) / g)
     V_d = PID(roll_sp - roll)                V_0 = PID(pitch_sp - pitch)      d_sigma = PID(yaw_ref - yaw)
     V_amp = V_hover + V_z / (cos roll cos pitch)
   Derivatives come from low-passed velocity and body rate. Integrators are clamped, and stand still while what they drive
   is at its limit. */

/* +1 or -1 where x is at its limit, else 0. */
static inline float flappy_saturation(float x, float low, float high) {
  return x > high ? 1.0F : x < low ? -1.0F : 0.0F;
}

/* Adds to an integral in the unit of the output, within its limit, and not further out while blocked. */
static inline float flappy_integrated(float integral, const flappy_gains *k, float error, float blocked_towards) {
  const float step = (k->i * flappy_controller_k.period_s) * error;
  const float moved = flappy_within(integral + step, k->integral_limit);
  return step * blocked_towards > 0.0F ? integral : moved;
}

/* A step of a second-order notch at the wing beat, in transposed direct form II. */
static inline float flappy_notched(float x, flappy_feedback *m) {
  const flappy_feedback_constants *k = &flappy_controller_k.feedback;
  const float y = flappy_fma(k->notch_near, x, m->notch_next);
  m->notch_next = flappy_fma(k->notch_far, x - y, m->notch_after);
  m->notch_after = flappy_difference2(k->notch_near, x, k->notch_back, y);
  return y;
}

static inline float flappy_attitude(const flappy_gains *k, float *integral, float error, float out, float limit) {
  *integral = flappy_integrated(*integral, k, error, flappy_saturation(out, -limit, limit));
  return flappy_within(out, limit);
}

static inline float flappy_attitude_pid(const flappy_gains *k, float *integral, float error, float rate_error,
                                        float limit) {
  return flappy_attitude(k, integral, error, flappy_fma(k->p, error, flappy_fma(k->d, rate_error, *integral)), limit);
}

static inline float flappy_forward(flappy_sin_cos yaw, float x, float y) { return flappy_sum2(yaw.cos, x, yaw.sin, y); }
static inline float flappy_left(flappy_sin_cos yaw, float x, float y) {
  return flappy_difference2(yaw.cos, y, yaw.sin, x);
}

static inline float flappy_velocity_pid(const flappy_gains *k, float error, float slope, float sum) {
  return flappy_fma(k->p, error, flappy_fma(k->d, slope, sum));
}

static inline flappy_wing_beat flappy_feedback_update(flappy_feedback *m, const flappy_motion *x, const flappy_setpoint *ref) {
  const flappy_feedback_constants *k = &flappy_controller_k.feedback;
  const flappy_controller_constants *loop = &flappy_controller_k;
  const flappy_matrix R = flappy_rotation_matrix(x->attitude);
  const flappy_sin_cos yaw = flappy_heading(&R);
  const flappy_vector before = m->velocity_m_s, way = flappy_minus(ref->position_m, x->position_m);
  const flappy_vector wanted = flappy_vector_of(
      flappy_within(flappy_fma(k->position_xy_1_s, way.x, ref->velocity_m_s.x), k->speed_limit_m_s),
      flappy_within(flappy_fma(k->position_xy_1_s, way.y, ref->velocity_m_s.y), k->speed_limit_m_s),
      flappy_within(flappy_fma(k->position_z_1_s, way.z, ref->velocity_m_s.z), k->climb_limit_m_s));
  const float a_most = k->acceleration_limit_m_s2, g = loop->gravity_m_s2;
  flappy_vector slope, error, w;
  flappy_wing_beat u;
  float sum_f, sum_l, error_f, error_l, a_f, a_l, pitch_for_a, pitch_wanted, roll_for_a, roll_wanted, blocked_f, blocked_l;
  float step_f, step_l, roll, pitch, yaw_error, climb, lift;

  /* position, velocity, acceleration */
  m->velocity_m_s = flappy_add_scaled(before, loop->velocity_share, flappy_minus(x->velocity_m_s, before));
  slope = flappy_times(loop->per_period_Hz, flappy_minus(before, m->velocity_m_s)); /* of the error */
  error = flappy_minus(wanted, m->velocity_m_s);
  sum_f = flappy_forward(yaw, m->integral_x, m->integral_y);
  sum_l = flappy_left(yaw, m->integral_x, m->integral_y);
  error_f = flappy_forward(yaw, error.x, error.y);
  error_l = flappy_left(yaw, error.x, error.y);
  a_f = flappy_velocity_pid(&k->forward, error_f, flappy_forward(yaw, slope.x, slope.y),
                            sum_f + flappy_forward(yaw, ref->acceleration_m_s2.x, ref->acceleration_m_s2.y));
  a_l = flappy_velocity_pid(&k->left, error_l, flappy_left(yaw, slope.x, slope.y),
                            sum_l + flappy_left(yaw, ref->acceleration_m_s2.x, ref->acceleration_m_s2.y));

  /* lean */
  pitch_for_a = flappy_atan2(flappy_within(a_f, a_most), g);
  pitch_wanted = flappy_within(pitch_for_a, k->pitch_limit_rad);
  roll_for_a = -flappy_atan2(flappy_within(a_l, a_most) * flappy_sin_cos_of(pitch_wanted).cos, g);
  roll_wanted = flappy_within(roll_for_a, k->roll_limit_rad);
  blocked_f = flappy_saturation(a_f, -a_most, a_most) +
              flappy_saturation(pitch_for_a, -k->pitch_limit_rad, k->pitch_limit_rad);
  blocked_l = flappy_saturation(a_l, -a_most, a_most) -
              flappy_saturation(roll_for_a, -k->roll_limit_rad, k->roll_limit_rad);
  step_f = flappy_integrated(sum_f, &k->forward, error_f, blocked_f) - sum_f;
  step_l = flappy_integrated(sum_l, &k->left, error_l, blocked_l) - sum_l;
  m->integral_x += flappy_difference2(yaw.cos, step_f, yaw.sin, step_l);
  m->integral_y += flappy_sum2(yaw.sin, step_f, yaw.cos, step_l);
  roll = flappy_atan2(R.z.y, R.z.z);
  pitch = -flappy_asin(R.z.x);
  yaw_error = flappy_atan2(flappy_difference2(ref->heading.sin, yaw.cos, ref->heading.cos, yaw.sin),
                           flappy_sum2(ref->heading.cos, yaw.cos, ref->heading.sin, yaw.sin));

  /* wing beat */
  m->body_rate_rad_s = flappy_add_scaled(m->body_rate_rad_s, loop->rate_share,
                                         flappy_minus(x->body_rate_rad_s, m->body_rate_rad_s));
  w = m->body_rate_rad_s;
  u.difference_V = flappy_attitude_pid(&k->roll, &m->integral_roll, roll_wanted - roll, -w.x, k->difference_limit_V);
  if (k->notch_hz > 0.0F) {
    const float swing = flappy_notched(flappy_sum2(k->pitch.p, pitch_wanted - pitch, k->pitch.d, -w.y), m);
    u.bias_V = flappy_attitude(&k->pitch, &m->integral_pitch, pitch_wanted - pitch, swing + m->integral_pitch,
                               k->bias_limit_V);
  } else {
    u.bias_V = flappy_attitude_pid(&k->pitch, &m->integral_pitch, pitch_wanted - pitch, -w.y, k->bias_limit_V);
  }
  u.split_cycle = flappy_attitude_pid(&k->yaw, &m->integral_yaw, flappy_within(yaw_error, k->yaw_error_limit_rad),
                                      ref->heading_rate_rad_s - w.z, k->split_cycle_limit);

  /* climb */
  climb = flappy_velocity_pid(&k->up, error.z, slope.z, m->integral_z);
  lift = climb / flappy_max(R.z.z, 0.5F); /* cos roll cos pitch */
  m->integral_z = flappy_integrated(m->integral_z, &k->up, error.z, flappy_saturation(lift, k->lower_V, k->upper_V));
  u.amplitude_V = k->hover_V + flappy_clamp(lift, k->lower_V, k->upper_V);
  return u;
}

/* The inputs that its integrators have learnt: those of a settled vehicle. */
static inline flappy_wing_beat flappy_feedback_trim(const flappy_feedback *m) {
  flappy_wing_beat u;
  u.amplitude_V = flappy_controller_k.feedback.hover_V + m->integral_z;
  u.difference_V = m->integral_roll;
  u.bias_V = m->integral_pitch;
  u.split_cycle = m->integral_yaw;
  return u;
}

/* Integrators at 0. */
static inline void flappy_feedback_start(flappy_feedback *m, const flappy_motion *x) {
  m->integral_x = m->integral_y = m->integral_z = 0.0F;
  m->integral_roll = m->integral_pitch = m->integral_yaw = 0.0F;
  m->velocity_m_s = x->velocity_m_s;
  m->body_rate_rad_s = x->body_rate_rad_s;
  m->notch_next = m->notch_after = 0.0F;
}

/* Takes back what it learnt in the last period, but for its filters. */
static inline void flappy_feedback_unlearn(const flappy_feedback *before, flappy_feedback *now) {
  const flappy_feedback filtered = *now;
  *now = *before;
  now->velocity_m_s = filtered.velocity_m_s;
  now->body_rate_rad_s = filtered.body_rate_rad_s;
  now->notch_next = filtered.notch_next;
  now->notch_after = filtered.notch_after;
}
