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
    value[i] = flappy_fma(flappy_fma(flappy_fma(a[5], t, a[4]), t, a[3]), t, a[2]);
    value[i] = flappy_fma(flappy_fma(value[i], t, a[1]), t, a[0]);
    rate[i] = flappy_fma(flappy_fma(5.0F * a[5], t, 4.0F * a[4]), t, 3.0F * a[3]);
    rate[i] = flappy_fma(flappy_fma(rate[i], t, 2.0F * a[2]), t, a[1]);
    bend[i] = flappy_fma(flappy_fma(flappy_fma(20.0F * a[5], t, 12.0F * a[4]), t, 6.0F * a[3]), t, 2.0F * a[2]);
  }
  s.position_m = flappy_vector_of(value[0], value[1], value[2]);
  s.velocity_m_s = flappy_vector_of(rate[0], rate[1], rate[2]);
  s.acceleration_m_s2 = flappy_vector_of(bend[0], bend[1], bend[2]);
  s.heading = flappy_sin_cos_wide(value[3]);
  s.heading_rate_rad_s = rate[3];
  return s;
}

static inline float flappy_within(float x, float limit) { return flappy_clamp(x, -limit, limit); }
