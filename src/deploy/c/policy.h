/* What hidden layers may do: exp(x) - 1 and 1 / (1 + exp(-x)) from the tanh of half of x. */
static inline float flappy_elu(float x) {
  const float t = flappy_tanh(flappy_min(x, 0.0F) * 0.5F);
  return x > 0.0F ? x : (t + t) / (1.0F - t);
}
static inline float flappy_silu(float x) {
  const float half = x * 0.5F;
  return flappy_fma(half, flappy_tanh(half), half);
}

/* One layer: for every output its bias, then one weight for each input. Four outputs at a time share what they read; each
   sums up its inputs in their order. */
static inline const float *flappy_policy_layer(const float *weights, const float *in, uint32_t inputs, float *out,
                                               uint32_t outputs) {
  const uint32_t row = inputs + 1;
  uint32_t o, i;
  for (o = 0; o + 4 <= outputs; o += 4, weights += 4 * row) {
    const float *w0 = weights, *w1 = w0 + row, *w2 = w1 + row, *w3 = w2 + row;
    float s0 = *w0++, s1 = *w1++, s2 = *w2++, s3 = *w3++;
    for (i = 0; i < inputs; ++i) {
      const float x = in[i];
      s0 = flappy_fma(*w0++, x, s0);
      s1 = flappy_fma(*w1++, x, s1);
      s2 = flappy_fma(*w2++, x, s2);
      s3 = flappy_fma(*w3++, x, s3);
    }
    out[o] = s0;
    out[o + 1] = s1;
    out[o + 2] = s2;
    out[o + 3] = s3;
  }
  for (o = outputs & ~3U; o < outputs; ++o) { /* said once more, or gcc 12 warns that o might wrap */
    float sum = *weights++;
    for (i = 0; i < inputs; ++i) sum = flappy_fma(*weights++, in[i], sum);
    out[o] = sum;
  }
  return weights;
}

#if FLAPPY_POLICY_LAYER_NORM
/* Takes the mean out, divides by the standard deviation, then a gain and a shift for each number. */
static inline const float *flappy_policy_normalise(const float *gains, float *x, uint32_t count) {
  const float share = 1.0F / (float)count;
  float mean = 0.0F, squares = 0.0F, scale;
  uint32_t i;
  for (i = 0; i < count; ++i) mean += x[i];
  mean *= share;
  for (i = 0; i < count; ++i) {
    x[i] -= mean;
    squares = flappy_fma(x[i], x[i], squares);
  }
  scale = 1.0F / flappy_sqrt(flappy_fma(squares, share, (float)1e-5));
  for (i = 0; i < count; ++i) x[i] = flappy_fma(x[i] * scale, gains[i], gains[count + i]);
  return gains + 2 * count;
}
#endif

/* Observation in, action out, both in the units of the tables above. An observation with a NaN in it is refused: it returns 1,
   all actions are 0, and a state is left as it is. Otherwise it returns 0. */
#if FLAPPY_POLICY_MEMORY > 0
static inline int flappy_policy_step_with(flappy_policy_state *state, const float obs[FLAPPY_POLICY_OBS],
                                          float action[FLAPPY_POLICY_ACT]) {
#else
static inline int flappy_policy_step(const float obs[FLAPPY_POLICY_OBS], float action[FLAPPY_POLICY_ACT]) {
#endif
  static const uint32_t widths[FLAPPY_POLICY_LAYERS + 1] = FLAPPY_POLICY_WIDTHS;
  float values[2][FLAPPY_POLICY_WIDEST];
  const float *weights = flappy_policy_weights;
  uint32_t layer, i;
  int refused = 0;
#if FLAPPY_POLICY_MEMORY > 0
  float seen[3 * FLAPPY_POLICY_MEMORY], kept[3 * FLAPPY_POLICY_MEMORY];
#endif
  for (i = 0; i < FLAPPY_POLICY_OBS; ++i) {
    const float x = (obs[i] - flappy_policy_mean[i]) * flappy_policy_scale[i];
    refused |= flappy_is_nan(x);
    values[0][i] = flappy_clamp(x, -FLAPPY_POLICY_CLIP, FLAPPY_POLICY_CLIP);
  }
#if FLAPPY_POLICY_MEMORY > 0
  weights = flappy_policy_layer(weights, values[0], FLAPPY_POLICY_OBS, seen, 3 * FLAPPY_POLICY_MEMORY);
  weights = flappy_policy_layer(weights, state->unit, FLAPPY_POLICY_MEMORY, kept, 3 * FLAPPY_POLICY_MEMORY);
  for (i = 0; i < FLAPPY_POLICY_MEMORY; ++i) values[1][i] = state->unit[i];
  flappy_policy_remember(seen, kept, values[1]);
  for (i = 0; i < FLAPPY_POLICY_MEMORY; ++i) state->unit[i] = refused ? state->unit[i] : values[1][i];
#endif
  for (layer = FLAPPY_POLICY_MEMORY > 0; layer < FLAPPY_POLICY_LAYERS; ++layer) {
    float *out = values[(layer + 1) % 2];
    weights = flappy_policy_layer(weights, values[layer % 2], widths[layer], out, widths[layer + 1]);
#if FLAPPY_POLICY_LAYER_NORM
    if (layer + 1 < FLAPPY_POLICY_LAYERS) weights = flappy_policy_normalise(weights, out, widths[layer + 1]);
#endif
    for (i = 0; i < widths[layer + 1]; ++i)
      out[i] = layer + 1 == FLAPPY_POLICY_LAYERS ? FLAPPY_POLICY_OUTPUT(out[i]) : FLAPPY_POLICY_HIDDEN(out[i]);
  }
  for (i = 0; i < FLAPPY_POLICY_ACT; ++i) {
    const float x = flappy_clamp(values[FLAPPY_POLICY_LAYERS % 2][i], -1.0F, 1.0F);
    action[i] = refused ? 0.0F : flappy_fma(flappy_policy_half[i], x, flappy_policy_middle[i]);
  }
  return refused;
}

static inline uint32_t flappy_policy_crc32(void) {
  uint32_t crc = 0;
  crc = flappy_crc32(crc, flappy_policy_mean, FLAPPY_POLICY_OBS);
  crc = flappy_crc32(crc, flappy_policy_scale, FLAPPY_POLICY_OBS);
  crc = flappy_crc32(crc, flappy_policy_middle, FLAPPY_POLICY_ACT);
  crc = flappy_crc32(crc, flappy_policy_half, FLAPPY_POLICY_ACT);
  return flappy_crc32(crc, flappy_policy_weights, FLAPPY_POLICY_WEIGHTS);
}
