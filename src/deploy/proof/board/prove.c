/* Observations in, and out: two self-tests, what the policy does, and how long it takes. PROVE_VECTORS observations are
   sent; PROVE_OBS and PROVE_ACT are the sizes they were made for. */
#include "board.h"
#include "flappy_policy.h"
#include "flappy_policy.h" /* once more: nothing is to be defined twice */
#ifdef PROVE_CONTROLLER
#include "flappy_controller.h"
#include "flappy_controller.h"
#endif

/* A policy with a memory is proven as the function that it is. */
#if FLAPPY_POLICY_MEMORY > 0
#define PROVEN_IN FLAPPY_POLICY_IN
#define PROVEN_OUT FLAPPY_POLICY_OUT
#else
#define PROVEN_IN FLAPPY_POLICY_OBS
#define PROVEN_OUT FLAPPY_POLICY_ACT
#endif
#if PROVEN_IN != PROVE_OBS || PROVEN_OUT != PROVE_ACT
#error "FLAPPY_POLICY_OBS and FLAPPY_POLICY_ACT are not those of the policy it is compared with"
#endif

typedef int (*Step)(const float *obs, float *action);

static float observation[PROVE_VECTORS][PROVEN_IN], action[PROVE_VECTORS][PROVEN_OUT];

#if FLAPPY_POLICY_MEMORY > 0
static int step(const float *obs, float *act) { return flappy_policy_of(obs, act); }
#else
static int step(const float *obs, float *act) { return flappy_policy_step(obs, act); }
#endif

static int nothing(const float *obs, float *act) {
  (void)obs;
  (void)act;
  return 0;
}

/* Microseconds of PROVE_ROUNDS times all vectors. */
static uint32_t duration(Step given) {
  /* the compiler shall not see whom it calls, or it would call nobody */
  Step volatile hidden = given;
  const Step called = hidden;
  const uint32_t begin = board_us();
  uint32_t round, v;
  for (round = 0; round < PROVE_ROUNDS; ++round)
    for (v = 0; v < PROVE_VECTORS; ++v) (void)called(observation[v], action[v]);
  return board_us() - begin;
}

int main(void) {
  int32_t code[2] = {0, 0};
  float error[2] = {0.0F, 0.0F}, each[PROVEN_OUT];
  uint32_t time[2], v;
  if (!board_read(observation, (unsigned)sizeof observation)) return 1;
  code[0] = (int32_t)flappy_policy_selftest();
  flappy_policy_selftest_errors(each);
  for (v = 0; v < PROVEN_OUT; ++v)
    if (!(each[v] <= error[0])) error[0] = each[v];
#ifdef PROVE_CONTROLLER
  code[1] = (int32_t)flappy_controller_selftest();
  error[1] = flappy_controller_selftest_error();
#endif
  for (v = 0; v < PROVE_VECTORS; ++v) (void)step(observation[v], action[v]);
  board_write(code, (unsigned)sizeof code);
  board_write(error, (unsigned)sizeof error);
  board_write(action, (unsigned)sizeof action);
  time[0] = duration(step);
  time[1] = duration(nothing);
  board_write(time, (unsigned)sizeof time);
  return 0;
}
