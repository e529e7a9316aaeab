/* A program that calls one function of FOOTPRINT_HEADER, or none: what it is larger by is that function. */
#include FOOTPRINT_HEADER

/* The caller's own, in every one of the programs. */
float observation[320], action[4];
float *volatile kept;
volatile int result;

#if defined FOOTPRINT_STEP && defined FLAPPY_CONTROLLER_OBS
/* What flappy_controller.h does in a control period, and its state. */
static flappy_controller controller;
static int flappy_controller_period(float *obs, float *added) {
  flappy_vector v;
  flappy_quaternion q;
  v.x = v.y = v.z = q.w = q.x = q.y = q.z = obs[0];
  if (obs[1] > 0.0F) flappy_controller_start(&controller, 0, v, q);
  (void)flappy_controller_imu(&controller, controller.now_us, v, v);
  (void)flappy_controller_pose(&controller, controller.now_us, 1, v, q);
  (void)flappy_controller_tick(&controller, controller.now_us + 1U);
  flappy_controller_observe(&controller, obs);
  flappy_controller_act(&controller, added);
  flappy_controller_steer(&controller);
#if FLAPPY_CONTROLLER_INPUTS > 0
  flappy_controller_inputs(&controller, added);
#else
  flappy_controller_drive(&controller, &added[0], &added[1]);
#endif
  return flappy_controller_policy_due(&controller);
}
#endif

#if defined FOOTPRINT_STEP && FLAPPY_POLICY_MEMORY > 0
static flappy_policy_state state;
static int footprint_step(const float *obs, float *act) { return flappy_policy_step_with(&state, obs, act); }
#undef FOOTPRINT_STEP
#define FOOTPRINT_STEP footprint_step
#endif

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
