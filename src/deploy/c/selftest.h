#if FLAPPY_POLICY_MEMORY == 0
/* For callers that serve policies of both kinds. */
static inline int flappy_policy_step_with(flappy_policy_state *state, const float obs[FLAPPY_POLICY_OBS],
                                          float action[FLAPPY_POLICY_ACT]) {
  (void)state;
  return flappy_policy_step(obs, action);
}
#endif

/* The same as a function of FLAPPY_POLICY_IN numbers to FLAPPY_POLICY_OUT: observation to action, each with the state behind
   it if there is one. */
static inline int flappy_policy_of(const float in[FLAPPY_POLICY_IN], float out[FLAPPY_POLICY_OUT]) {
#if FLAPPY_POLICY_MEMORY > 0
  flappy_policy_state state;
  uint32_t i;
  int refused;
  for (i = 0; i < FLAPPY_POLICY_MEMORY; ++i) state.unit[i] = in[FLAPPY_POLICY_OBS + i];
  refused = flappy_policy_step_with(&state, in, out);
  for (i = 0; i < FLAPPY_POLICY_MEMORY; ++i) out[FLAPPY_POLICY_ACT + i] = state.unit[i];
  return refused;
#else
  return flappy_policy_step(in, out);
#endif
}

/* Of each output, the largest difference from what the training server computed for the vectors above; NaN counts as 1e30. */
static inline void flappy_policy_selftest_errors(float error[FLAPPY_POLICY_OUT]) {
  uint32_t v, i;
  for (i = 0; i < FLAPPY_POLICY_OUT; ++i) error[i] = 0.0F;
  for (v = 0; v < FLAPPY_POLICY_VECTORS; ++v) {
    float out[FLAPPY_POLICY_OUT];
    (void)flappy_policy_of(flappy_policy_test_obs[v], out);
    for (i = 0; i < FLAPPY_POLICY_OUT; ++i) {
      const float difference = flappy_abs(out[i] - flappy_policy_test_action[v][i]);
      if (!(difference <= error[i])) error[i] = difference <= 1e30F ? difference : 1e30F;
    }
  }
}

/* 0: this build computes what was trained. Otherwise one of the codes, the first that is found. It never aborts. */
static inline int flappy_policy_selftest(void) {
  float out[FLAPPY_POLICY_OUT], in[FLAPPY_POLICY_IN];
  uint32_t i, bad;
  if (flappy_policy_crc32() != FLAPPY_POLICY_CRC32) return FLAPPY_POLICY_FAILED_CRC;
  flappy_policy_selftest_errors(out);
  for (i = 0; i < FLAPPY_POLICY_OUT; ++i)
    if (!(out[i] <= flappy_policy_tolerance[i])) return FLAPPY_POLICY_FAILED_VECTOR;
  for (bad = 0; bad < FLAPPY_POLICY_OBS; ++bad) {
    flappy_float nan;
    nan.bits = 0x7fc00000U;
    for (i = 0; i < FLAPPY_POLICY_IN; ++i) in[i] = i == bad ? nan.number : flappy_policy_test_obs[FLAPPY_POLICY_VECTORS - 1][i];
    if (flappy_policy_of(in, out) == 0) return FLAPPY_POLICY_FAILED_NAN;
    for (i = 0; i < FLAPPY_POLICY_OUT; ++i) {
      const float right = i < FLAPPY_POLICY_ACT ? 0.0F : in[FLAPPY_POLICY_OBS + i - FLAPPY_POLICY_ACT];
      if (!(out[i] >= right && out[i] <= right)) return FLAPPY_POLICY_FAILED_NAN;
    }
  }
  return 0;
}
