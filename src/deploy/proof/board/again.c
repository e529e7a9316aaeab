/* A second source with the headers in it: nothing of theirs is to collide. */
#include "flappy_policy.h"
#ifdef PROVE_CONTROLLER
#include "flappy_controller.h"
#endif

int flappy_again(const float *obs, float *action);
#if FLAPPY_POLICY_MEMORY > 0
int flappy_again(const float *obs, float *action) { return flappy_policy_of(obs, action); }
#else
int flappy_again(const float *obs, float *action) { return flappy_policy_step(obs, action); }
#endif
