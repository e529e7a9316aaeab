static inline uint32_t flappy_controller_crc_words(uint32_t crc, const int32_t *words, uint32_t count) {
  uint32_t i;
  for (i = 0; i < count; ++i) crc = flappy_crc32_word(crc, (uint32_t)words[i]);
  return crc;
}

/* Of all constants, the trace included. */
static inline uint32_t flappy_controller_crc(void) {
  uint32_t crc = flappy_crc32(0, (const float *)&flappy_controller_k, (uint32_t)(sizeof flappy_controller_k / sizeof(float)));
  crc = flappy_crc32(crc, flappy_controller_path, 24 * FLAPPY_CONTROLLER_SEGMENTS);
  crc = flappy_controller_crc_words(crc, flappy_controller_path_start, FLAPPY_CONTROLLER_SEGMENTS);
#if FLAPPY_CONTROLLER_INPUTS > 0
  crc = flappy_crc32(crc, flappy_controller_mix, 7 * FLAPPY_CONTROLLER_INPUTS);
#endif
  crc = flappy_crc32(crc, flappy_controller_test_state, FLAPPY_CONTROLLER_TEST_STATE);
  crc = flappy_controller_crc_words(crc, flappy_controller_test_clock, FLAPPY_CONTROLLER_TEST_CLOCK);
  crc = flappy_crc32(crc, flappy_controller_test_ring, 6 * FLAPPY_CONTROLLER_TEST_RING);
  crc = flappy_controller_crc_words(crc, flappy_controller_test_ring_us, 2 * FLAPPY_CONTROLLER_TEST_RING);
  crc = flappy_crc32(crc, flappy_controller_test_imu, 6 * FLAPPY_CONTROLLER_TEST_IMU);
  crc = flappy_controller_crc_words(crc, flappy_controller_test_imu_us, 2 * FLAPPY_CONTROLLER_TEST_IMU);
  crc = flappy_crc32(crc, flappy_controller_test_frames, 7 * FLAPPY_CONTROLLER_TEST_FRAMES);
  crc = flappy_controller_crc_words(crc, flappy_controller_test_frames_us, 3 * FLAPPY_CONTROLLER_TEST_FRAMES);
  crc = flappy_crc32(crc, flappy_controller_test_periods, 21 * FLAPPY_CONTROLLER_TEST_PERIODS);
  crc = flappy_controller_crc_words(crc, flappy_controller_test_handed_back, FLAPPY_CONTROLLER_TEST_PERIODS);
  return flappy_crc32(crc, flappy_controller_test_driven, FLAPPY_CONTROLLER_TEST_WIDTH * FLAPPY_CONTROLLER_TEST_UPDATES);
}

static inline flappy_vector flappy_vector_from(const float *x) { return flappy_vector_of(x[0], x[1], x[2]); }

static inline void flappy_controller_test_begin(flappy_controller *c, uint32_t zero_us) {
  const int32_t *clock = flappy_controller_test_clock;
  const flappy_vector none = flappy_vector_of(0.0F, 0.0F, 0.0F);
  float *to = (float *)&c->estimator;
  const float *from = flappy_controller_test_state;
  flappy_quaternion upright;
  uint32_t i;
  upright.w = 1.0F;
  upright.x = upright.y = upright.z = 0.0F;
  flappy_controller_start(c, zero_us, none, upright);
  for (i = 0; i < sizeof c->estimator / sizeof(float); ++i) to[i] = *from++;
  to = (float *)&c->estimate;
  for (i = 0; i < sizeof c->estimate / sizeof(float); ++i) to[i] = *from++;
  to = (float *)&c->feedback;
  for (i = 0; i < sizeof c->feedback / sizeof(float); ++i) to[i] = *from++;
  c->tick = (uint32_t)clock[0];
  c->phase = (uint32_t)clock[1];
  c->handed_back = clock[2];
  c->horizon_us = zero_us + (uint32_t)clock[3];
  c->present_us = zero_us + (uint32_t)clock[4];
  c->last_imu_us = c->pushed_us = zero_us + (uint32_t)clock[5];
  for (i = 0; i < FLAPPY_CONTROLLER_TEST_RING; ++i) {
    flappy_period *p = &c->ring[c->in_ring];
    p->gained.rotation_rad = flappy_vector_from(flappy_controller_test_ring + 6 * i);
    p->gained.velocity_m_s = flappy_vector_from(flappy_controller_test_ring + 6 * i + 3);
    p->from_us = zero_us + (uint32_t)flappy_controller_test_ring_us[2 * i];
    p->to_us = zero_us + (uint32_t)flappy_controller_test_ring_us[2 * i + 1];
    c->newest = p->gained;
    c->newest_us = p->to_us - p->from_us;
    if (flappy_after(p->to_us, c->horizon_us) && c->in_ring < FLAPPY_CONTROLLER_RING - 1) ++c->in_ring;
  }
}

static inline float flappy_controller_largest(float error, float is, float should_be) {
  const float difference = flappy_abs(is - should_be) / (flappy_abs(should_be) + 0.1F);
  if (is <= should_be && is >= should_be) return error; /* infinities, too */
  return difference <= error ? error : difference <= 1e30F ? difference : 1e30F; /* of NaN: 1e30 */
}

/* Flies c through the trace; the largest difference from what the training server computed, as a share of the number plus
   0.1. Times wrap half-way. */
static inline float flappy_controller_test_fly(flappy_controller *c) {
  const uint32_t length_us = FLAPPY_CONTROLLER_TEST_PERIODS * FLAPPY_CONTROLLER_CONTROL_US;
  const uint32_t zero_us = 0U - length_us / 2;
  uint32_t period, i, imu = 0, frame = 0, update = 0, drive_us;
  float error = 0.0F;
  flappy_controller_test_begin(c, zero_us);
  drive_us = (uint32_t)flappy_controller_test_clock[6];
  for (period = 0; period < FLAPPY_CONTROLLER_TEST_PERIODS; ++period) {
    const float *should_be = flappy_controller_test_periods + 21 * period; /* added, input, estimate */
    const float *is = (const float *)&c->input;
    const uint32_t end_us = (period + 1) * FLAPPY_CONTROLLER_CONTROL_US;
    flappy_controller_act(c, should_be);
    should_be += 4;
    flappy_controller_steer(c);
    for (i = 0; i < 4; ++i) error = flappy_controller_largest(error, is[i], *should_be++);
    for (; drive_us < end_us && update < FLAPPY_CONTROLLER_TEST_UPDATES; drive_us += FLAPPY_CONTROLLER_DRIVE_US, ++update) {
      float driven[FLAPPY_CONTROLLER_TEST_WIDTH];
#if FLAPPY_CONTROLLER_INPUTS > 0
      flappy_controller_inputs(c, driven);
#else
      flappy_controller_drive(c, &driven[0], &driven[1]);
#endif
      for (i = 0; i < FLAPPY_CONTROLLER_TEST_WIDTH; ++i)
        error = flappy_controller_largest(error, driven[i], flappy_controller_test_driven[FLAPPY_CONTROLLER_TEST_WIDTH * update + i]);
    }
    for (; imu < FLAPPY_CONTROLLER_TEST_IMU; ++imu) {
      const int32_t *us = flappy_controller_test_imu_us + 2 * imu; /* taken, arrived */
      const float *x = flappy_controller_test_imu + 6 * imu;
      if (us[1] > (int32_t)end_us) break;
      (void)flappy_controller_imu(c, zero_us + (uint32_t)us[0], flappy_vector_from(x), flappy_vector_from(x + 3));
    }
    for (; frame < FLAPPY_CONTROLLER_TEST_FRAMES; ++frame) {
      const int32_t *us = flappy_controller_test_frames_us + 3 * frame; /* taken, arrived, valid */
      const float *x = flappy_controller_test_frames + 7 * frame;
      flappy_quaternion q;
      if (us[1] > (int32_t)end_us) break;
      q.w = x[3];
      q.x = x[4];
      q.y = x[5];
      q.z = x[6];
      (void)flappy_controller_pose(c, zero_us + (uint32_t)us[0], us[2] != 0, flappy_vector_from(x), q);
    }
    if (flappy_controller_tick(c, zero_us + end_us) != flappy_controller_test_handed_back[period]) error = 1e30F;
    is = (const float *)&c->estimate;
    for (i = 0; i < 13; ++i) error = flappy_controller_largest(error, is[i], *should_be++);
  }
  return error;
}

/* 0 where all bits agree. */
static inline float flappy_controller_selftest_error(void) {
  flappy_controller c;
  return flappy_controller_test_fly(&c);
}

static inline int flappy_all_finite(const float *numbers, uint32_t bytes) {
  uint32_t i;
  for (i = 0; i < bytes / sizeof(float); ++i)
    if (!(flappy_abs(numbers[i]) <= 1e30F)) return 0;
  return 1;
}

/* 0: this build flies as was trained. Otherwise one of the codes, the first that is found. It never aborts. */
static inline int flappy_controller_selftest(void) {
  flappy_controller c;
  uint32_t bad, i, now_us;
  flappy_float nan;
  flappy_motion seen;
  if (flappy_controller_crc() != FLAPPY_CONTROLLER_CRC32) return FLAPPY_CONTROLLER_FAILED_CRC;
  if (!(flappy_controller_test_fly(&c) <= 1e-4F)) return FLAPPY_CONTROLLER_FAILED_TRACE;
  nan.bits = 0x7fc00000U;
  for (bad = 0; bad < 15; ++bad) { /* a NaN in each number, and quaternions of length 0 and 4 */
    float x[13];
    flappy_quaternion q;
    for (i = 0; i < 13; ++i) x[i] = i == bad ? nan.number : 0.0F;
    now_us = c.now_us + FLAPPY_CONTROLLER_CONTROL_US;
    if (flappy_controller_imu(&c, now_us, flappy_vector_from(x), flappy_vector_from(x + 3)) != (bad >= 6))
      return FLAPPY_CONTROLLER_FAILED_NAN;
    q.w = bad == 9 ? nan.number : bad == 13 ? 0.0F : bad == 14 ? 2.0F : 1.0F;
    q.x = bad == 14 ? 2.0F : x[10];
    q.y = bad == 14 ? 2.0F : x[11];
    q.z = bad == 14 ? 2.0F : x[12];
    if (bad >= 6 && !flappy_controller_pose(&c, now_us, 1, flappy_vector_from(x + 6), q)) return FLAPPY_CONTROLLER_FAILED_NAN;
    if (bad >= 6 && c.frames[c.in_frames - 1].valid > 0.0F) return FLAPPY_CONTROLLER_FAILED_NAN;
    (void)flappy_controller_tick(&c, now_us);
    flappy_controller_steer(&c);
    if (!flappy_all_finite((const float *)&c.estimator, (uint32_t)sizeof c.estimator) ||
        !flappy_all_finite((const float *)&c.estimate, (uint32_t)sizeof c.estimate) ||
        !flappy_all_finite((const float *)&c.feedback, (uint32_t)sizeof c.feedback))
      return FLAPPY_CONTROLLER_FAILED_NAN;
  }
  seen = c.estimate;
  seen.body_rate_rad_s.y = nan.number;
  (void)flappy_controller_tick_with(&c, c.now_us + FLAPPY_CONTROLLER_CONTROL_US, &seen);
  if (!flappy_all_finite((const float *)&c.estimate, (uint32_t)sizeof c.estimate)) return FLAPPY_CONTROLLER_FAILED_NAN;
  seen.attitude.w = nan.number;
  if (flappy_controller_start(&c, c.now_us, c.estimate.position_m, seen.attitude) ||
      !flappy_all_finite((const float *)&c.estimate, (uint32_t)sizeof c.estimate))
    return FLAPPY_CONTROLLER_FAILED_NAN;
  return 0;
}
