/* The nearest whole number that 8 bits hold, ties to even. */
static inline int8_t flappy_policy_rounded(float x) {
  const float to_whole = 12582912.0F;
  return (int8_t)((flappy_clamp(x, -127.0F, 127.0F) + to_whole) - to_whole);
}

#if FLAPPY_POLICY_MEMORY > 0
static inline void flappy_policy_round_memory(const float *memory, int8_t *to) {
  uint32_t i;
  for (i = 0; i < FLAPPY_POLICY_MEMORY; ++i) to[i] = flappy_policy_rounded(127.0F * memory[i]);
}
#endif

/* One layer: adds to the sum of every output its inputs, each times a weight. Four outputs at a time share what they read. */
static inline const int8_t *flappy_policy_layer(const int8_t *weights, const int8_t *in, uint32_t inputs, int32_t *sum,
                                                uint32_t outputs) {
  uint32_t o, i;
  for (o = 0; o + 4 <= outputs; o += 4, weights += 4 * inputs) {
    const int8_t *w0 = weights, *w1 = w0 + inputs, *w2 = w1 + inputs, *w3 = w2 + inputs;
    int32_t s0 = sum[o], s1 = sum[o + 1], s2 = sum[o + 2], s3 = sum[o + 3];
    for (i = 0; i < inputs; ++i) {
      const int32_t x = in[i];
      s0 += *w0++ * x;
      s1 += *w1++ * x;
      s2 += *w2++ * x;
      s3 += *w3++ * x;
    }
    sum[o] = s0;
    sum[o + 1] = s1;
    sum[o + 2] = s2;
    sum[o + 3] = s3;
  }
  for (o = outputs & ~3U; o < outputs; ++o) /* said once more, or gcc 12 warns that o might wrap */
    for (i = 0; i < inputs; ++i) sum[o] += *weights++ * (int32_t)in[i];
  return weights;
}

/* Observation in, action out, both in the units of the tables above. An observation with a NaN in it is refused: it returns 1,
   all actions are 0, and a state is left as it is. Otherwise it returns 0. Weights and activations are
   whole numbers of 8 bits, sums of 32; each sum is scaled by its multiplier. */
#if FLAPPY_POLICY_MEMORY > 0
static inline int flappy_policy_step_with(flappy_policy_state *state, const float obs[FLAPPY_POLICY_OBS],
                                          float action[FLAPPY_POLICY_ACT]) {
#else
static inline int flappy_policy_step(const float obs[FLAPPY_POLICY_OBS], float action[FLAPPY_POLICY_ACT]) {
#endif
  static const uint32_t widths[FLAPPY_POLICY_LAYERS + 1] = FLAPPY_POLICY_WIDTHS;
  int8_t values[FLAPPY_POLICY_WIDEST];
  int32_t sum[FLAPPY_POLICY_WIDEST];
  const int8_t *weights = flappy_policy_weights;
  const int32_t *bias = flappy_policy_bias;
  const float *multiplier = flappy_policy_multiplier;
  uint32_t layer, i;
  int refused = 0;
#if FLAPPY_POLICY_MEMORY > 0
  int32_t gates[3 * FLAPPY_POLICY_MEMORY];
  float of[2][3 * FLAPPY_POLICY_MEMORY], memory[FLAPPY_POLICY_MEMORY];
#endif
  for (i = 0; i < FLAPPY_POLICY_OBS; ++i) {
    const float x = (obs[i] - flappy_policy_mean[i]) * flappy_policy_scale[i];
    refused |= flappy_is_nan(x);
    values[i] = flappy_policy_rounded(x);
  }
#if FLAPPY_POLICY_MEMORY > 0
  for (layer = 0; layer < 2; ++layer) { /* sums over the observation, then over the memory */
    for (i = 0; i < 3 * FLAPPY_POLICY_MEMORY; ++i) gates[i] = *bias++;
    weights = flappy_policy_layer(weights, values, layer == 0 ? FLAPPY_POLICY_OBS : FLAPPY_POLICY_MEMORY, gates,
                                  3 * FLAPPY_POLICY_MEMORY);
    for (i = 0; i < 3 * FLAPPY_POLICY_MEMORY; ++i) of[layer][i] = (float)gates[i] * *multiplier++;
    flappy_policy_round_memory(state->unit, values);
  }
  for (i = 0; i < FLAPPY_POLICY_MEMORY; ++i) memory[i] = state->unit[i];
  flappy_policy_remember(of[0], of[1], memory);
  flappy_policy_round_memory(memory, values);
  for (i = 0; i < FLAPPY_POLICY_MEMORY; ++i) state->unit[i] = refused ? state->unit[i] : memory[i];
#endif
  for (layer = FLAPPY_POLICY_MEMORY > 0; layer < FLAPPY_POLICY_LAYERS; ++layer) {
    const uint32_t outputs = widths[layer + 1];
    for (i = 0; i < outputs; ++i) sum[i] = *bias++;
    weights = flappy_policy_layer(weights, values, widths[layer], sum, outputs);
    for (i = 0; i < outputs; ++i) {
      const float y = (float)sum[i] * *multiplier++;
      if (layer + 1 < FLAPPY_POLICY_LAYERS) values[i] = flappy_policy_rounded(FLAPPY_POLICY_HIDDEN(y));
      else action[i] = refused ? 0.0F : flappy_fma(flappy_policy_half[i], flappy_tanh(y), flappy_policy_middle[i]);
    }
  }
  return refused;
}

static inline uint32_t flappy_policy_crc32(void) {
  uint32_t crc = 0, i;
  crc = flappy_crc32(crc, flappy_policy_mean, FLAPPY_POLICY_OBS);
  crc = flappy_crc32(crc, flappy_policy_scale, FLAPPY_POLICY_OBS);
  crc = flappy_crc32(crc, flappy_policy_middle, FLAPPY_POLICY_ACT);
  crc = flappy_crc32(crc, flappy_policy_half, FLAPPY_POLICY_ACT);
  crc = flappy_crc32(crc, flappy_policy_multiplier, FLAPPY_POLICY_NEURONS);
  for (i = 0; i < FLAPPY_POLICY_NEURONS; ++i) crc = flappy_crc32_word(crc, (uint32_t)flappy_policy_bias[i]);
  for (i = 0; i < FLAPPY_POLICY_WEIGHTS; ++i) crc = flappy_crc32_word(crc, (uint32_t)flappy_policy_weights[i]);
  return crc;
}
