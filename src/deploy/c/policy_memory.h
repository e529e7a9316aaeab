#if FLAPPY_POLICY_MEMORY > 0
/* What the policy remembers from inference to inference, each number within -1 to 1. */
typedef struct {
  float unit[FLAPPY_POLICY_MEMORY];
} flappy_policy_state;

/* Call it before the first inference of each task: the policy remembers nothing. */
static inline void flappy_policy_reset(flappy_policy_state *state) {
  uint32_t i;
  for (i = 0; i < FLAPPY_POLICY_MEMORY; ++i) state->unit[i] = 0.0F;
}

/* 1 / (1 + exp(-x)) */
static inline float flappy_logistic(float x) { return flappy_fma(flappy_tanh(x * 0.5F), 0.5F, 0.5F); }

/* A gated recurrent unit. `seen` and `kept`: sums over the observation and over the memory, for all units' reset gates, then
   their update gates, then their new values. */
static inline void flappy_policy_remember(const float *seen, const float *kept, float *memory) {
  const uint32_t units = FLAPPY_POLICY_MEMORY;
  uint32_t i;
  for (i = 0; i < units; ++i) {
    const float reset = flappy_logistic(seen[i] + kept[i]);
    const float update = flappy_logistic(seen[units + i] + kept[units + i]);
    const float fresh = flappy_tanh(flappy_fma(reset, kept[2 * units + i], seen[2 * units + i]));
    memory[i] = flappy_fma(update, memory[i] - fresh, fresh);
  }
}
#else
typedef struct {
  float nothing; /* C has no empty struct */
} flappy_policy_state;
static inline void flappy_policy_reset(flappy_policy_state *state) { state->nothing = 0.0F; }
#endif
