/* Numbers that the estimator and the controller remember; all members of the first three are float. */
typedef struct {
  flappy_quaternion attitude;
  flappy_vector position_m, velocity_m_s; /* of the point where the IMU sits, in W */
} flappy_pose;

/* Turn and velocity gained over some time, in B at its middle, as measured. */
typedef struct {
  flappy_vector turn_rad, velocity_m_s;
} flappy_increment;

typedef struct {
  flappy_pose horizon, now;
  flappy_vector gyro_bias_rad_s, accel_bias_m_s2;
  float angle, angle_bias, gyro_bias; /* covariance: of each axis of the angle and the gyro's bias */
  float position, position_velocity, position_bias, velocity, velocity_bias, accel_bias; /* of position and so on */
  flappy_increment gathered;                  /* since the last control tick */
  flappy_vector body_rate_rad_s;              /* of the newest samples, bias taken out */
  float angle_innovation, position_innovation; /* of the last pose: r.r/S, three degrees of freedom each */
} flappy_estimator;

typedef struct {
  float integral_x, integral_y, integral_z;          /* m/s^2, m/s^2 in W; V */
  float integral_roll, integral_pitch, integral_yaw; /* V, V, split cycle */
  flappy_vector velocity_m_s, body_rate_rad_s;       /* low-passed */
} flappy_pid;

/* Motion of the torso origin. */
typedef struct {
  flappy_vector position_m;
  flappy_quaternion attitude;
  flappy_vector velocity_m_s;    /* in W */
  flappy_vector body_rate_rad_s; /* in B */
} flappy_motion;

typedef struct {
  float amplitude_V, difference_V, bias_V, split_cycle;
} flappy_wing_beat;

typedef struct {
  float sin, cos;
} flappy_sin_cos;

/* What the IMU gathered in one control period. Times are those of what was measured: the samples', less their lag. */
typedef struct {
  flappy_increment gained;
  uint32_t from_us, to_us;
} flappy_period;

typedef struct {
  flappy_vector position_m;
  flappy_quaternion attitude;
  float valid; /* 0 or 1 */
  uint32_t taken_us;
} flappy_frame;

typedef struct {
  flappy_estimator estimator;
  flappy_motion estimate; /* at now_us */
  flappy_pid pid;
  float added[4];         /* by the policy: V, V, V, split cycle */
  flappy_wing_beat input; /* before the driver clips it */
  uint32_t phase;         /* of the wing beat, 2^32 each */
  uint32_t tick, segment; /* control periods since the start; of the path */
  uint32_t now_us;        /* the last tick */
  int handed_back, hovering;
  flappy_vector hover_m; /* where, and facing whereto */
  flappy_sin_cos hover_heading;
  uint32_t horizon_us, present_us; /* of estimator.horizon and estimator.now */
  uint32_t last_imu_us, pushed_us; /* the last sample; the last one that is in the ring */
  flappy_increment newest;         /* in the ring, or already behind the horizon */
  uint32_t newest_us;              /* how long it took; 0: none yet */
  flappy_period ring[FLAPPY_CONTROLLER_RING]; /* beyond the horizon, oldest first, from `oldest` on */
  uint32_t oldest, in_ring;
  flappy_frame frames[FLAPPY_CONTROLLER_FRAMES]; /* until the IMU has covered their time, oldest first */
  uint32_t in_frames;
} flappy_controller;

/* Mathematics: the error of each function is a few units in the last place. */

typedef struct {
  flappy_vector x, y, z; /* rows */
} flappy_matrix;

/* Correctly rounded; NaN below 0. */
static inline float flappy_sqrt(float x) {
  flappy_float f;
  int32_t exponent;
  uint64_t mantissa, rest, root = 0, bit = (uint64_t)1 << 48;
  f.number = x;
  if (!(x > 0.0F)) return x < 0.0F ? (x - x) / (x - x) : x;
  if (f.bits >= 0x7f800000U) return x;
  exponent = (int32_t)(f.bits >> 23);
  mantissa = f.bits & 0x007fffffU;
  if (exponent > 0) {
    mantissa |= 0x00800000U;
  } else {
    for (exponent = 1; mantissa < 0x00800000U; --exponent) mantissa <<= 1;
  }
  /* x = mantissa 2^(exponent - 150); two bits more, or one, make the exponent even */
  mantissa <<= exponent % 2 != 0 ? 1 : 2;
  exponent -= exponent % 2 != 0 ? 151 : 152;
  for (rest = mantissa << 24; bit != 0; bit >>= 2) {
    if (rest >= root + bit) {
      rest -= root + bit;
      root = (root >> 1) + bit;
    } else {
      root >>= 1;
    }
  }
  /* root has one bit too many; half-way between two numbers there is none whose square is x */
  f.bits = ((uint32_t)(exponent / 2 + 138) << 23) + (uint32_t)((root + 1) >> 1);
  return f.number;
}

/* For |x| <= 1.75. */
static inline flappy_sin_cos flappy_sin_cos_of(float x) {
  const float u = x * x;
  float s = (float)2.5746579492065598e-6, c = (float)-2.5731345378016664e-7;
  flappy_sin_cos r;
  s = flappy_fma(s, u, (float)-0.00019795201602044300);
  s = flappy_fma(s, u, (float)0.0083328690443799029);
  s = flappy_fma(s, u, (float)-0.16666652095508948);
  c = flappy_fma(c, u, (float)0.000024740930771132188);
  c = flappy_fma(c, u, (float)-0.00138879694924598958);
  c = flappy_fma(c, u, (float)0.041666605729632825);
  c = flappy_fma(c, u, (float)-0.49999998687300314);
  r.sin = flappy_fma(x * u, s, x);
  r.cos = flappy_fma(u, c, 1.0F);
  return r;
}

/* Of any angle up to 1e4 rad. */
static inline flappy_sin_cos flappy_sin_cos_wide(float x) {
  const float to_whole = 12582912.0F, q = flappy_fma(x, (float)0.63661977236758138, to_whole) - to_whole;
  const float r = flappy_fma(-q, (float)7.549789954891882e-08,
                             flappy_fma(-q, (float)0.0004837512969970703, flappy_fma(-q, 1.5703125F, x)));
  const flappy_sin_cos near = flappy_sin_cos_of(r);
  const float turn = flappy_fma(-4.0F, (q * 0.25F + to_whole) - to_whole, q); /* quarters, from -2 to 2 */
  const int swap = turn * turn == 1.0F;
  const float s = swap ? near.cos : near.sin, c = swap ? near.sin : near.cos;
  flappy_sin_cos wide;
  wide.sin = turn < 0.0F || turn > 1.0F ? -s : s;
  wide.cos = turn > 0.0F || turn < -1.0F ? -c : c;
  return wide;
}

/* Of pi x for |x| <= 1. */
static inline flappy_sin_cos flappy_sin_cos_pi(float x) {
  const float a = flappy_abs(x), b = flappy_min(a, 1.0F - a), c = 0.5F - b; /* to the x axis, to the y axis */
  const flappy_sin_cos r = flappy_sin_cos_of(flappy_min(b, c) * (float)3.1415926535897931);
  flappy_sin_cos turned;
  turned.sin = flappy_copysign(b > c ? r.cos : r.sin, x);
  turned.cos = flappy_copysign(b > c ? r.sin : r.cos, 0.5F - a);
  return turned;
}

static inline float flappy_cos_pi(float x) {
  return flappy_sin_cos_of((0.5F - flappy_abs(x)) * (float)3.1415926535897931).sin;
}

static inline float flappy_atan2(float y, float x) {
  const float a = flappy_abs(x), b = flappy_abs(y), low = flappy_min(b, a), high = flappy_max(a, b);
  const int upper = low > high * (float)0.41421356237309505; /* then by tan(angle - pi / 4), halved */
  const float over = upper ? 0.5F * (low - high) : low, under = upper ? flappy_fma(0.5F, low, 0.5F * high) : high;
  const float t = over / (under == 0.0F ? 1.0F : under), u = t * t;
  float series = (float)-0.06078217923641205, octant, quadrant;
  series = flappy_fma(series, u, (float)0.10593843460083008);
  series = flappy_fma(series, u, (float)-0.14243541657924652);
  series = flappy_fma(series, u, (float)0.19998472929000854);
  series = flappy_fma(series, u, (float)-0.33333316445350647);
  octant = (upper ? (float)0.78539816339744828 : 0.0F) + flappy_fma(t * u, series, t);
  quadrant = b > a ? (float)1.5707963267948966 - octant : octant;
  return flappy_copysign(x < 0.0F ? (float)3.1415926535897931 - quadrant : quadrant, y);
}

/* Outside [-1, 1] as at the nearer end. */
static inline float flappy_asin(float x) {
  const float a = flappy_min(1.0F, flappy_abs(x));
  const int upper = a > 0.5F; /* then by pi / 2 - 2 asin(sqrt((1 - a) / 2)) */
  const float u = upper ? 0.5F * (1.0F - a) : a * a, s = upper ? flappy_sqrt(u) : a;
  float series = (float)0.042165011167526245, small;
  series = flappy_fma(series, u, (float)0.02418058179318905);
  series = flappy_fma(series, u, (float)0.045470092445611954);
  series = flappy_fma(series, u, (float)0.07495300471782684);
  series = flappy_fma(series, u, (float)0.16666752099990845);
  small = flappy_fma(s * u, series, s);
  return flappy_copysign(upper ? flappy_fma(-2.0F, small, (float)1.5707963267948966) : small, x);
}

static inline flappy_vector flappy_vector_of(float x, float y, float z) {
  flappy_vector v;
  v.x = x;
  v.y = y;
  v.z = z;
  return v;
}
static inline flappy_vector flappy_plus(flappy_vector a, flappy_vector b) {
  return flappy_vector_of(a.x + b.x, a.y + b.y, a.z + b.z);
}
static inline flappy_vector flappy_minus(flappy_vector a, flappy_vector b) {
  return flappy_vector_of(a.x - b.x, a.y - b.y, a.z - b.z);
}
static inline flappy_vector flappy_times(float s, flappy_vector a) {
  return flappy_vector_of(s * a.x, s * a.y, s * a.z);
}
/* a + s b. */
static inline flappy_vector flappy_add_scaled(flappy_vector a, float s, flappy_vector b) {
  return flappy_vector_of(flappy_fma(s, b.x, a.x), flappy_fma(s, b.y, a.y), flappy_fma(s, b.z, a.z));
}
/* a b + c d and a b - c d. */
static inline float flappy_sum2(float a, float b, float c, float d) { return flappy_fma(a, b, c * d); }
static inline float flappy_difference2(float a, float b, float c, float d) { return flappy_fma(a, b, -(c * d)); }
static inline float flappy_dot(flappy_vector a, flappy_vector b) {
  return flappy_fma(a.x, b.x, flappy_sum2(a.y, b.y, a.z, b.z));
}
static inline flappy_vector flappy_cross(flappy_vector a, flappy_vector b) {
  return flappy_vector_of(flappy_difference2(a.y, b.z, a.z, b.y), flappy_difference2(a.z, b.x, a.x, b.z),
                          flappy_difference2(a.x, b.y, a.y, b.x));
}
static inline flappy_vector flappy_turn(const flappy_matrix *m, flappy_vector v) {
  return flappy_vector_of(flappy_dot(m->x, v), flappy_dot(m->y, v), flappy_dot(m->z, v));
}
static inline flappy_vector flappy_turn_back(const flappy_matrix *m, flappy_vector v) {
  return flappy_vector_of(flappy_fma(m->x.x, v.x, flappy_sum2(m->y.x, v.y, m->z.x, v.z)),
                          flappy_fma(m->x.y, v.x, flappy_sum2(m->y.y, v.y, m->z.y, v.z)),
                          flappy_fma(m->x.z, v.x, flappy_sum2(m->y.z, v.y, m->z.z, v.z)));
}

static inline flappy_matrix flappy_rotation_matrix(flappy_quaternion q) {
  const float x2 = q.x + q.x, y2 = q.y + q.y, z2 = q.z + q.z;
  const float wx = q.w * x2, wy = q.w * y2, wz = q.w * z2, xx = q.x * x2, yy = q.y * y2, zz = q.z * z2;
  flappy_matrix m;
  m.x = flappy_vector_of(1.0F - (yy + zz), flappy_fma(q.x, y2, -wz), flappy_fma(q.x, z2, wy));
  m.y = flappy_vector_of(flappy_fma(q.x, y2, wz), 1.0F - (xx + zz), flappy_fma(q.y, z2, -wx));
  m.z = flappy_vector_of(flappy_fma(q.x, z2, -wy), flappy_fma(q.y, z2, wx), 1.0F - (xx + yy));
  return m;
}

/* Attitude after turning by the small rotation vector 2 e in B: q (1, e), brought back to length 1 by a Newton step. */
static inline flappy_quaternion flappy_turned(flappy_quaternion q, flappy_vector e) {
  flappy_quaternion r;
  float scale;
  r.w = q.w - flappy_fma(q.x, e.x, flappy_sum2(q.y, e.y, q.z, e.z));
  r.x = q.x + flappy_fma(q.w, e.x, flappy_difference2(q.y, e.z, q.z, e.y));
  r.y = q.y + flappy_fma(q.w, e.y, flappy_difference2(q.z, e.x, q.x, e.z));
  r.z = q.z + flappy_fma(q.w, e.z, flappy_difference2(q.x, e.y, q.y, e.x));
  scale = flappy_fma(-0.5F, flappy_fma(r.w, r.w, flappy_fma(r.x, r.x, flappy_sum2(r.y, r.y, r.z, r.z))), 1.5F);
  r.w *= scale;
  r.x *= scale;
  r.y *= scale;
  r.z *= scale;
  return r;
}

/* Rotation vector from attitude a to a near one, b: 2 asin(n)/n e for conj(a) b = (w, e) of either sign, |e| = n. */
static inline flappy_vector flappy_rotation_between(flappy_quaternion a, flappy_quaternion b) {
  const float w = flappy_fma(a.w, b.w, flappy_fma(a.x, b.x, flappy_sum2(a.y, b.y, a.z, b.z)));
  const flappy_vector e = flappy_vector_of(
      flappy_fma(a.w, b.x, -flappy_fma(a.x, b.w, flappy_difference2(a.y, b.z, a.z, b.y))),
      flappy_fma(a.w, b.y, -flappy_fma(a.y, b.w, flappy_difference2(a.z, b.x, a.x, b.z))),
      flappy_fma(a.w, b.z, -flappy_fma(a.z, b.w, flappy_difference2(a.x, b.y, a.y, b.x))));
  const float scale = flappy_fma((float)(1.0 / 3), flappy_dot(e, e), 2.0F);
  return flappy_times(w < 0.0F ? -scale : scale, e);
}

/* Where the nose points: cosine and sine of the yaw angle. */
static inline flappy_sin_cos flappy_heading(const flappy_matrix *m) {
  const float c = m->x.x, s = m->y.x;
  const float scale = 1.0F / flappy_sqrt(flappy_max(flappy_sum2(c, c, s, s), (float)1e-12));
  flappy_sin_cos heading;
  heading.sin = s * scale;
  heading.cos = c * scale;
  return heading;
}

/* Set points: quintic segments in x, y, z and heading over whole control ticks; the last one holds for ever. */

typedef struct {
  flappy_vector position_m, velocity_m_s, acceleration_m_s2; /* in W */
  flappy_sin_cos heading;
  float heading_rate_rad_s;
} flappy_setpoint;

/* At a tick; segment: where it was last, moved on here. */
static inline flappy_setpoint flappy_controller_setpoint(uint32_t tick, uint32_t *segment) {
  const float *a;
  float t, value[4], rate[4], bend[4];
  flappy_setpoint s;
  uint32_t i;
  while (*segment + 1 < FLAPPY_CONTROLLER_SEGMENTS && tick >= (uint32_t)flappy_controller_path_start[*segment + 1])
    ++*segment;
  t = (float)(tick - (uint32_t)flappy_controller_path_start[*segment]) * flappy_controller_k.period_s;
  a = flappy_controller_path + 24 * *segment;
  for (i = 0; i < 4; ++i, a += 6) {
    value[i] = flappy_fma(flappy_fma(flappy_fma(flappy_fma(flappy_fma(a[5], t, a[4]), t, a[3]), t, a[2]), t, a[1]), t, a[0]);
    rate[i] = flappy_fma(flappy_fma(flappy_fma(flappy_fma(5.0F * a[5], t, 4.0F * a[4]), t, 3.0F * a[3]), t, 2.0F * a[2]), t, a[1]);
    bend[i] = flappy_fma(flappy_fma(flappy_fma(20.0F * a[5], t, 12.0F * a[4]), t, 6.0F * a[3]), t, 2.0F * a[2]);
  }
  s.position_m = flappy_vector_of(value[0], value[1], value[2]);
  s.velocity_m_s = flappy_vector_of(rate[0], rate[1], rate[2]);
  s.acceleration_m_s2 = flappy_vector_of(bend[0], bend[1], bend[2]);
  s.heading = flappy_sin_cos_wide(value[3]);
  s.heading_rate_rad_s = rate[3];
  return s;
}

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
  const flappy_vector turn = flappy_minus(gained->turn_rad, flappy_times(duration, e->gyro_bias_rad_s));
  const flappy_vector quarter = flappy_times(0.25F * share, turn);
  const flappy_quaternion middle = flappy_turned(x->attitude, quarter);
  const flappy_matrix R = flappy_rotation_matrix(middle);
  flappy_vector v = flappy_minus(gained->velocity_m_s, flappy_times(duration, e->accel_bias_m_s2));
  v = flappy_turn(&R, flappy_times(share, v));
  v.z = flappy_fma(-time, flappy_controller_k.gravity_m_s2, v.z);
  x->position_m = flappy_add_scaled(x->position_m, time, flappy_add_scaled(x->velocity_m_s, 0.5F, v));
  x->velocity_m_s = flappy_plus(x->velocity_m_s, v);
  x->attitude = flappy_turned(middle, quarter);
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
  e->horizon.attitude = flappy_turned(e->horizon.attitude, flappy_times(0.5F * to_angle, angle));
  e->gyro_bias_rad_s = flappy_add_scaled(e->gyro_bias_rad_s, to_gyro, angle);
  e->gyro_bias = flappy_fma(-to_gyro, e->angle_bias, e->gyro_bias);
  e->angle_bias = flappy_fma(-to_angle, e->angle_bias, e->angle_bias);
  e->angle = flappy_fma(-to_angle, e->angle, e->angle);

  R = flappy_rotation_matrix(e->horizon.attitude);
  offset = flappy_minus(z->position_m, flappy_minus(e->horizon.position_m, flappy_turn(&R, k->imu_position_m)));
  per_position = 1.0F / (e->position + k->mocap_position_m2);
  if (seen) e->position_innovation = flappy_dot(offset, offset) * per_position;
  to_position = seen ? e->position * per_position : 0.0F;
  to_velocity = seen ? e->position_velocity * per_position : 0.0F;
  to_accel = seen ? e->position_bias * per_position : 0.0F;
  e->horizon.position_m = flappy_add_scaled(e->horizon.position_m, to_position, offset);
  e->horizon.velocity_m_s = flappy_add_scaled(e->horizon.velocity_m_s, to_velocity, offset);
  e->accel_bias_m_s2 = flappy_add_scaled(e->accel_bias_m_s2, to_accel, flappy_turn_back(&R, offset));
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
  c->estimator.gathered.turn_rad = c->estimator.gathered.velocity_m_s = none;
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
    e->body_rate_rad_s = flappy_minus(flappy_times(per_duration, c->newest.turn_rad), e->gyro_bias_rad_s);
    ahead_us = flappy_after(c->now_us, c->present_us) ? c->now_us - c->present_us : 0;
    if (ahead_us > FLAPPY_CONTROLLER_AHEAD_US) ahead_us = FLAPPY_CONTROLLER_AHEAD_US;
    if (ahead_us > 0) flappy_estimator_move(e, &ahead, &c->newest, ahead_us, c->newest_us);
  }
  R = flappy_rotation_matrix(ahead.attitude);
  c->estimate.position_m = flappy_minus(ahead.position_m, flappy_turn(&R, arm));
  c->estimate.attitude = ahead.attitude;
  c->estimate.velocity_m_s =
      flappy_minus(ahead.velocity_m_s, flappy_turn(&R, flappy_cross(e->body_rate_rad_s, arm)));
  c->estimate.body_rate_rad_s = e->body_rate_rad_s;
}

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

/* Cascaded PID: position P -> velocity PID -> lean angles -> attitude PID -> wing beat. f: forward, l: left, in the
   heading frame.
     v_sp = v_ref + k (p_ref - p)             e = v_sp - v        a_f,l = a_ref + PID(e)       V_z = PID(e_z)
     pitch_sp = atan(a_f / g)                 roll_sp = -atan(a_l cos(pitch_sp) / g)
     V_d = PID(roll_sp - roll)                V_0 = PID(pitch_sp - pitch)      d_sigma = PID(yaw_ref - yaw)
     V_amp = V_hover + V_z / (cos roll cos pitch)
   Derivatives come from low-passed velocity and body rate. Integrators are clamped, and stand still while what they drive
   is at its limit. */

static inline float flappy_within(float x, float limit) { return flappy_clamp(x, -limit, limit); }

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

static inline float flappy_attitude_pid(const flappy_gains *k, float *integral, float error, float rate_error,
                                        float limit) {
  const float out = flappy_fma(k->p, error, flappy_fma(k->d, rate_error, *integral));
  *integral = flappy_integrated(*integral, k, error, flappy_saturation(out, -limit, limit));
  return flappy_within(out, limit);
}

static inline float flappy_forward(flappy_sin_cos yaw, float x, float y) { return flappy_sum2(yaw.cos, x, yaw.sin, y); }
static inline float flappy_left(flappy_sin_cos yaw, float x, float y) {
  return flappy_difference2(yaw.cos, y, yaw.sin, x);
}

static inline float flappy_velocity_pid(const flappy_gains *k, float error, float slope, float sum) {
  return flappy_fma(k->p, error, flappy_fma(k->d, slope, sum));
}

static inline flappy_wing_beat flappy_pid_control(flappy_pid *m, const flappy_motion *x, const flappy_setpoint *ref) {
  const flappy_controller_constants *k = &flappy_controller_k;
  const flappy_matrix R = flappy_rotation_matrix(x->attitude);
  const flappy_sin_cos yaw = flappy_heading(&R);
  const flappy_vector before = m->velocity_m_s, way = flappy_minus(ref->position_m, x->position_m);
  const flappy_vector wanted = flappy_vector_of(
      flappy_within(flappy_fma(k->position_xy_1_s, way.x, ref->velocity_m_s.x), k->speed_limit_m_s),
      flappy_within(flappy_fma(k->position_xy_1_s, way.y, ref->velocity_m_s.y), k->speed_limit_m_s),
      flappy_within(flappy_fma(k->position_z_1_s, way.z, ref->velocity_m_s.z), k->climb_limit_m_s));
  const float a_most = k->acceleration_limit_m_s2, g = k->gravity_m_s2;
  flappy_vector slope, error, w;
  flappy_wing_beat u;
  float sum_f, sum_l, error_f, error_l, a_f, a_l, pitch_for_a, pitch_wanted, roll_for_a, roll_wanted, blocked_f, blocked_l;
  float step_f, step_l, roll, pitch, yaw_error, climb, lift;

  /* position, velocity, acceleration */
  m->velocity_m_s = flappy_add_scaled(before, k->velocity_share, flappy_minus(x->velocity_m_s, before));
  slope = flappy_times(k->per_period_Hz, flappy_minus(before, m->velocity_m_s)); /* of the error */
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
  m->body_rate_rad_s = flappy_add_scaled(m->body_rate_rad_s, k->rate_share,
                                         flappy_minus(x->body_rate_rad_s, m->body_rate_rad_s));
  w = m->body_rate_rad_s;
  u.difference_V = flappy_attitude_pid(&k->roll, &m->integral_roll, roll_wanted - roll, -w.x, k->difference_limit_V);
  u.bias_V = flappy_attitude_pid(&k->pitch, &m->integral_pitch, pitch_wanted - pitch, -w.y, k->bias_limit_V);
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
static inline flappy_wing_beat flappy_pid_trim(const flappy_pid *m) {
  flappy_wing_beat u;
  u.amplitude_V = flappy_controller_k.hover_V + m->integral_z;
  u.difference_V = m->integral_roll;
  u.bias_V = m->integral_pitch;
  u.split_cycle = m->integral_yaw;
  return u;
}

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

/* Of the beat, in [-1/2, 1/2). */
static inline float flappy_beat_fraction(uint32_t phase) { return (float)(int32_t)phase * 0x1p-32F; }

/* Interface. */

/* False for NaN, infinity and what no sensor shows. */
static inline int flappy_plausible(flappy_vector v, float limit) {
  return flappy_abs(v.x) <= limit && flappy_abs(v.y) <= limit && flappy_abs(v.z) <= limit;
}

/* A sample of an instant that is after b, but not much after the last tick. */
static inline int flappy_controller_timely(const flappy_controller *c, uint32_t taken_us, uint32_t b) {
  return flappy_after(taken_us, b) && !flappy_after(taken_us, c->now_us + 100000U);
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

/* At rest at this pose of the torso, integrators at 0; the task begins. */
static inline void flappy_controller_start(flappy_controller *c, uint32_t now_us, flappy_vector position_m,
                                           flappy_quaternion attitude) {
  const flappy_controller_constants *k = &flappy_controller_k;
  const flappy_vector none = flappy_vector_of(0.0F, 0.0F, 0.0F);
  const flappy_matrix R = flappy_rotation_matrix(attitude);
  flappy_estimator *e = &c->estimator;
  e->horizon.attitude = attitude;
  e->horizon.position_m = flappy_plus(position_m, flappy_turn(&R, k->imu_position_m));
  e->horizon.velocity_m_s = none;
  e->now = e->horizon;
  e->gyro_bias_rad_s = e->accel_bias_m_s2 = e->body_rate_rad_s = none;
  e->angle = k->start_angle_rad2;
  e->gyro_bias = k->start_gyro_bias_rad2_s2;
  e->position = k->start_position_m2;
  e->velocity = k->start_velocity_m2_s2;
  e->accel_bias = k->start_accel_bias_m2_s4;
  e->angle_bias = e->position_velocity = e->position_bias = e->velocity_bias = 0.0F;
  e->gathered.turn_rad = e->gathered.velocity_m_s = none;
  e->angle_innovation = e->position_innovation = 0.0F;
  c->estimate.position_m = position_m;
  c->estimate.attitude = attitude;
  c->estimate.velocity_m_s = c->estimate.body_rate_rad_s = none;
  c->pid.integral_x = c->pid.integral_y = c->pid.integral_z = 0.0F;
  c->pid.integral_roll = c->pid.integral_pitch = c->pid.integral_yaw = 0.0F;
  c->pid.velocity_m_s = c->pid.body_rate_rad_s = none;
  c->input.amplitude_V = c->input.difference_V = c->input.bias_V = c->input.split_cycle = 0.0F;
  c->phase = 0;
  c->now_us = c->last_imu_us = c->pushed_us = now_us;
  c->horizon_us = c->present_us = now_us - FLAPPY_CONTROLLER_IMU_LAG_US;
  c->newest.turn_rad = c->newest.velocity_m_s = none;
  c->newest_us = c->oldest = c->in_ring = c->in_frames = 0;
  flappy_controller_begin(c);
}

/* A sample of the IMU: its mean since the one before. It is dropped, and 0 returned, unless it is newer than that one, not
   from the future, and below 2,000 rad/s and 1e6 m/s^2: NaN and infinity never get in. */
static inline int flappy_controller_imu(flappy_controller *c, uint32_t taken_us, flappy_vector gyro_rad_s,
                                        flappy_vector accel_m_s2) {
  flappy_increment *sum = &c->estimator.gathered;
  flappy_vector turn, gained;
  float interval_s;
  if (!flappy_controller_timely(c, taken_us, c->last_imu_us)) return 0;
  if (!flappy_plausible(gyro_rad_s, 2000.0F) || !flappy_plausible(accel_m_s2, 1e6F)) return 0;
  interval_s = flappy_seconds(taken_us - c->last_imu_us);
  c->last_imu_us = taken_us;
  turn = flappy_times(interval_s, gyro_rad_s);
  gained = flappy_times(interval_s, accel_m_s2);
  /* the later sample, seen from the frame of the earlier ones */
  gained = flappy_plus(gained, flappy_times(0.5F, flappy_cross(sum->turn_rad, gained)));
  sum->velocity_m_s = flappy_minus(flappy_plus(sum->velocity_m_s, gained),
                                   flappy_times(0.5F, flappy_cross(turn, sum->velocity_m_s)));
  sum->turn_rad = flappy_plus(sum->turn_rad, turn);
  return 1;
}

/* A frame of the motion capture: the torso's pose when it was taken. A frame that is not valid (not tracked), or that is
   not finite, moves the horizon and corrects nothing. It is dropped, and 0 returned, unless it is newer than the one before
   and than the horizon, and not from the future. */
static inline int flappy_controller_pose(flappy_controller *c, uint32_t taken_us, int valid, flappy_vector position_m,
                                         flappy_quaternion attitude) {
  flappy_frame *f = &c->frames[c->in_frames < FLAPPY_CONTROLLER_FRAMES ? c->in_frames : 0];
  const uint32_t newest_us = c->in_frames > 0 ? c->frames[c->in_frames - 1].taken_us : c->horizon_us;
  if (c->in_frames == FLAPPY_CONTROLLER_FRAMES || !flappy_controller_timely(c, taken_us, newest_us)) return 0;
  if (!flappy_plausible(position_m, 20000.0F) || !(flappy_abs(attitude.w) <= 2.0F) ||
      !flappy_plausible(flappy_vector_of(attitude.x, attitude.y, attitude.z), 2.0F)) {
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

/* End of a control period: estimate, set point, hand-back. Returns whether it is handed back. */
static inline int flappy_controller_tick(flappy_controller *c, uint32_t now_us) {
  flappy_setpoint ref;
  c->now_us = now_us;
  flappy_controller_estimate(c);
  ++c->tick;
  ref = flappy_controller_reference(c, &c->segment);
  if (flappy_controller_arrived(c, &ref, (float)c->tick * flappy_controller_k.period_s)) c->handed_back = 1;
  return c->handed_back;
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

/* What the policy sees: the parts that its task shows, in this order. */
static inline void flappy_controller_observe(const flappy_controller *c, float obs[FLAPPY_CONTROLLER_OBS]) {
  const uint32_t parts = FLAPPY_CONTROLLER_PARTS;
  const flappy_motion *x = &c->estimate;
  const flappy_matrix R = flappy_rotation_matrix(x->attitude);
  const flappy_wing_beat trim = flappy_pid_trim(&c->pid);
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

/* Whether the policy is to act now. */
static inline int flappy_controller_policy_due(const flappy_controller *c) {
  return !c->handed_back && c->tick % FLAPPY_CONTROLLER_HOLD == 0;
}

/* What the policy adds from now on until the hand-back; what is not finite adds nothing. */
static inline void flappy_controller_act(flappy_controller *c, const float added[4]) {
  uint32_t i;
  for (i = 0; i < 4; ++i) c->added[i] = flappy_abs(added[i]) <= 1e6F ? added[i] : 0.0F;
}

/* Start of a control period: sets the inputs of the wing beat. */
static inline void flappy_controller_steer(flappy_controller *c) {
  const flappy_setpoint ref = flappy_controller_reference(c, &c->segment);
  const flappy_pid before = c->pid;
  flappy_wing_beat u = flappy_pid_control(&c->pid, &c->estimate, &ref);
  if (FLAPPY_CONTROLLER_HOLDS_TRIM && !c->handed_back) {
    const flappy_pid low_passed = c->pid;
    u = flappy_pid_trim(&before);
    c->pid = before;
    c->pid.velocity_m_s = low_passed.velocity_m_s;
    c->pid.body_rate_rad_s = low_passed.body_rate_rad_s;
  }
  c->input.amplitude_V = u.amplitude_V + (0.0F + (c->handed_back ? 0.0F : c->added[0]));
  c->input.difference_V = u.difference_V + (0.0F + (c->handed_back ? 0.0F : c->added[1]));
  c->input.bias_V = u.bias_V + (0.0F + (c->handed_back ? 0.0F : c->added[2]));
  c->input.split_cycle = u.split_cycle + (0.0F + (c->handed_back ? 0.0F : c->added[3]));
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
