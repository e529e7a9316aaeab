/* No feedback controller: its output is 0. */
static inline flappy_wing_beat flappy_feedback_trim(const flappy_feedback *m) {
  flappy_wing_beat u;
  (void)m;
  u.amplitude_V = u.difference_V = u.bias_V = u.split_cycle = 0.0F;
  return u;
}

static inline flappy_wing_beat flappy_feedback_update(flappy_feedback *m, const flappy_motion *x, const flappy_setpoint *ref) {
  (void)x;
  (void)ref;
  return flappy_feedback_trim(m);
}

static inline void flappy_feedback_start(flappy_feedback *m, const flappy_motion *x) {
  (void)x;
  m->none = 0.0F;
}

static inline void flappy_feedback_unlearn(const flappy_feedback *before, flappy_feedback *now) { *now = *before; }
