/* A program that calls one function of FOOTPRINT_HEADER, or none: what it is larger by is that function. */
#include FOOTPRINT_HEADER

#ifndef FLAPPY_POLICY_OBS
#define FLAPPY_POLICY_OBS 1
#define FLAPPY_POLICY_ACT 1
#endif

/* The caller's own, in every one of the programs. */
float observation[FLAPPY_POLICY_OBS], action[FLAPPY_POLICY_ACT];
float *volatile kept;
volatile int result;

/* Its frame and what it calls are the stack that is measured. */
__attribute__((noinline)) static int footprint(void) {
#if defined FOOTPRINT_STEP
  return FOOTPRINT_STEP(observation, action);
#elif defined FOOTPRINT_SELFTEST
  return FOOTPRINT_SELFTEST();
#else
  return 0;
#endif
}

int main(void) {
  kept = observation;
  kept = action;
  result = footprint();
  for (;;) {
  }
}
