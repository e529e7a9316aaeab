/* Of each output, the largest difference from what the training server computed for the vectors above; NaN counts as 1e30. */
static inline void flappy_policy_selftest_errors(float error[FLAPPY_POLICY_ACT]) {
  uint32_t v, i;
  for (i = 0; i < FLAPPY_POLICY_ACT; ++i) error[i] = 0.0F;
  for (v = 0; v < FLAPPY_POLICY_VECTORS; ++v) {
    float action[FLAPPY_POLICY_ACT];
    (void)flappy_policy_step(flappy_policy_test_obs[v], action);
    for (i = 0; i < FLAPPY_POLICY_ACT; ++i) {
      const float difference = flappy_abs(action[i] - flappy_policy_test_action[v][i]);
      if (!(difference <= error[i])) error[i] = difference <= 1e30F ? difference : 1e30F;
    }
  }
}

/* 0: this build computes what was trained. Otherwise one of the codes, the first that is found. It never aborts. */
static inline int flappy_policy_selftest(void) {
  float error[FLAPPY_POLICY_ACT], obs[FLAPPY_POLICY_OBS];
  uint32_t i, bad;
  if (flappy_policy_crc32() != FLAPPY_POLICY_CRC32) return FLAPPY_POLICY_FAILED_CRC;
  flappy_policy_selftest_errors(error);
  for (i = 0; i < FLAPPY_POLICY_ACT; ++i)
    if (!(error[i] <= flappy_policy_tolerance[i])) return FLAPPY_POLICY_FAILED_VECTOR;
  for (bad = 0; bad < FLAPPY_POLICY_OBS; ++bad) {
    flappy_float nan;
    nan.bits = 0x7fc00000U;
    for (i = 0; i < FLAPPY_POLICY_OBS; ++i) obs[i] = i == bad ? nan.number : flappy_policy_test_obs[0][i];
    if (flappy_policy_step(obs, error) == 0) return FLAPPY_POLICY_FAILED_NAN;
    for (i = 0; i < FLAPPY_POLICY_ACT; ++i)
      if (!(error[i] >= 0.0F && error[i] <= 0.0F)) return FLAPPY_POLICY_FAILED_NAN;
  }
  return 0;
}
