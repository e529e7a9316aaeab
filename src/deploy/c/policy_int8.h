/* The nearest whole number that 8 bits hold, ties to even. */
static inline int8_t flappy_policy_rounded(float x) {
  const float to_whole = 12582912.0F;
  return (int8_t)((flappy_clamp(x, -127.0F, 127.0F) + to_whole) - to_whole);
}

/* Observation in, what is added to the feedback controller's output out, both in the units of the tables above. An
   observation with a NaN in it is refused: it returns 1 and adds nothing. Otherwise it returns 0. Weights and activations are
   whole numbers of 8 bits, sums of 32; each sum is scaled by its multiplier. */
static inline int flappy_policy_step(const float obs[FLAPPY_POLICY_OBS], float action[FLAPPY_POLICY_ACT]) {
  static const uint32_t widths[FLAPPY_POLICY_LAYERS + 1] = FLAPPY_POLICY_WIDTHS;
  int8_t values[2][FLAPPY_POLICY_WIDEST];
  const int8_t *weight = flappy_policy_weights;
  const int32_t *bias = flappy_policy_bias;
  const float *multiplier = flappy_policy_multiplier;
  uint32_t layer, o, i;
  int refused = 0;
  for (i = 0; i < FLAPPY_POLICY_OBS; ++i) {
    const float x = (obs[i] - flappy_policy_mean[i]) * flappy_policy_scale[i];
    refused |= x != x;
    values[0][i] = flappy_policy_rounded(x);
  }
  for (layer = 0; layer < FLAPPY_POLICY_LAYERS; ++layer) {
    const int8_t *in = values[layer % 2];
    int8_t *out = values[(layer + 1) % 2];
    for (o = 0; o < widths[layer + 1]; ++o) {
      int32_t sum = *bias++;
      float y;
      for (i = 0; i < widths[layer]; ++i) sum += (int32_t)*weight++ * (int32_t)in[i];
      y = (float)sum * *multiplier++;
      if (layer + 1 < FLAPPY_POLICY_LAYERS) out[o] = flappy_policy_rounded(FLAPPY_POLICY_HIDDEN(y));
      else action[o] = refused ? 0.0F : flappy_fma(flappy_policy_half[o], flappy_tanh(y), flappy_policy_middle[o]);
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
